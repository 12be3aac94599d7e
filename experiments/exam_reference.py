"""References of the exam: layouts found by a long search, and random layouts.

`python -m experiments.exam_reference [--spec FILE] [--releases N]`. With fewer releases than the
specification asks for, references are provisional, and a later run with more replaces them.

On a site, the layout of the designer `race`, the best constant and no barrier are compared on new
releases, and the best of them is evaluated on further ones. On a corridor, the reference is the
joint choice of `rigdda corridor`. The random layouts are drawn uniformly from the decision box; on
a corridor, in the order of the sections, within the money that is left.

Writes the file of references beside the specification. An interrupted run continues where it
stopped.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import click
import msgspec
import numpy as np

from experiments.script import say
from rigdda import MECHANICS, Layout
from rigdda.agents.corridor.planning import Planner
from rigdda.agents.designers import race
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import verify
from rigdda.app.exam import specification
from rigdda.app.exam.specification import Anchor, ExamCorridor, References, Specification, tables
from rigdda.envs import CorridorProblem, DesignProblem
from rigdda.seeds import release_seeds

CHOICE, VALUE = 0.1, 0.2
"""Releases for the choice of the reference and for its value, over those of its search [-]."""

LEAST = 1_000
"""Least number of releases for the choice and for the value."""

DRAWS, EACH = 48, 40
"""Number of random layouts, and of releases of each."""

SEED = 20
"""Seed of the searches and of the random layouts."""


def of_site(problem: DesignProblem, releases: int) -> Anchor:
    """Return the anchor of a site."""
    found = race.design(problem, releases, SEED)
    candidates = dict.fromkeys([found.layout, constant(problem, Menu(problem)), ()])
    judged = [
        verify(problem, layout, _count(CHOICE, releases), SEED, stream="final")
        for layout in candidates
    ]
    best = min(judged, key=lambda e: e.objective).layout
    value = verify(problem, best, _count(VALUE, releases), SEED)
    rng = np.random.default_rng(SEED)
    drawn = [problem.decode(rng.uniform(*problem.bounds)) for _ in range(DRAWS)]
    random = [_draw(problem, layout, i) for i, layout in enumerate(drawn)]
    nothing = problem.nothing.objective
    mean = float(np.mean(random))
    return Anchor(tables((best,)), value.objective, value.ci, mean, nothing, releases)


def _count(share: float, releases: int) -> int:
    return max(LEAST, int(share * releases))


def _draw(problem: DesignProblem, layout: Layout, i: int) -> float:
    """Return Z of the random layout number `i`, on releases of its own."""
    return problem.evaluate(layout, release_seeds("search", SEED, EACH, i * EACH)).objective


def of_corridor(asked: ExamCorridor, most: int, releases: int) -> Anchor:
    """Return the anchor of a corridor."""
    corridor = asked.corridor()
    problem = CorridorProblem(corridor, most)
    plan = Planner(problem, releases, SEED).plan()
    best = plan.plans[0].evaluation.layouts
    value = problem.evaluate(best, release_seeds("verification", SEED, _count(VALUE, releases)))
    rng = np.random.default_rng(SEED)
    random = [_walk(problem, corridor.budgets[0], rng, i) for i in range(DRAWS)]
    mean = float(np.mean(random))
    return Anchor(tables(best), value.objective, value.ci, mean, problem.nothing, releases)


def _walk(problem: CorridorProblem, money: float, rng: np.random.Generator, i: int) -> float:
    """Return the annual cost of random layouts, built in order within the money that is left."""
    costs: list[float] = []
    for own, length in zip(problem.problems, problem.lengths.tolist(), strict=True):
        most = max(money, 0.0) / length
        within = DesignProblem(own.site, own.max_barriers, own.kinds, max_cost=most)
        layout = within.decode(rng.uniform(*within.bounds))
        money -= length * own.site.capital(layout)
        costs.append(length * _draw(own, layout, i))
    return math.fsum(costs)


def record(spec: Specification, file: Path, releases: int) -> References:
    """Record references that are missing, had fewer releases or are of other mechanics."""
    found = References(MECHANICS, {})
    if file.is_file():
        known = msgspec.json.decode(file.read_bytes(), type=References)
        found = known if known.mechanics == MECHANICS else found
    for name in spec.sites:
        if _lacks(found, name, releases):
            say(name)
            found.anchors[name] = of_site(spec.problem(name), releases)
            found.save(file)
    for corridor in spec.corridors:
        if _lacks(found, corridor.name, releases):
            say(corridor.name)
            found.anchors[corridor.name] = of_corridor(corridor, spec.max_barriers, releases)
            found.save(file)
    return found


def _lacks(found: References, name: str, releases: int) -> bool:
    """Return whether there is no reference of a name with so many releases."""
    return name not in found.anchors or found.anchors[name].releases < releases


def words(found: References) -> Sequence[str]:
    """Return a line for each reference."""
    return [
        f"{name}: reference {a.reference:.0f}, random {a.random:.0f}, nothing {a.nothing:.0f}"
        for name, a in found.anchors.items()
    ]


@click.command(help=__doc__)
@click.option("--spec", type=click.Path(exists=True, path_type=Path), metavar="FILE",
              help="Specification.  [default: the one of the package]")  # fmt: skip
@click.option("--releases", type=click.IntRange(200),
              help="Releases for each search, per section.  [default: those of the "
              "specification]")  # fmt: skip
def main(spec: Path | None, releases: int | None) -> None:
    """Record the references of a specification."""
    asked = specification.load(spec)
    file = specification.file_of_references(asked, spec)
    for line in words(record(asked, file, releases or asked.reference_releases)):
        click.echo(line)


if __name__ == "__main__":
    main()
