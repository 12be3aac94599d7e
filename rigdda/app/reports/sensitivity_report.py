"""Tables, picture and text of a sensitivity analysis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda.app.reports.pictures import DPI, FONT, save
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import euros, small, span
from rigdda.app.uncertainty.parameters import Input, Parameter
from rigdda.app.uncertainty.sensitivity import AnalysedInput, Output, Sensitivity
from rigdda.rounding import Rounding

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

SENSITIVITY_FILES = ("sensitivity.csv", "samples.csv", "tornado.png")

INDEX = {"morris": ("mu_star", "mu"), "sobol": ("ST", "S1")}
"""Names of the main index and of the other one in tables."""

WORDS = {"morris": "mu*", "sobol": "ST"}
"""Name of the main index in print."""

SHOWN, PANELS = 14, 3
"""Largest number of inputs, and of outputs, in the picture."""

LOW, HIGH, INTERVAL, NOISE = "#0072b2", "#d0312d", "#333333", "#b8860b"


def rows(found: Sensitivity) -> list[dict[str, Any]]:
    """Return one row for each output and input, the most important input of an output first."""
    main, other = INDEX[found.plan.method]
    out = []
    for output, indices in zip(found.outputs, found.indices, strict=True):
        for one, index in _ranked(found.plan.inputs, indices):
            limits = (one.low, one.high) if isinstance(one, Parameter) else (math.nan, math.nan)
            row: dict[str, Any] = {"output": output.name, "unit": output.unit, "input": one.path}
            row |= {"range_low": limits[0], "range_high": limits[1], "change": _change(one, index)}
            ends = max(index.low, 0.0), index.high  # no main index can be negative
            row |= {main: index.index, f"{main}_low": ends[0], f"{main}_high": ends[1]}
            row |= {other: index.first, f"{other}_low": index.first_low}
            row |= {f"{other}_high": index.first_high}
            if found.plan.method == "morris":
                row["sigma"] = index.spread
            row |= {"noise": index.noise, "signal_to_noise": index.signal}
            row |= {"distinguishable": "yes" if index.distinguishable else "no"}
            out.append(row)
    return out


def _change(one: Input, index: AnalysedInput) -> float:
    """Return the change over the range of an input; NaN for a posterior, which has no ends."""
    return index.change if isinstance(one, Parameter) else math.nan


def _ranked(
    inputs: Sequence[Input], indices: Sequence[AnalysedInput]
) -> list[tuple[Input, AnalysedInput]]:
    """Return inputs and their indices, the most important first."""
    pairs = list(zip(inputs, indices, strict=True))
    return sorted(pairs, key=lambda pair: -pair[1].index)


def samples(found: Sensitivity) -> list[dict[str, Any]]:
    """Return one row for each point: the values of the inputs and the outputs with their noise."""
    plan, out = found.plan, []
    noisy = [output.response.error for output in found.outputs]
    for i, place in enumerate(plan.cube.tolist()):
        row: dict[str, Any] = {}
        for one, at in zip(plan.inputs, place, strict=True):
            row |= dict(zip(one.paths, one.at(at), strict=True))
        for output, error in zip(found.outputs, noisy, strict=True):
            row[output.name] = float(output.response.values[i])
            row[f"{output.name}, standard error"] = float(error[i])
        out.append(row)
    return out


def write(folder: Path, found: Sensitivity) -> None:
    """Write `SENSITIVITY_FILES` into a folder."""
    write_rows(folder / "sensitivity.csv", rows(found))
    write_rows(folder / "samples.csv", samples(found))
    draw(folder / "tornado.png", found)


def tables(found: Sensitivity) -> list[tuple[str, Table]]:
    """Return a heading and a table for each output, at most 80 characters wide."""
    main, out = WORDS[found.plan.method], []
    for output, indices in zip(found.outputs, found.indices, strict=True):
        table = empty_table(("input", "range", "change", f"{main} (95 %)", "noise", ""))
        values = output.response.values
        for one, index in _ranked(found.plan.inputs, indices):
            if index.index <= 0.0:
                continue
            limits = isinstance(one, Parameter)
            table.add_row(
                _short(one),
                span((one.low, one.high)) if isinstance(one, Parameter) else "",
                _number(index.change) if limits else "",
                f"{_number(index.index)} ({_ends(max(index.low, 0.0), index.high)})",
                _number(index.noise),
                "" if index.distinguishable else "?",
            )
        unit = "" if output.unit == "-" else f" {output.unit}"
        low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
        words = f"median {_number(middle)}, 90 % of the points {span((low, high))}{unit}"
        out.append((f"{output.name}: {words}", table))
    return out


def _number(value: float, rounding: Rounding = "nearest") -> str:
    """Return a number with two or three significant figures as text."""
    large = abs(value) >= 1.0 or value == 0.0
    return euros(value, rounding) if large else small(value, rounding)


def _ends(low: float, high: float) -> str:
    """Return an interval as text, its ends rounded outward."""
    return f"{_number(low, 'down')} to {_number(high, 'up')}"


LONGEST_INPUT = 24
"""Largest number of letters of an input in a printed table."""


def _short(one: Input) -> str:
    """Return the name of an input, without what all inputs of its kind have in common."""
    name = one.path
    for top in ("surfaces.", "events.", "sources.", "consequences."):
        name = name.removeprefix(top)
    return name if len(name) <= LONGEST_INPUT else name[: LONGEST_INPUT - 3] + "..."


def explain(found: Sensitivity) -> str:
    """Return a text that explains the columns of the printed tables."""
    words = (
        "change: of the output on average from the low to the high end of the range; "
        + (
            "mu*: mean absolute change"
            if found.plan.method == "morris"
            else "ST: share of the variance with interactions"
        )
        + f"; noise: {WORDS[found.plan.method]} if all changes were noise; "
        "?: not distinguishable from the noise"
    )
    none = [
        _short(one)
        for i, one in enumerate(found.plan.inputs)
        if all(indices[i].index <= 0.0 for indices in found.indices)
    ]
    return words + (f"; no influence at all: {', '.join(none)}" if none else "")


def draw(path: Path, result: Sensitivity) -> None:
    """Write the tornado picture: changes of each output and indices with intervals and noise."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    shown = list(zip(result.outputs, result.indices, strict=True))
    shown = [(o, i) for o, i in shown if any(one.index > 0.0 for one in i)][:PANELS] or shown[:1]
    ranked = [_ranked(result.plan.inputs, indices)[:SHOWN] for _, indices in shown]
    ranked = [[pair for pair in pairs if pair[1].index > 0.0] or pairs[:1] for pairs in ranked]
    heights = [0.3 * len(pairs) + 1.0 for pairs in ranked]
    with rc_context(FONT):
        figure = Figure((11.0, sum(heights) + 0.6), dpi=DPI, layout="constrained")
        grid = figure.subplots(len(shown), 2, squeeze=False, sharey="row", height_ratios=heights)
        for (left, right), (output, _), pairs in zip(grid, shown, ranked, strict=True):
            _tornado(left, output, pairs)
            _indices(right, result, pairs)
        figure.legend(*_key(), loc="outside lower center", ncols=3, frameon=False)
        save(figure, path)


def _tornado(axes: Axes, output: Output, own: Sequence[tuple[Input, AnalysedInput]]) -> None:
    """Draw bars of the average change of an output, half of it to each side of 0."""
    mean = float(output.response.values.mean())
    for y, (one, index) in enumerate(own):
        if isinstance(one, Parameter):
            half = 0.5 * index.change
            axes.barh(y, -half, color=LOW, height=0.7)
            axes.barh(y, half, color=HIGH, height=0.7)
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(range(len(own)), [_labelled(one) for one, _ in own], fontsize=9)
    axes.set_ylim(len(own) - 0.5, -0.5)
    unit = "" if output.unit == "-" else f" [{output.unit}]"
    title = f"change of {output.name}{unit}; mean {_number(mean)}"
    axes.set_title(title, loc="left", fontsize=10)
    axes.grid(axis="x", alpha=0.25)


def _labelled(one: Input) -> str:
    """Return the name of an input with its range."""
    limits = f" ({span((one.low, one.high))})" if isinstance(one, Parameter) else ""
    return _short(one) + limits


def _indices(axes: Axes, found: Sensitivity, own: Sequence[tuple[Input, AnalysedInput]]) -> None:
    """Draw the main index of each input with its interval and the noise."""
    for y, (_, index) in enumerate(own):
        told = index.distinguishable
        axes.plot([max(index.low, 0.0), index.high], [y, y], color=INTERVAL, linewidth=1.6)
        axes.plot(index.index, y, "o", color=INTERVAL, markersize=6,
                  markerfacecolor=INTERVAL if told else "white")  # fmt: skip
        axes.plot([index.noise] * 2, [y - 0.35, y + 0.35], color=NOISE, linewidth=2.0)
    words = {"morris": "mu*: mean absolute change", "sobol": "ST: share of the variance"}
    axes.set_title(words[found.plan.method], loc="left", fontsize=10)
    axes.set_xlim(left=0.0)
    axes.grid(axis="x", alpha=0.25)


def _key() -> tuple[list[Any], list[str]]:
    """Return the handles and the labels of the legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[tuple[Any, str]] = [
        (Patch(color=LOW), "low end of the range"),
        (Patch(color=HIGH), "high end of the range"),
        (Line2D([], [], color=INTERVAL, marker="o"), "index with 95 % interval"),
        (
            Line2D([], [], color=INTERVAL, marker="o", markerfacecolor="white"),
            "not distinguishable from the noise",
        ),
        (Line2D([], [], color=NOISE, linewidth=2), "index that noise alone would give"),
    ]
    return [handle for handle, _ in entries], [words for _, words in entries]
