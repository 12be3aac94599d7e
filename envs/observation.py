"""What a designer sees of a site: 1-D float32 arrays of about unit spread over sites.

`rigdda.envs.fields` says what is in them: logarithms of what spreads over orders of magnitude,
each array less its centre over its spread, so that one policy can read many sites. What lies beyond
the bounds is clipped. A field is here if it differs between sites; what is the same at all of them
tells nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from rigdda import Barrier, Fence, Mesh, Outcome, Site
from rigdda.envs.envelope import Envelope, envelope, largest, stations
from rigdda.envs.evaluation import Evaluation
from rigdda.envs.fields import BOUND, FIELDS, LOOKED, PROFILE_POINTS
from rigdda.envs.memory import Memory
from rigdda.envs.problem import DesignProblem

Arrays = dict[str, NDArray[np.float32]]
Values = dict[str, ArrayLike]

CHECKED = Fence(0.0, 3.0, energy_class=1000)
"""The fence whose price is told."""


memory: Memory[bytes, Arrays] = Memory(4096)
"""What lasts of observations, by site, about 2 kB each."""


def space(size: int, slots: int, looks: bool) -> spaces.Dict:
    """Return the space of observations of layouts of `size` numbers in `slots` slots."""
    fields = FIELDS | LOOKED if looks else FIELDS
    sizes = {0: size, -1: slots}
    bounds = {name: 1.0 if name == "layout" else BOUND for name in fields}
    return spaces.Dict(
        {
            name: spaces.Box(-bounds[name], bounds[name], (sizes.get(f.size, f.size),), np.float32)
            for name, f in fields.items()
        }
    )


def observe(problem: DesignProblem, now: Evaluation, stands: ArrayLike) -> Arrays:
    """Return the observation of a problem with a layout in place, in arrays of its own.

    The first observation of a site in a process simulates its envelope.

    Parameters
    ----------
    problem : DesignProblem
        The site.
    now : Evaluation
        Of what stands.
    stands : (size,) array
        That as the numbers of all slots.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    lasting = {name: array.copy() for name, array in _lasting(problem).items()}
    return lasting | _scaled({"spent": [now.capital / _worth(problem)], "layout": stands})


def looked(
    problem: DesignProblem, layout: Sequence[Barrier], outcomes: Sequence[Outcome],
    slots: int, left: float,
) -> Arrays:  # fmt: skip
    """Return what is seen of what stands when barriers are placed one by one.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of releases of every event with `layout` in place.
    slots : int
        Barriers that may stand.
    left : float
        Share of them that may still be placed.
    """
    site = problem.site
    names = [outcome.event for outcome in outcomes]
    weights = np.array([site.rate(name, layout) / names.count(name) for name in names])
    bills = np.array([sum(site.bill(layout, outcome)) for outcome in outcomes])
    reached = np.array([outcome.reached for outcome in outcomes], dtype=float)
    groups = np.array([largest(site, name) > 1 for name in names])
    values: Values = {
        "harm_now": [weights @ bills / _worth(problem)],
        "reached_now": [_mean(reached, weights * mine) for mine in (~groups, groups)],
        "slots_left": [left],
    }
    standing = [i for i, barrier in enumerate(layout) if not isinstance(barrier, Mesh)]
    for name in ("taken", "topped", "broken"):
        values[name] = np.zeros(slots)
    for k, i in enumerate(standing):
        took = [outcome.barriers[k] for outcome in outcomes]
        values["taken"][i] = math.log10(1.0 + max(one.max_energy for one in took))  # type: ignore[index]
        values["topped"][i] = np.mean([one.overtopped > 0 for one in took])  # type: ignore[index]
        values["broken"][i] = np.mean([one.failed for one in took])  # type: ignore[index]
    return _scaled(values)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    total = float(weights.sum())
    return float(weights @ values) / total if total > 0.0 else 0.0


def _worth(problem: DesignProblem) -> float:
    """Return Z without barriers, 1 where that is nothing [EUR per metre and year]."""
    return problem.nothing.objective or 1.0


def _scaled(values: Values) -> Arrays:
    """Return values less their centres over their spreads, as float32 within their bounds."""
    out = {}
    for name, value in values.items():
        field = FIELDS.get(name) or LOOKED[name]
        scaled = (np.asarray(value, dtype=np.float64).ravel() - field.centre) / field.spread
        bound = 1.0 if name == "layout" else BOUND
        out[name] = np.clip(scaled, -bound, bound).astype(np.float32)
    return out


def _lasting(problem: DesignProblem) -> Arrays:
    """Return what is the same with any layout in place; computed once a process and site."""
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
    """Return the ground, the road and where barriers may stand."""
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
    """Return what passes and what is left."""
    return {
        "often": np.log10(1e-3 + seen.often),
        "energy": np.log10(1.0 + seen.energy),
        "bounce": np.log10(0.1 + np.maximum(seen.bounce, 0.0)),
        "deposit": np.sqrt(seen.deposit),
    }


def _worthy(problem: DesignProblem) -> Values:
    """Return what is at stake, what falls, and what barriers cost beside that."""
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
        "ditch": 10.0 * min(prices.ditch.values(), default=0.0) + prices.ditch_base,
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
    """Return what the best option of mesh takes off, and costs."""
    site, worth = problem.site, _worth(problem)
    best = 0.0, 0.0
    for option in site.meshes:
        kept = {name: option.factors.get(name, 1.0) for name in site.event_names}
        off = sum((1.0 - kept[n]) * z for n, z in problem.nothing.by_event.items()) / worth
        best = max(best, (off, option.area * option.price * site.prices.annual("mesh") / worth))
    return {"mesh": best}
