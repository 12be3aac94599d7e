"""Design without a search: the value network against the rule and the best constant.

`python -m experiments.no_search [--quick] [--out DIR]`. On sites of the test split, which no
training used, every method builds one layout without simulating any layout: nothing, the constant,
the engineering rule, the best layout of the family of the site (chosen by forecasts on training
sites with wide ranges; nothing on sites of a family without any), the policy that ships, the least
Z by the analytic estimate of the passages (`analytic`) and by the value network (`value`). The
estimates use the same releases without barriers. The layouts are verified on the same fresh
releases. Sites with an event of 100 blocks or more are left out.

Writes no_search.csv, one row per layout. An interrupted run is resumed. Judged by the lower end of
the 95 % interval of the gain of the value network over the better of the constant and the rule.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.made_with import MADE_WITH, resumed
from experiments.script import Number, interval, main, say, write
from experiments.search_gain import FRESH, QUICK_VERIFY, VERIFY, problems_of
from rigdda import Layout, sites
from rigdda.agents import training
from rigdda.agents.designers import policy
from rigdda.agents.designers.forecast import Value
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import Ledger, verify
from rigdda.agents.designers.race import forecast_pool
from rigdda.agents.designers.store import Store
from rigdda.barriers import describe
from rigdda.envs import DesignProblem, forecast_table

SITES, QUICK_SITES = 18, 2
BUDGET = 20_000
"""Budget of which a sixteenth is for releases without barriers."""


class Analytic(Value):
    """The analytic estimate instead of the network."""

    def __init__(self) -> None:
        """Create the estimate, which has no weights."""

    def __call__(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the first feature, the analytic share."""
        first: NDArray[np.float64] = features[..., 0]
        return first


def forecast(problem: DesignProblem, value: Value | None) -> Layout:
    """Return the layout with the least forecast Z."""
    ledger = Ledger(problem, BUDGET, 0, None, None)
    surrogate = forecast_pool(ledger, Menu(problem), [], value)
    best = surrogate.best(1)
    return best[0] if best and surrogate.value().min() < 1.0 else ()


def methods(problem: DesignProblem) -> dict[str, Layout]:
    """Return the layout of every method."""
    simple = training.methods(policy.load(), forecast_table.load(), problem)
    return simple | {"analytic": forecast(problem, Analytic()), "value": forecast(problem, None)}


def study(problem: DesignProblem, releases: int) -> list[dict[str, Any]]:
    """Return the rows of a site."""
    say(problem.site.name)
    store, found = Store(), []
    for name, layout in methods(problem).items():
        built = layout if problem.fits(layout) else ()
        e = verify(problem, built, releases, FRESH, store)
        found.append({
            "site": problem.site.name, "method": name, "z": e.objective, "z_low": e.ci[0],
            "z_high": e.ci[1], "z_nothing": problem.nothing.objective, **MADE_WITH,
            "layout": "; ".join(map(describe, built)),
        })  # fmt: skip
    return found


def relative(rows: Sequence[Any], method: str) -> NDArray[np.float64]:
    """Return Z of a method over Z without barriers on every site [-]."""
    own = [r for r in rows if r["method"] == method]
    return np.array([float(r["z"]) / float(r["z_nothing"]) for r in own])


def run(quick: bool, out: Path) -> Number:
    """Write no_search.csv."""
    path = out / "no_search.csv"
    rows: list[Any] = resumed(path)
    known = {r["site"] for r in rows}
    for problem in problems_of(QUICK_SITES if quick else SITES, sites.split("test")):
        if problem.site.name not in known:
            rows += study(problem, QUICK_VERIFY if quick else VERIFY)
            write(path, rows)
    value = relative(rows, "value")
    lines, least = [], np.inf
    for other in ("nothing", "constant", "rule", "best of the family", "policy", "analytic"):
        mean, half = interval(relative(rows, other) - value)
        lines.append(f"value ahead of {other}: {mean:.3f} +- {half:.3f}")
        least = min(least, mean - half) if other in ("constant", "rule") else least
    what = "gain of the value network over constant and rule over Z without barriers, lower end"
    note = f"{len(value)} sites\n" + "\n".join(lines)
    return Number(what, least, low=-1.0 if quick else 0.0, note=note)


if __name__ == "__main__":
    main(run)
