"""Layouts that `rigdda design` chooses with its default precision and with all its releases.

`python -m experiments.design_precision [--quick] [--out DIR]`. On every built-in design site, the
command's search and verification run twice, with the default `--precision` and with
`--precision 0`, in both cases with required checks. Both layouts are evaluated on the same fresh
releases. A site agrees if both layouts have barriers of the same kinds and the 95 % interval of the
difference of Z contains zero.

Writes design_precision.csv, one row per site. An interrupted run is resumed. Judged by the number
of sites that agree.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from experiments.contenders import kinds_of
from experiments.made_with import MADE_WITH, resumed
from experiments.script import Number, main, say, write
from rigdda import sites
from rigdda.agents.designers import DEFAULT
from rigdda.app.commands.design import BUDGET, PRECISION, RELEASES
from rigdda.app.design import design
from rigdda.app.design_study import DesignStudy
from rigdda.barriers import describe
from rigdda.envs import DesignProblem, compare
from rigdda.seeds import release_seeds

TABLE = "design_precision.csv"

BUDGETS, QUICK_BUDGETS = (BUDGET, RELEASES), (400, 200)
"""Limits of the releases of the search and of the verification of a layout."""

FRESH, QUICK_FRESH = 6_000, 200
"""Fresh releases of each of the two layouts."""

SEED, FRESH_SEED = 0, 1
"""Seeds of the designs and of the fresh releases."""

AGREE = 5
"""Least number of sites of the six that must agree."""


def designed(problem: DesignProblem, limits: tuple[int, int], precision: float) -> DesignStudy:
    """Return the design of a site as the command computes it, without its files."""
    budget, releases = limits
    with tempfile.TemporaryDirectory() as folder:
        found, _ = design(
            problem, DEFAULT, budget, SEED, releases, Path(folder), lambda *_: None, precision
        )
    return found


def row(name: str, limits: tuple[int, int], fresh: int) -> dict[str, Any]:
    """Return the row of a site: both layouts, their releases and the difference of their Z."""
    problem = DesignProblem(name, checks="required")
    found: dict[str, Any] = {"site": name}
    layouts = []
    for label, precision in (("short", PRECISION), ("long", 0.0)):
        say(f"{name}: {label}")
        start = time.process_time()
        study = designed(problem, limits, precision)
        layout = study.chosen.evaluation.layout
        layouts.append(layout)
        found |= {
            f"{label}_search": study.result.simulations,
            f"{label}_verification": study.chosen.evaluation.releases,
            f"{label}_cpu_s": time.process_time() - start,
            f"{label}_kinds": kinds_of(layout),
            f"{label}_layout": "; ".join(map(describe, layout)),
        }
    short, long = layouts
    apart = compare(
        problem.with_checks("reported"),
        short,
        long,
        release_seeds("verification", FRESH_SEED, fresh),
    )
    same = found["short_kinds"] == found["long_kinds"]
    agrees = same and apart.ci[0] <= 0.0 <= apart.ci[1]
    return found | {
        "difference": apart.value, "difference_low": apart.ci[0], "difference_high": apart.ci[1],
        "z_nothing": problem.nothing.objective, "agrees": int(agrees), **MADE_WITH,
    }  # fmt: skip


def in_words(r: Any) -> str:
    """Return the layouts of a row and the difference of their Z in words."""
    short, long = (r[f"{label}_layout"] or "nothing" for label in ("short", "long"))
    value, low, high, base = (
        float(r[key]) for key in ("difference", "difference_low", "difference_high", "z_nothing")
    )
    return f"{r['site']}: {short} / {long}: {value:.1f} ({low:.1f} to {high:.1f}) of {base:.0f}"


def run(quick: bool, out: Path) -> Number:
    """Write design_precision.csv."""
    path = out / TABLE
    rows: list[Any] = resumed(path)
    known = {r["site"] for r in rows}
    names = sites.design_names()
    for name in names[:1] if quick else names:
        if name not in known:
            limits = QUICK_BUDGETS if quick else BUDGETS
            rows.append(row(name, limits, QUICK_FRESH if quick else FRESH))
            write(path, rows)
    note = "\n".join(map(in_words, rows))
    count = sum(int(r["agrees"]) for r in rows)
    return Number("sites that agree", count, low=1 if quick else AGREE, note=note)


if __name__ == "__main__":
    main(run)
