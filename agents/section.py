"""The picture of a slope for who must decide: what comes down, how high, how hard, and what stands.

Above, the slope before and after with the ways of blocks, coloured by event. Below, without
barriers, how high and how hard blocks come by along the slope, with what stands there.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda import Barrier, Ditch, Fence, Layout, Site
from rigdda.agents.flights import Flights, Floats, fly, reach, sources, stations_of
from rigdda.agents.pictures import BARRIER, DPI, FONT, GROUND, ROAD, ZONE, colours, save
from rigdda.agents.wording import short, standing
from rigdda.barriers import Earthwork, earthworks
from rigdda.model.place import BarrierZone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

DRAWN = 30
"""Ways of an event that are drawn: with more the eye sees no less, and no more."""

APART = 8.0
"""Distance of two barriers below which their labels are put one below the other [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One slope of the picture: its title, what stands, and releases of every event."""

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
    """Write the PNG of a slope.

    Parameters
    ----------
    path : path
        The PNG.
    site : Site
        Where.
    zone : BarrierZone
        Where barriers may stand.
    panels : sequence of Panel
        Slopes, side by side or one above the other, to scale.
    envelopes : sequence of Flights
        Releases without barriers, of which heights and energies are shown.
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
        for axes, panel in zip(grid.flat, panels, strict=True):
            _slope(axes, site, zone, panel, bottom)
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.label_outer()
        heights, energies = lower.subplots(1, 2, sharex=True)
        heights.set_xlim(left, right)
        for axes in (heights, energies):
            axes.axvspan(zone.start, zone.end, color=ZONE, alpha=0.25, lw=0)
        _envelopes(heights, energies, site, panels[-1].layout, envelopes)
        _key(lower, site, envelopes)
        save(figure, path)


def released(
    path: str | os.PathLike[str],
    site: Site,
    layout: Layout,
    seeds: Sequence[int],
    event: str | None = None,
) -> None:
    """Write the PNG of releases with a layout, of one event or of all.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.agents.flights.fly` does.
    """
    names = site.event_names if event is None else (event,)
    stations = stations_of(site)
    nothing = [fly(site, (), name, seeds, stations) for name in names]
    after = [fly(site, layout, name, seeds, stations) for name in names] if layout else nothing
    count = sum(flights.releases for flights in after)
    title = f"{site.name}: {count} releases, by event" if event is None else f"{event}: {count}"
    section(path, site, site.barrier_zone, [Panel(title, layout, after)], nothing)


def _window(site: Site) -> tuple[float, float, float, float]:
    """Return left, right, bottom, top of what matters: from the source to beyond the road [m]."""
    x, y = np.array(site.slope.points).T
    pieces = sources(site)
    start = min(reach(piece)[0] for piece in pieces)
    high = max(float(piece[:, 1].max()) for piece in pieces)
    way = site.road.end - start
    left, right = max(start - 0.05 * way, x[0]), min(site.road.end + 0.06 * way, x[-1])
    low = float(y[(x >= left) & (x <= right)].min())
    return left, right, low - 0.1 * (high - low), high + 0.05 * (high - low)


def _slope(axes: Axes, site: Site, zone: BarrierZone, panel: Panel, bottom: float) -> None:
    """Draw one slope: its ground, zone, road and sources, the ways of blocks, what stands."""
    built, moved = earthworks(site.profile, standing(panel.layout), site.slope.surface)
    x, y = built.points.T
    axes.fill_between(x, y, bottom, color=GROUND, linewidth=0, zorder=2)
    axes.plot(*_along(site, zone.start, zone.end), color=ZONE, linewidth=5, zorder=2.5,
              solid_capstyle="butt")  # fmt: skip
    axes.plot(*_along(site, site.road.start, site.road.end), color=ROAD, linewidth=5, zorder=3,
              solid_capstyle="butt")  # fmt: skip
    for flights, colour in zip(panel.flights, colours(len(panel.flights)), strict=True):
        for way in flights.ways[:: max(1, len(flights.ways) // DRAWN)]:
            axes.plot(*way.T, color=colour, linewidth=0.6, alpha=0.55, zorder=4)
    for corners in sources(site):
        axes.plot(*corners.T, color="black", linewidth=2.0, zorder=4.5)
    _barriers(axes, site, panel, moved)
    axes.set_aspect("equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(panel.title, loc="left", fontsize=11)


def _along(site: Site, start: float, end: float) -> tuple[Floats, Floats]:
    """Return the ground between two chainages, x and y [m]."""
    inner = [x for x, _ in site.slope.points if start < x < end]
    at = np.array([start, *inner, end])
    return at, np.array([site.profile.height(x) for x in at])


def _barriers(axes: Axes, site: Site, panel: Panel, moved: Mapping[Barrier, Floats]) -> None:
    """Draw what stands and say what it is, in the ground, where nothing else is drawn."""
    outlines = [
        moved[b] if isinstance(b, Earthwork) else b.outline(site.profile)
        for b in standing(panel.layout)
    ]
    for i, (barrier, outline) in enumerate(zip(standing(panel.layout), outlines, strict=True)):
        dug = isinstance(barrier, Ditch)
        axes.fill(*outline.T, facecolor="white" if dug else BARRIER, edgecolor=BARRIER,
                  linewidth=1.4 if dug else 2.0, zorder=5)  # fmt: skip
        foot = outline[np.argmin(outline[:, 0])]
        axes.annotate(
            short(barrier).replace(", ", ",\n"),
            foot,
            xytext=(-34, -16 - 36 * _near(outlines[:i], outline)),
            textcoords="offset points",
            ha="right",
            va="center",
            color=BARRIER,
            fontweight="bold",
            zorder=7,
            arrowprops={"arrowstyle": "-", "color": BARRIER, "linewidth": 0.9, "shrinkB": 0},
        )
    for i, mesh in enumerate(set(panel.layout) - set(standing(panel.layout))):
        axes.text(0.98, 0.93 - 0.09 * i, short(mesh), ha="right", color=BARRIER,
                  fontweight="bold", transform=axes.transAxes, zorder=7)  # fmt: skip


def _near(others: Sequence[Floats], outline: Floats) -> int:
    """Return how many barriers before one are so near that their labels would meet it."""
    x, y = outline.mean(axis=0)
    return sum(abs(o[:, 0].mean() - x) < APART and abs(o[:, 1].mean() - y) < APART for o in others)


def _envelopes(
    heights: Axes, energies: Axes, site: Site, layout: Layout, envelopes: Sequence[Flights]
) -> None:
    """Draw how high and how hard blocks come by, and the barriers by height and class."""
    for flights, colour in zip(envelopes, colours(len(envelopes)), strict=True):
        heights.plot(flights.stations, flights.height, color=colour, linewidth=1.6)
        energies.plot(flights.stations, flights.energy / 1e3, color=colour, linewidth=1.6)
    for axes in (heights, energies):
        axes.axvspan(site.road.start, site.road.end, color=ROAD, alpha=0.2, lw=0)
        axes.grid(alpha=0.25)
        axes.set_xlabel("x [m]")
    for barrier in standing(layout):
        if not isinstance(barrier, Ditch):
            heights.plot([barrier.x] * 2, [0.0, barrier.height], color=BARRIER, linewidth=4,
                         solid_capstyle="butt")  # fmt: skip
        else:
            heights.axvline(barrier.x, color=BARRIER, linewidth=1, linestyle=":")
        if isinstance(barrier, Fence) and barrier.energy_class is not None:
            energies.plot(barrier.x, barrier.energy_class, "D", color=BARRIER, markersize=8)
        else:
            energies.axvline(barrier.x, color=BARRIER, linewidth=1, linestyle=":")
    if any((flights.energy > 0.0).any() for flights in envelopes):  # else there is nothing to see
        energies.set_yscale("log")
    heights.set_ylim(bottom=0.0)
    heights.set_title("Without barriers: 95 % of block tops pass below [m above ground]",
                      loc="left", fontsize=10)  # fmt: skip
    energies.set_title("Without barriers: 95 % of blocks come with less energy [kJ]",
                       loc="left", fontsize=10)  # fmt: skip


def _key(figure: FigureBase, site: Site, envelopes: Sequence[Flights]) -> None:
    """Say what colours mean, below the picture."""
    from matplotlib.lines import Line2D

    lines = []
    for flights, colour in zip(envelopes, colours(len(envelopes)), strict=True):
        label = f"{flights.event}, {site.event(flights.event).rate:g} a year per 100 m"
        lines.append(Line2D([], [], color=colour, linewidth=2, label=label))
    lines += [
        Line2D([], [], color="black", linewidth=3, label="rock starts here"),
        Line2D([], [], color=ZONE, linewidth=6, label="barriers may stand"),
        Line2D([], [], color=ROAD, linewidth=6, label="road"),
        Line2D([], [], color=BARRIER, marker="D", linewidth=4, label="barrier: height, class"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=min(4, len(lines)),
                  frameon=False)  # fmt: skip
