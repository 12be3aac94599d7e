"""What is asked of a layout beside a low cost, and whether it meets that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rigdda import check
from rigdda.envs.intervals import Estimate

MET, MISSED, UNDECIDED = "met", "missed", "undecided"
"""What targets are: the upper bounds of all probabilities are low enough; the lower bound of one is
too high; there are too few releases to say."""


@dataclass(frozen=True, slots=True)
class Targets:
    """Greatest probabilities in every design event, asked of one-sided 95 % bounds.

    Parameters
    ----------
    reach : float, optional
        Of a block that comes onto the road.
    failure : float, optional
        Of a barrier that fails.

    Raises
    ------
    BadInput
        If one is not between 0 and 1.
    """

    reach: float | None = None
    failure: float | None = None

    def __post_init__(self) -> None:
        for name in ("reach", "failure"):
            value = getattr(self, name)
            if value is not None:
                number = check.number(f"targets.{name}", value, 0.0, 1.0, open_low=True)
                object.__setattr__(self, name, number)

    def state(
        self,
        events: Iterable[str],
        reach: Mapping[str, Estimate],
        failure: Mapping[str, Estimate],
    ) -> str | None:
        """Return "met", "missed" or "undecided" over the design events, None if nothing is asked.

        Parameters
        ----------
        events : iterable of str
            The design events.
        reach, failure : mapping of str to Estimate
            What was seen in each event.
        """
        states = {
            decide(seen[event], greatest)
            for seen, greatest in ((reach, self.reach), (failure, self.failure))
            if greatest is not None
            for event in events
        }
        return next((state for state in (MISSED, UNDECIDED, MET) if state in states), None)


def decide(seen: Estimate, greatest: float) -> str:
    """Return whether a probability is at most `greatest`: "met", "missed" or "undecided"."""
    if seen.bound <= greatest:
        return MET
    return MISSED if seen.floor > greatest else UNDECIDED
