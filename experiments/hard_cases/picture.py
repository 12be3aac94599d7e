"""Picture of the verdicts, errors and penetrations of all cases against the step."""

from __future__ import annotations

import math
from collections.abc import Callable

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from experiments.hard_cases.case import FAILS, HOLDS, REFUSES, Result

COLOURS = "RdYlGn_r"
LEAST, MOST = 1e-3, 1e3
"""Limits of the colour scale of errors over their tolerances [-]."""

SMALLEST, LARGEST = 1e-6, 1.0
"""Limits of the colour scale of penetrations over the mean block size [-]."""


def verdicts(figure: Figure, results: list[Result]) -> None:
    """Draw a row per case and a column per step: errors over tolerances, and penetrations."""
    left, right = figure.subplots(1, 2, sharey=True)
    names = list(dict.fromkeys(r.case for r in results))
    steps = sorted({r.dt for r in results})
    errors = LogNorm(LEAST, MOST)
    field(left, results, names, steps, over_bar, errors)
    field(right, results, names, steps, lambda r: r.penetration, LogNorm(SMALLEST, LARGEST))
    left.set(title="error / bar [-]", yticks=range(len(names)), yticklabels=names)
    right.set(title="penetration / block size [-]")
    for ax in (left, right):
        figure.colorbar(ax.images[0], ax=ax, location="bottom", shrink=0.8, pad=0.02)
    figure.suptitle("empty: holds.  D degrades, R refuses, X fails", fontsize=10)


def over_bar(result: Result) -> float:
    """Return the error over its tolerance [-]; an error that must be zero counts as 1000."""
    if result.bar > 0.0:
        return result.error / result.bar
    return math.nan if math.isnan(result.error) else (MOST if result.error > 0.0 else 0.0)


def field(
    ax: Axes,
    results: list[Result],
    names: list[str],
    steps: list[float],
    value: Callable[[Result], float],
    norm: LogNorm,
) -> None:
    """Draw a value of each trial as a colour, with its verdict."""
    cells = np.full((len(names), len(steps)), np.nan)
    for r in results:
        row, column = names.index(r.case), steps.index(r.dt)
        cells[row, column] = np.clip(value(r), norm.vmin, norm.vmax)
        if r.verdict != HOLDS:
            mark = {REFUSES: "R", FAILS: "X"}.get(r.verdict, "D")
            ax.text(column, row, mark, ha="center", va="center", fontsize=7)
    colours = mpl.colormaps[COLOURS].with_extremes(bad="0.85")
    ax.imshow(cells, cmap=colours, norm=norm, aspect="auto")
    ax.set(xticks=range(len(steps)), xticklabels=[f"{1e3 * dt:g}" for dt in steps])
    ax.set_xlabel("step [ms]")
    ax.tick_params(labelsize=8)
    for side in ("top", "right"):
        ax.spines[side].set_visible(True)
