"""Settings of all tests: hypothesis draws the same examples on every machine and run."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=25)
settings.load_profile("repeatable")
