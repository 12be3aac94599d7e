"""The default designer: forecast all layouts, simulate the promising ones, race the best.

Releases without barriers show which blocks pass each station, how fast and how high. From them, a
network forecasts Z for every single barrier that may be built and for pairs of the best ones
(`rigdda.agents.designers.forecast`). The layouts with the least forecast minus one standard
deviation are simulated in three batches. After each batch, a Gaussian process updates the forecasts
of all layouts (`rigdda.agents.designers.surrogate`), and combinations of the best layout with
another barrier join the pool.

The best layouts, the rule, the constant and no barrier race on separate releases
(`rigdda.agents.designers.racing`). The chosen layout is evaluated on further releases that did not
affect the choice, so that its evaluation is unbiased.

With a `precision`, the search stops before its budget is used up if another `DECISION_STEP`
releases are expected to lower Z by less than this share of it. The expectation is that of the
Gaussian process over all results that the releases may have (knowledge gradient).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from rigdda import Layout, check
from rigdda.agents.designers import policy
from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.forecast import Forecast, Value, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress
from rigdda.agents.designers.racing import KEPT, Arm, Floats, Track, best_of_ends
from rigdda.agents.designers.store import Store
from rigdda.agents.designers.surrogate import COMMON, Surrogate, expected_gain
from rigdda.envs import DesignProblem

EXPLORE, FINAL_SHARE = 0.55, 0.28
"""Shares of the budget for the exploration and for the final [-]. The rest is for the ensemble and
the report."""
LEAST_FINAL_BUDGET = 160
"""Least budget for a final. With less, the layout of the policy is built without a search."""
EACH, LEAST_EXPLORED, MOST_EXPLORED = 0.9, 10, 100
"""Releases of a layout in the exploration over the square root of the budget, and their bounds."""
BATCHES = 3
"""Number of batches."""
BOLD = 1.0
"""Number of standard deviations below the mean by which layouts are ranked for simulation [-]."""
BEST_OF = 12
"""Number of single barriers of each kind with which combinations are formed."""
MOST_FINALISTS = 10
"""Largest number of layouts in the final besides no barrier, the rule and the constant."""
DECISION_STEP = 1000
"""Number of releases between two decisions whether the search stops."""
REPORT_RELEASES = 300
"""Number of releases for the evaluation of the chosen layout in a search that may stop early."""
AS_GOOD = 0.005
"""Largest excess of Z over the best, divided by Z without barriers, with which a layout with fewer
barriers is preferred [-]."""


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
    precision: float = 0.0,
) -> DesignResult:
    """Return the best layout that is found within the budget.

    If the budget is too small for a final, the designer `policy` is used: a comparison of layouts
    on a few releases would choose a worse layout than it does (`experiments.policy_search`).

    Parameters
    ----------
    problem, simulations, seed, progress, store
        As for every designer, see `rigdda.agents.designers.protocol`.
    precision : float
        Gain of another `DECISION_STEP` releases below which the search stops, relative to Z [-].
        With 0, or if the problem has targets, the whole budget is used.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    check.number("precision", precision, 0.0, 1.0)
    ledger = Ledger(problem, simulations, seed, progress, store)
    if ledger.budget < LEAST_FINAL_BUDGET:
        return policy.design(problem, simulations, seed, progress, store)
    menu, track = Menu(problem), Track(ledger)
    known = unsearched(problem, menu)
    surrogate = forecast_pool(ledger, menu, known)
    track.expect = surrogate.expect
    stops = precision if not surrogate.has_targets else 0.0
    explore(track, surrogate, int(EXPLORE * simulations), precision=stops)
    ends = final(track, surrogate, known, int(FINAL_SHARE * simulations), stops)
    chosen = choose(surrogate, ends, track.seen.get((), track.nothing))
    report = min(REPORT_RELEASES, ledger.left) if stops > 0.0 else ledger.left
    return ledger.result(ledger.evaluate(chosen, "report", report))


def final(
    track: Track, surrogate: Surrogate, known: Sequence[Layout], budget: int, precision: float
) -> list[Arm]:
    """Return the best of a race of the best layouts of the exploration, no barrier and `known`."""
    least = 3 * len(track.problem.site.events)
    found = surrogate.best(min(MOST_FINALISTS, max(1, budget // (4 * least) - 1)))
    finalists = list(dict.fromkeys([(), *found, *known]))
    first = max(least, budget // (3 * len(finalists)))
    if precision == 0.0:
        return track.race(finalists, budget, first, keep=3, stage="final", strict=True)

    def contenders(arms: Sequence[Arm]) -> list[Arm]:
        value, gain = state_of_final(surrogate, arms, track.seen[()])
        best = np.argsort(value, kind="stable")[: max(3, math.ceil(KEPT * len(arms)))]
        return [arms[i] for i in best.tolist()] if gain >= precision else []

    first = min(first, max(least, DECISION_STEP // len(finalists)))
    return track.contest(finalists, budget, first, DECISION_STEP, "final", contenders)


def state_of_final(surrogate: Surrogate, arms: Sequence[Arm], nothing: Arm) -> tuple[Floats, float]:
    """Return Z of the arms of a final, and the expected gain of another `DECISION_STEP` releases.

    Z is over the risk without barriers, and the gain is relative to the least Z [-]. The releases
    would be shared by all arms that were drawn equally often. `COMMON` of the variance is left out,
    because releases that all arms have in common do not change their order.
    """
    value, variance = np.array([surrogate.joint(arm, nothing) for arm in arms]).T
    known = np.array([sum(map(len, arm.releases.values())) for arm in arms], dtype=np.float64)
    rivals = known == known.max()
    more = np.where(rivals, DECISION_STEP / rivals.sum(), 0.0)
    learnt = np.sqrt((1.0 - COMMON) * variance * more / np.maximum(known + more, 1.0))
    annual = np.array([arm.annual / surrogate.worth for arm in arms])
    gain = expected_gain(value, np.diag(learnt), np.minimum(annual, value))
    return value, gain / max(float(value.min()), 1e-9)


def forecast_pool(
    ledger: Ledger, menu: Menu, known: Sequence[Layout], value: Value | None = None
) -> Surrogate:
    """Return the forecasts of all single barriers, of pairs of the best and of `known` layouts.

    `value` is the network for the forecasts, by default the one that ships with the package.
    """
    problem, singles = ledger.problem, single_barriers(menu)
    forecast = Forecast(problem, ledger.ensemble(menu.stations), value or value_network())
    ledger.starts |= {*known, *singles}
    return forecasts_of(forecast, menu, known, singles)


def single_barriers(menu: Menu) -> list[Layout]:
    """Return all layouts of one barrier."""
    return [(b,) for kind in menu.problem.kinds for b in menu.singles(kind)]


def forecasts_of(
    forecast: Forecast, menu: Menu, known: Sequence[Layout], singles: Sequence[Layout]
) -> Surrogate:
    """Return forecasts of `known` layouts, of single barriers and of pairs of the best of them."""
    surrogate = Surrogate(menu.problem, forecast)
    surrogate.add([*known, *singles])
    best = firsts(surrogate, BEST_OF)
    surrogate.add(joined(menu.problem, best, best))
    return surrogate


def firsts(surrogate: Surrogate, n: int) -> list[Layout]:
    """Return the `n` best single barriers of each kind, each at another station."""
    kept: dict[str, dict[float, Layout]] = {}
    for layout in surrogate.best(len(surrogate.layouts)):
        if len(layout) == 1:
            own = kept.setdefault(layout[0].kind, {})
            at = layout[0].x if layout[0].kind not in ("mesh", "removal") else float(len(own))
            if len(own) < n:
                own.setdefault(at, layout)
    return [layout for own in kept.values() for layout in own.values()]


def joined(
    problem: DesignProblem, some: Sequence[Layout], others: Sequence[Layout]
) -> Iterator[Layout]:
    """Yield the feasible combinations of two layouts."""
    for one, two in itertools.product(some, others):
        both = tuple(sorted((*one, *two), key=lambda b: b.x))
        if len(both) <= problem.max_barriers and problem.fits(both):
            yield both


def explore(
    track: Track,
    surrogate: Surrogate,
    budget: int,
    prices: Sequence[float] = (0.0,),
    precision: float = 0.0,
) -> list[Arm]:
    """Simulate promising layouts in batches and let the surrogate learn from them.

    Parameters
    ----------
    track, surrogate : Track, Surrogate
        The releases and the forecasts.
    budget : int
        Number of releases.
    prices : sequence of float
        Prices of capital [1/year] for which promising layouts are sought in turn.
    precision : float
        Expected fall of Z by the next batch below which the exploration ends, relative to Z [-].
        With 0, the budget is used up in `BATCHES` batches; otherwise a batch has `DECISION_STEP`
        releases.
    """
    problem, ledger = track.problem, track.ledger
    end = ledger.left - budget
    each = min(
        max(LEAST_EXPLORED, 2 * len(problem.site.events), int(EACH * math.sqrt(budget))),
        MOST_EXPLORED,
    )
    arms: list[Arm] = []
    batches = BATCHES if precision == 0.0 else max(BATCHES, math.ceil(budget / DECISION_STEP))
    for i in range(batches):
        count = (ledger.left - end) // (each * (batches - i)) - 1
        if count < 1:
            break
        share = max(1, count // len(prices))
        wanted = dict.fromkeys(
            layout for price in prices for layout in surrogate.promising(share, BOLD, price)
        )
        if i > 0 and precision > 0.0 and surrogate.gain(list(wanted)) < precision:
            break
        found = track.look([(), *wanted], each, ledger.left - end)
        if not found:
            break
        nothing, more = found[0], found[1:]
        arms += more
        surrogate.learn(more, nothing)
        best = [layout for price in prices for layout in surrogate.best(1, price)]
        surrogate.add(joined(problem, best, firsts(surrogate, BEST_OF)))
    return arms


def choose(surrogate: Surrogate, ends: Sequence[Arm], nothing: Arm) -> Layout:
    """Return the best layout of a final, or one that is nearly as good with fewer barriers.

    Z is estimated from the final and from the exploration together. If there is a target, only the
    final counts.

    Parameters
    ----------
    surrogate : Surrogate
        The estimates of the exploration.
    ends : sequence of Arm
        The best arms of the final.
    nothing : Arm
        The arm without barriers of the final.
    """
    if not ends:
        return ()
    if surrogate.has_targets:
        return best_of_ends(ends).layout
    value = {arm.layout: surrogate.joint(arm, nothing)[0] for arm in ends}
    most = min(value.values()) + AS_GOOD
    as_good = [layout for layout in value if value[layout] < most]
    fewest = min(len(layout) for layout in as_good)
    return min((x for x in as_good if len(x) == fewest), key=lambda x: value[x])
