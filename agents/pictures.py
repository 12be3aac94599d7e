"""What pictures share, and the picture of cost against risk."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda.envs import Evaluation
from rigdda.envs.rendering import GROUND, ROAD
from rigdda.files import atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["BARRIER", "DPI", "FONT", "GROUND", "ROAD", "ZONE", "Point", "colours", "cost", "save"]

BARRIER, ZONE, TRIED, EQUAL = "#14213d", "#9dc3e6", "#9aa5b1", "#c8ccd0"
EVENTS = ("#0072b2", "#d0312d", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7b4fb0", "#6b4226")
"""Colours of events, told apart by the colour-blind as far as eight can be."""

MARKERS = ("o", "^", "s", "D", "P", "X")
FONT: dict[Any, Any] = {"font.size": 11, "axes.spines.top": False, "axes.spines.right": False}
DPI = 120

SHEDS = 1.6
"""A reference dearer than this many times all else is told at the edge, not drawn to scale."""


@dataclass(frozen=True, slots=True)
class Point:
    """What a named layout costs, in EUR per metre of road and year.

    Parameters
    ----------
    name : str
        What it is.
    capital : float
        What its capital costs a year.
    risk : float
        Expected harm and repair of a year.
    interval : (float, float)
        95 % interval of `risk`.
    """

    name: str
    capital: float
    risk: float
    interval: tuple[float, float]

    @classmethod
    def of(cls, name: str, evaluation: Evaluation) -> Point:
        """Return the point of an evaluation; its capital is known, so all doubt is of the risk."""
        risk, capital = evaluation.harm + evaluation.repair, evaluation.capital
        low, high = (max(end - capital, 0.0) for end in evaluation.ci)
        return cls(name, capital, risk, (min(low, risk), max(high, risk)))


def colours(count: int) -> list[str]:
    """Return the colours of so many events of a site, in its order."""
    return [EVENTS[i % len(EVENTS)] for i in range(count)]


def cost(
    path: str | os.PathLike[str], tried: Sequence[Evaluation], points: Sequence[Point]
) -> None:
    """Write a PNG of what layouts cost a year against the risk that they leave.

    Parameters
    ----------
    path : path
        The PNG.
    tried : sequence of Evaluation
        What a search evaluated, each by few releases.
    points : sequence of Point
        Verified layouts and references, with intervals; Z is the same along the thin lines.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    near = [point for point in points if point.capital <= _reach(points)]
    right = 1.15 * max([point.capital for point in near] + [1.0])
    top = 1.2 * max(point.interval[1] for point in points)
    with rc_context(FONT):
        figure = Figure((9.0, 6.2), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        _equal(axes, right, top)
        axes.plot([e.capital for e in tried], [e.harm + e.repair for e in tried], ".", color=TRIED,
                  markersize=4, alpha=0.6, zorder=2,
                  label=_searched(tried))  # fmt: skip
        for i, point in enumerate(near):
            _named(axes, point, MARKERS[i % len(MARKERS)], EVENTS[i % len(EVENTS)])
        for point in points:
            if point not in near:
                axes.annotate(
                    f"{point.name}: {point.capital:,.0f} a year, {point.risk:,.0f} of risk",
                    (0.995, 0.01), xycoords="axes fraction", ha="right", va="bottom", fontsize=10,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8},
                )  # fmt: skip
        axes.set(xlim=(-0.02 * right, right), ylim=(0.0, top))
        axes.set(xlabel="capital and upkeep [EUR per metre of road and year]",
                 ylabel="harm and repair to expect [EUR per metre of road and year]")  # fmt: skip
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
        save(figure, path)


def _searched(tried: Sequence[Evaluation]) -> str:
    """Return what the points of a search are, and half their median 95 % interval.

    The best of many is too good by about as much.
    """
    words = f"{len(tried):,} layouts of the search, by few releases"
    if not tried:
        return words
    half = float(np.median([0.5 * (e.ci[1] - e.ci[0]) for e in tried]))
    return f"{words}, ± {half:,.0f}"


def _reach(points: Sequence[Point]) -> float:
    """Return the dearest capital that is drawn to scale [EUR per metre and year]."""
    least = min(point.capital + point.risk for point in points)
    return SHEDS * max(least, *(p.risk for p in points), sorted(p.capital for p in points)[-2])


def _equal(axes: Axes, right: float, top: float) -> None:
    """Draw lines of equal Z, which is the sum of both axes, and write their value."""
    from matplotlib.ticker import MaxNLocator

    levels = [z for z in MaxNLocator(9).tick_values(0.0, right + top) if 0.0 < z < right + top]
    for z in levels:
        axes.plot([0.0, z], [z, 0.0], color=EQUAL, linewidth=0.8, zorder=1)
        x = z - 0.985 * top if z > top else 0.0
        if x < 0.9 * right:
            axes.annotate(f"Z = {z:,.0f}", (x, z - x), xytext=(3, 2), textcoords="offset points",
                          fontsize=8, color="#80868b", zorder=1, va="bottom")  # fmt: skip


def _named(axes: Axes, point: Point, marker: str, colour: str) -> None:
    """Draw a named layout with the interval of its risk."""
    spread = np.abs(np.array(point.interval) - point.risk)[:, None]
    axes.errorbar(point.capital, point.risk, spread, fmt=marker, color=colour, markersize=9,
                  capsize=4, linewidth=1.6, zorder=4,
                  label=f"{point.name}: Z = {point.capital + point.risk:,.0f}")  # fmt: skip


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, whole or not at all."""
    with atomic(path) as part:
        figure.savefig(part, format="png")
