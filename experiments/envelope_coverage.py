"""Coverage of the intervals of quantiles at a station, against a sample of 50,000 releases.

For single blocks and for groups of blocks of the site `verge`, releases are repeated in 100 runs of
400. The table gives how many of the 100 intervals (95 %) of a run hold the quantile of the large
sample. Intervals that lack an end, because too few blocks pass, hold what is beyond the other end,
and are counted in a column of their own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.script import Number, main, say, write
from rigdda import Site
from rigdda.app.reports.stations import LEVELS, QUANTITIES, Passing
from rigdda.envs.quantiles import quantiles
from rigdda.passages import passages

SITE, STATION = "verge", 8.0
EVENTS = ("block", "group")


class Plan(NamedTuple):
    """Numbers of releases: in the reference, in a run, and of runs."""

    reference: int
    each: int
    runs: int


FULL, QUICK = Plan(50_000, 400, 100), Plan(4_000, 200, 20)

PIECE = 5_000
"""Releases whose passages are in memory at a time."""


def known(site: Site, event: str, count: int, seed: int) -> dict[str, NDArray[np.float64]]:
    """Return the values of each quantity in the passages of some releases."""
    found: dict[str, list[NDArray[np.float64]]] = {name: [] for name in QUANTITIES}
    for start in range(seed, seed + count, PIECE):
        seeds = range(start, min(start + PIECE, seed + count))
        table = passages(site, (), [(s, event) for s in seeds], [STATION]).table
        for name, quantity in QUANTITIES.items():
            found[name].append(quantity.of(table))
        say(f"{event}: {seeds[-1] - seed + 1:,} of {count:,}")
    return {name: np.concatenate(parts) for name, parts in found.items()}


def coverage(event: str, plan: Plan) -> list[dict[str, Any]]:
    """Return how many runs hold each quantile of an event, a row for each."""
    site = Site.load(SITE)
    truth = known(site, event, plan.reference, plan.each * plan.runs)
    held = np.zeros((len(QUANTITIES), len(LEVELS)), dtype=int)
    open_ended = np.zeros_like(held)
    for run in range(plan.runs):
        seeds = range(run * plan.each, (run + 1) * plan.each)
        found = passages(site, (), [(seed, event) for seed in seeds], [STATION])
        passing = Passing.of(site, (), event, found)
        for i, (name, quantity) in enumerate(QUANTITIES.items()):
            sample = passing.sample(event, found.table, quantity.of(found.table))
            for k, one in enumerate(quantiles(sample, LEVELS)):
                true = np.quantile(truth[name], LEVELS[k], method="inverted_cdf")
                held[i, k] += not (one.low > true or one.high < true)
                open_ended[i, k] += bool(np.isnan([one.low, one.high]).any())
    return [
        {"event": event, "quantity": name, "level": level, "runs": plan.runs,
         "releases": plan.each, "reference": plan.reference,
         "reference_value": float(np.quantile(truth[name], level, method="inverted_cdf")),
         "held": int(held[i, k]), "lack_an_end": int(open_ended[i, k])}
        for i, name in enumerate(QUANTITIES) for k, level in enumerate(LEVELS)
    ]  # fmt: skip


def run(quick: bool, out: Path) -> Number:
    """Count intervals that hold the quantile, and write the table."""
    plan = QUICK if quick else FULL
    rows = [row for event in EVENTS for row in coverage(event, plan)]
    write(out / "envelope_coverage.csv", rows)
    closed = [row["held"] / row["runs"] for row in rows if not row["lack_an_end"]]
    share = 100.0 * float(np.mean(closed))
    note = f"least {100.0 * min(closed):.0f}, most {100.0 * max(closed):.0f} of {len(closed)}"
    return Number("intervals of quantiles that hold the value [%]", share, 90.0, 99.0, note)


if __name__ == "__main__":
    main(run)
