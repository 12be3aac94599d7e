"""Tables of the layouts that a design verified: their annual cost, and their chances by event.

They hold what `rigdda design` prints, at full precision.
"""

from __future__ import annotations

import math
from typing import Any

from rigdda import Site
from rigdda.app.design_study import SHED, DesignStudy
from rigdda.app.reports.wording import unchanged
from rigdda.barriers import describe
from rigdda.envs import Evaluation
from rigdda.envs.intervals import Estimate

Row = dict[str, Any]


def layouts(done: DesignStudy) -> list[Row]:
    """Return a row for each verified layout, and one for a rock shed as a reference.

    Z and its parts are in EUR per metre of road and year, `cost` is the price to build in EUR per
    metre, and `debris` is the volume on the road in m3 per metre and year; `debris_share` is that
    volume divided by that of the first layout. `chosen` marks the layout found. `_low` and `_high`
    are the ends of 95 % intervals.
    """
    site, whole = done.problem.site, done.nothing.evaluation.debris
    rows = [
        {"layout": case.name, "chosen": case is done.chosen, **_costs(site, case.evaluation, whole)}
        for case in done.cases
    ]
    shed = {name: 0.0 for name in rows[0] if name not in ("layout", "chosen")}
    known = ("objective", "objective_low", "objective_high", "capital")
    shed |= dict.fromkeys(known, site.shed()) | {"cost": site.prices.shed, "releases": 0}
    return [*rows, {"layout": SHED, "chosen": False, **shed, "targets": "", "barriers": ""}]


def _costs(site: Site, e: Evaluation, whole: float) -> Row:
    """Return the cost of a layout and its parts; `whole` is the debris without the layout."""
    return {
        "objective": e.objective, **_ends("objective", e.ci),
        "capital": e.capital,
        "harm": e.harm, **_ends("harm", e.harm_ci),
        "repair": e.repair, **_ends("repair", e.repair_ci),
        "cost": e.cost,
        "debris": e.debris, **_ends("debris", e.debris_ci), 
        "debris_share": e.debris / whole if whole else math.nan,
        "targets": e.targets or "",
        "releases": e.releases,
        "barriers": "; ".join(describe(barrier) for barrier in e.layout) or unchanged(site),
    }  # fmt: skip


def _ends(name: str, interval: tuple[float, float]) -> Row:
    """Return the ends of an interval as columns."""
    low, high = interval
    return {f"{name}_low": low, f"{name}_high": high}


def chances(done: DesignStudy) -> list[Row]:
    """Return a row for each event and verified layout.

    `reach` is the probability that a block of a release reaches the road, `failure` that a barrier
    fails; `_low` and `_high` are the ends of 95 % intervals, and `_bound` is a one-sided 95 % upper
    bound. `cost` is the expected harm and repair of the event in EUR per metre and year.
    """
    return [
        {
            "event": event.name,
            "design": event.design,
            "layout": case.name,
            "releases": case.evaluation.reach[event.name].releases,
            **_chance("reach", case.evaluation.reach[event.name]),
            **_chance("failure", case.evaluation.failure[event.name]),
            "cost": case.evaluation.by_event[event.name],
        }
        for event in done.problem.site.events
        for case in done.cases
    ]


def _chance(name: str, estimate: Estimate) -> Row:
    """Return a probability with the ends of its interval and its upper bound as columns."""
    ends = _ends(name, (estimate.low, estimate.high))
    return {name: estimate.probability, **ends, f"{name}_bound": estimate.bound}
