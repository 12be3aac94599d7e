"""Pictures of a slope: in section, of what passes, and of what the engineering rule demands.

The section shows the trajectories of blocks, the barriers, and envelopes of the heights and the
energies of the blocks. Further pictures show what passes along the slope and at a station, where
blocks stop, and cost against risk.

The picture of the rule shows where a fence of a given class is sufficient: the demanded energy
between the classes of the catalogue, the needed height between their greatest heights, and for each
class the stretches where it satisfies the rule.
"""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Ditch, Fence, Layout, Mesh, Run, Simulation, Site
from rigdda.app.reports.source_outlines import sources
from rigdda.app.reports.stations import (
    ALL_EVENTS,
    PASSING_RATE,
    PER,
    QUANTITIES,
    Passing,
    Rows,
    summary,
    undecided,
)
from rigdda.barriers import FENCE_CLASSES, Earthwork, earthworks, standing
from rigdda.barriers.fence import CLASSES, WornFence
from rigdda.display import BARRIER, OLD, ROAD, ZONE
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.envelope import largest
from rigdda.envs.rendering import (
    BAND,
    DASHED,
    STRETCH,
    Label,
    draw_barrier,
    draw_elongation,
    draw_ground,
    draw_mesh,
    materials,
    name_places,
    top_of,
    write_labels,
)
from rigdda.files import atomic
from rigdda.model.site_tables import BarrierZone
from rigdda.passages import ends, passages

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, FigureBase


Floats = NDArray[np.float64]

DRAWN_TRAJECTORIES = 30
"""Largest number of trajectories of an event that are drawn."""

ENVELOPE_BLOCKS = 300
"""Largest number of blocks of an event behind an envelope of a design; 15 are above the 95 %
quantile."""

FRAME_INTERVAL = 0.05
"""Time between two points of a trajectory [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class EventTrajectories:
    """Trajectories in releases of one event.

    Parameters
    ----------
    event : str
        Name of the event.
    ways : tuple of (n, 2) array
        Trajectory of the centroid of each block [m].
    """

    event: str
    ways: tuple[Floats, ...]


@dataclass(frozen=True, slots=True, eq=False)
class PassageEnvelope:
    """95 % quantiles of what passes stations in releases of one event.

    Parameters
    ----------
    event : str
        Its name.
    stations : (K,) array
        Chainages [m], ascending.
    height, energy : (3, K) array
        Quantile and the ends of its 95 % interval: of the height of the tops of blocks above the
        ground [m] and of their energy [kJ]. NaN where there are too few blocks.
    """

    event: str
    stations: Floats
    height: Floats
    energy: Floats

    @classmethod
    def of(cls, event: str, rows: Rows) -> PassageEnvelope:
        """Return the envelope in a table along the slope, see `rigdda.app.reports.stations`."""
        own = [row for row in rows if row["event"] == event]

        def lines(quantity: str) -> Floats:
            found = [row for row in own if row["quantity"] == quantity]
            return np.array([[row[f"q95{end}"] for row in found] for end in ("", "_low", "_high")])

        stations = np.array([row["x_m"] for row in own if row["quantity"] == "energy"])
        return cls(event, stations, lines("height_top"), lines("energy"))


def trajectories(site: Site, layout: Layout, event: str, seeds: Sequence[int]) -> EventTrajectories:
    """Simulate releases of an event in threads on all cores, for their trajectories.

    The seeds are used in order until `DRAWN_TRAJECTORIES` blocks have been released.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope.
    Diverged
        If a simulation diverges.
    """
    first = _run(site, layout, event, seeds[0])
    more = seeds[1 : max(1, -(-DRAWN_TRAJECTORIES // len(first.scene.blocks)))]
    with ThreadPoolExecutor() as pool:
        runs = [first, *pool.map(lambda seed: _run(site, layout, event, seed), more)]
    ways = [run.poses[:, i, :2] for run in runs for i in range(run.poses.shape[1])]
    return EventTrajectories(event, tuple(ways[:: max(1, -(-len(ways) // DRAWN_TRAJECTORIES))]))


def _run(site: Site, layout: Layout, event: str, seed: int) -> Run:
    scene = site.realise(layout, seed, event)
    simulation = Simulation(scene, site.settings(scene), leave=ends(site)[1])
    return simulation.run(site.motion.duration, FRAME_INTERVAL)


def envelopes(
    site: Site, layout: Layout, seeds: Sequence[int], stations: Floats
) -> list[PassageEnvelope]:
    """Simulate releases of every event of a site and return their envelopes.

    The seeds are used in order until as many blocks of an event have been released as there are
    seeds.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.passages.passages` does.
    """
    counts = {name: max(1, len(seeds) // largest(site, name)) for name in site.event_names}
    releases = [(seed, name) for name, count in counts.items() for seed in seeds[:count]]
    found = passages(site, layout, releases, stations.tolist())
    passing = Passing.of(site, layout, None, found)
    rows = summary(passing, range(len(stations)), site.event_names, ("height_top", "energy"))
    return [PassageEnvelope.of(name, rows) for name in site.event_names]


def reach(corners: Floats) -> tuple[float, float]:
    """Return the least and the greatest chainage of corners [m]."""
    return float(corners[:, 0].min()), float(corners[:, 0].max())


__all__ = [
    "BARRIER",
    "DPI",
    "FONT",
    "ROAD",
    "ZONE",
    "Point",
    "colours",
    "cost_against_risk",
    "save",
]

TRIED, EQUAL = "#9aa5b1", "#c8ccd0"
EVENTS = ("#0072b2", "#d0312d", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7b4fb0", "#6b4226")
"""Colours of events, chosen to be distinguishable with colour blindness as far as possible."""

MARKERS = ("o", "^", "s", "D", "P", "X")
FONT: dict[Any, Any] = {
    "font.size": 11,
    "text.parse_math": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
DPI = 120

SHEDS = 1.6
"""A layout whose capital exceeds all other costs by more than this factor is written as text at the
edge of the diagram instead of being drawn to scale [-]."""


@dataclass(frozen=True, slots=True)
class Point:
    """Costs of a named layout in EUR per metre of road and year.

    Parameters
    ----------
    name : str
        Name of the layout.
    capital : float
        Annual cost of its capital and upkeep.
    risk : float
        Expected annual harm and repair.
    interval : (float, float)
        95 % interval of `risk`.
    """

    name: str
    capital: float
    risk: float
    interval: tuple[float, float]

    @classmethod
    def of(cls, name: str, evaluation: Evaluation) -> Point:
        """Return the point of an evaluation; its uncertainty is that of the risk alone."""
        risk, capital = evaluation.harm + evaluation.repair, evaluation.capital
        low, high = (max(end - capital, 0.0) for end in evaluation.ci)
        return cls(name, capital, risk, (min(low, risk), max(high, risk)))


def colours(count: int) -> list[str]:
    """Return the colours of the events of a site, in the order of the site."""
    return [EVENTS[i % len(EVENTS)] for i in range(count)]


def colour_of(site: Site, event: str) -> str:
    """Return the colour of an event of a site."""
    return colours(len(site.events))[site.event_names.index(event)]


def cost_against_risk(
    path: str | os.PathLike[str], tried: Sequence[Evaluation], points: Sequence[Point]
) -> None:
    """Write a PNG diagram of the annual capital cost of layouts against their remaining risk.

    Z is constant along the thin lines.

    Parameters
    ----------
    path : path
        The PNG file.
    tried : sequence of Evaluation
        Evaluations of the search, each with few releases.
    points : sequence of Point
        Verified layouts and references, with intervals.
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
        if tried:
            axes.plot([e.capital for e in tried], [e.harm + e.repair for e in tried], ".",
                      color=TRIED, markersize=4, alpha=0.6, zorder=2,
                      label=_searched(tried))  # fmt: skip
        for i, point in enumerate(near):
            _named(axes, point, MARKERS[i % len(MARKERS)], EVENTS[i % len(EVENTS)])
        for point in points:
            if point not in near:
                axes.annotate(
                    f"{point.name}: {point.capital:,.0f} for capital, {point.risk:,.0f} for risk",
                    (0.995, 0.01), xycoords="axes fraction", ha="right", va="bottom", fontsize=10,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8},
                )  # fmt: skip
        axes.set(xlim=(-0.02 * right, right), ylim=(0.0, top))
        axes.set(xlabel="capital and upkeep [EUR per metre of road and year]",
                 ylabel="expected harm and repair [EUR per metre of road and year]")  # fmt: skip
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
        save(figure, path)


def _searched(tried: Sequence[Evaluation]) -> str:
    """Return the label of the layouts of a search, with half the median 95 % interval.

    The estimate of the best of many layouts is too low by about this amount.
    """
    words = f"{len(tried):,} layouts of the search, few releases each"
    half = float(np.median([0.5 * (e.ci[1] - e.ci[0]) for e in tried]))
    return f"{words}, ± {half:,.0f}"


def _reach(points: Sequence[Point]) -> float:
    """Return the largest capital that is drawn to scale [EUR per metre and year]."""
    least = min(point.capital + point.risk for point in points)
    return SHEDS * max(least, *(p.risk for p in points), sorted(p.capital for p in points)[-2])


def _equal(axes: Axes, right: float, top: float) -> None:
    """Draw lines of equal Z, which is the sum of both coordinates, and write their values."""
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


VECTOR: dict[Any, Any] = {"svg.hashsalt": "rigdda", "svg.fonttype": "path"}
"""Settings of vector pictures: the same figure gives the same file, and letters are outlines, so
that no font is needed."""


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG and, beside it, as SVG for reports; each atomically."""
    from matplotlib import rc_context

    with atomic(path) as part:
        figure.savefig(part, format="png")
    figure.set_layout_engine("none")  # the second file has the places of the first
    with rc_context(VECTOR), atomic(Path(path).with_suffix(".svg")) as part:
        figure.savefig(part, format="svg", metadata={"Date": None})


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One slope of the picture with its title, its layout and releases of every event."""

    title: str
    layout: Layout
    shown: Sequence[EventTrajectories]


def section(
    path: str | os.PathLike[str],
    site: Site,
    zone: BarrierZone,
    panels: Sequence[Panel],
    envelopes: Sequence[PassageEnvelope],
    words: str,
) -> None:
    """Write a PNG picture of a slope in section.

    Parameters
    ----------
    path : path
        The PNG file.
    site : Site
        The site.
    zone : BarrierZone
        The zone in which barriers may be built.
    panels : sequence of Panel
        Slopes drawn to scale, side by side or one above the other.
    envelopes : sequence of PassageEnvelope
        Heights and energies that are shown below the slopes.
    words : str
        Description of the releases of the envelopes, for their titles.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    window = _window(site, panels)
    left, right, bottom, top = window
    ratio = (top - bottom) / (right - left)
    width = 13.0 if ratio > 0.3 else 11.0
    rows, columns = (1, len(panels)) if ratio > 0.3 else (len(panels), 1)
    tall = min(width / columns * ratio, 7.0)
    with rc_context(FONT):
        figure = Figure((width, rows * (tall + 0.5) + 4.8), dpi=DPI, layout="constrained")
        parts: Any = figure.subfigures(2, height_ratios=[rows * (tall + 0.5) + 0.4, 4.4])
        upper, lower = parts
        grid = upper.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        labels = []
        for axes, panel in zip(grid.flat, _wrapped(panels, columns), strict=True):
            labels.append(_slope(axes, site, zone, panel, window))
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.label_outer()
        heights, energies = lower.subplots(1, 2, sharex=True)
        heights.set_xlim(left, right)
        for axes in (heights, energies):
            axes.axvspan(zone.start, zone.end, color=ZONE, alpha=0.25, lw=0)
        _envelopes(heights, energies, site, panels[-1].layout, envelopes, words)
        _key(lower, site, [own.event for own in envelopes])
        write_labels(figure, list(zip(grid.flat, labels, strict=True)))
        save(figure, path)


TITLE_WIDTH = 126
"""Number of characters of a title across a whole picture."""


def _wrapped(panels: Sequence[Panel], columns: int) -> list[Panel]:
    """Return panels whose titles have lines that fit into one of several columns."""
    width, found = TITLE_WIDTH // columns, []
    for panel in panels:
        lines = (part for line in panel.title.splitlines() for part in textwrap.wrap(line, width))
        found.append(replace(panel, title="\n".join(lines)))
    return found


SLOPES_PER_ROW = 3
"""Largest number of slopes side by side."""


def slopes(
    path: str | os.PathLike[str], site: Site, zone: BarrierZone, panels: Sequence[Panel]
) -> None:
    """Write a PNG picture of several slopes to the same scale, without envelopes.

    Parameters
    ----------
    path : path
        The PNG file.
    site : Site
        The site.
    zone : BarrierZone
        The zone in which barriers may be built.
    panels : sequence of Panel
        The slopes, up to `SLOPES_PER_ROW` side by side.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    window = _window(site, panels)
    left, right, bottom, top = window
    columns = 2 if len(panels) == 4 else min(SLOPES_PER_ROW, len(panels))
    rows = -(-len(panels) // columns)
    panels = _wrapped(panels, columns)
    lines = 1 + max(panel.title.count("\n") for panel in panels)
    tall = min(13.0 / columns * (top - bottom) / (right - left), 7.0) + 0.25 + 0.2 * lines
    with rc_context(FONT):
        figure = Figure((13.0, rows * tall + 1.2), dpi=DPI, layout="constrained")
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        drawn = list(zip(grid.flat, panels, strict=False))
        labels = []
        for axes, panel in drawn:
            labels.append(_slope(axes, site, zone, panel, window))
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.label_outer()
        for axes in grid.flat[len(panels) :]:
            axes.set_visible(False)
        _key(figure, site, site.event_names, envelopes=False)
        write_labels(figure, [(axes, own) for (axes, _), own in zip(drawn, labels, strict=True)])
        save(figure, path)


def released_slope(
    path: str | os.PathLike[str], passing: Passing, layout: Layout, rows: Rows
) -> None:
    """Write a PNG picture of releases with a layout.

    Parameters
    ----------
    path : path
        The PNG.
    passing : Passing
        The releases. Trajectories are those of the first releases of each event.
    layout : Layout
        The barriers.
    rows : list of dict
        Table along the slope, see `rigdda.app.reports.stations.summary`.

    Raises
    ------
    BadInput, Diverged
        The same errors as `trajectories`.
    """
    site, drawn = passing.site, [name for name in passing.events if name not in passing.not_drawn]
    shown = []
    for name in drawn:
        seeds = [passing.found.seed[i] for i in passing.releases(name).tolist()]
        shown.append(trajectories(site, layout, name, seeds))
    count = len(passing.found.seed)
    title = f"{site.name}: {count:,} releases; some trajectories of each event"
    words = f"With the layout, {count:,} releases" if layout else f"{count:,} releases"
    panels = [Panel(title, layout, shown)]
    section(
        path, site, site.barrier_zone, panels, [PassageEnvelope.of(n, rows) for n in drawn], words
    )


def _window(site: Site, panels: Sequence[Panel]) -> tuple[float, float, float, float]:
    """Return left, right, bottom, top of the whole profile and all trajectories [m]."""
    x, y = np.array(site.slope.points).T
    ways = (way for panel in panels for shown in panel.shown for way in shown.ways)
    shown = (y, *(piece[:, 1] for piece in sources(site)), *(way[:, 1] for way in ways))
    high = max(float(part.max()) for part in shown)
    low = float(y.min())
    return float(x[0]), float(x[-1]), low - 0.1 * (high - low), high + 0.05 * (high - low)


def _slope(
    axes: Axes, site: Site, zone: BarrierZone, panel: Panel, window: tuple[float, ...]
) -> list[Label]:
    """Draw the ground, zone, road, sources, trajectories and barriers of one slope.

    Return the labels of the barriers, which are written when the size of the axes is final.
    """
    standing = site.standing(panel.layout)
    built, moved = earthworks(site.profile, standing, site.soil)
    ditches = [barrier for barrier in standing if isinstance(barrier, Ditch)]
    with suppress(BadInput):  # a ditch in an embankment cannot be dug without it
        built, _ = earthworks(site.profile, ditches, site.soil)
    *_, bottom, top = window
    draw_ground(axes, site, built, bottom)
    axes.plot(*site.ground_between(site.road.start, site.road.end).T, color=ROAD, linewidth=5,
              zorder=3, solid_capstyle="butt")  # fmt: skip
    name_places(axes, site, (zone.start, zone.end))
    for shown in panel.shown:
        for way in shown.ways:
            axes.plot(*way.T, color=colour_of(site, shown.event), linewidth=0.6, alpha=0.55,
                      zorder=4)  # fmt: skip
    for corners in sources(site):
        axes.plot(*corners.T, color="black", linewidth=2.0, zorder=4.5)
    axes.set_aspect("equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(panel.title, loc="left", fontsize=11)
    return _barriers(axes, site, panel.layout, moved, BAND * (top - bottom))


def _barriers(
    axes: Axes, site: Site, layout: Layout, moved: Mapping[Barrier, Floats], thickness: float
) -> list[Label]:
    """Draw the barriers, with mesh as a band of this thickness [m], and return their labels."""
    labels = []
    for barrier in layout:
        if isinstance(barrier, Mesh):
            labels.append(Label(barrier.label, draw_mesh(axes, site, barrier, thickness)))
    old = site.existing_barriers
    for built, words in zip(site.standing(layout), site.labels(layout), strict=True):
        outline = moved[built] if isinstance(built, Earthwork) else built.outline(site.profile)
        colour = OLD if built in old else BARRIER
        draw_barrier(axes, built, outline, colour=colour, old=built in old)
        if isinstance(built, Fence):
            draw_elongation(axes, site, built)
        labels.append(Label(words, top_of(outline), colour))
    return labels


def _envelopes(
    heights: Axes,
    energies: Axes,
    site: Site,
    layout: Layout,
    drawn: Sequence[PassageEnvelope],
    words: str,
) -> None:
    """Draw the envelopes of height and energy, and the height and class of the barriers."""
    for envelope in drawn:
        for axes, lines in ((heights, envelope.height), (energies, envelope.energy)):
            colour = colour_of(site, envelope.event)
            draw_quantile(axes, envelope.stations, lines[0], lines[2], color=colour)
            axes.fill_between(envelope.stations, lines[1], lines[2], color=colour, alpha=0.2, lw=0)
    for axes in (heights, energies):
        axes.axvspan(site.road.start, site.road.end, color=ROAD, alpha=0.2, lw=0)
        axes.grid(alpha=0.25)
        axes.set_xlabel("x [m]")
    for barrier in site.standing(layout):
        tall = barrier.left_height(0.0)
        colour = OLD if barrier in site.existing_barriers else BARRIER
        if tall > 0.0:
            heights.plot([barrier.x] * 2, [0.0, tall], color=colour, linewidth=4,
                         solid_capstyle="butt")  # fmt: skip
        else:
            heights.axvline(barrier.x, color=colour, linewidth=1, linestyle=":")
        if isinstance(barrier, Fence) and barrier.energy_class is not None:
            takes = barrier.remaining if isinstance(barrier, WornFence) else barrier.rated
            energies.plot(barrier.x, takes, "D", color=colour, markersize=8)
        else:
            energies.axvline(barrier.x, color=colour, linewidth=1, linestyle=":")
    if any((envelope.energy[0] > 0.0).any() for envelope in drawn):  # otherwise there are no curves
        plain_log(energies)
    heights.set_ylim(bottom=0.0)
    heights.set_title(f"{words}: 95 % quantile of block tops [m above ground]",
                      loc="left", fontsize=10)  # fmt: skip
    energies.set_title(
        f"{words}: 95 % quantile of the energy of blocks [kJ]", loc="left", fontsize=10
    )


def draw_quantile(axes: Axes, x: ArrayLike, value: Floats, high: Floats, **style: Any) -> None:
    """Draw a quantile along the slope, thin where it has no upper end of its interval.

    Parameters
    ----------
    x, value, high : (K,) array
        Chainages, quantile and the upper end, NaN where there are too few blocks for one.
    **style
        Colour and style of the line.
    """
    axes.plot(x, value, linewidth=0.7, alpha=0.6, **style)
    axes.plot(x, np.where(np.isnan(high), np.nan, value), linewidth=1.6, **style)


def plain_log(axes: Axes) -> None:
    """Make the y axis logarithmic, with plain numbers and at most four powers of ten."""
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(bottom=max(low, high / AXIS_RATIO))
    plain_numbers(axes.yaxis, (1.0, 2.0, 5.0))


def plain_numbers(axis: Axis, multiples: Sequence[float]) -> None:
    """Write plain numbers at these multiples of powers of ten of a logarithmic axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=multiples))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))


AXIS_RATIO = 1e4
"""Greatest ratio of the ends of a logarithmic axis."""


def _key(figure: FigureBase, site: Site, events: Sequence[str], envelopes: bool = True) -> None:
    """Draw the legend below the picture, with or without the entries for envelopes."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines: list[Any] = []
    for name in events:
        label = f"{name}, {site.event(name).rate:.3g} a year per 100 m"
        lines.append(Line2D([], [], color=colour_of(site, name), linewidth=2, label=label))
    lines += [Patch(color=colour, label=name) for name, colour in materials(site).items()]
    lines += [
        Line2D([], [], color="black", linewidth=3, label="rock source"),
        Line2D([], [], color=ZONE, linewidth=6, label="barrier zone"),
        Line2D([], [], color=ROAD, linewidth=6, label="road"),
        Line2D([], [], color=BARRIER, marker="D", linewidth=4, label="barrier: height, class"),
        Patch(color=BARRIER, alpha=STRETCH, lw=0, label="elongation of a fence"),
    ]
    if site.existing:
        lines.append(
            Line2D([], [], color=OLD, linestyle=DASHED, linewidth=4, label="existing barrier")
        )
    if envelopes:
        lines += [
            Patch(color="black", alpha=0.2, lw=0, label="95 % interval"),
            Line2D([], [], color="black", linewidth=0.7, label="too few blocks for one"),
        ]
    figure.legend(handles=lines, loc="outside lower center", ncols=min(4, len(lines)),
                  frameon=False)  # fmt: skip


Style = Literal[":", "-", "--"]

QUANTILE_LINES: dict[str, Style] = {"q50": ":", "q95": "-", "q99": "--"}
"""Styles of the quantiles of a picture along the slope."""

BINS = 30
"""Bins of a histogram."""

HISTOGRAM_RATIO = 1e4
"""Greatest energy over the least that a histogram shows separately."""

WHOLE, NORMAL = "#222222", "#b5651d"
"""Colours of all events together, and of heights normal to the slope."""

ALONG_SLOPE = ("energy", "velocity", "height", PASSING_RATE)
"""Quantities of the picture along the slope."""

AT_STATION = ("energy", "velocity", "height")
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
        for axes, quantity in zip(
            figure.subplots(2, 2, sharex=True).flat, ALONG_SLOPE, strict=True
        ):
            own = [row for row in rows if row["quantity"] == quantity]
            if quantity == PASSING_RATE:
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
    for name, style in QUANTILE_LINES.items():
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
        x, colour = [row["x_m"] for row in own], _colour_of_group(passing, group)
        axes.plot(x, [row["mean"] for row in own], color=colour, linewidth=1.6)
        low, high = ([row[f"mean_{end}"] for row in own] for end in ("low", "high"))
        axes.fill_between(x, low, high, color=colour, alpha=0.18, lw=0)
    axes.set_ylim(bottom=0.0)
    axes.set_title(f"releases that pass [{PER} of road]", loc="left", fontsize=10)


def _colour_of_group(passing: Passing, group: str) -> str:
    """Return the colour of an event, or of all events."""
    return WHOLE if group == ALL_EVENTS else colour_of(passing.site, group)


def _legend(figure: Figure, passing: Passing) -> None:
    """Say what lines and colours mean, below the picture."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines: list[Any] = [
        Line2D([], [], color=WHOLE, linestyle=style, label=f"{name[1:]} % of blocks are below")
        for name, style in QUANTILE_LINES.items()
    ]
    lines += [
        Line2D([], [], color=_colour_of_group(passing, group), linewidth=2, label=f"{group} (rate)")
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
        for axes, quantity in zip(figure.subplots(1, 3), AT_STATION, strict=True):
            _histogram(axes, passing, place, quantity)
            own = [row for row in rows if row["x_m"] == x and row["quantity"] == quantity]
            _mark_quantiles(axes, own[-1])
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
        edges = np.geomspace(high / HISTOGRAM_RATIO, high, BINS + 1).tolist()
        axes.set_xscale("log")
        plain_numbers(axes.xaxis, (1.0,))
    weight = passing.sample(group, rows, values).weight
    whole = float(weight.sum())
    drawn = [(event, known.of(own), weight[rows["event"] == own["event"][0]])
             for event, own in parts if len(own)]  # fmt: skip
    drawn = [one for one in drawn if len(one[2])]
    axes.hist([np.clip(v, edges[0], edges[-1]) for _, v, _ in drawn], edges,
              weights=[100.0 * w / whole for *_, w in drawn],
              stacked=True, color=[_colour_of_group(passing, event) for event, *_ in drawn],
              label=[event for event, *_ in drawn])  # fmt: skip


def _mark_quantiles(axes: Axes, row: dict[str, Any]) -> None:
    """Draw the quantiles over all events as lines."""
    for name, style in QUANTILE_LINES.items():
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
            x, colour = [row["x_m"] for row in own], _colour_of_group(passing, group)
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


DEMAND, FITS, ENERGY_ONLY = "#1a1a1a", "#2a9d8f", "#c9ddd9"
"""Colours of the demand, of stretches where a class satisfies the rule, and of stretches where only
its energy suffices."""

NOTE = "#4a5560"
"""Colour of the names of classes."""

TALL = 12.0
"""Largest height in the picture [m] unless more is needed everywhere; no fence is nearly as
high."""

FENCE_MARKERS = "Do^sv"
"""Markers of the fences of different layouts."""


def draw_demand(
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
        Table of the demand, see `rigdda.app.reports.design_report.demand_rows`.
    layouts : mapping of str to Layout
        Layouts whose fences are shown, by name.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((11.0, 10.5), dpi=DPI, layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.15, 1.0, 1.0])
        energies, heights, classes = panels
        _demanded_energies(energies, problem, rows)
        _needed_heights(heights, problem, rows)
        _class_stretches(classes, rows)
        for name, marker in zip(layouts, FENCE_MARKERS, strict=False):
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


def _values(rows: Sequence[Mapping[str, Any]], name: str) -> Floats:
    return np.array([row[name] for row in rows], dtype=np.float64)


def _demanded_energies(
    axes: Axes, problem: DesignProblem, rows: Sequence[Mapping[str, Any]]
) -> None:
    """Draw the demanded energy over bands of the classes."""
    x, energy = _values(rows, "x_m"), _values(rows, "demanded_energy_kJ")
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
    speed = _values(rows, "velocity_m_s")
    least, most = (
        energy * (_values(rows, f"velocity_{end}_m_s") / speed) ** 2 for end in ("low", "high")
    )
    axes.fill_between(x, least, most, color=DEMAND, alpha=0.2, lw=0, label="95 % interval")
    axes.plot(x, energy, color=DEMAND, linewidth=1.8, label="demand with partial factors")
    factors = problem.site.rule
    axes.set_title(
        f"demanded energy of a fence at {factors.level}, with all partial factors [kJ]; bands: "
        "least class with this energy", loc="left", fontsize=10,
    )  # fmt: skip


def _needed_heights(axes: Axes, problem: DesignProblem, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw the needed height, and the greatest heights of the classes."""
    x, height = _values(rows, "x_m"), _values(rows, "needed_height_m")
    factors, centre = problem.site.rule, _values(rows, "height_m")
    least, most = (
        height + factors.velocity * factors.height * (_values(rows, f"height_{end}_m") - centre)
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


def _class_stretches(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw for each class where it satisfies the rule, and where only its energy suffices."""
    x, energy = _values(rows, "x_m"), _values(rows, "demanded_energy_kJ")
    step = float(np.diff(x).min()) if len(x) > 1 else 1.0
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
