"""Contact detection and the contact law."""
