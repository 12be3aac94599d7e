"""Pictures of a slope in section and of cost against risk.

The section shows the trajectories of blocks, the barriers, and envelopes of the heights and the
energies of the blocks.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import Barrier, Fence, Layout, Mesh, Run, Simulation, Site
from rigdda.app.reports.stations import Passing, Rows, summary
from rigdda.barriers import Earthwork, earthworks
from rigdda.barriers.fence import WornFence
from rigdda.display import BARRIER, OLD, ROAD, ZONE
from rigdda.envs import Evaluation
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

DRAWN = 30
"""Largest number of trajectories of an event that are drawn."""

ENOUGH = 300
"""Largest number of blocks of an event behind an envelope of a design; 15 are above the 95 %
quantile."""

EVERY = 0.05
"""Time between two points of a trajectory [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectories:
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


def trajectories(site: Site, layout: Layout, event: str, seeds: Sequence[int]) -> Trajectories:
    """Simulate releases of an event in threads on all cores, for their trajectories.

    The seeds are used in order until `DRAWN` blocks have been released.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope.
    Diverged
        If a simulation diverges.
    """
    first = _run(site, layout, event, seeds[0])
    more = seeds[1 : max(1, -(-DRAWN // len(first.scene.blocks)))]
    with ThreadPoolExecutor() as pool:
        runs = [first, *pool.map(lambda seed: _run(site, layout, event, seed), more)]
    ways = [run.poses[:, i, :2] for run in runs for i in range(run.poses.shape[1])]
    return Trajectories(event, tuple(ways[:: max(1, len(ways) // DRAWN)]))


def _run(site: Site, layout: Layout, event: str, seed: int) -> Run:
    scene = site.realise(layout, seed, event)
    simulation = Simulation(scene, site.settings(scene), leave=ends(site)[1])
    return simulation.run(site.motion.duration, EVERY)


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


def sources(site: Site) -> list[Floats]:
    """Return the corners of each source [m]: a closed polygon, or the ground line of a band."""
    ground, out = site.profile, []
    for source in site.sources:
        if source.band is None:
            pieces = (np.array(piece, dtype=np.float64) for _, piece in source.pieces())
            out += [np.concatenate([piece, piece[:1]]) for piece in pieces]
        else:
            start, end = source.band
            x = [start, *(x for x, _ in site.slope.points if start < x < end), end]
            out.append(np.array([(at, ground.height(at)) for at in x]))
    return out


def reach(corners: Floats) -> tuple[float, float]:
    """Return the least and the greatest chainage of corners [m]."""
    return float(corners[:, 0].min()), float(corners[:, 0].max())


__all__ = ["BARRIER", "DPI", "FONT", "ROAD", "ZONE", "Point", "colours", "cost", "save"]

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


def cost(
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
    shown: Sequence[Trajectories]


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
        for axes, panel in zip(grid.flat, panels, strict=True):
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


COLUMNS = 3
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
        The slopes, up to `COLUMNS` side by side.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    window = _window(site, panels)
    left, right, bottom, top = window
    columns = 2 if len(panels) == 4 else min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    tall = min(13.0 / columns * (top - bottom) / (right - left), 7.0) + 0.6
    with rc_context(FONT):
        figure = Figure((13.0, rows * tall + 1.2), dpi=DPI, layout="constrained")
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        drawn = list(zip(grid.flat, panels, strict=False))
        labels = [_slope(axes, site, zone, panel, window) for axes, panel in drawn]
        for axes, _ in drawn:
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.label_outer()
        for axes in grid.flat[len(panels) :]:
            axes.set_visible(False)
        _key(figure, site, site.event_names, envelopes=False)
        write_labels(figure, [(axes, own) for (axes, _), own in zip(drawn, labels, strict=True)])
        save(figure, path)


def released(path: str | os.PathLike[str], passing: Passing, layout: Layout, rows: Rows) -> None:
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
    built, moved = earthworks(site.profile, site.standing(panel.layout), site.slope.surface)
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
    found: Sequence[PassageEnvelope],
    words: str,
) -> None:
    """Draw the envelopes of height and energy, and the height and class of the barriers."""
    for own in found:
        for axes, lines in ((heights, own.height), (energies, own.energy)):
            colour = colour_of(site, own.event)
            draw_quantile(axes, own.stations, lines[0], lines[2], color=colour)
            axes.fill_between(own.stations, lines[1], lines[2], color=colour, alpha=0.2, lw=0)
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
    if any((own.energy[0] > 0.0).any() for own in found):  # otherwise there are no curves
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
    axes.set_ylim(bottom=max(low, high / RATIO))
    plain_numbers(axes.yaxis, (1.0, 2.0, 5.0))


def plain_numbers(axis: Axis, multiples: Sequence[float]) -> None:
    """Write plain numbers at these multiples of powers of ten of a logarithmic axis."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=multiples))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))


RATIO = 1e4
"""Greatest ratio of the ends of a logarithmic axis."""


def _key(figure: FigureBase, site: Site, events: Sequence[str], envelopes: bool = True) -> None:
    """Draw the legend below the picture, with or without the entries for envelopes."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines: list[Any] = []
    for name in events:
        label = f"{name}, {site.event(name).rate:g} a year per 100 m"
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
