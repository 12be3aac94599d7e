"""What a designer sees of a site: 1-D float32 arrays of order one, each inside its bounds.

Lengths are in units of 100 m and positions relative to the uphill edge of the road, x growing
downhill and y up, so that one policy can read many sites. What lies outside the bounds is clipped.

=========  ==============  ===========  ===========================================================
name       shape           bounds       entries
=========  ==============  ===========  ===========================================================
profile    (33,)           -2 to 5      elevation at equal steps from the crest to the road's
                                        downhill edge [100 m]
span       (1,)            0 to 10      length of that profile [100 m]
surfaces   (7,)            0 to 1       friction angle [90 deg] and restitution of the slope, the
                                        source and the barriers; scatter of the friction [10 deg]
source     (5,)            -10 to 10    least x, greatest x, least y, greatest y of the rock mass
                                        [100 m]; its area [100 m2]
block      (1,)            0 to 1       root of the wanted mean area of the blocks [10 m]
damping    (2,)            0 to 5       coefficient [1/s]; 1 if it acts in contact only, else 0
zone       (2,)            -10 to 0     first and last x for barriers [100 m]
road       (1,)            0 to 1       width [100 m]
limits     (8,)            0 to 1       greatest height, least and greatest thickness of a wall,
                                        greatest depth, least and greatest width of a ditch [10 m];
                                        log10 of the least and greatest capacity of a fence [10]
prices     (8,)            -10 to 10    base [cost limit], square [cost limit per m2], factor uphill
                                        of the toe, x of the toe [100 m]; prices of gravity walls,
                                        fences, ditches, embankments [cost limit]
weights    (2,)            0 to 10      risk weight, cost weight
energy     (16,)           0 to 1       barrier-free 95 % energy at equal steps across the zone,
                                        log10(1 + E/J) / 10
bounce     (16,)           0 to 1       barrier-free 95 % height of the centroids above the ground
                                        at the same stations [100 m]
deposit    (17,)           0 to 1       barrier-free share of the mass at the end in 16 equal parts
                                        of the profile and beyond it
layout     (size,)         -1 to 1      what stands, encoded as a vector; at reset nothing
cost_left  (1,)            -10 to 1     1 - cost / cost limit
=========  ==============  ===========  ===========================================================

When barriers are placed one by one, these are seen as well. They are of releases that are not
scored: of as many as are scored, at most 4; at reset they equal the barrier-free ones.

===========  =======  ========  =================================================================
energy_now   (16,)    0 to 1    like `energy`, with what stands
bounce_now   (16,)    0 to 1    like `bounce`, with what stands
deposit_now  (17,)    0 to 1    like `deposit`, with what stands
slots_left   (1,)     0 to 1    share of the barriers that may still be placed
===========  =======  ========  =================================================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from envs import encoding
from envs.envelope import BINS, STATIONS, Envelope, envelope
from envs.memory import Memory, fingerprint
from envs.problem import DesignProblem
from rigdda import Barrier, Site

Observation = dict[str, NDArray[np.float32]]

PROFILE_POINTS = 33
LENGTH = 100.0
"""Unit of positions and lengths [m]."""
SIZE = 10.0
"""Unit of the sizes of blocks and walls [m]."""

LENGTHS = (
    "max_height", "min_thickness", "max_thickness", "max_depth", "min_width", "max_width",
)  # fmt: skip
PRICED = ("gravity_wall", "fence", "ditch", "embankment")

FIELDS: dict[str, tuple[int, float, float]] = {
    "profile": (PROFILE_POINTS, -2.0, 5.0),
    "span": (1, 0.0, 10.0),
    "surfaces": (7, 0.0, 1.0),
    "source": (5, -10.0, 10.0),
    "block": (1, 0.0, 1.0),
    "damping": (2, 0.0, 5.0),
    "zone": (2, -10.0, 0.0),
    "road": (1, 0.0, 1.0),
    "limits": (8, 0.0, 1.0),
    "prices": (8, -10.0, 10.0),
    "weights": (2, 0.0, 10.0),
    "energy": (STATIONS, 0.0, 1.0),
    "bounce": (STATIONS, 0.0, 1.0),
    "deposit": (BINS + 1, 0.0, 1.0),
    "layout": (encoding.NUMBERS, -1.0, 1.0),
    "cost_left": (1, -10.0, 1.0),
}
"""Size, lower and upper bound of every array; the size of `layout` is that of a problem's vector,
here that of one slot for one kind."""


PLACEMENT_FIELDS: dict[str, tuple[int, float, float]] = FIELDS | {
    "energy_now": FIELDS["energy"],
    "bounce_now": FIELDS["bounce"],
    "deposit_now": FIELDS["deposit"],
    "slots_left": (1, 0.0, 1.0),
}
"""The same for barriers that are placed one by one."""


memory: Memory[tuple[bytes, float, float, float], Observation] = Memory(4096)
"""What lasts of observations, by site, cost limit and weights, about 1 kB each."""


def space(problem: DesignProblem) -> spaces.Dict:
    """Return the space of a problem's observations."""
    return _space(problem, FIELDS)


def placement_space(problem: DesignProblem) -> spaces.Dict:
    """Return the space of observations when barriers are placed one by one."""
    return _space(problem, PLACEMENT_FIELDS)


def _space(problem: DesignProblem, fields: dict[str, tuple[int, float, float]]) -> spaces.Dict:
    sizes = {"layout": problem.size}
    return spaces.Dict(
        {
            name: spaces.Box(low, high, (sizes.get(name, size),), np.float32)
            for name, (size, low, high) in fields.items()
        }
    )


def observe(problem: DesignProblem, layout: Sequence[Barrier]) -> Observation:
    """Return the observation of a problem with a layout in place, in arrays of its own.

    The first observation of a site in a process simulates its envelope.

    Raises
    ------
    BadInput
        If `layout` is not one that the problem's `decode` can give.
    Diverged
        If a simulation diverges.
    """
    values: dict[str, ArrayLike] = {
        "layout": problem.encode(layout),
        "cost_left": [1.0 - problem.site.cost(layout) / problem.cost_limit],
    }
    lasting = {name: array.copy() for name, array in _lasting(problem).items()}
    return lasting | _within(values)


def _lasting(problem: DesignProblem) -> Observation:
    """Return what is the same with any layout in place; computed once a process and problem."""
    site = problem.site
    key = fingerprint(site), problem.cost_limit, problem.risk_weight, problem.cost_weight
    known = memory.recall([key])
    if key not in known:
        values = {
            **_slope(site),
            **_rock(site),
            **_barriers(problem),
            **_passing(envelope(site)),
        }
        known[key] = _within(values)
        memory.remember(known)
    return known[key]


def observe_placement(
    problem: DesignProblem, layout: Sequence[Barrier], now: Envelope, left: float
) -> Observation:
    """Return the observation when barriers are placed one by one.

    Parameters
    ----------
    now : Envelope
        With `layout` in place.
    left : float
        Share of the slots that are left.

    Raises
    ------
    BadInput, Diverged
        As `observe` does.
    """
    seen = {f"{name}_now": values for name, values in _passing(now).items()} | {
        "slots_left": [left]
    }
    return observe(problem, layout) | _within(seen)


def _within(values: dict[str, ArrayLike]) -> Observation:
    """Return values as float32 arrays of their own, clipped to their bounds."""
    return {
        name: np.clip(np.array(values[name], dtype=np.float32), np.float32(low), np.float32(high))
        for name, (_, low, high) in PLACEMENT_FIELDS.items()
        if name in values
    }


def _passing(envelope: Envelope) -> dict[str, ArrayLike]:
    """Return what passes and what is left."""
    return {
        "energy": np.log10(1.0 + envelope.energy) / 10.0,
        "bounce": envelope.bounce / LENGTH,
        "deposit": envelope.deposit,
    }


def _slope(site: Site) -> dict[str, ArrayLike]:
    """Return the ground and the road."""
    crest, road, ground = site.slope.points[0][0], site.road, site.profile
    height = [ground.height(x) for x in np.linspace(crest, road.end, PROFILE_POINTS)]
    return {
        "profile": (np.array(height) - ground.height(road.start)) / LENGTH,
        "span": [(road.end - crest) / LENGTH],
        "road": [(road.end - road.start) / LENGTH],
    }


def _rock(site: Site) -> dict[str, ArrayLike]:
    """Return the source and the mechanics of its blocks."""
    source, motion = site.source, site.motion
    x, y = source.outline.T - [[site.road.start], [site.profile.height(site.road.start)]]
    barrier = "concrete" if "concrete" in site.surfaces else "rock"
    names = (site.slope.surface, source.surface, barrier)
    met = [site.surfaces[name] for name in names]
    pairs = [value for s in met for value in (s.friction_deg / 90.0, s.restitution or 0.0)]
    extent = np.array([x.min(), x.max(), y.min(), y.max()]) / LENGTH
    return {
        "surfaces": [*pairs, site.scatter.friction_deg / 10.0],
        "source": [*extent, source.area / LENGTH],
        "block": [math.sqrt(source.mean_block_area) / SIZE],
        "damping": [motion.damping, motion.damping_when == "contact"],
    }


def _barriers(problem: DesignProblem) -> dict[str, ArrayLike]:
    """Return where barriers may stand, what they cost and what counts."""
    site, limit = problem.site, problem.cost_limit
    zone, costs, edge = site.barrier_zone, site.costs, site.road.start
    toe = (site.slope.toe - edge) / LENGTH
    return {
        "zone": [(zone.start - edge) / LENGTH, (zone.end - edge) / LENGTH],
        "limits": [
            *(getattr(zone, name) / SIZE for name in LENGTHS),
            math.log10(zone.min_capacity) / 10.0,
            math.log10(zone.max_capacity) / 10.0,
        ],
        "prices": [
            costs.base / limit,
            costs.square / limit,
            costs.off_toe,
            toe,
            *(getattr(costs, kind) / limit for kind in PRICED),
        ],
        "weights": [problem.risk_weight, problem.cost_weight],
    }
