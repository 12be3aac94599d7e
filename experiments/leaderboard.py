"""Leaderboard of the exam: every method of the package, scored as `rigdda exam` scores an entry.

`python -m experiments.leaderboard [--quick] [--out DIR] [--budget N ...]`. A row is the score of an
entry with one budget on the sites or on the corridors; its column `command` repeats it. Entries
that do not search have rows for a budget of 0 only. Rows of a track and a budget are not ranked
where their scores cannot be told apart: the column `same_as` names the entries of which the
difference over the tasks has a 95 % interval that contains 0. Then the entries are verified on a
second set of releases. Judged by the share of the pairs told apart that have the same order there.

Writes exam/leaderboard.csv, exam/leaderboard.png and exam/stability.csv. An interrupted run
continues from the folder runs/leaderboard, if the networks of the package are the same.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.made_with import MADE_WITH
from experiments.script import BLUE, GREY, Number, draw, folder, options, say, write
from rigdda.app.exam import ranking, specification
from rigdda.app.exam.scorer import Scorer
from rigdda.app.exam.specification import ExamPart

MODULE = "rigdda.app.exam.entries"
"""Module of the entries for the methods of the package."""

ELSEWHERE = {"ppo": "experiments.exam_ppo:design"}
"""Entries of other modules by their name in the table."""

STILL = ("nothing", "constant", "engineering_rule", "random_layout", "ppo")
"""Entries that do not search."""

SEARCHES = ("value", "policy", "race", "random_search", "cma", "tpe", "convex")
"""Entries that search."""

BUDGETS, QUICK_BUDGETS = (0, 500), (0, 60)
"""Budgets by default; `--budget` adds others."""

STABLE, QUICK_STABLE = 0.95, 0.0
"""Least share of the pairs told apart that have the same order on a second set of releases [-]."""

WORK = Path("runs/leaderboard") / "-".join(MADE_WITH.values())
"""Folder of the exams of the entries with the present mechanics and networks."""

KEPT = (
    "track", "budget", "tasks", "score", "score_low", "score_high", "distance", "used", "flags",
    "version", "specification", "seed", "releases",
)  # fmt: skip
"""Columns of a summary that the leaderboard has."""


def asked(quick: bool, budget: int) -> ExamPart:
    """Return the exam with one budget, or a small part of it."""
    spec = specification.load()
    return (
        specification.part(spec, 2, 0, (budget,), 40)
        if quick
        else specification.part(spec, budgets=(budget,))
    )


def entries(budget: int) -> Sequence[str]:
    """Return the entries that have rows for a budget."""
    return SEARCHES if budget else STILL


def entry_of(name: str) -> str:
    """Return the module and function of an entry."""
    return ELSEWHERE.get(name, f"{MODULE}:{name}")


def exam_of(name: str, part: ExamPart, work: Path) -> Scorer:
    """Return the scorer of an entry, whose layouts are submitted."""
    spec = specification.load()
    references = specification.references(spec)
    own = work / name
    own.mkdir(parents=True, exist_ok=True)
    job = Scorer(part, references, entry_of(name), "", own)
    job.play()
    return job


def rows_of(name: str, job: Scorer) -> list[dict[str, Any]]:
    """Return the rows of an entry."""
    specification.check_references(job.asked, job.references)
    budget = job.asked.budgets[0]
    command = f"rigdda exam --entry {entry_of(name)} --budget {budget}"
    return [
        {"entry": name, **{key: row[key] for key in KEPT}, "command": command}
        for row in ranking.summary(job.verify(), job.asked, name)
    ]


def by_task(job: Scorer, track: str, chosen: int = 0) -> NDArray[np.float64]:
    """Return the scores of an entry on the tasks of a track, on a set of releases."""
    roads = track == ranking.CORRIDORS
    return np.array([s.score for s in job.verify(chosen) if s.corridor == roads])


def told_apart(rows: Sequence[dict[str, Any]], jobs: dict[tuple[str, int], Scorer]) -> None:
    """Add the column `same_as` to the rows of all entries."""
    groups: dict[tuple[str, int], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["track"], row["budget"]), []).append(row)
    for (track, budget), own in groups.items():
        scores = {row["entry"]: by_task(jobs[row["entry"], budget], track) for row in own}
        same = ranking.ties(scores)
        for row in own:
            row["same_as"] = " ".join(same[row["entry"]])


def stability(jobs: dict[tuple[str, int], Scorer]) -> tuple[float, list[dict[str, Any]]]:
    """Return the share of the pairs told apart that keep their order on other releases, and rows.

    Entries are compared on the sites at the same budget, those without a search at each. The rows
    contain each pair with the mean difference of its scores on both sets of releases.
    """
    rows: list[dict[str, Any]] = []
    for budget in sorted({own for _, own in jobs} - {0}):
        names = [key for key in jobs if key[1] in (0, budget)]
        say(f"{budget:,} releases: second set of releases")
        first, second = (
            {name: by_task(jobs[name, own], ranking.SITES, chosen) for name, own in names}
            for chosen in (0, 1)
        )
        same = ranking.ties(first)
        for one, other in itertools.combinations(first, 2):
            before, after = (float((s[one] - s[other]).mean()) for s in (first, second))
            rows.append({
                "budget": budget, "entry": one, "other": other, "difference": before,
                "difference_second_set": after, "told_apart": other not in same[one],
            })  # fmt: skip
    clear = [row for row in rows if row["told_apart"]]
    kept = [row for row in clear if row["difference"] * row["difference_second_set"] > 0.0]
    return len(kept) / max(len(clear), 1), rows


def draw_scores(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Draw the score of each entry with its interval, one panel for each track."""

    def paint(sheet: Figure) -> None:
        tracks = list(dict.fromkeys(row["track"] for row in rows))
        panels = sheet.subplots(1, len(tracks), sharey=True, squeeze=False)[0]
        for axes, track in zip(panels, tracks, strict=True):
            own = [row for row in rows if row["track"] == track][::-1]
            ends = [
                [row["score"] - row["score_low"] for row in own],
                [row["score_high"] - row["score"] for row in own],
            ]
            names = [f"{row['entry'].replace('_', ' ')}, {row['budget']:,}" for row in own]
            scores = [row["score"] for row in own]
            axes.errorbar(scores, names, xerr=ends, fmt="o", color=BLUE, capsize=3)
            for anchor in (0.0, 1.0):
                axes.axvline(anchor, color=GREY, linestyle=":")
            axes.set(title=track, xlabel="score: 0 random layouts, 1 reference")

    draw(path, (10.0, 1.0 + 0.17 * len(rows)), paint)


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
    told_apart(rows, compared)
    write(out / "exam" / "leaderboard.csv", rows)
    draw_scores(out / "exam" / "leaderboard.png", rows)
    share, table = stability(compared)
    write(out / "exam" / "stability.csv", table)
    note = "\n".join(
        f"{r['track']}, {r['budget']:,}: {r['entry']} {ranking.with_interval(r)}" for r in rows
    )
    what = "share of the pairs of entries told apart with the same order on other releases"
    return Number(what, share, low=QUICK_STABLE if quick else STABLE, note=note)


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
