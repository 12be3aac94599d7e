"""How far the best layout of a family is behind the layout of a search, in the simulator.

`python -m experiments.wide_race [--quick] [--out DIR]`. On sites of the test split with wide
ranges, `race` searches with 2,000 releases. Its layout, the best layout of the family of the site
(chosen on training sites by forecasts) and the layout of the policy that ships are verified on the
same fresh releases. The distance confirms, or not, what `experiments.wide_sites` finds by
forecasts: how much a decision for the site gains over one for the family.

Writes wide_race.csv, one row per layout. An interrupted run is resumed. Judged by the mean distance
of the best layout of the family to the layout of the search, over Z without barriers.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from experiments.made_with import MADE_WITH
from experiments.no_search import relative
from experiments.policy_table import FRESH, known_rows, problems
from experiments.script import Number, interval, main, say, write
from rigdda.agents.designers import policy, race
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.store import Store
from rigdda.agents.training import methods
from rigdda.barriers import describe
from rigdda.envs import DesignProblem, forecast_table

SITES, QUICK_SITES = 12, 2
BUDGET, QUICK_BUDGET = 2_000, 100
"""Number of releases of a search."""
RELEASES, QUICK_RELEASES = 1_000, 60
"""Number of fresh releases of each layout."""
BAR = 0.08
"""Least mean distance [-]."""


def study(problem: DesignProblem, budget: int, releases: int) -> list[dict[str, Any]]:
    """Return the rows of a site."""
    say(problem.site.name)
    trained, store = policy.load(), Store()
    others = methods(trained, forecast_table.load(), problem)
    layouts = {name: others[name] for name in ("nothing", "best of the family", "policy")}
    layouts["race"] = race.design(problem, budget, 0).layout
    found = []
    for name, layout in layouts.items():
        e = verify(problem, layout, releases, FRESH, store)
        found.append({
            "site": problem.site.name, "family": problem.site.family, "method": name,
            "budget": budget, "releases": releases, "z": e.objective, "z_low": e.ci[0],
            "z_high": e.ci[1], "z_nothing": problem.nothing.objective, **MADE_WITH,
            "layout": "; ".join(map(describe, layout)),
        })  # fmt: skip
    return found


def run(quick: bool, out: Path) -> Number:
    """Write wide_race.csv."""
    path = out / "wide_race.csv"
    budget, releases = (QUICK_BUDGET, QUICK_RELEASES) if quick else (BUDGET, RELEASES)
    rows = [row for row in known_rows(path, releases) if row["budget"] == str(budget)]
    known = {row["site"] for row in rows}
    for problem in problems(QUICK_SITES if quick else SITES):
        if problem.site.name not in known:
            rows += study(problem, budget, releases)
            write(path, rows)
    searched = relative(rows, "race")
    behind = {
        name: interval(relative(rows, name) - searched)
        for name in ("nothing", "best of the family", "policy")
    }
    note = f"{len(searched)} sites, race {searched.mean():.3f} of Z without barriers\n"
    note += "\n".join(
        f"{name}: {mean:.3f} +- {half:.3f} behind" for name, (mean, half) in behind.items()
    )
    what = "mean distance of the best layout of the family to that of race"
    return Number(what, behind["best of the family"][0], low=-math.inf if quick else BAR, note=note)


if __name__ == "__main__":
    main(run)
