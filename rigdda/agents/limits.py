"""Largest numbers that are accepted; larger ones are probably typing errors."""

from __future__ import annotations

JOB_RELEASES = 1_000_000
"""Largest number of releases, of layouts times releases, or of episodes of one job. A million
take hours, determine a mean to a thousandth of the standard deviation, and need a few GB of
memory."""


SEED = 2**32 - 1
"""Largest seed of a search or a training, which is the limit of the generators in numpy and torch.
Seeds of releases may be larger."""


RELEASE_SEED = 2**63 - 1 - JOB_RELEASES
"""Largest seed of the first release of a job. Tables contain the seeds of all its releases as whole
numbers of 64 bits with a sign."""


SINGLE_SEED = 2**64 - 1
"""Largest seed of a release that is simulated alone, so that all releases of the exam, whose seeds
have 64 bits without a sign, can be replayed."""
