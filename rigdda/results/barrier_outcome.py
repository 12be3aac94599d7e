"""What one barrier took in a release, and what it holds in the end."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rigdda.results.ending import BarrierEnding
from rigdda.results.states import STANDS

GONE = ("failed", "overturned", "pushed")
"""States in which a barrier holds nothing."""


@dataclass(frozen=True, slots=True)
class BarrierOutcome:
    """What one barrier took in a release.

    Ditches and embankments are ground: what happens on them counts as no hit, and they absorb
    nothing here.

    Parameters
    ----------
    hits : int
        Hits, counted anew after 0.1 s apart.
    max_energy, total_energy : float
        Largest and summed energy of the hits, of translation and rotation just before the first
        touch [J].
    absorbed_energy : float
        Work that contact forces of the barrier took from the blocks [J]: of a fence the force of
        its brakes times its path, and what its own mass took.
    impact_heights : tuple of float
        Height of each hit above the ground at the barrier's uphill face at the start [m].
    overtopped : int
        Blocks that started uphill of the barrier and first passed it before it failed, was pushed
        away or overturned: beyond its downhill face, the downhill edge of a ditch or of an
        embankment's crest. A gravity wall counts as where it stood at the start.
    failed : bool
        Whether it no longer stands as it was built.
    caught : float
        Share of the released mass at rest at the end that it holds, or that is in the ditch.
    state : {"stands", "failed", "slid", "overturned", "pushed"}
        At the end. A fence failed, a gravity wall has slid if a corner is more than 0.1 m away from
        its place, and is overturned if it was turned beyond the angle of its diagonal; an
        embankment was pushed away.
    displacement : float
        Distance of its centroid at the end from where it was at the start [m]; of a fence the
        elongation that was used.
    road_area : float
        Its area that lies beyond the uphill edge of the road at the end [m2]: only a gravity wall
        comes there.
    thrust : float
        Greatest mean over a second of the horizontal force on it, downhill [N/m], of a ditch none.
    resistance : float
        Thrust that it bears [N/m], inf where none can move it, see `rigdda.Scene.resistance`; of
        a fence the force against which it gives way.
    left_height : float
        Height that is left of it [m]: none of what failed, was overturned or pushed away, nor of a
        ditch.
    """

    hits: int
    max_energy: float
    total_energy: float
    absorbed_energy: float
    impact_heights: tuple[float, ...]
    overtopped: int
    failed: bool
    caught: float
    state: str
    displacement: float
    road_area: float
    thrust: float
    resistance: float
    left_height: float


def measure_barrier(
    ended: BarrierEnding,
    hits: Sequence[tuple[float, float]],
    passed: Iterable[tuple[float, float]],
    caught: float,
) -> BarrierOutcome:
    """Return the outcome of a barrier.

    Parameters
    ----------
    ended : BarrierEnding
        The barrier in the end.
    hits : sequence of (energy, height)
        Hits of it [J, m].
    passed : iterable of (start, time)
        Chainage of each block at the start, and when it first passed the barrier [m, s].
    caught : float
        Share of the released mass that it holds at rest [-].
    """
    barrier, state = ended.barrier, ended.states[-1][1]
    gone = next((time for time, state in ended.states if state in GONE), math.inf)
    return BarrierOutcome(
        hits=len(hits),
        max_energy=max((energy for energy, _ in hits), default=0.0),
        total_energy=math.fsum(energy for energy, _ in hits),
        absorbed_energy=ended.absorbed,
        impact_heights=tuple(height for _, height in hits),
        overtopped=sum(x < barrier.x and time < gone for x, time in passed),
        failed=state != STANDS,
        caught=caught,
        state=state,
        displacement=ended.displacement,
        road_area=ended.road_area,
        thrust=ended.thrust,
        resistance=ended.resistance,
        left_height=0.0 if state in GONE else barrier.left_height(ended.displacement),
    )


def holding(ended: BarrierEnding, places: Sequence[tuple[float, float]]) -> list[bool]:
    """Return which centroids (x, y) a barrier holds at the end, see `rigdda.Outcome`."""
    if ended.states[-1][1] in GONE:
        return [False] * len(places)
    return [ended.reach.includes(x, y) for x, y in places]
