"""What is described: a scene of blocks and barriers, and a site with its events and prices."""
