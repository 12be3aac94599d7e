"""The engineering rule: the cheapest fence that a code of practice requires.

The rule is that of `rigdda.envs.fence_checks`. Stations are compared by a price without the jumps
between classes, and among prices that are nearly equal the station nearest the downhill end of the
zone is taken, so that the answer hardly depends on the releases. If no fence fits, the answer is
Ritchie's ditch, or else an embankment or a wall with the height that the rule requires of a fence.
It then has the name of this barrier.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Site, Wall
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.store import Store
from rigdda.barriers import FENCE_CLASSES
from rigdda.barriers.base import MIN_HEIGHT
from rigdda.barriers.fence import CLASSES
from rigdda.envs import DesignProblem, design_envelope
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.fence_checks import Demand, FenceCheck, demand_at, demands
from rigdda.envs.ritchie_ditch import RitchieDitch
from rigdda.rounding import between

COVERED = 0.95
"""Least share of the design blocks that reach the road which must cross the station of a fence [-].
It prevents fences uphill of the sources."""

UNSEARCHED_RELEASES = 4000
"""Largest number of releases for the evaluation of a layout that needs no search."""

RULE_NAME = "rule"
"""Name of the layout in tables if it satisfies the rule."""


@dataclass(frozen=True, slots=True)
class RuleAnswer:
    """Answer of the rule for a problem.

    Parameters
    ----------
    layout : Layout
        The fence; another barrier if no fence fits; no barrier if none is needed or possible.
    name : str
        "rule" for a fence that satisfies the rule, otherwise what the layout is.
    reason : str
        Why the layout is not a fence of the rule; empty if it is.
    check : FenceCheck or None
        The design sheet of the fence or, if none fits, of the one that comes nearest. None if no
        block of the design events reaches the road or no fence may be built.
    envelope : DesignEnvelope
        What the blocks of the design events do.
    """

    layout: Layout
    name: str
    reason: str
    check: FenceCheck | None
    envelope: DesignEnvelope

    @property
    def caveat(self) -> str:
        """A note if the fence fits at one end of the intervals only; empty if not."""
        if self.check is None:
            return ""
        ranges = self.check.ranges
        possible = all(low < 1.0 for low, _ in ranges.values())
        sure = all(high < 1.0 for _, high in ranges.values())
        if sure or not possible:
            return ""
        words = ", ".join(
            f"{name} {between(low, high, '.2f')}"
            for name, (low, high) in ranges.items()
            if low < 1.0 <= high
        )
        return f"a close call, as the utilisations have 95 % intervals: {words}"


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout of the rule and its evaluation.

    The releases of the design envelope do not depend on the seed and are not counted: like those of
    the cost without barriers they belong to the site, and are simulated once.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger = Ledger(problem, simulations, seed, progress, store)
    layout = answer(problem).layout
    evaluation = ledger.evaluate(layout, "report", min(UNSEARCHED_RELEASES, ledger.left))
    return ledger.result(evaluation, "start")


def answer(problem: DesignProblem, seed: int = 0) -> RuleAnswer:
    """Return the answer of the rule for a problem.

    Barriers that stand already and are kept hold back the blocks of the design events, as they do
    in the checks of a layout.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    seed : int
        Seed of the releases of the design envelope.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    site, kept = problem.site, problem.site.existing_barriers
    while True:
        envelope = design_envelope.of(site, problem.zone, seed, layout=kept)
        found = judge(problem, envelope)
        standing = site.standing(found.layout)
        remaining = tuple(barrier for barrier in kept if barrier in standing)
        if remaining == kept:
            return found
        kept = remaining  # the layout replaces the others


def judge(problem: DesignProblem, envelope: DesignEnvelope) -> RuleAnswer:
    """Return the answer of the rule for what the blocks of the design events do."""
    if not envelope.reaches:
        return RuleAnswer((), "no barrier", "no design block reaches the road", None, envelope)
    menu, zone = Menu(problem), problem.zone
    asked = [d for d in demands(envelope, problem.site.rule) if d.covered >= COVERED]
    if "fence" not in problem.kinds:
        return _instead(menu, envelope, asked, "fences are not allowed", None)
    if not asked:
        few = "at no station of the zone do the blocks pass that reach the road"
        return _instead(menu, envelope, asked, few, None)
    asked += list(_last_places(problem, envelope))
    best = choose(menu, asked)
    if best is not None:
        demand, fence = best
        return RuleAnswer(
            (fence,), RULE_NAME, "", FenceCheck.of(problem.site, fence, demand), envelope
        )
    if problem.max_cost is not None:
        free = DesignProblem(problem.site, kinds=problem.kinds, zone=(zone.start, zone.end))
        costly = choose(Menu(free), asked)
        if costly is not None:
            demand, fence = costly
            price = f"{problem.site.capital((fence,)):,.0f} EUR/m, more than max_cost"
            reason = f"a fence that fits, {fence.label} at {fence.x:.1f} m, costs {price}"
            return _instead(
                menu, envelope, asked, reason, FenceCheck.of(problem.site, fence, demand)
            )
    near = nearest(problem, asked)
    return _instead(menu, envelope, asked, why(problem, asked), near)


TIE = 0.02
"""Relative difference of smooth prices below which the place decides [-]; about their standard
error."""


def choose(menu: Menu, asked: list[Demand]) -> tuple[Demand, Fence] | None:
    """Return the place of the fence and the cheapest fence there; None if none fits anywhere.

    Prices in the catalogue jump from class to class, so that small differences of the demand would
    decide on the place. Therefore places are compared by `smooth_price`, and of those within `TIE`
    of the least, the one nearest to the downhill end of the zone is taken.
    """
    places = []
    for demand in asked:
        found = min(
            fences(menu, demand), key=lambda f: menu.problem.site.capital((f,)), default=None
        )
        if found is not None:
            places.append((demand, found, smooth_price(menu.problem.site, demand, found)))
    if not places:
        return None
    least = min(price for *_, price in places)
    tied = [place for place in places if place[2] <= (1.0 + TIE) * least]
    demand, fence, _ = max(tied, key=lambda place: (place[0].x, -place[2]))
    return demand, fence


def smooth_price(site: Site, demand: Demand, fence: Fence) -> float:
    """Return the price of a fence of exactly the demanded energy and height [EUR/m].

    The price per area is interpolated between the classes, in the logarithm of the energy. The
    energy is at least the one at which the catalogue has the height, interpolated likewise.

    Parameters
    ----------
    site : Site
        The site.
    demand : Demand
        The demand.
    fence : Fence
        A fence at this place; the surcharge for access is the same.
    """
    factors = demand.hard.factors
    log = np.log(np.array(CLASSES, dtype=np.float64))
    heights = np.array([row.height for row in FENCE_CLASSES.values()])
    first = np.concatenate([[True], np.diff(heights) > 0.0])  # the lowest class of each height
    share = factors.rated(1) / factors.energy  # usable energy of a class of 1 kJ [J]
    energy = max(
        math.log(max(demand.energy() / share, 1e-9)),
        float(np.interp(demand.height(), heights[first], log[first])),
    )
    known = [i for i, name in enumerate(CLASSES) if f"{name}" in site.prices.fence]
    prices = np.array([site.prices.fence[f"{CLASSES[i]}"] for i in known])
    access = site.capital((fence,)) / fence.price(site, None)
    each = float(np.interp(energy, log[known], prices))
    return access * (each * demand.height() + site.prices.fence_base)


def fences(menu: Menu, demand: Demand) -> Iterator[Fence]:
    """Yield the fences that satisfy the rule, have a price and may be built at a station."""
    wanted = math.ceil(2.0 * demand.height() - 1e-9) / 2.0  # in steps of half a metre
    site, factor = menu.problem.site, demand.hard.factors.elongation
    for name, row in demand.classes():
        tall = max(row.lowest, wanted)
        if tall > min(row.height, menu.zone.max_height) or f"{name}" not in site.prices.fence:
            continue
        fence = menu.put(Fence(demand.x, tall, energy_class=name), demand.x)
        if isinstance(fence, Fence):
            clear = site.road.start - fence.end
            if factor * fence.deflection <= clear + 1e-9:
                yield fence


def _last_places(problem: DesignProblem, envelope: DesignEnvelope) -> Iterator[Demand]:
    """Yield the demand at the last place where each class keeps clear of the road."""
    factors, zone = problem.site.rule, problem.zone
    for name, row in FENCE_CLASSES.items():
        fence = Fence(0.0, row.lowest, energy_class=name)
        x = problem.site.road.start - fence.extent - factors.elongation * row.elongation
        x = math.floor(10.0 * x + 1e-6) / 10.0
        if zone.start <= x <= zone.end:
            demand = demand_at(envelope, factors, x)
            if demand is not None and demand.covered >= COVERED:
                yield demand


def nearest(problem: DesignProblem, asked: list[Demand]) -> FenceCheck:
    """Return the check of the fence that comes nearest to the rule where none fits it.

    Fences that keep clear of the road come first, because the elongation follows from the place
    alone, while energy and height depend on the releases. Classes that are only made higher than
    the zone permits are left out.
    """
    limit = problem.zone.max_height
    made = {name: row for name, row in FENCE_CLASSES.items() if row.lowest <= limit}
    checks = [
        FenceCheck.of(
            problem.site, Fence(demand.x, min(row.height, limit), energy_class=name), demand
        )
        for demand in asked
        for name, row in (made or FENCE_CLASSES).items()
    ]
    return min(
        checks,
        key=lambda check: (
            check.elongation_use > 1.0,
            max(check.uses.values()),
            sum(check.uses.values()),
        ),
    )


def why(problem: DesignProblem, asked: list[Demand]) -> str:
    """Return in words why no fence fits at any of some stations."""
    near = nearest(problem, asked)
    demand, fence = near.demand, near.fence
    words = []
    if near.energy_use >= 1.0:
        needed = 1e-3 * demand.energy() * near.factors.energy
        words.append(f"it needs {needed:,.0f} kJ, with factors, of {near.factors.level}")
    if near.height_use > 1.0:
        limit = problem.zone.max_height
        most = ", more than barrier_zone.max_height" if demand.height() > limit else ""
        words.append(f"it needs a height of {demand.height():.1f} m{most}")
    if near.elongation_use > 1.0:
        room = f"{near.design_elongation:.1f} m, and the road is {near.clearance:.1f} m away"
        words.append(f"its elongation times its factor is {room}")
    if not words:
        words.append("it may not be built there")
    what = f"a fence of {fence.rated:,} kJ and {fence.height:g} m at {fence.x:.1f} m"
    return f"no fence fits; {what} comes nearest: {'; '.join(words)}"


def _instead(
    menu: Menu,
    envelope: DesignEnvelope,
    asked: list[Demand],
    reason: str,
    near: FenceCheck | None,
) -> RuleAnswer:
    """Return the answer if no fence fits: a ditch at the toe, or else a barrier of the height."""
    zone, site = menu.zone, menu.problem.site
    ritchie = RitchieDitch.of(site)
    width = min(max(ritchie.width, zone.min_width), zone.max_width)
    ditch = Ditch(zone.start, min(ritchie.depth, zone.max_depth), width)
    options: list[tuple[Barrier, float]] = [(ditch, site.slope.toe)]
    if asked:
        x, tall = asked[-1].x, min(max(asked[-1].height(), MIN_HEIGHT), zone.max_height)
        thick = Embankment.least_crest(zone)
        options += [(kind(x, tall, thick), x) for kind in (Embankment, GravityWall, Wall)]
    for barrier, at in options:
        if barrier.kind not in menu.problem.kinds:
            continue
        found = menu.nearest(barrier, at)
        if found is not None:
            name = ritchie.name_of(found) if isinstance(found, Ditch) else found.words
            return RuleAnswer((found,), name, reason, near, envelope)
    return RuleAnswer((), "no barrier", reason, near, envelope)
