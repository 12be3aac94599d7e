"""Pictures of what passes: along the slope, at a station, and where blocks stop."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rigdda.app.reports.pictures import (
    DPI,
    FONT,
    ROAD,
    colour_of,
    draw_quantile,
    plain_log,
    plain_numbers,
    save,
)
from rigdda.app.reports.stations import ALL, PER, QUANTITIES, RATE, Passing, Rows, undecided

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Style = Literal[":", "-", "--"]

LINES: dict[str, Style] = {"q50": ":", "q95": "-", "q99": "--"}
"""Styles of the quantiles of a picture along the slope."""

BINS = 30
"""Bins of a histogram."""

ENERGIES = 1e4
"""Greatest energy over the least that is told apart in a histogram."""

WHOLE, NORMAL = "#222222", "#b5651d"
"""Colours of all events together, and of heights normal to the slope."""

SLOPE = ("energy", "velocity", "height", RATE)
"""Quantities of the picture along the slope."""

SHOWN = ("energy", "velocity", "height")
"""Quantities of the histograms at a station."""


def along_slope(path: str | os.PathLike[str], passing: Passing, rows: Rows) -> None:
    """Write the PNG of quantiles along the slope.

    Parameters
    ----------
    path : path
        The PNG.
    passing : Passing
        The releases.
    rows : list of dict
        Table along the slope, see `rigdda.app.reports.stations.summary`.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((11.0, 8.0), dpi=DPI, layout="constrained")
        for axes, quantity in zip(figure.subplots(2, 2, sharex=True).flat, SLOPE, strict=True):
            own = [row for row in rows if row["quantity"] == quantity]
            if quantity == RATE:
                _rates(axes, passing, own)
            else:
                other = "height_normal" if quantity == "height" else ""
                _quantiles(axes, passing, own, [r for r in rows if r["quantity"] == other])
            axes.axvspan(
                passing.site.road.start, passing.site.road.end, color=ROAD, alpha=0.2, lw=0
            )
            axes.grid(alpha=0.25)
            axes.set_xlabel("x [m]")
        _legend(figure, passing)
        save(figure, path)


def _quantiles(axes: Axes, passing: Passing, rows: Rows, normal: Rows) -> None:
    """Draw the quantiles over all events, with the interval of the 95 % quantile.

    `normal` are the rows of heights normal to the slope, of which the 95 % quantile is drawn; it is
    empty for other quantities.
    """
    own = [row for row in rows if row["event"] == passing.groups[-1]]
    x = [row["x_m"] for row in own]
    for name, style in LINES.items():
        value, high = (np.array([row[key] for row in own]) for key in (name, f"{name}_high"))
        draw_quantile(axes, x, value, high, color=WHOLE, linestyle=style)
    band = [[row[f"q95_{end}"] for row in own] for end in ("low", "high")]
    axes.fill_between(x, band[0], band[1], color=WHOLE, alpha=0.18, lw=0)
    if normal:
        lies = [row for row in normal if row["event"] == passing.groups[-1]]
        axes.plot(x, [row["q95"] for row in lies], color=NORMAL, linewidth=1.2)
    name = own[0]["quantity"]
    axes.set_title(f"{QUANTITIES[name].words}, {passing.groups[-1]} [{own[0]['unit']}]", loc="left",
                   fontsize=10)  # fmt: skip
    if name == "energy" and any(row["q50"] > 0.0 for row in own):
        plain_log(axes)
    else:
        axes.set_ylim(bottom=0.0)


def _rates(axes: Axes, passing: Passing, rows: Rows) -> None:
    """Draw how often a release passes, by event."""
    for group in passing.groups:
        own = [row for row in rows if row["event"] == group]
        x, colour = [row["x_m"] for row in own], _colour(passing, group)
        axes.plot(x, [row["mean"] for row in own], color=colour, linewidth=1.6)
        low, high = ([row[f"mean_{end}"] for row in own] for end in ("low", "high"))
        axes.fill_between(x, low, high, color=colour, alpha=0.18, lw=0)
    axes.set_ylim(bottom=0.0)
    axes.set_title(f"releases that pass [{PER} of road]", loc="left", fontsize=10)


def _colour(passing: Passing, group: str) -> str:
    """Return the colour of an event, or of all events."""
    return WHOLE if group == ALL else colour_of(passing.site, group)


def _legend(figure: Figure, passing: Passing) -> None:
    """Say what lines and colours mean, below the picture."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines: list[Any] = [
        Line2D([], [], color=WHOLE, linestyle=style, label=f"{name[1:]} % of blocks are below")
        for name, style in LINES.items()
    ]
    lines += [
        Line2D([], [], color=_colour(passing, group), linewidth=2, label=f"{group} (rate)")
        for group in passing.groups
    ]
    lines += [
        Patch(color=WHOLE, alpha=0.18, lw=0, label="95 % interval"),
        Line2D([], [], color=NORMAL, linewidth=1.2, label="95 %, normal to the slope"),
        Line2D([], [], color=WHOLE, linewidth=0.7, alpha=0.6, label="too few blocks for one"),
        Patch(color=ROAD, alpha=0.2, lw=0, label="road"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=4, frameon=False, fontsize=10)


def station(path: str | os.PathLike[str], passing: Passing, place: int, rows: Rows) -> None:
    """Write the PNG of the histograms at a station.

    Parameters
    ----------
    path : path
        The PNG.
    passing : Passing
        The releases.
    place : int
        Index of the station.
    rows : list of dict
        Table of stations, see `rigdda.app.reports.stations.summary`.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    x = float(passing.found.stations[place])
    with rc_context(FONT):
        figure = Figure((11.0, 4.6), dpi=DPI, layout="constrained")
        for axes, quantity in zip(figure.subplots(1, 3), SHOWN, strict=True):
            _histogram(axes, passing, place, quantity)
            own = [row for row in rows if row["x_m"] == x and row["quantity"] == quantity]
            _mark(axes, own[-1])
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False,
                      fontsize=10)  # fmt: skip
        count = len(passing.found.at(place))
        figure.suptitle(f"{passing.site.name}, x = {x:g} m: {count:,} blocks pass in "
                        f"{len(passing.found.seed):,} releases", fontsize=11)  # fmt: skip
        save(figure, path)


def _histogram(axes: Axes, passing: Passing, place: int, quantity: str) -> None:
    """Draw the share of passing blocks by a quantity, each event in its colour."""
    known = QUANTITIES[quantity]
    parts = [(event, passing.passages(event, place)) for event in passing.events]
    group = passing.groups[-1]
    rows = passing.passages(group, place)
    axes.set(xlabel=f"{known.words} [{known.unit}]", ylabel="share of passing blocks [%]")
    axes.grid(alpha=0.25)
    if not len(rows):
        axes.text(0.5, 0.5, "no block passes", ha="center", transform=axes.transAxes)
        return
    values = known.of(rows)
    low, high = min(0.0, float(values.min())), max(float(values.max()), 1e-9)
    edges = np.linspace(low, high, BINS + 1).tolist()
    if quantity == "energy":
        edges = np.geomspace(high / ENERGIES, high, BINS + 1).tolist()
        axes.set_xscale("log")
        plain_numbers(axes.xaxis, (1.0,))
    weight = passing.sample(group, rows, values).weight
    whole = float(weight.sum())
    drawn = [(event, known.of(own), weight[rows["event"] == own["event"][0]])
             for event, own in parts if len(own)]  # fmt: skip
    drawn = [one for one in drawn if len(one[2])]
    axes.hist([np.clip(v, edges[0], edges[-1]) for _, v, _ in drawn], edges,
              weights=[100.0 * w / whole for *_, w in drawn],
              stacked=True, color=[_colour(passing, event) for event, *_ in drawn],
              label=[event for event, *_ in drawn])  # fmt: skip


def _mark(axes: Axes, row: dict[str, Any]) -> None:
    """Draw the quantiles over all events as lines."""
    for name, style in LINES.items():
        if np.isfinite(row[name]):
            axes.axvline(row[name], color=WHOLE, linestyle=style, linewidth=1.4,
                         label=f"{name[1:]} % are below")  # fmt: skip


def run_out(path: str | os.PathLike[str], passing: Passing, rows: Rows) -> None:
    """Write the PNG of how often rock stops beyond each chainage.

    Parameters
    ----------
    path : path
        The PNG.
    passing : Passing
        The releases.
    rows : list of dict
        Table of the run-out, see `rigdda.app.reports.stations.run_out`.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((10.0, 6.0), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        for group in passing.groups:
            own = [row for row in rows if row["event"] == group and row["rate"] > 0.0]
            x, colour = [row["x_m"] for row in own], _colour(passing, group)
            axes.plot(x, [row["rate"] for row in own], color=colour, linewidth=1.8, label=group)
            low, high = ([row[f"rate_{end}"] for row in own] for end in ("low", "high"))
            axes.fill_between(x, low, high, color=colour, alpha=0.18, lw=0)
        if any(row["rate"] > 0.0 for row in rows):
            plain_log(axes)
        road = passing.site.road
        axes.axvspan(road.start, road.end, color=ROAD, alpha=0.2, lw=0, label="road")
        axes.grid(alpha=0.25)
        axes.set(xlabel="x [m]", ylabel=f"releases with a block that stops beyond x [{PER}]")
        words = undecided(passing) or "every block had stopped when its release ended"
        axes.set_title(words, loc="left", fontsize=10)
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=10)
        save(figure, path)
