"""Joint choice of barriers on the built-in corridor `corridor-12`, and the simple methods.

`python -m experiments.corridor_twelve [--quick] [--out DIR]` plans the corridor of twelve sections
as `rigdda corridor corridor-12` does, with budgets of 100, 200 and 400 EUR per metre of road. The
choice of the integer programme is compared with the same money for every metre of road, with the
worst section first and with the greatest saving per cost, on releases that chose nothing.

The table has the gain of each method and by how much it is behind the programme, with 95 %
intervals. `wall_s` and `cpu_s` are the wall and processor time of the whole plan. Judged by the
least of the lower ends of the differences from the first two methods.
"""

from __future__ import annotations

import time
from pathlib import Path

from msgspec.structs import replace

from experiments.script import Number, main, say, write
from rigdda import Corridor
from rigdda.agents.corridor.planning import Planner
from rigdda.app.reports.corridor_folder import budget_rows
from rigdda.envs import CorridorProblem

NAME = "corridor-12"

SEED = 0

BUDGETS = (100.0, 200.0, 400.0)
"""Budgets per metre of road [EUR/m]."""

RELEASES, QUICK_RELEASES = 4_000, 200
"""Number of releases per section; the first is the default of the command."""

SIMPLE = ("same money per metre", "worst section first")
"""Methods of the acceptance: equal shares of the money, and the worst section first."""


def run(quick: bool, out: Path) -> Number:
    """Plan the corridor and write corridor_twelve.csv."""
    corridor = Corridor.load(NAME)
    length = sum(section.length for section in corridor.sections)
    budgets = tuple(each * length for each in BUDGETS)
    problem = CorridorProblem(replace(corridor, budgets=budgets))
    start, cpu = time.perf_counter(), time.process_time()
    plan = Planner(problem, QUICK_RELEASES if quick else RELEASES, SEED).plan()
    taken = {"wall_s": time.perf_counter() - start, "cpu_s": time.process_time() - cpu}
    rows = [row | taken for row in budget_rows(plan)]
    write(out / "corridor_twelve.csv", rows)
    for row in rows:
        ends = f"{row['behind_low']:,.0f} to {row['behind_high']:,.0f}"
        say(f"{row['budget']}, {row['method']}: gain {row['gain']:,.0f} EUR/year, "
            f"behind {row['behind']:,.0f} ({ends})")  # fmt: skip
    judged = [r for r in rows if r["budget"] != "unlimited" and r["method"] in SIMPLE]
    return Number(
        "gain of the joint choice over equal shares and worst section first, least lower end "
        "[EUR/year]",
        min(row["behind_low"] for row in judged),
        low=0.0,
    )


if __name__ == "__main__":
    main(run)
