"""Pictures of a slope in section and of cost against risk.

The section shows the trajectories of blocks, the barriers, and envelopes of the heights and the
energies of the blocks.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Fence, Layout, Mesh, Run, Simulation, Site
from rigdda.barriers import Earthwork, earthworks, standing
from rigdda.display import BARRIER, GROUND, ROAD, ZONE
from rigdda.envs import Evaluation
from rigdda.envs.rendering import (
    BAND,
    Label,
    draw_barrier,
    draw_mesh,
    name_places,
    top_of,
    write_labels,
)
from rigdda.files import atomic
from rigdda.geometry import polygon_properties
from rigdda.model.site_tables import BarrierZone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, FigureBase

Floats = NDArray[np.float64]

QUANTILE = 0.95
"""Quantile that the envelopes show [-]."""

LEAST = 20
"""Least number of blocks that must pass a chainage for a meaningful 95 % quantile."""

BLOCKS = 60
"""Number of blocks of an event that are simulated, rounded up to whole releases."""

STATIONS = 60
"""Number of chainages of an envelope."""

EVERY = 0.05
"""Time between two points of a trajectory [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """Releases of one event.

    Parameters
    ----------
    event : str
        Name of the event.
    releases : int
        Number of releases.
    ways : tuple of (n, 2) array
        Trajectory of the centroid of each block [m].
    run : Run
        The first release.
    stations : (K,) array
        Chainages of the envelopes [m], ascending.
    height : (K,) array
        95 % quantile of the height of the tops of passing blocks above the ground [m]. The top is
        the height of the centroid plus the circumscribed radius. NaN where fewer than 20 blocks
        pass.
    energy : (K,) array
        95 % quantile of the energy of translation and rotation of passing blocks [J]. The width of
        a block is taken as the square root of its area.
    """

    event: str
    releases: int
    ways: tuple[Floats, ...]
    run: Run
    stations: Floats
    height: Floats
    energy: Floats


def fly(site: Site, layout: Layout, event: str, seeds: Sequence[int], stations: Floats) -> Flights:
    """Simulate releases of an event in threads on all cores.

    The seeds are used in order until `BLOCKS` blocks have been released.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope.
    Diverged
        If a simulation diverges.
    """
    barriers = standing(layout)
    first = _run(site, barriers, event, seeds[0], stations)
    more = seeds[1 : max(1, -(-BLOCKS // len(first.scene.blocks)))]
    with ThreadPoolExecutor() as pool:
        rest = pool.map(lambda seed: _run(site, barriers, event, seed, stations), more)
        runs = [first, *rest]
    height, energy = _passage_envelopes(runs, len(stations))
    ways = tuple(run.poses[:, i, :2] for run in runs for i in range(run.poses.shape[1]))
    return Flights(event, len(runs), ways, first, stations, height, energy)


def _run(site: Site, layout: Layout, event: str, seed: int, stations: Floats) -> Run:
    scene = site.realise(layout, seed, event)
    simulation = Simulation(scene, site.settings(scene), tuple(stations.tolist()))
    return simulation.run(site.motion.duration, EVERY)


def stations_of(site: Site) -> Floats:
    """Return the chainages of the envelopes: from the highest source to the road's far edge [m]."""
    left = max(site.slope.points[0][0], min(start for start, _ in map(reach, sources(site))))
    return np.linspace(left, site.road.end, STATIONS + 1)[1:]


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


def _passage_envelopes(runs: Sequence[Run], stations: int) -> tuple[Floats, Floats]:
    """Return the 95 % quantiles of heights [m] and of energies [J] at each station."""
    height, energy = np.full(stations, np.nan), np.full(stations, np.nan)
    sizes = [np.array([_size(block.vertices) for block in run.scene.blocks]) for run in runs]
    for k in range(stations):
        tops, works = [], []
        for run, size in zip(runs, sizes, strict=True):
            crossed = run.crossings(k)
            radius, width = size[crossed["block"]].T
            tops.append(crossed["height"] + radius)
            works.append(crossed["energy"] * width)
        if sum(map(len, tops)) >= LEAST:
            height[k] = np.quantile(np.concatenate(tops), QUANTILE)
            energy[k] = np.quantile(np.concatenate(works), QUANTILE)
    return height, energy


def _size(vertices: Floats) -> tuple[float, float]:
    """Return a block's circumscribed radius about its centroid and the root of its area [m]."""
    area, centre, _ = polygon_properties(vertices)
    return float(np.hypot(*(vertices - centre).T).max()), float(np.sqrt(area))


__all__ = ["BARRIER", "DPI", "FONT", "GROUND", "ROAD", "ZONE", "Point", "colours", "cost", "save"]

TRIED, EQUAL = "#9aa5b1", "#c8ccd0"
EVENTS = ("#0072b2", "#d0312d", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7b4fb0", "#6b4226")
"""Colours of events, chosen to be distinguishable with colour blindness as far as possible."""

MARKERS = ("o", "^", "s", "D", "P", "X")
FONT: dict[Any, Any] = {"font.size": 11, "axes.spines.top": False, "axes.spines.right": False}
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
        axes.plot([e.capital for e in tried], [e.harm + e.repair for e in tried], ".", color=TRIED,
                  markersize=4, alpha=0.6, zorder=2,
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
    if not tried:
        return words
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


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG atomically."""
    with atomic(path) as part:
        figure.savefig(part, format="png")


DRAWN = 30
"""Largest number of trajectories of an event that are drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One slope of the picture with its title, its layout and releases of every event."""

    title: str
    layout: Layout
    flights: Sequence[Flights]


def section(
    path: str | os.PathLike[str],
    site: Site,
    zone: BarrierZone,
    panels: Sequence[Panel],
    envelopes: Sequence[Flights],
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
    envelopes : sequence of Flights
        Releases without barriers, whose heights and energies are shown.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    window = _window(site)
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
        _envelopes(heights, energies, site, panels[-1].layout, envelopes)
        _key(lower, site, envelopes)
        for axes, own in zip(grid.flat, labels, strict=True):
            write_labels(axes, own)
        save(figure, path)


def released(
    path: str | os.PathLike[str],
    site: Site,
    layout: Layout,
    seeds: Sequence[int],
    event: str | None = None,
) -> None:
    """Write a PNG picture of releases with a layout, of one event or of all events.

    Raises
    ------
    BadInput, Diverged
        The same errors as `fly`.
    """
    names = site.event_names if event is None else (event,)
    stations = stations_of(site)
    nothing = [fly(site, (), name, seeds, stations) for name in names]
    after = [fly(site, layout, name, seeds, stations) for name in names] if layout else nothing
    count = sum(flights.releases for flights in after)
    title = f"{site.name}: {count} releases, by event" if event is None else f"{event}: {count}"
    section(path, site, site.barrier_zone, [Panel(title, layout, after)], nothing)


def _window(site: Site) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of the picture, from the sources to the road [m]."""
    x, y = np.array(site.slope.points).T
    pieces = sources(site)
    start = min(reach(piece)[0] for piece in pieces)
    high = max(float(piece[:, 1].max()) for piece in pieces)
    way = site.road.end - start
    left, right = max(start - 0.05 * way, x[0]), min(site.road.end + 0.06 * way, x[-1])
    low = float(y[(x >= left) & (x <= right)].min())
    return left, right, low - 0.1 * (high - low), high + 0.05 * (high - low)


def _slope(
    axes: Axes, site: Site, zone: BarrierZone, panel: Panel, window: tuple[float, ...]
) -> list[Label]:
    """Draw the ground, zone, road, sources, trajectories and barriers of one slope.

    Return the labels of the barriers, which are written when the size of the axes is final.
    """
    built, moved = earthworks(site.profile, standing(panel.layout), site.slope.surface)
    x, y = built.points.T
    *_, bottom, top = window
    axes.fill_between(x, y, bottom, color=GROUND, linewidth=0, zorder=2)
    axes.plot(*site.ground_between(site.road.start, site.road.end).T, color=ROAD, linewidth=5,
              zorder=3, solid_capstyle="butt")  # fmt: skip
    name_places(axes, site, (zone.start, zone.end))
    for flights, colour in zip(panel.flights, colours(len(panel.flights)), strict=True):
        for way in flights.ways[:: max(1, len(flights.ways) // DRAWN)]:
            axes.plot(*way.T, color=colour, linewidth=0.6, alpha=0.55, zorder=4)
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
    for built in standing(layout):
        outline = moved[built] if isinstance(built, Earthwork) else built.outline(site.profile)
        draw_barrier(axes, built, outline)
        labels.append(Label(built.label, top_of(outline)))
    return labels


def _envelopes(
    heights: Axes, energies: Axes, site: Site, layout: Layout, envelopes: Sequence[Flights]
) -> None:
    """Draw the envelopes of height and energy, and the height and class of the barriers."""
    for flights, colour in zip(envelopes, colours(len(envelopes)), strict=True):
        heights.plot(flights.stations, flights.height, color=colour, linewidth=1.6)
        energies.plot(flights.stations, flights.energy / 1e3, color=colour, linewidth=1.6)
    for axes in (heights, energies):
        axes.axvspan(site.road.start, site.road.end, color=ROAD, alpha=0.2, lw=0)
        axes.grid(alpha=0.25)
        axes.set_xlabel("x [m]")
    for barrier in standing(layout):
        tall = barrier.left_height(0.0)
        if tall > 0.0:
            heights.plot([barrier.x] * 2, [0.0, tall], color=BARRIER, linewidth=4,
                         solid_capstyle="butt")  # fmt: skip
        else:
            heights.axvline(barrier.x, color=BARRIER, linewidth=1, linestyle=":")
        if isinstance(barrier, Fence) and barrier.energy_class is not None:
            energies.plot(barrier.x, barrier.energy_class, "D", color=BARRIER, markersize=8)
        else:
            energies.axvline(barrier.x, color=BARRIER, linewidth=1, linestyle=":")
    if any((flights.energy > 0.0).any() for flights in envelopes):  # otherwise there are no curves
        energies.set_yscale("log")
    heights.set_ylim(bottom=0.0)
    heights.set_title("Without barriers: 95 % quantile of block tops [m above ground]",
                      loc="left", fontsize=10)  # fmt: skip
    energies.set_title("Without barriers: 95 % quantile of the energy of blocks [kJ]",
                       loc="left", fontsize=10)  # fmt: skip


def _key(figure: FigureBase, site: Site, envelopes: Sequence[Flights]) -> None:
    """Draw the legend below the picture."""
    from matplotlib.lines import Line2D

    lines = []
    for flights, colour in zip(envelopes, colours(len(envelopes)), strict=True):
        label = f"{flights.event}, {site.event(flights.event).rate:g} per year and 100 m"
        lines.append(Line2D([], [], color=colour, linewidth=2, label=label))
    lines += [
        Line2D([], [], color="black", linewidth=3, label="rock source"),
        Line2D([], [], color=ZONE, linewidth=6, label="barrier zone"),
        Line2D([], [], color=ROAD, linewidth=6, label="road"),
        Line2D([], [], color=BARRIER, marker="D", linewidth=4, label="barrier: height, class"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=min(4, len(lines)),
                  frameon=False)  # fmt: skip
