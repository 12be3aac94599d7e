"""Leaderboard of the exam: every method of the package, scored as `rigdda exam` scores an entry.

`python -m experiments.leaderboard [--quick] [--out DIR] [--budget N ...]`. A row is the score of an
entry with one budget on the sites or on the corridors; its column `command` repeats it. Entries
that do not search have rows for a budget of 0 only. Then the entries are verified on a second set
of releases, and Kendall's rank correlation between both rankings of the sites is computed.

Writes exam/leaderboard.csv, exam/leaderboard.png and exam/stability.csv. An interrupted run
continues from the folder runs/leaderboard.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from scipy.stats import kendalltau

from experiments.script import Number, folder, options, say, write
from rigdda.app.exam import ranking, scorer, specification
from rigdda.app.exam.scorer import ExamPart, Scorer

MODULE = "rigdda.app.exam.entries"

STILL = ("nothing", "constant", "engineering_rule", "random_layout")
"""Entries that do not search."""

SEARCHES = ("random_search", "race", "cma", "tpe", "convex", "value")
"""Entries that search."""

BUDGETS, QUICK_BUDGETS = (0, 500, 2_000), (0, 60)
"""Budgets by default. Rows for 10,000 releases take an hour more: `--budget 10000`."""

STABLE, QUICK_STABLE = 0.9, -1.0
"""Least rank correlation of the rankings on two sets of releases [-]."""

WORK = Path("runs/leaderboard")
"""Folder of the exams of the entries."""

KEPT = (
    "track", "budget", "tasks", "score", "score_low", "score_high", "distance", "used", "flags",
    "version", "specification", "seed", "releases",
)  # fmt: skip
"""Columns of a summary that the leaderboard has."""


def asked(quick: bool, budget: int) -> ExamPart:
    """Return the exam with one budget, or a small part of it."""
    spec = specification.load()
    return scorer.part(spec, 2, 0, (budget,), 40) if quick else scorer.part(spec, budgets=(budget,))


def entries(budget: int) -> Sequence[str]:
    """Return the entries that have rows for a budget."""
    return SEARCHES if budget else STILL


def exam_of(name: str, part: ExamPart, work: Path) -> Scorer:
    """Return the scorer of an entry, whose layouts are submitted."""
    spec = specification.load()
    references = specification.references(spec)
    own = work / name
    own.mkdir(parents=True, exist_ok=True)
    secrets = (specification.file_of_references(spec),)
    job = Scorer(part, references, f"{MODULE}:{name}", "", own, secrets)
    job.play()
    return job


def rows_of(name: str, job: Scorer) -> list[dict[str, Any]]:
    """Return the rows of an entry."""
    scorer.check_references(job.asked, job.references)
    budget = job.asked.budgets[0]
    command = f"rigdda exam --entry {MODULE}:{name} --budget {budget}"
    return [
        {"entry": name, **{key: row[key] for key in KEPT}, "command": command}
        for row in ranking.summary(job.verify(), job.asked, name)
    ]


def stability(jobs: dict[tuple[str, int], Scorer]) -> tuple[float, list[dict[str, Any]]]:
    """Return the least Kendall's tau of the rankings on two sets of releases, and the scores."""
    rows = []
    for (name, budget), job in jobs.items():
        say(f"{name}, {budget:,} releases: second set of releases")
        scores = [
            ranking.summary(job.verify(chosen), job.asked, name)[0]["score"] for chosen in (0, 1)
        ]
        rows.append({"entry": name, "budget": budget,
                     "score": scores[0], "score_second_set": scores[1]})  # fmt: skip
    still = [row for row in rows if not row["budget"]]
    taus = []
    for budget in sorted({row["budget"] for row in rows} - {0}):
        own = [*still, *(row for row in rows if row["budget"] == budget)]
        both = zip(*((row["score"], row["score_second_set"]) for row in own), strict=True)
        taus.append(float(kendalltau(*both).statistic))
        say(f"Kendall's tau with {budget:,} releases: {taus[-1]:.3f}")
    return min(taus), rows


def run(quick: bool, out: Path, budgets: Sequence[int] = ()) -> Number:
    """Write exam/leaderboard.csv, exam/leaderboard.png and exam/stability.csv."""
    work = WORK / "quick" if quick else WORK
    rows: list[dict[str, Any]] = []
    compared: dict[tuple[str, int], Scorer] = {}
    wanted = sorted({*(QUICK_BUDGETS if quick else BUDGETS), *budgets})
    for budget in wanted:
        part = asked(quick, budget)
        for name in entries(budget):
            say(f"{name}: {budget:,} releases")
            exam_of(name, part, work)
        for name in entries(budget):
            say(f"{name}: verification")
            job = exam_of(name, part, work)
            compared[name, budget] = job
            rows += rows_of(name, job)
            write(out / "exam" / "leaderboard.csv", rows)
    ranking.draw(out / "exam" / "leaderboard.png", rows)
    tau, table = stability(compared)
    write(out / "exam" / "stability.csv", table)
    note = "\n".join(
        f"{r['track']}, {r['budget']:,}: {r['entry']} {ranking.with_interval(r)}" for r in rows
    )
    what = "least Kendall's tau of the rankings of the entries on two sets of releases"
    return Number(what, tau, low=QUICK_STABLE if quick else STABLE, note=note)


@click.command(help=__doc__)
@options
@click.option("--budget", "budgets", type=click.IntRange(0), multiple=True,
              help="Further budget. May be repeated.")  # fmt: skip
def main(quick: bool, out: Path | None, budgets: tuple[int, ...]) -> None:
    """Record the leaderboard."""
    number = run(quick, folder(quick, out), budgets)
    click.echo(number)
    sys.exit(not number.passed)


if __name__ == "__main__":
    main()
