"""What comes out: a run, the outcome of a release, and replays of both."""
