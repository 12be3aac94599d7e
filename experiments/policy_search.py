"""Searches with few releases: started from the policy, from the value network and from nothing.

`python -m experiments.policy_search [--quick] [--out DIR]`. On sites of the test split with wide
ranges, every method searches with 100, 500 and 2,000 releases:

- `race`, the default designer, starts from the forecasts of the value network.
- `race with the policy` is `race` with the three best layouts of the policy in its final.
- `policy, then a race` simulates only the layouts that the policy scores highest, as many as the
  budget allows, beside no barrier, the constant and the rule.
- `cma`, `tpe` and `random` start without any forecast.

`policy` and `value` build the layout of the policy that ships and the layout with the least
forecast, without simulating layouts (a budget of 0). All layouts are verified on the same fresh
releases. The sites are those of `experiments.policy_table`.

Writes policy_search.csv, one row per layout, and policy_search.png. An interrupted run is resumed.
Judged by the mean gain of `race with the policy` over `race`, the least of the budgets.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.made_with import MADE_WITH
from experiments.no_search import forecast
from experiments.policy_table import FRESH, known_rows, problems
from experiments.script import GREY, Number, interval, main, say, write
from experiments.script import draw as drawn
from rigdda import Layout
from rigdda.agents import designers
from rigdda.agents.designers import policy, race
from rigdda.agents.designers.convex import unsearched
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import Ledger, verify
from rigdda.agents.designers.racing import Track, best_of_ends
from rigdda.agents.designers.store import Store
from rigdda.agents.learning import forecasts
from rigdda.barriers import describe
from rigdda.envs import DesignProblem

SITES, QUICK_SITES = 12, 2
BUDGETS, QUICK_BUDGETS = (100, 500, 2_000), (100, 200)
RELEASES, QUICK_RELEASES = 600, 60
"""Number of fresh releases of each layout."""
SEED = 0
"""Seed of the searches."""
ADDED = 3
"""Number of layouts of the policy in the final of `race with the policy`."""
SHARE = 0.9
"""Share of the budget for the race of `policy, then a race`; the rest is for the report [-]."""
BARE = ("cma", "tpe", "random")
"""Designers that start without any forecast."""


def ranked(problem: DesignProblem) -> list[Layout]:
    """Return the layouts of the catalogue of the policy, the one with the highest score first."""
    trained = policy.load()
    found = forecasts.of_site(problem, trained.layouts)
    scores = np.where(np.isfinite(found.z), trained.scores(found.features), -np.inf)
    order = np.argsort(-scores, kind="stable")[: int(np.isfinite(scores).sum())]
    return [layout for i in order.tolist() if (layout := found.layouts[i]) is not None]


def race_of_policy(problem: DesignProblem, budget: int, best: Sequence[Layout]) -> Layout:
    """Return the best layout of a race of the best layouts of the policy."""
    track = Track(Ledger(problem, budget, SEED, None, None))
    known = [(), *unsearched(problem, Menu(problem))]
    least = len(problem.site.events)
    own = int(SHARE * budget)
    most = max(1, own // (4 * least) - len(known))
    contestants = list(dict.fromkeys([*best[:most], *known]))
    first = max(least, own // (3 * len(contestants)))
    ends = track.race(contestants, own, first, keep=3, stage="final", strict=True)
    return best_of_ends(ends).layout if ends else best[0]


def race_with_policy(problem: DesignProblem, budget: int, best: Sequence[Layout]) -> Layout:
    """Return the layout of `race` with layouts of the policy in its final."""
    if budget < race.LEAST_FINAL_BUDGET:
        return race_of_policy(problem, budget, best)
    ledger = Ledger(problem, budget, SEED, None, None)
    menu, track = Menu(problem), Track(ledger)
    known = list(dict.fromkeys([*unsearched(problem, menu), *(x for x in best[:ADDED] if x)]))
    surrogate = race.forecast_pool(ledger, menu, known)
    track.expect = surrogate.expect
    race.explore(track, surrogate, int(race.EXPLORE * budget))
    ends = race.final(track, surrogate, known, int(race.FINAL_SHARE * budget), 0.0)
    return race.choose(surrogate, ends, track.seen.get((), track.nothing))


def designed(name: str) -> Callable[[DesignProblem, int, Sequence[Layout]], Layout]:
    """Return the search of a designer of the package."""

    def found(problem: DesignProblem, budget: int, best: Sequence[Layout]) -> Layout:
        layout: Layout = designers.module(name).design(problem, budget, SEED).layout
        return layout

    return found


SEARCHLESS = ("policy", "value")
"""Methods that simulate no layout."""

SEARCHES: dict[str, Callable[[DesignProblem, int, Sequence[Layout]], Layout]] = {
    "race": designed("race"),
    "race with the policy": race_with_policy,
    "policy, then a race": race_of_policy,
    **{name: designed(name) for name in BARE},
}
"""The searches by name: functions of the problem, the budget and the layouts of the policy."""


def study(problem: DesignProblem, budgets: Sequence[int], releases: int) -> list[dict[str, Any]]:
    """Return the rows of a site."""
    best, store = ranked(problem), Store()
    layouts = {("policy", 0): best[0], ("value", 0): forecast(problem, None)}
    for budget in budgets:
        for name, search in SEARCHES.items():
            say(f"{problem.site.name}: {name}, {budget:,} releases")
            layouts[name, budget] = search(problem, budget, best)
    found = []
    for (name, budget), layout in layouts.items():
        e = verify(problem, layout, releases, FRESH, store)
        found.append({
            "site": problem.site.name, "method": name, "budget": budget, "releases": releases,
            "z": e.objective, "z_low": e.ci[0], "z_high": e.ci[1],
            "z_nothing": problem.nothing.objective, **MADE_WITH,
            "layout": "; ".join(map(describe, layout)),
        })  # fmt: skip
    return found


def shares(rows: Sequence[Any], name: str, budget: int) -> Any:
    """Return Z of a method with a budget over Z without barriers on every site [-]."""
    own = [r for r in rows if r["method"] == name and int(r["budget"]) == budget]
    return np.array([float(r["z"]) / float(r["z_nothing"]) for r in own])


def draw(path: Path, rows: Sequence[Any], budgets: Sequence[int]) -> None:
    """Draw the mean Z of each method against the number of releases."""

    def paint(sheet: Figure) -> None:
        axes = sheet.add_subplot(
            xscale="log", xlabel="releases of the search",
            ylabel="mean Z over Z without barriers [-]",
        )  # fmt: skip
        axes.set_xticks(budgets, [f"{budget:,}" for budget in budgets])
        axes.minorticks_off()
        for name in SEARCHES:
            axes.plot(budgets, [shares(rows, name, b).mean() for b in budgets], "o-", label=name)
        for name, style in zip(SEARCHLESS, ("--", ":"), strict=True):
            own = float(shares(rows, name, 0).mean())
            axes.axhline(own, color=GREY, linestyle=style, label=f"{name}, no search")
        axes.legend()

    drawn(path, (7.0, 4.5), paint)


def run(quick: bool, out: Path) -> Number:
    """Write policy_search.csv and policy_search.png."""
    path, releases = out / "policy_search.csv", QUICK_RELEASES if quick else RELEASES
    budgets, rows = QUICK_BUDGETS if quick else BUDGETS, known_rows(path, releases)
    known = {row["site"] for row in rows}
    for problem in problems(QUICK_SITES if quick else SITES):
        if problem.site.name not in known:
            rows += study(problem, budgets, releases)
            write(path, rows)
    draw(out / "policy_search.png", rows, budgets)
    lines, gains = [f"{len(shares(rows, 'policy', 0))} sites"], []
    lines += [f"{name}, no search: {shares(rows, name, 0).mean():.3f}" for name in SEARCHLESS]
    for budget in budgets:
        own = shares(rows, "race", budget)
        for name in SEARCHES:
            z = shares(rows, name, budget)
            mean, half = interval(own - z)
            gains += [mean] if name == "race with the policy" else []
            ahead = "" if name == "race" else f", ahead of race by {mean:.3f} +- {half:.3f}"
            lines.append(f"{budget:,} releases, {name}: {z.mean():.3f}{ahead}")
    what = "gain of race with the policy over race, over Z without barriers, least of budgets"
    return Number(what, min(gains), low=-math.inf if quick else 0.0, note="\n".join(lines))


if __name__ == "__main__":
    main(run)
