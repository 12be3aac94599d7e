"""The default designer without each of its parts.

`python -m experiments.race_ablation [--quick] [--out DIR]` runs `race` on sites of the validation
split with budgets of 500 and 2,000 releases, each time without one part:

- network: the analytic estimate of the passages takes the place of the value network;
- pairs: only single barriers, the rule and the constant are forecast;
- batches: all layouts are simulated in one batch, before the forecasts are updated;
- final: the exploration takes the releases of the final, and its best layout is chosen.

The first sites of the split, which served in the development of the designer, are left out. The
layouts are verified on the same fresh releases. The table has one row per search. Judged by the
greatest mean by which a version without a part is ahead of the whole designer, over Z without
barriers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from experiments.made_with import MADE_WITH, resumed
from experiments.no_search import Analytic
from experiments.script import Number, interval, main, say, write
from experiments.search_gain import (
    FRESH,
    QUICK_SITES,
    QUICK_VERIFY,
    SEED,
    SITES,
    VERIFY,
    problems_of,
)
from rigdda import Layout, sites
from rigdda.agents.designers import race
from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, Ledger, verify
from rigdda.agents.designers.racing import Track
from rigdda.agents.designers.store import Store
from rigdda.barriers import describe
from rigdda.envs import DesignProblem

BUDGETS, QUICK_BUDGETS = (500, 2_000), (200,)
FIRST = 20
"""Index in the split of the first site."""

WHOLE = "whole"


def no_layouts(*_: Any) -> Iterator[Layout]:
    """Return no layouts."""
    return iter(())


PATCHES: Mapping[str, Mapping[str, Any]] = {
    WHOLE: {},
    "network": {"value_network": Analytic},
    "pairs": {"joined": no_layouts},
    "batches": {"BATCHES": 1},
}
"""What takes the place of names of the module `race` without each part."""


def without_final(problem: DesignProblem, simulations: int, seed: int) -> DesignResult:
    """Return the best layout of an exploration that takes the releases of the final."""
    ledger = Ledger(problem, simulations, seed, None, None)
    menu, track = Menu(problem), Track(ledger)
    surrogate = race.forecast_pool(ledger, menu, unsearched(problem, menu))
    track.expect = surrogate.expect
    race.explore(track, surrogate, int((race.EXPLORE + race.FINAL_SHARE) * simulations))
    chosen = surrogate.best(1)[0] if surrogate.value().min() < 1.0 else ()
    return ledger.result(ledger.evaluate(chosen, "report", ledger.left))


def designer(part: str) -> Callable[[DesignProblem, int, int], DesignResult]:
    """Return the designer without a part."""
    if part == "final":
        return without_final

    def design(problem: DesignProblem, simulations: int, seed: int) -> DesignResult:
        with ExitStack() as stack:
            for name, other in PATCHES[part].items():
                stack.enter_context(mock.patch.object(race, name, other))
            return race.design(problem, simulations, seed)

    return design


PARTS = (*PATCHES, "final")


def row(
    problem: DesignProblem, part: str, budget: int, releases: int, store: Store
) -> dict[str, Any]:
    """Return the row of a search without a part, with its verified layout.

    `store` keeps the releases of verified layouts, since several searches find the same.
    """
    say(f"{problem.site.name}: without {part}, {budget} releases")
    found = designer(part)(problem, budget, SEED)
    e = verify(problem, found.layout, releases, FRESH, store)
    return {
        "site": problem.site.name, "without": part, "budget": budget,
        "releases": found.simulations, "cpu_s": found.seconds, "z": e.objective,
        "z_low": e.ci[0], "z_high": e.ci[1], "z_nothing": problem.nothing.objective,
        **MADE_WITH, "layout": "; ".join(map(describe, found.layout)),
    }  # fmt: skip


def losses(rows: list[Any], part: str, budget: int) -> list[float]:
    """Return by how much Z is greater without a part on every site, over Z without barriers."""
    share: dict[str, dict[str, float]] = {}
    for r in rows:
        if int(r["budget"]) == budget:
            share.setdefault(r["site"], {})[r["without"]] = float(r["z"]) / float(r["z_nothing"])
    return [own[part] - own[WHOLE] for own in share.values() if part in own]


def run(quick: bool, out: Path) -> Number:
    """Write race_ablation.csv."""
    path = out / "race_ablation.csv"
    rows: list[Any] = resumed(path)
    known = {(r["site"], r["without"], int(r["budget"])) for r in rows}
    budgets = QUICK_BUDGETS if quick else BUDGETS
    names = sites.split("validation")[FIRST:]
    verified = QUICK_VERIFY if quick else VERIFY
    for problem in problems_of(QUICK_SITES if quick else SITES, names):
        store = Store()
        for budget in budgets:
            for part in PARTS:
                if (problem.site.name, part, budget) not in known:
                    rows.append(row(problem, part, budget, verified, store))
                    write(path, rows)
    ends = {
        (budget, part): interval(losses(rows, part, budget))
        for budget in budgets
        for part in PARTS[1:]
    }
    note = "\n".join(
        f"{budget} releases, without {part}: Z greater by {mean:.3f} +- {half:.3f}"
        for (budget, part), (mean, half) in ends.items()
    )
    best = -float(np.min([mean for mean, _ in ends.values()]))
    return Number("greatest gain without a part [-]", best, high=0.01, note=note)


if __name__ == "__main__":
    main(run)
