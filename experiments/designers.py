"""Distance of designers from the reference, against the number of releases that they use.

`python -m experiments.designers [--quick] [--out DIR]`, after `python -m experiments.reference`. On
every built-in design site, `race` and `random` search with several seeds and two budgets, the
others once with the default budget. Their layouts are verified on fresh releases, together with the
reference and no barriers. The distance is (Z - Z of the reference) / (Z without barriers - Z of the
reference): 0 equals the reference, 1 means no gain.

Writes designers.csv, one row per search, and designers.png. An interrupted run is resumed.
"""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments import reference
from experiments.made_with import MADE_WITH, resumed
from experiments.script import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    RESULTS,
    Number,
    draw,
    main,
    say,
    write,
)
from rigdda import BadInput, Layout, sites
from rigdda.agents import designers
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.store import Store
from rigdda.app.commands.design import BUDGET
from rigdda.barriers import describe
from rigdda.envs import DesignProblem, Evaluation

COLOURS = {
    "race": RED, "random": GREY, "constant": "black", "rule": ORANGE, "cma": BLUE, "tpe": GREEN,
    "convex": "#9467bd",
}  # fmt: skip
FREE = ("constant", "rule")
"""Designers that do not search; one budget and one seed suffice."""
MANY = ("race", "random")
"""Designers that search with every budget and seed; the others use the default budget and one
seed."""
TICKS, APART = (2_000, 5_000, 10_000, 20_000), 1.03
"""Tick labels of the axis, and the factor by which points of different designers are separated."""
SEEDS, QUICK_SEEDS = 3, 1
BUDGETS, QUICK_BUDGETS = (BUDGET // 10, BUDGET), (600,)
VERIFY, QUICK_VERIFY = 6_000, 800
FRESH = 1
"""Seed of the verification releases, different from that by which the reference was selected."""
TARGET = 0.05
"""Target distance of the default designer with its default budget, on five of six sites."""


def cases(quick: bool) -> list[tuple[int, int, str]]:
    """Return seed, budget and designer of every search on a site, most informative first."""
    budgets, seeds = (QUICK_BUDGETS, QUICK_SEEDS) if quick else (BUDGETS, SEEDS)
    found = [
        (seed, budget, name)
        for name in COLOURS
        for budget in (budgets if name in MANY else budgets[-1:])
        for seed in range(seeds if name in MANY else 1)
    ]
    order = {name: i for i, name in enumerate((*FREE, *MANY))}
    rest = len(order)
    return sorted(found, key=lambda c: (c[2] not in order, c[0], order.get(c[2], rest), c[1]))


class Contest:
    """A site with its reference and the layouts verified on it.

    Parameters
    ----------
    site : str
        Name of a built-in design site.
    recorded : list of dict
        Rows of the reference.
    releases : int
        Number of releases for the verification of each layout.
    """

    def __init__(self, site: str, recorded: list[Any], releases: int):
        self.site, self.problem, self.store = site, DesignProblem(site), Store()
        self.releases = releases
        best = next(r for r in recorded if r["site"] == site and r["what"] == reference.BEST)
        self.best = reference.layout_of(best)

    def verify(self, layout: Layout) -> Evaluation:
        """Return the evaluation of a layout on the common releases."""
        return verify(self.problem, layout, self.releases, FRESH, self.store)

    def row(self, name: str, budget: int, seed: int) -> dict[str, Any]:
        """Run a designer; return the row of its result."""
        say(f"{self.site}: {name}, {budget} releases, seed {seed}")
        found = designers.module(name).design(self.problem, budget, seed)
        least, nothing, e = map(self.verify, (self.best, (), found.layout))
        gain = nothing.objective - least.objective
        return {
            "site": self.site, "designer": name, "budget": budget, "seed": seed,
            "releases": found.simulations, "cpu_s": found.seconds, "z": e.objective,
            "z_low": e.ci[0], "z_high": e.ci[1], "reported": found.evaluation.objective,
            "reported_low": found.evaluation.ci[0], "reported_high": found.evaluation.ci[1],
            "z_reference": least.objective, "z_nothing": nothing.objective,
            "distance": (e.objective - least.objective) / gain, "origin": found.origin,
            "on_bound": "; ".join(found.on_bound), **MADE_WITH,
            "layout": "; ".join(map(describe, found.layout)),
        }  # fmt: skip


def medians(rows: list[Any], name: str, budget: int) -> dict[str, float]:
    """Return the median distance of a designer over its seeds, by site."""
    own = [r for r in rows if r["designer"] == name and int(r["budget"]) == budget]
    return {
        site: statistics.median(float(r["distance"]) for r in own if r["site"] == site)
        for site in dict.fromkeys(r["site"] for r in own)
    }


def picture(figure: Figure, rows: list[Any]) -> None:
    """Draw the distance of every search against its number of releases, site by site."""
    names = list(dict.fromkeys(r["site"] for r in rows))
    grid = figure.subplots(2, (len(names) + 1) // 2, squeeze=False, sharey=True).ravel()
    for axes, site in zip(grid, names, strict=False):
        for i, (name, colour) in enumerate(COLOURS.items()):
            own = [r for r in rows if r["site"] == site and r["designer"] == name]
            x, y = (np.array([float(r[k]) for r in own]) for k in ("releases", "distance"))
            axes.plot(APART**i * x, y, "o", color=colour, alpha=0.6, label=name)
        axes.axhline(0.0, color="0.8", zorder=0)
        axes.axhline(1.0, color="0.8", zorder=0, linestyle=":")
        axes.set(xscale="log", title=site, xlabel="releases", ylim=(-0.1, 1.5))
        axes.set_xticks(TICKS, [f"{tick:,}" for tick in TICKS])
        axes.set_xticks([], minor=True)
    grid[0].set_ylabel("distance from the reference [-]")
    grid[0].legend(fontsize=8)
    for axes in grid[len(names) :]:
        axes.set_visible(False)


def run(quick: bool, out: Path) -> Number:
    """Write designers.csv and designers.png."""
    path = out / "reference.csv"
    recorded = reference.load(path) or reference.load(RESULTS / "reference.csv")
    if not recorded:
        raise BadInput("reference", str(path), "run python -m experiments.reference first")
    rows: list[Any] = resumed(out / "designers.csv")
    known = {(r["site"], r["designer"], int(r["budget"]), int(r["seed"])) for r in rows}
    contests: dict[str, Contest] = {}
    for seed, budget, name in cases(quick):
        for site in sites.design_names():
            if (site, name, budget, seed) not in known:
                if site not in contests:
                    contests[site] = Contest(site, recorded, QUICK_VERIFY if quick else VERIFY)
                rows.append(contests[site].row(name, budget, seed))
                write(out / "designers.csv", rows)
    draw(out / "designers.png", (14.0, 8.0), lambda figure: picture(figure, rows))
    budget = (QUICK_BUDGETS if quick else BUDGETS)[-1]
    note = "\n".join(
        f"{name}: " + ", ".join(f"{s} {d:.2f}" for s, d in medians(rows, name, budget).items())
        for name in COLOURS
    )
    fifth = sorted(medians(rows, "race", budget).values())[-2]
    what = "median distance of `race` from the reference, the second greatest of the sites"
    return Number(what, fifth, high=2.0 if quick else TARGET, note=note)


if __name__ == "__main__":
    main(run)
