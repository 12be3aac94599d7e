"""Picture of what the engineering rule demands of a fence along the slope.

It answers where a fence of a given class would do: the demanded energy between the classes of the
catalogue, the needed height between their greatest heights, and for each class the stretches where
it satisfies the rule.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Fence, Layout
from rigdda.app.reports.pictures import DPI, FONT, ROAD, plain_numbers, save
from rigdda.barriers import FENCE_CLASSES, standing
from rigdda.barriers.fence import CLASSES
from rigdda.display import BARRIER, ZONE
from rigdda.envs import DesignProblem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

DEMAND, FITS, ENERGY_ONLY = "#1a1a1a", "#2a9d8f", "#c9ddd9"
"""Colours of the demand, of stretches where a class satisfies the rule, and of stretches where only
its energy suffices."""

NOTE = "#4a5560"
"""Colour of the names of classes."""

TALL = 12.0
"""Largest height in the picture [m] unless more is needed everywhere; no fence is nearly as
high."""

MARKERS = "Do^sv"
"""Markers of the fences of different layouts."""


def write(
    path: str | os.PathLike[str],
    problem: DesignProblem,
    rows: Sequence[Mapping[str, Any]],
    layouts: Mapping[str, Layout],
) -> None:
    """Write the PNG of the demand along the slope.

    Parameters
    ----------
    path : path
        The PNG.
    problem : DesignProblem
        The problem.
    rows : sequence of dict
        Table of the demand, see `rigdda.app.reports.checks.along_slope`.
    layouts : mapping of str to Layout
        Layouts whose fences are shown, by name.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((11.0, 10.5), dpi=DPI, layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.15, 1.0, 1.0])
        energies, heights, classes = panels
        _energies(energies, problem, rows)
        _heights(heights, problem, rows)
        _classes(classes, rows)
        for name, marker in zip(layouts, MARKERS, strict=False):
            _fences(energies, heights, classes, layouts[name], name, marker)
        zone, road = problem.zone, problem.site.road
        for axes in panels:
            axes.axvspan(road.start, road.end, color=ROAD, alpha=0.2, lw=0)
            axes.axvspan(zone.start, zone.end, color=ZONE, alpha=0.12, lw=0)
            axes.grid(alpha=0.25, axis="x")
        room = 0.1 * (road.start - zone.start)
        classes.set_xlim(zone.start - 0.5 * room, min(road.start + room, road.end))
        classes.set_xlabel("x [m]")
        handles: dict[str, Any] = {}
        for axes in panels:
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                handles.setdefault(label, handle)
        figure.legend([*handles.values()], [*handles], loc="outside lower center", ncols=3,
                      frameon=False, fontsize=10)  # fmt: skip
        save(figure, path)


def _column(rows: Sequence[Mapping[str, Any]], name: str) -> Floats:
    return np.array([row[name] for row in rows], dtype=np.float64)


def _energies(axes: Axes, problem: DesignProblem, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the demanded energy over bands of the classes."""
    x, energy = _column(rows, "x_m"), _column(rows, "demanded_energy_kJ")
    top = 1.5 * max(CLASSES[-1], float(energy.max(initial=0.0)))
    bottom = min(0.5 * CLASSES[0], 0.7 * float(energy.min(initial=CLASSES[0])))
    edges = [bottom, *CLASSES, top]
    for i, (low, high) in enumerate(pairwise(edges)):
        axes.axhspan(low, high, color="#9aa7b5" if i % 2 else "#dde3ea", alpha=0.35, lw=0)
        words = f"{high:,g} kJ" if i < len(CLASSES) else "no class"
        axes.annotate(words, (1.005, (low * high) ** 0.5), xycoords=("axes fraction", "data"),
                      va="center", fontsize=8, color=NOTE, annotation_clip=False)  # fmt: skip
    axes.set_yscale("log")
    axes.set_ylim(bottom, top)
    plain_numbers(axes.yaxis, (1.0, 2.0, 5.0))
    speed = _column(rows, "velocity_m_s")
    least, most = (
        energy * (_column(rows, f"velocity_{end}_m_s") / speed) ** 2 for end in ("low", "high")
    )
    axes.fill_between(x, least, most, color=DEMAND, alpha=0.2, lw=0, label="95 % interval")
    axes.plot(x, energy, color=DEMAND, linewidth=1.8, label="demand with partial factors")
    factors = problem.site.rule
    axes.set_title(
        f"demanded energy of a fence at {factors.level}, with all partial factors [kJ]; bands: "
        "least class with this energy", loc="left", fontsize=10,
    )  # fmt: skip


def _heights(axes: Axes, problem: DesignProblem, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the needed height, and the greatest heights of the classes."""
    x, height = _column(rows, "x_m"), _column(rows, "needed_height_m")
    factors, centre = problem.site.rule, _column(rows, "height_m")
    least, most = (
        height + factors.velocity * factors.height * (_column(rows, f"height_{end}_m") - centre)
        for end in ("low", "high")
    )
    axes.fill_between(x, least, most, color=DEMAND, alpha=0.2, lw=0)
    axes.plot(x, height, color=DEMAND, linewidth=1.8)
    highest: dict[float, int] = {}
    for name, row in FENCE_CLASSES.items():
        highest.setdefault(row.height, name)
    limit = min(problem.zone.max_height, max(highest))
    for tall, name in highest.items():
        axes.axhline(tall, color="#9aa7b5", linewidth=0.8)
        axes.annotate(f"{tall:g} m, {name:,} kJ", (1.005, tall), va="center", fontsize=7,
                      xycoords=("axes fraction", "data"), color=NOTE,
                      annotation_clip=False)  # fmt: skip
    axes.axhline(limit, color="#b5382a", linewidth=1.4, linestyle="--",
                 label="greatest height here")  # fmt: skip
    top = max(TALL, 1.4 * float(height.min(initial=math.inf))) if len(height) else TALL
    axes.set_ylim(0.0, top)
    words = f"; the curve reaches {height.max():.0f} m" if height.max(initial=0.0) > top else ""
    axes.set_title(
        "needed height of a fence [m]; lines: greatest height of fences and the class from which "
        f"it is made{words}", loc="left", fontsize=10,
    )  # fmt: skip


def _classes(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw for each class where it satisfies the rule, and where only its energy suffices."""
    x, energy = _column(rows, "x_m"), _column(rows, "demanded_energy_kJ")
    step = float(np.diff(x).min(initial=1.0)) if len(x) > 1 else 1.0
    for i, name in enumerate(CLASSES):
        fits = np.array([f"{name}" in row["classes_that_fit_kJ"].split() for row in rows])
        strong = "its energy suffices, but not height or clearance"
        for chosen, colour, label in (
            ((energy < name) & ~fits, ENERGY_ONLY, strong),
            (fits, FITS, "a fence of this class satisfies the rule"),
        ):
            starts = np.maximum(x[chosen] - 0.5 * step, x[0])
            spans = np.minimum(x[chosen] + 0.5 * step, x[-1]) - starts
            bars = [*zip(starts.tolist(), spans.tolist(), strict=True)]
            axes.broken_barh(bars, (i - 0.4, 0.8), color=colour, lw=0, label=label)
    axes.set_yticks(range(len(CLASSES)), [f"{name:,}" for name in CLASSES])
    axes.set_ylim(-0.6, len(CLASSES) - 0.4)
    axes.set_title("where would a fence of this class [kJ] do?", loc="left", fontsize=10)


def _fences(
    energies: Axes, heights: Axes, classes: Axes, layout: Layout, name: str, marker: str
) -> None:
    """Draw the fences of a layout."""
    for barrier in standing(layout):
        if isinstance(barrier, Fence) and barrier.energy_class is not None:
            style: dict[str, Any] = {
                "marker": marker, "color": BARRIER, "markersize": 9, "linestyle": "none",
                "markeredgecolor": "white", "label": f"fence: {name}", "zorder": 5,
            }  # fmt: skip
            energies.plot(barrier.x, barrier.energy_class, **style)
            heights.plot(barrier.x, barrier.height, **style)
            classes.plot(barrier.x, CLASSES.index(barrier.energy_class), **style)
