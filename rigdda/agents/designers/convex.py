"""Mixed-integer linear programming on an ensemble of releases without barriers.

The programme chooses one, two or three barriers from a catalogue that estimates their effects
(`rigdda.agents.designers.catalogue`). With z[j] = 1 if barrier j is built, and h_r the remaining
harm of release r,

    minimise    standing + annual.z + weight.h
    subject to  h_r >= base_r - sum_j relief[r, j] z[j],  h_r >= 0
                sum z <= max_barriers, capital.z <= max_cost, and barriers do not overlap

`standing` is the upkeep of the existing barriers, a constant.

The sum of the reliefs overestimates the joint effect of two barriers. Therefore further programmes
scale the reliefs down. The estimate also neglects the effect of a barrier on the motion farther
downhill, so the resulting layouts are compared by simulation.

These optima, the engineering rule, lower and weaker variants of its fence (the rule does not
consider costs), the best constant and no barrier are the starting layouts of every search.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rigdda import Fence, Layout
from rigdda.agents.designers.catalogue import Catalogue, CrossingEnsemble, Floats, whole
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, Progress, Proposals, search
from rigdda.agents.designers.rule import answer
from rigdda.agents.designers.store import Store
from rigdda.barriers import FENCE_CLASSES
from rigdda.barriers.base import MIN_GAP, SIZE_STEP
from rigdda.barriers.fence import CLASSES
from rigdda.envs import DesignProblem


@dataclass(frozen=True, slots=True)
class Choice:
    """An optimum of the programme.

    Parameters
    ----------
    layout : tuple of Barrier
        The barriers, going downhill.
    objective : float
        Z as estimated by the programme [EUR per m and year].
    bound : float
        Objective of the linear relaxation, which is a lower bound of Z in the programme [EUR per m
        and year].
    """

    layout: Layout
    objective: float
    bound: float


def choose(
    catalogue: Catalogue, slots: int, share: float = 1.0, max_cost: float | None = None
) -> Choice:
    """Return the best choice of at most `slots` barriers from a catalogue.

    Parameters
    ----------
    catalogue : Catalogue
        The barriers.
    slots : int
        Largest number of barriers.
    share : float
        Factor on all reliefs [-].
    max_cost : float, optional
        Largest capital cost [EUR per m].
    """
    if not catalogue.barriers:
        return Choice((), catalogue.nothing, catalogue.nothing)
    bound, _ = _solve(catalogue, slots, share, max_cost, boolean=False)
    value, z = _solve(catalogue, slots, share, max_cost, boolean=True)
    built = [catalogue.barriers[j] for j in np.flatnonzero(z > 0.5).tolist()]
    return Choice(tuple(sorted(built, key=lambda b: b.x)), value, min(bound, value))


def _solve(
    catalogue: Catalogue, slots: int, share: float, max_cost: float | None, boolean: bool
) -> tuple[float, Floats]:
    """Return the least objective and its z (J,), with integers or values between 0 and 1."""
    import cvxpy as cp

    useful = np.flatnonzero(catalogue.weight * catalogue.base > 0.0)
    scale = max(float(catalogue.weight @ catalogue.base), 1e-12)
    z = cp.Variable(len(catalogue.barriers), boolean=boolean)
    left = cp.Variable(len(useful), nonneg=True)  # remaining share of the harm of a release [-]
    weigh = (catalogue.weight * catalogue.base)[useful] / scale
    part = share * catalogue.relief[useful] / catalogue.base[useful, None]
    goal = (catalogue.annual / scale) @ z + weigh @ left
    rules = [left >= 1.0 - part @ z, cp.sum(z) <= slots, z >= 0, z <= 1]
    if max_cost is not None:
        rules.append(catalogue.capital @ z <= max_cost)
    clashes = _clashes(catalogue)
    if len(clashes):
        rules.append(clashes @ z <= 1)
    problem = cp.Problem(cp.Minimize(goal), rules)
    with suppress(ValueError, cp.SolverError):
        problem.solve(solver=cp.HIGHS, mip_rel_gap=GAP)
    if z.value is None:  # no barrier is always a solution
        return catalogue.nothing, np.zeros(len(catalogue.barriers))
    least = catalogue.standing + scale * float(problem.value)
    return least, np.asarray(z.value, dtype=np.float64)


GAP = 0.01
"""Relative optimality gap, which is smaller than the error of the estimates [-]."""


def _clashes(catalogue: Catalogue) -> Floats:
    """Return for each start of a barrier which barriers occupy or nearly touch it, (n, J)."""
    start, end = catalogue.span.T
    starts = np.unique(start)
    over = (start <= starts[:, None]) & (starts[:, None] < end + MIN_GAP)
    kinds = np.array([b.kind == "mesh" for b in catalogue.barriers])
    over &= ~kinds & np.array([b.kind != "removal" for b in catalogue.barriers])
    rows = np.concatenate([over, kinds[None]])  # at most one mesh
    return np.unique(rows[rows.sum(axis=1) > 1], axis=0).astype(np.float64)


CAREFUL = (1.0, 0.8, 0.5)
"""Factors on the estimated reliefs [-]."""
TABLE = 120
"""Number of barriers from which the programme chooses: the best of every kind at every station,
ranked by their effect alone."""


@dataclass(frozen=True, slots=True)
class ConvexResult(DesignResult):
    """Result with the best layout in simulation and all optima that were simulated.

    Parameters
    ----------
    choices : tuple of Choice
        Optima of the programmes, each with the bound of its relaxation.
    """

    choices: tuple[Choice, ...]


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> ConvexResult:
    """Return the layout of the programmes that is best in simulation.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    ledger, menu = Ledger(problem, simulations, seed, progress, store), Menu(problem)
    ensemble = ledger.ensemble(menu.stations)
    choices = best_choices(problem, ensemble, menu)
    layouts = [*(choice.layout for choice in choices), answer(problem).layout]
    ledger.starts |= set(layouts)
    found = search(ledger, _propose(layouts))
    own = {name: getattr(found, name) for name in DesignResult.__dataclass_fields__}
    return ConvexResult(**own, choices=choices)


def _propose(layouts: list[Layout]) -> Proposals:
    """Yield the layouts and no barrier, so that the result is never worse than no barrier."""
    for layout in dict.fromkeys([*layouts, ()]):  # noqa: UP028, a list cannot be sent values
        yield layout


def best_choices(
    problem: DesignProblem, ensemble: CrossingEnsemble, menu: Menu
) -> tuple[Choice, ...]:
    """Return the optima with different layouts, those with few barriers first."""
    catalogue = promising(whole(problem, ensemble, menu))
    found: dict[Layout, Choice] = {}
    for slots, share in _ladder(problem):
        choice = choose(catalogue, slots, share, problem.max_cost)
        if problem.fits(choice.layout):
            found.setdefault(choice.layout, choice)
    return tuple(found.values())


def _ladder(problem: DesignProblem) -> Iterator[tuple[int, float]]:
    """Yield the largest number of barriers and the factor on the reliefs of each programme."""
    for slots in range(1, min(problem.max_barriers, 3) + 1):
        for share in CAREFUL:
            yield slots, share


def promising(catalogue: Catalogue) -> Catalogue:
    """Return the most promising barriers of a catalogue.

    These are the best barriers of every kind at every station, up to the same number for each kind.
    """
    best: dict[tuple[str, float], int] = {}
    order = np.argsort(catalogue.objective, kind="stable").tolist()
    for j in order:
        barrier = catalogue.barriers[j]
        best.setdefault((barrier.kind, 0.0 if barrier.kind == "mesh" else barrier.x), j)
    kinds: dict[str, list[int]] = {}
    for (kind, _), j in best.items():
        kinds.setdefault(kind, []).append(j)
    each = TABLE // max(1, len(kinds))
    chosen = [j for group in kinds.values() for j in group[:each]]
    return catalogue.take(sorted(chosen))


CHEAPER = ((0, 1), (1, 0), (1, 1), (0, 2))
"""Steps of height and of class by which the fence of the rule is reduced in its variants."""


def starts(ledger: Ledger) -> list[Layout]:
    """Return the starting layouts of a search, the most promising first."""
    menu = Menu(ledger.problem)
    ensemble = ledger.ensemble(menu.stations)
    ledger.known = tuple(unsearched(ledger.problem, menu))
    optima = [choice.layout for choice in best_choices(ledger.problem, ensemble, menu)]
    found = list(dict.fromkeys([*optima, *known(ledger.problem, menu), ()]))
    ledger.starts |= set(found)
    return found


def unsearched(problem: DesignProblem, menu: Menu) -> list[Layout]:
    """Return the baseline layouts of every search: the rule and the best constant."""
    layouts = answer(problem).layout, constant(problem, menu)
    return [layout for layout in dict.fromkeys(layouts) if layout and problem.fits(layout)]


def known(problem: DesignProblem, menu: Menu) -> list[Layout]:
    """Return the layouts that need no search: the rule, its variants and the best constant."""
    one = answer(problem).layout
    smaller = [_smaller(one, *steps) for steps in CHEAPER]
    layouts = [one, constant(problem, menu), *smaller]
    return [layout for layout in dict.fromkeys(layouts) if layout and problem.fits(layout)]


def _smaller(layout: Layout, lower: int, weaker: int) -> Layout:
    """Return a layout with its fences reduced by some steps of height and of class."""
    out = []
    for b in layout:
        if isinstance(b, Fence) and b.energy_class is not None:
            name = CLASSES[max(0, CLASSES.index(b.energy_class) - weaker)]
            row = FENCE_CLASSES[name]
            tall = min(max(row.lowest, b.height - lower * SIZE_STEP), row.height)
            b = Fence(b.x, tall, energy_class=name)
        out.append(b)
    return tuple(out)
