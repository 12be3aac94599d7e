"""How far barriers that are designed stand from one another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rigdda import BadInput, Barrier, Fence
from rigdda.envs.sizes import TOLERANCE

Span = tuple[float, float]

MIN_GAP = 0.5
"""Least distance between the works of two barriers [m]."""


def room(barrier: Barrier, works: Span) -> Span:
    """Return the chainages that a barrier needs: its works, and where a fence gives way to [m]."""
    start, end = works
    gives = barrier.elongation if isinstance(barrier, Fence) else None
    return start, end + (gives or 0.0)


def meet(one: Span, two: Span) -> bool:
    """Tell whether two barriers are nearer than `MIN_GAP`."""
    return one[0] < two[1] + MIN_GAP - TOLERANCE and two[0] < one[1] + MIN_GAP - TOLERANCE


def check_gaps(rooms: Sequence[tuple[str, Barrier, Span]]) -> None:
    """Check that no two barriers meet.

    Parameters
    ----------
    rooms : sequence of (str, Barrier, (start, end))
        What messages call each, each, and the room that it needs [m].

    Raises
    ------
    BadInput
        If two do.
    """
    ordered = sorted(rooms, key=lambda item: item[2])
    for (_, before, one), (where, barrier, two) in pairwise(ordered):
        if meet(one, two):
            mend = f"put it {MIN_GAP:g} m beyond {one[1]:g}, up to where the {before.words} needs"
            raise BadInput(f"{where}.x", barrier.x, mend)
