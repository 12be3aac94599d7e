"""Choice of one option for each section of a corridor within a budget.

The options of a section are layouts, with the construction cost c [EUR], the annual cost a
[EUR/year] and the total cost v = length x Z [EUR/year]. With x[s, k] = 1 if section s gets its
option k, `optimum` solves the integer programme

    minimise    sum_s sum_k v[s, k] x[s, k]
    subject to  sum_k x[s, k] = 1  for every section,
                sum_s sum_k c[s, k] x[s, k] <= budget,
                sum_s sum_k a[s, k] x[s, k] <= yearly budget

with HiGHS through CVXPY. This is the multiple-choice knapsack problem (Kellerer, Pferschy and
Pisinger, Knapsack Problems, 2004, chapter 11). The functions below it are simple methods with which
it is compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Error

if TYPE_CHECKING:
    import cvxpy as cp

Floats = NDArray[np.float64]
Choice = tuple[int, ...]
"""Index of the chosen option of each section."""

OPTIMALITY_GAP = 1e-6
"""Relative optimality gap of the integer programme [-]."""

BUDGET_ROUNDING = 1e-9
"""Relative excess of a budget that is attributed to rounding [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Options:
    """Options of all sections.

    Parameters
    ----------
    lengths : (S,) array
        Lengths of the sections [m].
    costs, annual, values : sequences of S arrays (K_s,)
        Construction cost [EUR], annual cost [EUR/year] and total cost [EUR/year] of each option.
        The first option of each section is to build nothing, which costs nothing.
    missed : sequence of S arrays (K_s,)
        Amount by which each option misses the targets of its section [-], 0 if it meets them.

    Raises
    ------
    BadInput
        If the shapes differ, a section has no option, or its first option has a cost.
    """

    lengths: Floats
    costs: Sequence[Floats]
    annual: Sequence[Floats]
    values: Sequence[Floats]
    missed: Sequence[Floats]

    def __post_init__(self) -> None:
        sizes = [len(own) for own in self.values]
        for name in ("costs", "annual", "missed"):
            if [len(own) for own in getattr(self, name)] != sizes:
                raise BadInput(name, sizes, "give one number for each option of each section")
        if not sizes or min(sizes) < 1 or len(self.lengths) != len(sizes):
            raise BadInput("lengths", len(self.lengths), "give each section at least one option")
        if any(own[0] != 0.0 for own in self.costs):
            raise BadInput("costs", [own[0] for own in self.costs], "let the first option be free")

    @property
    def nothing(self) -> Choice:
        """The choice to build nothing anywhere."""
        return (0,) * len(self.values)

    def total(self, choice: Sequence[int], table: Sequence[Floats]) -> float:
        """Return the sum of a table over the options of a choice."""
        return math.fsum(own[k] for own, k in zip(table, choice, strict=True))

    def gain(self, choice: Sequence[int]) -> float:
        """Return the reduction of the total cost by a choice [EUR/year]."""
        return self.total(self.nothing, self.values) - self.total(choice, self.values)


def optimum(
    options: Options,
    budget: float,
    yearly: float | None = None,
    scenarios: Sequence[Floats] | None = None,
    tail: float = 0.2,
) -> Choice:
    """Return the choice with the least total cost within a budget.

    Missed targets come first: the sum of the amounts by which targets are missed is minimised, and
    the total cost only among the choices with that sum.

    Parameters
    ----------
    options : Options
        The options.
    budget : float
        Budget for construction [EUR].
    yearly : float, optional
        Greatest annual cost of all barriers [EUR/year].
    scenarios : sequence of S arrays (R, K_s), optional
        Possible total costs of each option, equally likely [EUR/year]. If they are given, the mean
        over the worst share `tail` of the scenarios is minimised instead of the expected total
        (conditional value at risk; Rockafellar and Uryasev 2000, Journal of Risk 2, 21-41).
    tail : float
        Share of the scenarios [-].

    Raises
    ------
    Error
        If the solver fails.
    """
    import cvxpy as cp

    chosen = [cp.Variable(len(own), boolean=True) for own in options.values]

    def total(table: Sequence[Floats]) -> cp.Expression:
        return sum(own @ x for own, x in zip(table, chosen, strict=True))

    limits = [cp.sum(x) == 1 for x in chosen]
    limits.append(total(options.costs) <= budget * (1.0 + BUDGET_ROUNDING))
    if yearly is not None:
        least_annual = options.total(options.nothing, options.annual)  # of existing barriers
        most = max(yearly, least_annual) * (1.0 + BUDGET_ROUNDING)
        limits.append(total(options.annual) <= most)
    if any(own.any() for own in options.missed):
        least = _solve(cp.Problem(cp.Minimize(total(options.missed)), limits))
        limits.append(total(options.missed) <= least + 1e-6)
    scale = max(options.total(options.nothing, options.values), 1e-12)
    if scenarios is None:
        goal = total(options.values) / scale
    else:
        threshold, count = cp.Variable(), len(scenarios[0])
        excess = cp.Variable(count, nonneg=True)
        limits.append(excess >= total(scenarios) / scale - threshold)
        goal = threshold + cp.sum(excess) / (tail * count)
    _solve(cp.Problem(cp.Minimize(goal), limits))
    return tuple(int(np.argmax(np.asarray(x.value))) for x in chosen)


def _solve(problem: cp.Problem) -> float:
    """Solve a programme with HiGHS and return its objective."""
    import cvxpy as cp

    try:
        value = problem.solve(solver=cp.HIGHS, mip_rel_gap=OPTIMALITY_GAP)
    except cp.SolverError as error:
        raise Error(f"the integer programme of the corridor failed: {error}") from None
    if not np.isfinite(value):
        raise Error(f"the integer programme of the corridor has no solution ({value})")
    return float(value)


def shadow_price(options: Options, budget: float) -> float:
    """Return what one more euro of the budget would save each year [1/year].

    It is the multiplier of the budget in the linear relaxation, in which a section may be divided
    between options, without targets and without a yearly budget.
    """
    steps = increments(options)
    left = budget
    for step in steps:
        left -= step.cost
        if left < -BUDGET_ROUNDING * budget:
            return step.saving / step.cost
    return 0.0


@dataclass(frozen=True, slots=True)
class Increment:
    """A step of a section from an option to the next one on the convex hull of its front.

    Parameters
    ----------
    section, before, after : int
        Index of the section, and of both options.
    cost, saving : float
        Additional construction cost [EUR] and reduction of the total cost [EUR/year].
    """

    section: int
    before: int
    after: int
    cost: float
    saving: float


def increments(options: Options) -> list[Increment]:
    """Return the steps along the convex hulls of all fronts by saving per cost, the best first."""
    found = []
    for s in range(len(options.values)):
        hull = convex_hull(options.costs[s], options.values[s])
        for i, k in pairwise(hull):
            cost = float(options.costs[s][k] - options.costs[s][i])
            saving = float(options.values[s][i] - options.values[s][k])
            found.append(Increment(s, i, k, cost, saving))
    return sorted(found, key=lambda step: -step.saving / step.cost)


def convex_hull(costs: Floats, values: Floats) -> list[int]:
    """Return the options of a section that are best for some price of capital, the cheapest first.

    They are the corners of the lower left part of the convex hull of cost and value.
    """
    order = np.lexsort((values, costs))
    hull: list[int] = []
    for k in order.tolist():
        if hull and values[k] >= values[hull[-1]]:
            continue
        if hull and costs[k] == costs[hull[-1]]:
            continue
        while len(hull) > 1 and _slope(costs, values, hull[-2], hull[-1]) >= _slope(
            costs, values, hull[-1], k
        ):
            hull.pop()
        hull.append(k)
    return hull


def _slope(costs: Floats, values: Floats, i: int, k: int) -> float:
    """Return the change of value per cost between two options [1/year]."""
    return float((values[k] - values[i]) / (costs[k] - costs[i]))


def spare(options: Options, choice: Sequence[int], yearly: float | None) -> float:
    """Return the annual cost by which a choice is below the yearly budget [EUR/year], at least 0.

    Without a yearly budget, it is infinite.
    """
    if yearly is None:
        return math.inf
    return max(0.0, yearly - options.total(choice, options.annual))


def by_ratio(options: Options, budget: float, yearly: float | None = None) -> Choice:
    """Return the choice of the steps with the greatest saving per cost that both budgets allow.

    A step that the money left does not allow ends the improvement of its section. Targets are
    ignored.
    """
    choice, left, ended = list(options.nothing), budget, set()
    left_yearly = spare(options, choice, yearly)
    for step in increments(options):
        if step.section in ended:
            continue
        annual = options.annual[step.section]
        more = float(annual[step.after] - annual[step.before])
        if step.cost <= _limit(left) and more <= _limit(left_yearly):
            choice[step.section] = step.after
            left -= step.cost
            left_yearly -= more
        else:
            ended.add(step.section)
    return tuple(choice)


def same_money(options: Options, budget: float, yearly: float | None = None) -> Choice:
    """Return the best option of each section for the same money per metre of road.

    The yearly budget is divided in the same way.
    """
    shares = (options.lengths / options.lengths.sum()).tolist()
    left = spare(options, options.nothing, yearly)
    return tuple(_best(options, s, budget * own, left * own) for s, own in enumerate(shares))


def worst_first(options: Options, budget: float, yearly: float | None = None) -> Choice:
    """Return the best options that the money left allows, for the worst sections first.

    The worst section is that with the greatest cost per metre without barriers.
    """
    choice, left = list(options.nothing), budget
    left_yearly = spare(options, choice, yearly)
    worst = np.argsort([-own[0] for own in options.values] / options.lengths, kind="stable")
    for s in worst.tolist():
        choice[s] = _best(options, s, left, left_yearly)
        left -= float(options.costs[s][choice[s]])
        left_yearly -= float(options.annual[s][choice[s]] - options.annual[s][0])
    return tuple(choice)


def _limit(money: float) -> float:
    """Return the greatest cost that an amount of money allows, with a tolerance for rounding."""
    return max(0.0, money) * (1.0 + BUDGET_ROUNDING)


def _best(options: Options, s: int, money: float, yearly: float) -> int:
    """Return the best option of a section that an amount of money allows.

    It is the one that misses the targets least, and among these the one with the least total cost.
    `yearly` limits its annual cost in addition to that of the first option [EUR/year].
    """
    more = options.annual[s] - options.annual[s][0]
    within = np.flatnonzero((options.costs[s] <= _limit(money)) & (more <= _limit(yearly)))
    return int(within[np.lexsort((options.values[s][within], options.missed[s][within]))[0]])


RATIO = "saving per cost"
"""Name of the simple method that ignores targets."""

SIMPLE_METHODS = {
    "same money per metre": same_money,
    "worst section first": worst_first,
    RATIO: by_ratio,
}
"""Simple methods by name."""
