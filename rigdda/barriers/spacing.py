"""Clear distances between barriers along the slope."""

from __future__ import annotations

from rigdda.barriers.base import TOLERANCE, Barrier

Span = tuple[float, float]

MIN_GAP = 0.5
"""Minimum distance between the works of two barriers [m]."""


def room(barrier: Barrier, works: Span) -> Span:
    """Return the chainages that a barrier occupies, including its elongation downhill [m]."""
    start, end = works
    return start, end + barrier.deflection


def meet(one: Span, two: Span) -> bool:
    """Return whether two barriers are closer than `MIN_GAP`."""
    return one[0] < two[1] + MIN_GAP - TOLERANCE and two[0] < one[1] + MIN_GAP - TOLERANCE
