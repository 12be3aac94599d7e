"""Gain of the default designer over random search on generated sites, at equal releases.

`python -m experiments.search_gain [--quick] [--out DIR]`. Both search on the same sites with three
budgets. The sites are the last of the validation split. No decision about the designer was based on
them: the first of the split served in its development, and others decided which of its parts were
removed (`experiments.race_ablation`). The layouts are verified on the same fresh releases. The
difference of Z is divided by Z without barriers and averaged over the sites. Sites with an event of
100 blocks or more are left out, since a release takes as long as hundreds of others.

Writes search_gain.csv, one row per search. An interrupted run is resumed. Judged by the lower end
of the 95 % interval of the mean gain, the least of the budgets.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.made_with import MADE_WITH, resumed
from experiments.script import Number, interval, main, say, write
from rigdda import sites
from rigdda.agents import designers
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.store import Store
from rigdda.barriers import describe
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import largest

NAMES = (designers.DEFAULT, "random")
BUDGETS, QUICK_BUDGETS = (500, 2_000, 20_000), (200,)
SITES, QUICK_SITES = 18, 2
VERIFY, QUICK_VERIFY = 1_000, 200
SEED, FRESH = 0, 1
"""Seed of the searches and of the verification."""
FIRST = 39
"""Index in the split of the first site."""
MOST = 100
"""Number of blocks of an event from which a site is left out."""


def problems_of(count: int, names: Sequence[str]) -> list[DesignProblem]:
    """Return the problems of the first sites without large masses, those of few blocks first."""
    found: list[DesignProblem] = []
    for name in names:
        problem = DesignProblem(name)
        if len(found) < count and blocks(problem) < MOST:
            found.append(problem)
    return sorted(found, key=lambda problem: (blocks(problem), problem.site.name))


def blocks(problem: DesignProblem) -> int:
    """Return the largest number of blocks of an event."""
    return max(largest(problem.site, name) for name in problem.site.event_names)


def row(
    problem: DesignProblem, name: str, budget: int, releases: int, store: Store
) -> dict[str, Any]:
    """Return the row of one search with its verified layout, whose releases `store` keeps."""
    say(f"{problem.site.name}: {name}, {budget} releases")
    found = designers.module(name).design(problem, budget, SEED)
    e = verify(problem, found.layout, releases, FRESH, store)
    return {
        "site": problem.site.name, "designer": name, "budget": budget,
        "releases": found.simulations, "cpu_s": found.seconds, "z": e.objective,
        "z_low": e.ci[0], "z_high": e.ci[1], "reported": found.evaluation.objective,
        "z_nothing": problem.nothing.objective, "origin": found.origin,
        **MADE_WITH, "layout": "; ".join(map(describe, found.layout)),
    }  # fmt: skip


def gains(rows: Sequence[Any], budget: int) -> list[float]:
    """Return by how much the default is ahead on every site, over Z without barriers [-]."""
    share: dict[str, dict[str, float]] = {}
    for r in rows:
        if int(r["budget"]) == budget:
            own = share.setdefault(r["site"], {})
            own[r["designer"]] = float(r["z"]) / float(r["z_nothing"])
    first, second = NAMES
    return [own[second] - own[first] for own in share.values() if len(own) == len(NAMES)]


def run(quick: bool, out: Path) -> Number:
    """Write search_gain.csv."""
    path = out / "search_gain.csv"
    rows: list[Any] = resumed(path)
    known = {(r["site"], r["designer"], int(r["budget"])) for r in rows}
    budgets = QUICK_BUDGETS if quick else BUDGETS
    names = sites.split("validation")[FIRST:]
    releases = QUICK_VERIFY if quick else VERIFY
    for problem in problems_of(QUICK_SITES if quick else SITES, names):
        store = Store()
        for budget in budgets:
            for name in NAMES:
                if (problem.site.name, name, budget) not in known:
                    rows.append(row(problem, name, budget, releases, store))
                    write(path, rows)
    found = {budget: gains(rows, budget) for budget in budgets}
    ends = {budget: interval(values) for budget, values in found.items()}
    note = "\n".join(
        f"{budget} releases: {mean:.3f} +- {half:.3f} over {len(found[budget])} sites"
        for budget, (mean, half) in ends.items()
    )
    least = min(mean - half for mean, half in ends.values())
    what = "gain over random search, of Z without barriers, lower end, least of budgets"
    return Number(what, least, low=-1.0 if quick else 0.0, note=note)


if __name__ == "__main__":
    main(run)
