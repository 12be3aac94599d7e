"""Outcomes of releases with what it took to simulate them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

from rigdda import Outcome


class Sample(tuple[Outcome, ...]):
    """Outcomes of releases, and what they took.

    Attributes
    ----------
    ran : tuple of bool
        Whether each was simulated; of equal releases one was.
    seconds : float
        Processor time of the simulations [s].
    """

    ran: tuple[bool, ...]
    seconds: float

    def __new__(
        cls, outcomes: Iterable[Outcome] = (), ran: Sequence[bool] = (), seconds: float = 0.0
    ) -> Sample:
        """Make one; without `ran` nothing was simulated."""
        made = super().__new__(cls, outcomes)
        made.ran = tuple(ran) if ran else (False,) * len(made)
        made.seconds = seconds
        return made

    def __getnewargs__(self) -> tuple[tuple[Outcome, ...], tuple[bool, ...], float]:
        """Return what makes it anew."""
        return tuple(self), self.ran, self.seconds

    def __add__(self, other: object) -> Sample:
        """Return both, one after the other."""
        if not isinstance(other, Sample):
            return NotImplemented
        both = (*self, *other), (*self.ran, *other.ran)
        return Sample(*both, self.seconds + other.seconds)

    @property
    def simulated(self) -> int:
        """How many were simulated."""
        return sum(self.ran)

    def split(self, ends: Sequence[int]) -> list[Sample]:
        """Return the parts between ends, the time shared out by what was simulated."""
        each = self.seconds / max(self.simulated, 1)
        parts = [(self[a:b], self.ran[a:b]) for a, b in pairwise(ends)]
        return [Sample(outcomes, ran, each * sum(ran)) for outcomes, ran in parts]
