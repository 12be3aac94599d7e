"""Settings of all tests: hypothesis draws the same examples on every machine and run."""

import os

from hypothesis import settings

# Tests run in one process per core, and their networks are small: more threads only wait for each
# other. The libraries read the variable when they are loaded, so it is set before all imports.
os.environ.setdefault("OMP_NUM_THREADS", "1")

settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=25)
settings.load_profile("repeatable")
