"""Policies without a search: the acceptance table of the trained policy.

`python -m experiments.policy_table [--quick] [--out DIR]`. On sites of the test split with wide
ranges, which decided nothing, every method builds one layout without simulating any layout:
nothing, the constant, the engineering rule, the best layout of the family of the site (chosen on
training sites by forecasts, told the family), the least forecast Z of the value network over all
single barriers and pairs (`value`), the least forecast of the catalogue of the policy, and
the policy that ships. The layouts are verified on the same fresh releases. Sites where Z
without barriers is below 30 EUR per metre and year are left out, and those with an event of 100
blocks or more.

Writes policy_table.csv, one row per layout, with the forecast Z of the layout with the least
forecast. An interrupted run is resumed. Judged by the lower end
of the 95 % interval of the gain of the policy over the best of the constant, the rule and the
family, and, in the note, by the distance to the value network.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.made_with import MADE_WITH, resumed
from experiments.no_search import forecast, relative
from experiments.script import Number, interval, main, say, write
from experiments.search_gain import blocks
from rigdda import Layout, sites
from rigdda.agents.designers import policy
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.store import Store
from rigdda.agents.learning import forecasts
from rigdda.agents.training import MASS, methods
from rigdda.barriers import describe
from rigdda.envs import DesignProblem, forecast_table

SITES, QUICK_SITES = 18, 2
LOOKED_AT = 20
"""Number of test sites at the start of the split that are left out, because results on them were
looked at while the training was developed."""
RELEASES, QUICK_RELEASES = 400, 60
FRESH = 3
"""Seed of the releases, which nothing else draws."""
SIMPLE = ("constant", "rule", "best of the family")
"""Methods that the policy must improve on."""
LEAST = "least forecast"
"""Method whose forecast is compared with the outcome."""


def layouts(problem: DesignProblem) -> dict[str, Layout]:
    """Return the layout of every method."""
    simple = methods(policy.load(), forecast_table.load(), problem)
    return simple | {"value": forecast(problem, None)}


def study(problem: DesignProblem, releases: int) -> list[dict[str, Any]]:
    """Return the rows of a site."""
    say(problem.site.name)
    store, found = Store(), []
    own = forecasts.of_site(problem, policy.load().layouts)
    nothing = problem.nothing.objective
    for name, layout in layouts(problem).items():
        e = verify(problem, layout, releases, FRESH, store)
        z = nothing * float(np.nanmin(own.z)) if name == LEAST else ""
        found.append({
            "site": problem.site.name, "method": name, "z": e.objective, "z_low": e.ci[0],
            "z_high": e.ci[1], "z_forecast": z, "z_nothing": nothing, "releases": releases,
            **MADE_WITH,
            "layout": "; ".join(map(describe, layout)),
        })  # fmt: skip
    return found


def problems(count: int) -> list[DesignProblem]:
    """Return the problems of the first test sites without large masses, see `LOOKED_AT`."""
    found: list[DesignProblem] = []
    for name in sites.split("wide-test")[LOOKED_AT:]:
        if len(found) < count:
            problem = forecasts.problem(name)
            costs = problem.nothing.objective >= forecasts.LEAST_COST
            found += [problem] if costs and blocks(problem) < MASS else []
    return found


def known_rows(path: Path, releases: int) -> list[Any]:
    """Return the rows of an earlier run with the same networks and as many releases a layout."""
    return [r for r in resumed(path) if r["releases"] == str(releases)]


def differences(rows: Sequence[Any], others: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return how far the policy is ahead of each method: mean and half width [-]."""
    own = relative(rows, "policy")
    return {other: interval(relative(rows, other) - own) for other in others}


def optimism(rows: Sequence[Any]) -> NDArray[np.float64]:
    """Return Z minus its forecast, over Z without barriers, of the layout with the least one."""
    own = [row for row in rows if row["method"] == LEAST]
    off = [(float(r["z"]) - float(r["z_forecast"])) / float(r["z_nothing"]) for r in own]
    return np.array(off)


def run(quick: bool, out: Path) -> Number:
    """Write policy_table.csv."""
    path, releases = out / "policy_table.csv", QUICK_RELEASES if quick else RELEASES
    rows = known_rows(path, releases)
    known = {row["site"] for row in rows}
    for problem in problems(QUICK_SITES if quick else SITES):
        if problem.site.name not in known:
            rows += study(problem, releases)
            write(path, rows)
    names = list(dict.fromkeys(row["method"] for row in rows))
    lines = []
    for name, (mean, half) in differences(rows, names).items():
        z = float(relative(rows, name).mean())
        apart = "" if name == "policy" else f", policy ahead by {mean:.3f} +- {half:.3f}"
        lines.append(f"{name}: {z:.3f}{apart}")
    off = optimism(rows)
    mean, half = interval(off)
    lines.append(
        f"forecast too good by {mean:.3f} +- {half:.3f}, rms {np.sqrt((off**2).mean()):.3f}"
    )
    least = min(mean - half for mean, half in differences(rows, SIMPLE).values())
    what = "gain of the policy over constant, rule and family over Z without barriers, lower end"
    note = f"{len(relative(rows, 'policy'))} sites\n" + "\n".join(lines)
    return Number(what, least, low=-math.inf if quick else 0.0, note=note)


if __name__ == "__main__":
    main(run)
