"""Pictures of error against processor time: closed forms and the highway case."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from experiments.bench.pictures import COLOURS, LEAST
from experiments.front import front
from experiments.speed_error.closed_forms import Point
from experiments.speed_error.highway import OUTCOMES, Sample
from experiments.speed_error.knobs import ITERATIONS, STEP, STIFFNESS, SWEEPS, TOLERANCE
from experiments.speed_error.tables import RELEASES, bias, total_error

MARKS = {
    STEP: "o", STIFFNESS: "s", TOLERANCE: "^", SWEEPS: "<", ITERATIONS: "v", "block area": "D",
}  # fmt: skip
"""Marker of each knob."""

SHADES = {
    STEP: "#c0392b", STIFFNESS: "#e67e22", TOLERANCE: "#7f8c8d", SWEEPS: "#8e44ad",
    ITERATIONS: "#34495e", "block area": "#16a085",
}  # fmt: skip
"""Colour of each knob."""

COLUMNS = 4


def closed_forms(figure: Figure, points: Sequence[Point]) -> None:
    """Draw a panel per case: every choice, the front of each engine, and the default."""
    cases = list(dict.fromkeys(p.case for p in points))
    panels = figure.subplots(math.ceil(len(cases) / COLUMNS), COLUMNS, squeeze=False).ravel()
    for ax, case in zip(panels, cases, strict=False):
        _panel(ax, [p for p in points if p.case == case])
    for ax in panels[len(cases) :]:
        ax.axis("off")
    handles = {
        label: handle
        for ax in panels[: len(cases)]
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=5)


def _panel(ax: Axes, points: Sequence[Point]) -> None:
    for engine, colour in COLOURS.items():
        here = [(p.cpu_us_per_simulated_s, max(p.error, LEAST))
                for p in points if p.engine == engine]  # fmt: skip
        if best := front(here, lambda p: p):
            ax.plot(*zip(*best, strict=True), ".-", color=colour, linewidth=1.2, label=engine)
    for p in points:
        if p.engine != "rigdda" or not math.isfinite(p.error):
            continue
        ax.plot(
            p.cpu_us_per_simulated_s, max(p.error, LEAST), MARKS[p.knob], color=SHADES[p.knob],
            markersize=4, label=p.knob, zorder=3,
        )  # fmt: skip
        if p.default:
            ax.plot(p.cpu_us_per_simulated_s, max(p.error, LEAST), "*", color="black",
                    markersize=11, label="default", zorder=4)  # fmt: skip
    ax.set(xscale="log", yscale="log", title=points[0].case)
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("CPU µs per simulated s", fontsize=8)
    ax.set_ylabel(points[0].quantity, fontsize=8)


def highway(figure: Figure, samples: Sequence[Sample], reference: Sample) -> None:
    """Draw the bias of each outcome, and below it the error of a mean of several releases."""
    panels = figure.subplots(2, len(OUTCOMES))
    for k, name in enumerate(OUTCOMES):
        _biases(panels[0, k], samples, reference, k)
        _totals(panels[1, k], samples, reference, k)
        panels[0, k].set_title(name)
    panels[0, 0].set_ylabel("bias against the reference")
    panels[1, 0].set_ylabel("error of a mean (bias and noise)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside upper center", ncols=5)


def _biases(ax: Axes, samples: Sequence[Sample], reference: Sample, k: int) -> None:
    default = next(s for s in samples if s.default)
    noise = default.half(100)[k]
    ax.axhspan(-noise, noise, color="0.9", zorder=0, label="95 % interval of 100 releases")
    ax.axhline(0.0, color="0.5", linewidth=0.8)
    for s in samples:
        own = s.engine == "rigdda"
        off, sure = bias(s, reference)
        ax.errorbar(
            s.cpu, off[k], sure[k], fmt=MARKS[s.knob] if own else "x",
            color=SHADES[s.knob] if own else COLOURS[s.engine], markersize=4, linewidth=0.8,
            label=s.knob if own else s.engine,
        )  # fmt: skip
        if s.default:
            ax.plot(s.cpu, off[k], "*", color="black", markersize=11, label="default", zorder=4)
    ax.set(xscale="log", xlabel="CPU s a release")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.xaxis.set_minor_formatter(NullFormatter())


def _totals(ax: Axes, samples: Sequence[Sample], reference: Sample, k: int) -> None:
    points: list[tuple[float, float]] = []
    for s in samples:
        own = s.engine == "rigdda"
        if own and s.knob != STEP:
            continue
        cost = s.cpu * np.array(RELEASES)
        error = np.array([total_error(s, reference, n)[k] for n in RELEASES])
        colour = SHADES[STEP] if own else COLOURS[s.engine]
        style = "-*" if s.default else "--" if own else ":"
        ax.plot(cost, error, style, color="black" if s.default else colour, linewidth=1.0,
                markersize=8)  # fmt: skip
        if own:
            ax.annotate(f"{1e3 * s.value:g} ms", (cost[-1], error[-1]), fontsize=7)
        points += zip(cost, error, strict=True)
    ax.plot(*zip(*front(points, lambda p: p), strict=True), color="0.8", linewidth=4.0, zorder=0)
    ax.set(xscale="log", yscale="log")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(f"CPU s of {', '.join(map(str, RELEASES))} releases")
