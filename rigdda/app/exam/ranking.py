"""Scores of an exam over its tasks: interquartile means with intervals, tables and pictures."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import trim_mean

from rigdda.app.exam.scorer import ExamScore
from rigdda.app.exam.specification import ExamPart, References
from rigdda.app.reports import pictures, tables
from rigdda.envs.intervals import student_interval
from rigdda.rounding import between

if TYPE_CHECKING:
    from rich.table import Table

Floats = NDArray[np.float64]

RESAMPLES = 2000
"""Number of resamples of the bootstrap."""

LEAST_TASKS = 10
"""Least number of tasks of which a mean has an interval. The interval of three corridors would
contain the true mean in 73 % of all cases."""

SITES, CORRIDORS = "sites", "corridors"
"""Tracks, which are never put together in one mean."""

FILES = ("results.csv", "summary.csv", "score.png")
"""Files of results."""


def interquartile_mean(values: Floats) -> float:
    """Return the mean of the middle half of some values."""
    return float(trim_mean(values, 0.25))


def interval(values: Floats, strata: Sequence[str], seed: int = 0) -> tuple[float, float]:
    """Return the 95 % interval of the interquartile mean by a stratified percentile bootstrap.

    Parameters
    ----------
    values : (n,) array
        Scores.
    strata : sequence of n str
        Stratum of each value. Deviations from the mean of a stratum of m values, multiplied by
        sqrt(m / (m - 1)), are drawn with replacement within it, so that the variance of a resample
        is that of the stratum (Davison and Hinkley 1997, Bootstrap Methods and their Application,
        section 3.2).
    seed : int
        Seed of the resamples.

    Returns
    -------
    (float, float)
        The ends of the interval; NaN if there are fewer than `LEAST_TASKS` values, or only one in a
        stratum.
    """
    rng, labels = np.random.default_rng(seed), np.array(strata)
    if len(values) < LEAST_TASKS or np.unique(labels, return_counts=True)[1].min() < 2:
        return math.nan, math.nan
    drawn = np.empty((RESAMPLES, len(values)))
    for label in np.unique(labels):
        own = np.flatnonzero(labels == label)
        mean, factor = values[own].mean(), math.sqrt(len(own) / (len(own) - 1))
        drawn[:, own] = mean + factor * (values[rng.choice(own, (RESAMPLES, len(own)))] - mean)
    means = trim_mean(drawn, 0.25, axis=1)
    low, high = np.quantile(means, [0.025, 0.975]).tolist()
    return low, high


def ties(scores: Mapping[str, Floats]) -> dict[str, list[str]]:
    """Return for each entry the others from which it cannot be distinguished.

    Two entries are distinguished if the 95 % interval of the mean of their differences over the
    tasks (Student's t) does not contain 0.

    Parameters
    ----------
    scores : mapping of str to (n,) array
        Scores of each entry on the same tasks.
    """
    found: dict[str, list[str]] = {name: [] for name in scores}
    for one, other in itertools.combinations(scores, 2):
        low, high = student_interval(scores[one] - scores[other])
        if low <= 0.0 <= high:
            found[one].append(other)
            found[other].append(one)
    return found


def family(name: str) -> str:
    """Return the family of a site, which is its stratum."""
    return name.rpartition("-")[0] or name


def rows(scores: Sequence[ExamScore], asked: ExamPart, entry: str) -> list[dict[str, Any]]:
    """Return the rows of results.csv: one for each site or corridor and budget."""
    return [
        {
            "entry": entry,
            "track": CORRIDORS if score.corridor else SITES,
            "name": score.submission.name,
            "budget": score.submission.budget,
            "seed": asked.seed,
            "used": score.submission.used,
            "refused": score.submission.refused,
            "score": score.score,
            "distance": score.distance,
            "objective": score.objective,
            "reference": sum(
                at * e.objective for at, e in zip(score.lengths, score.references, strict=True)
            ),
            "cost": score.cost,
            "barriers": sum(len(e.layout) for e in score.evaluations),
            "releases": asked.verification,
            "entry_cpu_s": score.submission.seconds,
            "flags": "; ".join(score.submission.flags),
        }
        for score in scores
    ]


def summary(scores: Sequence[ExamScore], asked: ExamPart, entry: str) -> list[dict[str, Any]]:
    """Return the rows of summary.csv: one for each track and budget."""
    flags = sum(len(score.submission.flags) for score in scores)
    found = []
    for track in (SITES, CORRIDORS):
        for budget in asked.budgets:
            own = [
                score for score in scores
                if score.corridor == (track == CORRIDORS) and score.submission.budget == budget
            ]  # fmt: skip
            if own:
                found.append(_summary(own, track, budget, asked, entry, flags))
    return found


def _summary(
    own: Sequence[ExamScore], track: str, budget: int, asked: ExamPart, entry: str, flags: int
) -> dict[str, Any]:
    values = np.array([score.score for score in own])
    strata = [family(s.submission.name) if track == SITES else track for s in own]
    low, high = interval(values, strata)
    return {
        "entry": entry,
        "track": track,
        "budget": budget,
        "tasks": len(own),
        "score": interquartile_mean(values),
        "score_low": low,
        "score_high": high,
        "distance": interquartile_mean(np.array([score.distance for score in own])),
        "used": float(np.mean([score.submission.used for score in own])),
        "flags": flags,
        "complete": asked.complete,
        "version": asked.specification.version,
        "specification": asked.specification.key,
        "seed": asked.seed,
        "releases": asked.verification,
    }


def with_interval(row: dict[str, Any]) -> str:
    """Return the score of a row of the summary as text, with its interval if it has one."""
    score = f"{row['score']:.3f}"
    if math.isnan(row["score_low"]):
        return score
    return f"{score} ({between(row['score_low'], row['score_high'], '.3f')})"


def table(summaries: Sequence[dict[str, Any]]) -> Table:
    """Return the table that the command prints."""
    head = ("track", "budget", "tasks", "score (95 %)", "distance", "releases used")
    out = tables.empty_table(head)
    for row in summaries:
        out.add_row(
            row["track"], f"{row['budget']:,}", str(row["tasks"]), with_interval(row),
            f"{row['distance']:.3f}", f"{row['used']:,.0f}",
        )  # fmt: skip
    return out


def draw(path: str | os.PathLike[str], summaries: Sequence[dict[str, Any]]) -> None:
    """Draw the scores against the budget with their 95 % bands, one panel for each track."""
    tracks = [t for t in (SITES, CORRIDORS) if any(row["track"] == t for row in summaries)]
    entries = list(dict.fromkeys(row["entry"] for row in summaries))
    budgets = sorted({row["budget"] for row in summaries})
    figure = Figure(figsize=(5.5 * len(tracks), 4.2), layout="constrained")
    grid = figure.subplots(1, len(tracks), squeeze=False, sharey=True)[0]
    for axes, track in zip(grid, tracks, strict=True):
        for i, entry in enumerate(entries):
            colour = colormaps["tab10"](i % 10)
            own = [r for r in summaries if r["track"] == track and r["entry"] == entry]
            x = [budgets.index(r["budget"]) for r in own]
            low, high = ([r[k] for r in own] for k in ("score_low", "score_high"))
            axes.plot(x, [r["score"] for r in own], "o-", color=colour, label=entry)
            axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0.0)
        axes.axhline(1.0, color="0.7", linestyle=":", zorder=0)
        axes.axhline(0.0, color="0.7", linestyle=":", zorder=0)
        axes.set_xticks(range(len(budgets)), [f"{budget:,}" for budget in budgets])
        axes.set(title=track, xlabel="releases per section")
    grid[0].set_ylabel("score: 0 random layouts, 1 reference")
    grid[0].legend(fontsize=8)
    pictures.save(figure, path)


def write(
    folder: Path, scores: Sequence[ExamScore], asked: ExamPart, entry: str
) -> list[dict[str, Any]]:
    """Write the results into a folder and return the rows of the summary."""
    found = summary(scores, asked, entry)
    tables.write_rows(folder / FILES[0], rows(scores, asked, entry))
    tables.write_rows(folder / FILES[1], found)
    draw(folder / FILES[2], found)
    return found


def broken(scores: Sequence[ExamScore]) -> list[str]:
    """Return a line for each broken rule, with the tasks on which it was broken."""
    found: dict[str, list[str]] = {}
    for score in scores:
        for reason in score.submission.flags:
            where = f"{score.submission.name} at {score.submission.budget:,} releases"
            found.setdefault(reason, []).append(where)
    return [
        f"flagged: the entry {reason} ({places[0]}"
        + (f" and {len(places) - 1} more)" if len(places) > 1 else ")")
        for reason, places in found.items()
    ]


def remarks(asked: ExamPart, references: References) -> list[str]:
    """Return why the results cannot enter the leaderboard; none if they can."""
    found = []
    if not asked.specification.current:
        found.append(
            "the mechanics are not those of the references: this is another version of the exam, "
            "whose scores must not be compared with the leaderboard"
        )
    elif not asked.complete:
        why = "the seed is not 0" if asked.seed else "a part of the exam was played"
        found.append(f"{why}: the result cannot enter the leaderboard")
    if asked.verification < asked.specification.verification:
        most = asked.specification.verification
        found.append(
            f"each layout was verified on fewer than {most:,} releases: the score of a single site "
            "is mostly noise"
        )
    wanting = len(references.provisional(asked.specification))
    if wanting:
        found.append(
            f"{wanting} references are provisional, because their searches had fewer releases than "
            "specified: scores will change when they are replaced"
        )
    return found
