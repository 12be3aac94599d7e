"""Pictures of error against processor time, and of the growth of cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from experiments.bench.cases import Case
from experiments.bench.growth import FITTED, Growth, exponent
from experiments.bench.levels import Row, on_front

COLOURS = {"rigdda": "#c0392b", "pymunk": "#2980b9", "box2d": "#27ae60", "mujoco": "#8e44ad"}
LEAST = 1e-8
"""Lower limit at which errors are drawn, below which they are rounding."""


def fronts(path: Path, cases: Sequence[Case], rows: Sequence[Row]) -> None:
    """Draw a panel per case, with all settings as dots and the front of each engine as a line."""
    columns = 4
    height = math.ceil(len(cases) / columns)
    figure = Figure(figsize=(4.0 * columns, 3.4 * height), layout="constrained")
    axes = np.atleast_2d(figure.subplots(height, columns, squeeze=False)).ravel()
    for ax, case in zip(axes, cases, strict=False):
        for engine, colour in COLOURS.items():
            here = [r for r in rows if r.case == case.name and r.engine == engine]
            here = [r for r in here if math.isfinite(r.error)]
            for style, points in ((".", here), ("-o", on_front(here))):
                ax.plot(
                    [r.cpu_us_per_simulated_s for r in points],
                    [max(r.error, LEAST) for r in points],
                    style,
                    color=colour,
                    markersize=3 if style == "." else 5,
                    alpha=0.35 if style == "." else 1.0,
                    label=engine if style == "-o" else None,
                )
        for error in case.levels:
            ax.axhline(error, color="0.8", linewidth=0.8, zorder=0)
        ax.set(xscale="log", yscale="log", title=case.name, ylabel=case.quantity)
        ax.set_xlabel("CPU us per simulated s")
        ax.xaxis.set_minor_formatter(NullFormatter())
    for ax in axes[len(cases) :]:
        ax.axis("off")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    _save(figure, path)


def growth(path: Path, rows: Sequence[Growth]) -> None:
    """Draw the cost against the number of blocks with the fitted power."""
    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    ax = figure.subplots()
    blocks = np.array([r.blocks for r in rows], dtype=float)
    cost = np.array([r.cpu_us_per_simulated_s for r in rows])
    ax.plot(blocks, cost, "o", color=COLOURS["rigdda"])
    power, large = exponent(list(rows)), blocks >= FITTED
    if large.sum() >= 2:
        scale = np.exp(np.mean(np.log(cost[large]) - power * np.log(blocks[large])))
        line = scale * blocks[large] ** power
        ax.plot(blocks[large], line, color="0.4", label=f"blocks^{power:.2f}")
        ax.legend()
    ax.set(xscale="log", yscale="log", xlabel="blocks", ylabel="CPU us per simulated s")
    ax.set_xticks(blocks, [f"{n:,.0f}" for n in blocks])
    ax.minorticks_off()
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    with mpl.rc_context({"savefig.dpi": 110}):
        figure.savefig(path)
