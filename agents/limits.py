"""Largest numbers that may be asked for; a larger one is taken for a slip of the pen."""

from __future__ import annotations

RELEASES = 1_000_000
"""Releases, layouts times releases or episodes of one job: a million take hours, and give
means to a thousandth of the spread. Jobs and their outcomes fill some GB of memory then."""


SITES = 10_000
"""Random sites to try designers on: all are posed before the first is tried, at 1 ms each."""


SEED = 2**32 - 1
"""Seed of a search or a training: numpy's and torch's generators, in other packages, take no more.
Seeds of single releases may be larger."""
