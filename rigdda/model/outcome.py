"""The outcome of a release: what it means for the road, and what each barrier took and holds."""

from __future__ import annotations

from dataclasses import dataclass


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


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a release means for the road.

    Parameters
    ----------
    event : str
        Name of the event.
    width : float
        Its width along the road [m].
    released_mass : float
        Mass of all blocks that could move [kg per metre of width].
    released_volume : float
        Volume of all blocks that could move, their area times the width [m3].
    road_volume : float
        Of this, volume of the blocks whose centroid ever passed the uphill edge of the road [m3].
    reached : bool
        Whether any did.
    reach : (low, high)
        Chainages between which all blocks stayed, corners included [m]: barriers wholly outside
        change nothing.
    debris_fraction : float
        Share of the released mass whose centroid ever passed the uphill edge of the road, in the
        air included: what the reward measures.
    debris_on_road : float
        Area of the blocks whose centroid is on the road at the end [m2].
    max_energy_on_road : float
        Largest kinetic energy of a block over the road [J].
    run_out : tuple of float
        Chainages that 50, 95 and 100 % of the mass have not passed at the end [m], at most that of
        the downhill edge of the road: a release is over when nothing moves but what goes on there.
    slope_fraction, held_fraction, road_fraction, beyond_fraction : float
        Where the mass is at the end, by centroid; they add up to 1 exactly. Held: uphill of a
        barrier that stands and below the line that rises uphill from its top at the angle of
        friction, the steepest surface of a deposit that leans on it. Not of one that failed or
        was overturned; what a ditch holds is between its edges, below that line from its
        downhill edge.
    barriers : tuple of BarrierOutcome
        One for each barrier of the layout.
    cut_off : bool
        Whether half of the rock still moved above the road when `motion.duration` was over: it
        counts as if it had stopped there.
    """

    event: str
    width: float
    released_mass: float
    released_volume: float
    road_volume: float
    reached: bool
    reach: tuple[float, float]
    debris_fraction: float
    debris_on_road: float
    max_energy_on_road: float
    run_out: tuple[float, float, float]
    slope_fraction: float
    held_fraction: float
    road_fraction: float
    beyond_fraction: float
    barriers: tuple[BarrierOutcome, ...]
    cut_off: bool = False
