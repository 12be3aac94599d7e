"""Observations of a site and of the layout on it.

They are 1-D float32 arrays, shifted and scaled so that most entries have a spread of about one or
less over the generated sites. No entry is the same for all sites.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from rigdda import Fence, Layout, Outcome, Site
from rigdda.barriers import Built, standing
from rigdda.envs.cost import Evaluation
from rigdda.envs.envelope import DEPOSIT_BINS, ZONE_STATIONS, Envelope, envelope, largest, stations
from rigdda.envs.outcome_cache import Memory
from rigdda.envs.problem import DesignProblem

PROFILE_POINTS = 16
BOUND = 10.0
"""Bound of all arrays except `layout`, in spreads."""


class Field(NamedTuple):
    """An array of the observation.

    `size` is its length (0: that of an encoded layout; -1: one entry per slot), `centre` and
    `spread` scale it, and `entries` describes it.
    """

    size: int
    centre: float
    spread: float
    entries: str


FIELDS: dict[str, Field] = {
    "profile": Field(
        PROFILE_POINTS, 1.5, 0.9,
        "elevation above the uphill edge of the road at equal steps from the crest to it: "
        "asinh(y / 10 m)",
    ),
    "span": Field(1, 1.6, 0.35, "log10 of the distance from the crest to the road [m]"),
    "zone": Field(
        2, 0.3, 1.0,
        "log10 of the distance from the start and from the end of the barrier zone to the road [m]",
    ),
    "incline": Field(ZONE_STATIONS, 0.6, 0.5, "inclination of the ground across the zone [rad]"),
    "ground": Field(
        4, 0.45, 0.2,
        "tan of the friction angle and restitution at the start and at the end of the zone",
    ),
    "road": Field(1, 0.92, 0.06, "log10 of the width of the road [m]"),
    "closure": Field(1, 4.75, 0.12, "log10(1 + cost of one day of road closure in EUR)"),
    "nothing": Field(1, 2.7, 0.25, "log10(0.001 + Z without barriers in EUR per m and year)"),
    "groups": Field(1, 0.3, 0.2, "share of Z without barriers due to groups of blocks"),
    "rates": Field(
        2, -0.2, 0.7, "log10 of the rate of releases of single blocks and of groups "
        "[1/year per 100 m]",
    ),
    "often": Field(
        2 * ZONE_STATIONS, -0.2, 0.6,
        "rate at which single blocks, then groups, pass the stations: "
        "log10(0.001 + rate in 1/year per 100 m)",
    ),
    "energy": Field(
        2 * ZONE_STATIONS, 5.4, 0.9,
        "95 % quantile of the energy of passing blocks: log10(1 + E / J)",
    ),
    "bounce": Field(
        2 * ZONE_STATIONS, 0.8, 0.4,
        "95 % quantile of the height of their centroids: log10(0.1 + h / m)",
    ),
    "deposit": Field(
        DEPOSIT_BINS + 2, 0.2, 0.2,
        "square root of the share of the cross-sectional area of the annual rock that comes to "
        "rest uphill of the zone, in equal bins from its start to the downhill edge of the road, "
        "and beyond",
    ),
    "prices": Field(
        3, -1.2, 0.6,
        "log10 of the annual cost of a fence of 1,000 kJ and 3 m, of 10 m3 of embankment and of "
        "10 m3 of ditch, each divided by Z without barriers",
    ),
    "mesh": Field(
        2, 0.15, 0.3,
        "greatest reduction of Z by a mesh option, and the annual cost of that option, each "
        "divided by Z without barriers",
    ),
}  # fmt: skip
"""Observation of a site, in both environments."""

LAYOUT_FIELDS: dict[str, Field] = {
    "spent": Field(1, 0.0, 0.5, "annual cost of the layout divided by Z without barriers"),
    "layout": Field(
        0, 0.0, 1.0, "the layout, sorted downhill with mesh last, encoded like actions"
    ),
    "harm_now": Field(
        1, 0.5, 0.5, "harm and repair cost with the layout divided by Z without barriers"
    ),
    "reached_now": Field(
        2, 0.5, 0.5, "share of releases of single blocks, and of groups, that reach the road"
    ),
    "taken": Field(
        -1, 3.0, 3.0,
        "greatest impact energy on each barrier, downhill, without mesh: log10(1 + E / J)",
    ),
    "topped": Field(-1, 0.0, 0.5, "share of releases in which a block passes over each barrier"),
    "broken": Field(-1, 0.0, 0.5, "share of releases in which each barrier fails"),
    "slots_left": Field(1, 0.5, 0.5, "share of the slots that may still be filled"),
}  # fmt: skip
"""Observation of the current layout, in the environment that places barriers one by one.

The environment that designs a whole layout in one step does not use these: it starts without
barriers, so they would never change."""


Arrays = dict[str, NDArray[np.float32]]
Values = dict[str, ArrayLike]

CHECKED = Fence(0.0, 3.0, energy_class=1000)
"""Fence whose price is part of the observation."""


memory: Memory[bytes, Arrays] = Memory(4096)
"""Site observations by site, about 2 kB each."""


def space(size: int, slots: int, with_layout: bool) -> spaces.Dict:
    """Return the observation space for `slots` slots whose layout vector has `size` entries."""
    fields = FIELDS | LAYOUT_FIELDS if with_layout else FIELDS
    sizes = {0: size, -1: slots}
    bounds = {name: 1.0 if name == "layout" else BOUND for name in fields}
    return spaces.Dict(
        {
            name: spaces.Box(-bounds[name], bounds[name], (sizes.get(f.size, f.size),), np.float32)
            for name, f in fields.items()
        }
    )


def observe(problem: DesignProblem) -> Arrays:
    """Return the observation of the site of a problem, as new arrays.

    The first observation of a site in a process computes or loads its envelope.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    return {name: array.copy() for name, array in _lasting(problem).items()}


def mesh_last(layout: Layout) -> Layout:
    """Return a layout in the order of the observation: sorted downhill, mesh and removals last.

    Sorted by position alone, mesh would always come first, and the entries for mesh in the later
    slots would never vary.
    """
    return tuple(sorted(layout, key=lambda barrier: (not isinstance(barrier, Built), barrier.x)))


def of_layout(
    problem: DesignProblem, now: Evaluation, stands: ArrayLike, outcomes: Sequence[Outcome],
    slots: int, left: float,
) -> Arrays:  # fmt: skip
    """Return the observation of the current layout when barriers are placed one by one.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    now : Evaluation
        Evaluation of the current layout.
    stands : (size,) array
        The layout in the order of `mesh_last`, encoded as the numbers of all slots.
    outcomes : sequence of Outcome
        Outcomes of releases of every event with this layout.
    slots : int
        Number of slots.
    left : float
        Share of the slots that may still be filled.
    """
    site, layout = problem.site, now.layout
    names = [outcome.event for outcome in outcomes]
    weights = np.array([site.rate(name, layout) / names.count(name) for name in names])
    bills = np.array([sum(site.bill(layout, outcome)) for outcome in outcomes])
    reached = np.array([outcome.reached for outcome in outcomes], dtype=float)
    groups = np.array([largest(site, name) > 1 for name in names])
    values: Values = {
        "spent": [now.capital / _worth(problem)],
        "layout": stands,
        "harm_now": [weights @ bills / _worth(problem)],
        "reached_now": [_mean(reached, weights * mine) for mine in (~groups, groups)],
        "slots_left": [left],
    }
    for name in ("taken", "topped", "broken"):
        values[name] = np.zeros(slots)
    for k in range(len(standing(layout))):
        took = [outcome.barriers[k] for outcome in outcomes]
        values["taken"][k] = math.log10(1.0 + max(one.max_energy for one in took))  # type: ignore[index]
        values["topped"][k] = np.mean([one.overtopped > 0 for one in took])  # type: ignore[index]
        values["broken"][k] = np.mean([one.failed for one in took])  # type: ignore[index]
    return _scaled(values)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    total = float(weights.sum())
    return float(weights @ values) / total if total > 0.0 else 0.0


def _worth(problem: DesignProblem) -> float:
    """Return Z without barriers, or 1 if it is 0 [EUR per metre and year]."""
    return problem.nothing.objective or 1.0


def _scaled(values: Values) -> Arrays:
    """Return (value - centre) / spread of each field as float32, clipped to its bound."""
    out = {}
    for name, value in values.items():
        field = FIELDS.get(name) or LAYOUT_FIELDS[name]
        scaled = (np.asarray(value, dtype=np.float64).ravel() - field.centre) / field.spread
        bound = 1.0 if name == "layout" else BOUND
        out[name] = np.clip(scaled, -bound, bound).astype(np.float32)
    return out


def _lasting(problem: DesignProblem) -> Arrays:
    """Return the observation of the site without the layout, computed once per process and site."""
    key = problem.key
    known = memory.recall([key])
    if key not in known:
        site = problem.site
        known[key] = _scaled(
            {**_slope(site), **_passing(envelope(site)), **_worthy(problem), **_mesh(problem)}
        )
        memory.remember(known)
    return known[key]


def _slope(site: Site) -> Values:
    """Return the fields that describe the ground, the road and the barrier zone."""
    crest, road, ground, zone = site.slope.points[0][0], site.road, site.profile, site.barrier_zone
    edge = ground.height(road.start)
    x = np.linspace(crest, road.start, PROFILE_POINTS + 1)[:-1]
    across = stations(site)
    half = 0.5 * (across[1] - across[0])
    fall = [ground.height(at - half) - ground.height(at + half) for at in across.tolist()]
    met = [site.surfaces[site.slope.surface_at(at)] for at in (zone.start, zone.end)]
    return {
        "profile": np.arcsinh(np.array([ground.height(at) - edge for at in x.tolist()]) / 10.0),
        "span": [math.log10(road.start - crest)],
        "zone": [math.log10(max(road.start - at, 0.01)) for at in (zone.start, zone.end)],
        "incline": np.arctan2(fall, 2.0 * half),
        "ground": [
            value
            for s in met
            for value in (math.tan(math.radians(s.friction_deg)), s.restitution or 0.0)
        ],
        "road": [math.log10(road.end - road.start)],
    }


def _passing(seen: Envelope) -> Values:
    """Return the fields of the barrier-free envelope."""
    return {
        "often": np.log10(1e-3 + seen.often),
        "energy": np.log10(1.0 + seen.energy),
        "bounce": np.log10(0.1 + np.maximum(seen.bounce, 0.0)),
        "deposit": np.sqrt(seen.deposit),
    }


def _worthy(problem: DesignProblem) -> Values:
    """Return the fields of consequences, rates of events and relative prices of barriers."""
    site, nothing, worth = problem.site, problem.nothing, _worth(problem)
    groups = {name for name in site.event_names if largest(site, name) > 1}
    often = {name: 100.0 * site.rate(name) for name in site.event_names}
    rates = [
        sum(rate for name, rate in often.items() if (name in groups) == those)
        for those in (False, True)
    ]
    prices = site.prices
    per_m2 = prices.fence.get(f"{CHECKED.energy_class:g}", 0.0)
    bought = {
        "fence": per_m2 * CHECKED.height + prices.fence_base,
        "embankment": 10.0 * prices.embankment,
        "ditch": 10.0 * min(prices.ditch.values()) + prices.ditch_base,
    }
    return {
        "closure": [math.log10(1.0 + site.consequences.closure)],
        "nothing": [math.log10(1e-3 + nothing.objective)],
        "groups": [sum(nothing.by_event[name] for name in groups) / worth],
        "rates": [math.log10(1e-3 + rate) for rate in rates],
        "prices": [
            math.log10(1e-6 + price * prices.annual(kind) / worth) for kind, price in bought.items()
        ],
    }


def _mesh(problem: DesignProblem) -> Values:
    """Return the relative reduction of Z by the best mesh option, and its relative annual cost."""
    site, worth = problem.site, _worth(problem)
    best = 0.0, 0.0
    for option in site.meshes:
        kept = {name: option.factors.get(name, 1.0) for name in site.event_names}
        off = sum((1.0 - kept[n]) * z for n, z in problem.nothing.by_event.items()) / worth
        best = max(best, (off, option.area * option.price * site.prices.annual("mesh") / worth))
    return {"mesh": best}
