"""Outcome of a release: rock on the road, and loads and damage of each barrier.

`rigdda.measurement` computes outcomes. `OUTCOME_COLUMNS` and `BARRIER_COLUMNS` in
`rigdda.app.reports.tables` are the columns of their tables.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BarrierOutcome:
    """Outcome of a release for one barrier.

    Ditches and embankments are part of the ground: contacts with them do not count as hits, and the
    energy that they absorb is not recorded here.

    Parameters
    ----------
    hits : int
        Number of hits; contacts less than 0.1 s apart count as one.
    max_energy, total_energy : float
        Largest and total energy of the hits, translational and rotational, just before first
        contact [J].
    absorbed_energy : float
        Work that contact forces of the barrier do against the blocks [J]; for a fence the braking
        force times its deflection, plus the energy taken up by its own mass.
    impact_heights : tuple of float
        Height of each hit above the initial ground at the uphill face of the barrier [m].
    overtopped : int
        Number of blocks that started uphill of the barrier and first passed it before it failed,
        was pushed away or overturned. A block has passed when it is beyond the downhill face, or
        the downhill edge of a ditch or of the crest of an embankment. For a gravity wall the
        initial position counts.
    failed : bool
        Whether it is no longer in its original state.
    caught : float
        Share of the released mass that is at rest at the end and held by the barrier or lies in the
        ditch.
    state : {"stands", "failed", "slid", "overturned", "pushed"}
        Final state. A fence can have "failed". A gravity wall has "slid" if a corner is more than
        0.1 m from its original place, and is "overturned" if it rotated beyond the angle of its
        diagonal. An embankment can be "pushed" away.
    displacement : float
        Final distance of its centroid from the initial position [m]; for a fence the elongation
        used.
    road_area : float
        Its final area beyond the uphill edge of the road [m2]; above 0 for gravity walls only.
    thrust : float
        Greatest one-second mean of the downhill horizontal force on it [N/m]; 0 for a ditch.
    resistance : float
        Thrust that it resists [N/m], inf if it cannot move, see `rigdda.Scene.resistance`; for a
        fence the force at which it deflects.
    left_height : float
        Remaining height [m]; 0 for a ditch and after failing, overturning or being pushed away.
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
    """Outcome of a release for the road.

    Parameters
    ----------
    event : str
        Name of the event.
    width : float
        Width of the event along the road [m].
    released_mass : float
        Mass of all blocks that can move [kg per metre of width].
    released_volume : float
        Volume of all blocks that can move, their area times the width [m3].
    road_volume : float
        Volume of those blocks whose centroid ever passed the uphill edge of the road [m3].
    reached : bool
        Whether there were any such blocks.
    reach : (low, high)
        Range of chainages within which all blocks stayed, including their corners [m]. Barriers
        entirely outside it have no effect.
    debris_fraction : float
        Share of the released mass whose centroid ever passed the uphill edge of the road, including
        in the air.
    debris_on_road : float
        Area of the blocks whose centroid is on the road at the end [m2].
    max_energy_on_road : float
        Largest kinetic energy of a block over the road [J].
    run_out : tuple of float
        Final chainages beyond which 50, 5 and 0 % of the mass lie [m], limited to the downhill edge
        of the road: a release ends when nothing moves uphill of that edge.
    slope_fraction, held_fraction, road_fraction, beyond_fraction : float
        Final distribution of the mass by centroid; adds up to exactly 1. Mass is held if it lies
        uphill of a barrier that has not failed or overturned, below a line that rises uphill from
        its top at the friction angle (the steepest surface of a deposit). A ditch holds what lies
        between its edges below such a line from its downhill edge.
    barriers : tuple of BarrierOutcome
        One for each barrier of the layout.
    cut_off : bool
        Whether half of the rock still moved uphill of the road when `motion.duration` ended. The
        outcome is computed as if it had stopped there.
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
