"""Hard cases for a range of steps: each holds, degrades, is refused with a clear error, or fails.

Judged by the share of trials that neither hold nor are refused. Up to the default step, only the
cases that must be refused may be, and all others must hold. No trial may fail at any step.
"""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path

from experiments.hard_cases.case import DEGRADES, FAILS, HOLDS, REFUSES, Result
from experiments.hard_cases.picture import verdicts
from experiments.hard_cases.suite import CASES, QUICK_STEPS, STEPS
from experiments.hard_cases.worker import Worker
from experiments.script import Number, draw
from experiments.study import Row, tabulate
from rigdda import Settings
from rigdda.files import atomic

LIMIT, QUICK_LIMIT = 600.0, 60.0
"""Processor time after which a trial counts as hung [s], twice that of the longest one."""

DEFAULT = Settings().dt

MOST = 0.02
"""Greatest share of trials that may degrade beyond the default step [-]. Bodies that travel a large
part of their size per step may penetrate by chance: among 12 steps from 12.5 to 21 ms, a volley at
100 m/s does in five, and a hopper into which 1,000 blocks fall at 15 m/s in one."""


def table(results: list[Result]) -> str:
    """Return the verdicts as a Markdown table with a row per case and a column per step."""
    steps = sorted({r.dt for r in results})
    lines = ["| case | criterion | " + " | ".join(f"{1e3 * dt:g} ms" for dt in steps) + " |"]
    lines.append("|---" * (len(steps) + 2) + "|")
    criteria = {case.name: case.criterion for case in CASES}
    for name, trials in groupby(results, key=lambda r: r.case):
        cells = " | ".join(r.verdict for r in sorted(trials, key=lambda r: r.dt))
        lines.append(f"| {name} | {criteria[name]} | {cells} |")
    return "\n".join(lines) + "\n"


def report(results: list[Result]) -> str:
    """Return the counts of verdicts at each step and the wrong ones."""
    lines = []
    for dt in sorted({r.dt for r in results}):
        here = [r.verdict for r in results if r.dt == dt]
        counts = ", ".join(f"{here.count(v)} {v}" for v in (HOLDS, REFUSES, DEGRADES, FAILS))
        lines.append(f"{1e3 * dt:g} ms: {counts}")
    return "\n".join(
        [*lines, *(f"{r.case} {1e3 * r.dt:g} ms {r.verdict}: {r.note}" for r in wrong(results))]
    )


def wrong(results: list[Result]) -> list[Result]:
    """Return the wrong results: a case must hold, or be refused if it has no answer.

    Beyond the default step, any case may be refused.
    """
    refused = {case.name for case in CASES if case.refused}
    return [r for r in results if r.verdict not in allowed(r.case in refused, r.dt)]


def allowed(refused: bool, dt: float) -> tuple[str, ...]:
    """Return the correct verdicts at a step for a case that must or must not be refused."""
    if refused:
        return (REFUSES,)
    return (HOLDS,) if dt <= DEFAULT else (HOLDS, REFUSES)


def sentence(row: Row) -> str:
    """Return a progress message for a trial."""
    return f"{row['case']} {1e3 * row['dt']:g} ms {row['verdict']} {row['note']}"


def share_wrong(results: list[Result]) -> float:
    """Return the share of wrong trials [-], infinite if any of them cannot be due to chance."""
    found = wrong(results)
    grave = any(r.dt <= DEFAULT or r.verdict != DEGRADES for r in found)
    return math.inf if grave else len(found) / len(results)


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    steps = QUICK_STEPS if quick else STEPS
    cases = [{"case": case.name, "dt": dt} for case in CASES for dt in steps]
    with Worker(QUICK_LIMIT if quick else LIMIT) as worker:
        rows = tabulate(out / "hard_cases.csv", cases, worker.measure, sentence)
    results = [Result(**row) for row in rows]
    with atomic(out / "hard_cases.md") as part:
        part.write_text(table(results), encoding="utf-8")
    draw(out / "hard_cases.png", (9.0, 11.0), lambda figure: verdicts(figure, results))
    return Number(
        f"share of {len(results)} trials with a wrong verdict",
        share_wrong(results),
        high=MOST,
        note=report(results),
    )
