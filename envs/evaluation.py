"""What a layout is worth on some releases: its cost a year and the parts of it, with intervals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rigdda import BadInput, Layout, Outcome
from rigdda.envs.intervals import Estimate, Interval, Known


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What a layout is worth on some releases.

    Parameters
    ----------
    layout : tuple of Barrier
        The barriers.
    seeds : tuple of int
        Seed of each release, in the order of `outcomes`; empty where they are not kept.
    objective, ci : float, (float, float)
        Z and its 95 % interval [EUR per metre of road and year]. Of fewer than two releases an
        event, it and what is told of harm and debris may be negative, see `rigdda.envs.estimator`.
    capital, harm, repair : float
        The parts of Z: what the barriers cost a year, what rock on the road costs, what mending and
        emptying the barriers costs.
    harm_ci, repair_ci : (float, float)
        Their 95 % intervals.
    cost : float
        Price of the layout [EUR per metre of road].
    debris, debris_ci : float, (float, float)
        Expected volume that comes onto the road [m3 per metre of road and year].
    debris_share : float
        The same over what comes onto it without barriers [-]; 0 where nothing does.
    reach, failure : dict of str to Estimate
        For each event the probability that a block comes onto the road, and that a barrier fails.
    by_event : dict of str to float
        What each event adds to Z, harm and repair [EUR per metre of road and year].
    targets : {"met", "missed", "undecided"} or None
        Whether the layout meets what is asked of it; None if nothing is.
    outcomes : tuple of Outcome
        One for each release; empty where they are not kept.
    releases, simulated : int
        Releases that it rests on, and how many of these were simulated for it; what the others
        give was known. The latter is not compared.
    seconds : float
        Processor time of the simulations [s]; not compared.
    """

    layout: Layout
    seeds: tuple[int, ...]
    objective: float
    ci: Interval
    capital: float
    harm: float
    harm_ci: Interval
    repair: float
    repair_ci: Interval
    cost: float
    debris: float
    debris_ci: Interval
    debris_share: float
    reach: dict[str, Estimate]
    failure: dict[str, Estimate]
    by_event: dict[str, float]
    targets: str | None
    outcomes: tuple[Outcome, ...]
    releases: int
    simulated: int = field(default=0, compare=False)
    seconds: float = field(default=0.0, compare=False)

    @property
    def typical(self) -> tuple[int, str]:
        """Seed and event of a release that stands for the others.

        Of the event that adds most to Z the one that brings nearly the event's mean volume onto the
        road, the first of equals.

        Raises
        ------
        BadInput
            If the evaluation was made without its seeds, or its outcomes are not kept.
        """
        if not self.outcomes or len(self.seeds) != len(self.outcomes):
            raise BadInput("seeds", self.seeds, "evaluate with the seeds of the releases")
        seen = {outcome.event for outcome in self.outcomes}
        event = max(seen, key=lambda name: (self.by_event[name], name))
        own = [i for i, outcome in enumerate(self.outcomes) if outcome.event == event]
        volume = np.array([self.outcomes[i].road_volume for i in own])
        return self.seeds[own[int(np.argmin(np.abs(volume - volume.mean())))]], event

    def gain(self, nothing: Evaluation) -> float:
        """Return the fall of Z over Z of nothing, see `DesignProblem.reward`."""
        if nothing.objective > 0.0:
            return (nothing.objective - self.objective) / nothing.objective
        if self.objective > 0.0:
            return -1.0
        return 1.0 - self.debris_share if nothing.debris else 0.0


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of an event from releases without barriers.

    Parameters
    ----------
    releases, reached : int
        How many there were, and in how many a block came onto the road.
    harm, volume : Known
        Harm [EUR] and volume [m3] where one did; where none ever did, of all that is released.
    blocks : float
        Mean number of blocks.
    """

    releases: int
    reached: int
    harm: Known
    volume: Known
    blocks: float
