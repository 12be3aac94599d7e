"""Designers side by side: what the layout that each would give is worth, as it simulates more.

`python -m experiments.designers [--quick] [--out DIR]`: on 20 random sites that no training sees;
with `--site NAME`, repeatable, on those instead, with several seeds of the search. All at fidelity
"fast". What a designer would give at a budget is its best layout so far; all of these are verified
on releases that no designer sees.

Writes designers.csv (one row a site, seed, designer and budget), summary.csv (means over them with
95 % intervals) and designers.png. Goes on where it was stopped.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from agents import cma, exam, extra
from agents.names import DESIGNERS
from agents.protocol import Designer, DesignResult
from agents.store import Store
from agents.tables import write_rows
from agents.terminal import progress, show
from agents.verify import verify
from envs import DesignProblem, fidelity
from experiments import designers_curves as curves
from rigdda import BadInput, Layout, Site

RESULTS = Path("experiments/results/designers")
WARM = "cma from policy"
FIRST_BUDGET = 25


class Case(NamedTuple):
    """A problem and the seed of the searches on it."""

    problem: DesignProblem
    seed: int


class Budget(NamedTuple):
    """Releases that a designer may simulate, and unseen ones that a layout is verified on."""

    simulations: int
    verify: int

    def steps(self) -> list[int]:
        """Return the budgets at which a search is looked at, doubled up to the whole."""
        out, step = [], FIRST_BUDGET
        while step < self.simulations:
            out.append(step)
            step *= 2
        return [*out, self.simulations]


def contestants(names: Sequence[str]) -> dict[str, Designer]:
    """Return designers by their names."""
    return {name: cma.warm_started if name == WARM else extra.module(name).design for name in names}


def incumbents(found: DesignResult, budgets: Sequence[int]) -> Iterator[tuple[int, Layout]]:
    """Yield the layout that a designer would give at each budget: its best so far, then its last.

    Nothing, as long as it has evaluated nothing.
    """
    entries = found.history.stage("search") or found.history.entries
    for budget in budgets:
        seen = [entry.evaluation for entry in entries if entry.simulations <= budget]
        best = min(seen, key=lambda e: e.objective).layout if seen else ()
        yield budget, found.layout if budget >= found.simulations else best


def compete(
    case: Case, designers: dict[str, Designer], budget: Budget, folder: Path
) -> Iterator[dict[str, Any]]:
    """Yield the rows of one case; what was simulated is kept in a file of `folder`."""
    posed, seed = case
    store = Store(folder / f"{posed.site.name}-{seed}.jsonl")
    nothing = verify(posed, (), budget.verify, seed, store)
    for name, design in designers.items():
        found = design(posed, budget.simulations, seed, None, store)
        for at, layout in incumbents(found, budget.steps()):
            e = verify(posed, layout, budget.verify, seed, store)
            yield {
                "site": posed.site.name, "seed": seed, "designer": name, "budget": at,
                "simulations": min(at, found.simulations), "nothing": nothing.objective,
                "objective": e.objective, "gain": nothing.objective - e.objective,
                "debris": e.debris, "cost": e.cost, "barriers": len(e.layout),
            }  # fmt: skip


def cases(named: Sequence[str], sites: int, seeds: int) -> list[Case]:
    """Return the cases: named sites with several seeds, or unseen random sites."""
    if not named:
        return [Case(problem, 0) for problem in exam.unseen(sites)]
    fast = [DesignProblem(fidelity.at(Site.load(name), "fast")) for name in named]
    return [Case(problem, seed) for problem in fast for seed in range(seeds)]


@click.command()
@click.option("--quick", is_flag=True, help="Minutes: 2 sites, 100 simulations, 8 to verify.")
@click.option("--site", "named", multiple=True, help="A site instead of the unseen ones.")
@click.option("--sites", default=20, show_default=True, help="Unseen sites.")
@click.option("--seeds", default=8, show_default=True, help="Seeds of the searches on a --site.")
@click.option("--designer", "names", multiple=True, type=click.Choice([*DESIGNERS, WARM]),
              help="Some instead of all.")  # fmt: skip
@click.option("--simulations", default=400, show_default=True, help="Releases of a search.")
@click.option("--verify", default=32, show_default=True, help="Unseen releases of a layout.")
@click.option("--out", type=click.Path(path_type=Path), help=f"Folder to write into: {RESULTS}.")
def main(
    quick: bool, named: Sequence[str], sites: int, seeds: int, names: Sequence[str],
    simulations: int, verify: int, out: Path | None,
) -> None:  # fmt: skip
    """Compare the designers, see the module."""
    if quick:
        sites, seeds, simulations, verify = min(sites, 2), 2, min(simulations, 100), 8
    folder = out or (RESULTS / "quick" if quick else RESULTS)
    try:
        designers = contestants(names or [*DESIGNERS, WARM])
        drawn = cases(named, sites, seeds)
    except BadInput as error:
        raise click.UsageError(str(error)) from None
    (folder / "evaluations").mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    with progress(len(drawn) * len(designers)) as tick:
        for case in drawn:
            for row in compete(
                case, designers, Budget(simulations, verify), folder / "evaluations"
            ):
                rows.append(row)
                tick(
                    len({(r["site"], r["seed"], r["designer"]) for r in rows}),
                    case.problem.site.name,
                )
            write_rows(folder / "designers.csv", rows)
    table = curves.summary(rows)
    write_rows(folder / "summary.csv", table)
    curves.picture(folder / "designers.png", rows)
    show(curves.table(table))


if __name__ == "__main__":
    main()
