"""Layouts worth trying first: what one barrier-free ensemble suggests to every search.

The optima of `convex`, the engineering rule, its fence lower and weaker (the rule does not know
what it costs), the best constant, and no barrier at all.
"""

from __future__ import annotations

from rigdda import Fence, Layout
from rigdda.agents import convex
from rigdda.agents.constant import constant
from rigdda.agents.crossings import Ensemble, ensemble_for
from rigdda.agents.menu import STEP, Menu
from rigdda.agents.protocol import Ledger, Proposals
from rigdda.agents.rule import rule
from rigdda.barriers import FENCE_CLASSES
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import CLASSES

CHEAPER = ((0, 1), (1, 0), (1, 1), (0, 2))
"""Steps of height and of class by which the rule's fence is tried smaller."""


def starts(ledger: Ledger) -> list[Layout]:
    """Return the different layouts that an ensemble suggests, the most promising first."""
    menu = Menu(ledger.problem)
    ensemble = ensemble_for(ledger, menu.stations)
    ledger.known = tuple(unsearched(ledger.problem, ensemble, menu))
    optima = [choice.layout for choice in convex.optima(ledger.problem, ensemble, menu)]
    found = list(dict.fromkeys([*optima, *known(ledger.problem, ensemble, menu), ()]))
    ledger.starts |= set(found)
    return found


def unsearched(problem: DesignProblem, ensemble: Ensemble, menu: Menu) -> list[Layout]:
    """Return the layouts that every search must beat: the rule's and the best constant."""
    layouts = rule(problem, ensemble, menu), constant(problem, menu)
    return [layout for layout in dict.fromkeys(layouts) if layout and problem.fits(layout)]


def known(problem: DesignProblem, ensemble: Ensemble, menu: Menu) -> list[Layout]:
    """Return the layouts that need no search: the rule's, it smaller, and the best constant."""
    one = rule(problem, ensemble, menu)
    smaller = [_smaller(one, *steps) for steps in CHEAPER]
    layouts = [one, constant(problem, menu), *smaller]
    return [layout for layout in dict.fromkeys(layouts) if layout and problem.fits(layout)]


def offered(ledger: Ledger) -> Proposals:
    """Yield what `starts` suggests."""
    for layout in starts(ledger):  # noqa: UP028, a list cannot be sent values
        yield layout


def _smaller(layout: Layout, lower: int, weaker: int) -> Layout:
    """Return a layout whose fences are lower and of a lower class by some steps."""
    out = []
    for b in layout:
        if isinstance(b, Fence) and b.energy_class is not None:
            name = CLASSES[max(0, CLASSES.index(b.energy_class) - weaker)]
            row = FENCE_CLASSES[name]
            tall = min(max(row.lowest, b.height - lower * STEP), row.height)
            b = Fence(b.x, tall, energy_class=name)
        out.append(b)
    return tuple(out)
