"""Picture of a site: ground, sources of rock, forest, existing barriers, barrier zone and road."""

from __future__ import annotations

import os
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Block, Site, seeds
from rigdda.app.reports.pictures import DPI, FONT, save, sources
from rigdda.app.site_check import called
from rigdda.barriers import Earthwork, earthworks
from rigdda.display import OLD
from rigdda.envs.rendering import ROAD, ROCK, Label, draw_barrier, top_of, write_labels
from rigdda.model.site_tables import Origin

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

DRAWN_STEMS, WOOD = 60, "#2e7d32"
"""Stems on the whole length of the picture, and their colour."""

COLOURS = {
    "hard_rock": "#a9a39b",
    "weathered_rock": "#bfae95",
    "coarse_talus": "#d8c08a",
    "fine_scree": "#e6d6a8",
    "hard_soil": "#c79f73",
    "meadow": "#b5cf92",
    "asphalt": "#5f6670",
    "concrete": "#8f9aa5",
}
"""Colour of each ground of the library in pictures."""

OTHER_COLOURS = ("#e0b8a0", "#c4b7d6", "#b8d4d0", "#d9d9d9")
"""Colours of surfaces that name no ground."""

ZONED, STARTS = "#1c5aa0", "#b3261e"
"""Colours of the barrier zone and of sources."""

INCHES = (11.0, 4.2, 9.0)
"""Width, and least and greatest height of the picture."""


def draw(path: str | os.PathLike[str], site: Site) -> None:
    """Write a PNG of the whole section: ground by materials, sources, barrier zone and road."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    points = np.array(site.slope.points)
    long, tall = np.ptp(points, axis=0)
    wide, low, high = INCHES
    height = min(max(low, 1.9 + (wide - 1.0) * 1.2 * tall / long), high)
    with rc_context({**FONT, "text.parse_math": False}):  # names may have the sign of a dollar
        figure = Figure((wide, height), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        bottom = float(points[:, 1].min() - 0.12 * tall)
        _draw_ground(axes, site, bottom)
        _draw_sources(axes, site)
        _draw_forest(axes, site, 0.05 * tall)
        _draw_places(axes, site, 0.03 * tall)
        axes.set_aspect("equal")
        axes.set(
            xlim=(points[0, 0], points[-1, 0]),
            ylim=(bottom, float(points[:, 1].max()) + 0.14 * tall),
        )
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.set_title(site.name, loc="left", fontweight="bold", fontsize=12)
        _draw_survey(axes, site)
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=10)
        write_labels(figure, [(axes, [*_names(site), *_draw_standing(axes, site)])])
        save(figure, path)


def _draw_ground(axes: Axes, site: Site, bottom: float) -> None:
    """Fill the ground below each segment with the colour of its surface."""
    points, names = site.slope.chain()
    used = list(dict.fromkeys(names))
    unknown = iter(OTHER_COLOURS * len(used))
    colours = {n: COLOURS.get(site.surfaces[n].ground) or next(unknown) for n in used}
    told: set[str] = set()
    overhangs = any(b[0] < a[0] for a, b in pairwise(points))
    if overhangs:  # columns below its pieces would lie over one another
        frame = [(points[-1][0], bottom), (points[0][0], bottom)]
        axes.fill(*np.array([*points, *frame]).T, color="#e8e4dc", linewidth=0)
    for (a, b), name in zip(pairwise(points), names, strict=True):
        label = None if name in told else called(site, name)
        told.add(name)
        if overhangs:
            axes.plot([a[0], b[0]], [a[1], b[1]], color=colours[name], linewidth=6, label=label,
                      solid_capstyle="round", zorder=1.5)  # fmt: skip
        else:
            axes.fill([a[0], b[0], b[0], a[0]], [a[1], b[1], bottom, bottom],
                      facecolor=colours[name], edgecolor=colours[name], linewidth=0.8,
                      label=label)  # fmt: skip
    axes.plot(*np.array(points).T, color="#333333", linewidth=1.0, zorder=2)
    axes.plot(*np.array(site.slope.points).T, ".", color="#333333", markersize=4, zorder=2.1,
              label="points of the profile")  # fmt: skip


def _draw_sources(axes: Axes, site: Site) -> None:
    """Draw bands as lines on the ground, and the blocks of masses."""
    for source in site.sources:
        if source.band is None:
            blocks = [Block(outline) for outline in source.cut(seeds.generator(0, 0))]
            for block in blocks:
                axes.fill(*block.vertices.T, facecolor=ROCK, edgecolor="white", linewidth=0.4,
                          zorder=3)  # fmt: skip
    for i, corners in enumerate(sources(site)):
        axes.plot(*corners.T, color=STARTS, linewidth=3.0, zorder=3.2, solid_capstyle="butt",
                  label="rock starts here" if i == 0 else None)  # fmt: skip


def _draw_forest(axes: Axes, site: Site, tall: float) -> None:
    """Draw stems [m] at evenly spaced places of the forests, which are not surveyed places."""
    length = float(np.ptp(np.array(site.slope.points)[:, 0]))
    for i, one in enumerate(site.forest):
        count = max(2, round(DRAWN_STEMS * (one.end - one.start) / length))
        x = np.linspace(one.start, one.end, count)
        foot = np.array([site.profile.height(at) for at in x.tolist()])
        axes.vlines(x, foot, foot + tall, color=WOOD, linewidth=1.6, zorder=2.5,
                    label="forest" if i == 0 else "")  # fmt: skip


def _names(site: Site) -> list[Label]:
    """Return the names of sources and where to write them: at the lower end of bands."""
    found = []
    for source in site.sources:
        if source.band is not None:
            at = source.band[1], site.profile.height(source.band[1])
        else:
            outline = source.outline
            at = tuple(outline[outline[:, 1].argmax()].tolist())
        found.append(Label(source.name, at, STARTS))
    return found


def _draw_standing(axes: Axes, site: Site) -> list[Label]:
    """Draw the barriers that stand already and return their labels."""
    built = site.standing()
    ground, moved = earthworks(site.profile, built, site.soil)
    labels = []
    for barrier, words in zip(built, site.labels(), strict=True):
        outline = moved[barrier] if isinstance(barrier, Earthwork) else barrier.outline(ground)
        draw_barrier(axes, barrier, outline, colour=OLD, old=True)
        labels.append(Label(words, top_of(outline), OLD))
    return labels


def _draw_places(axes: Axes, site: Site, lift: float) -> None:
    """Draw the road and the parts of the zone, and name the toe."""
    ground = site.profile

    def line(start: float, end: float, up: float) -> tuple[Floats, Floats]:
        inner = [x for x, _ in site.slope.points if start < x < end]
        at = np.array([start, *inner, end])
        return at, np.array([ground.height(x) + up for x in at])

    road, toe = site.road, site.slope.toe
    axes.plot(*line(road.start, road.end, 0.0), color=ROAD, linewidth=5, zorder=3.1,
              solid_capstyle="butt", label="road")  # fmt: skip
    for i, (low, high) in enumerate(site.rooms):
        axes.plot(*line(low, high, lift), color=ZONED, linewidth=2.5, zorder=3.1,
                  label="barriers may stand here" if i == 0 else None)  # fmt: skip
    axes.annotate("toe", (toe, ground.height(toe)), xytext=(0, -22), textcoords="offset points",
                  ha="center", fontsize=10, zorder=6,
                  arrowprops={"arrowstyle": "->", "color": "black"})  # fmt: skip


def _draw_survey(axes: Axes, site: Site) -> None:
    """Add the coordinates of the survey on the upper and the right side, if they differ."""
    from matplotlib.ticker import FuncFormatter

    origin = site.origin
    if not origin.surveyed:
        return
    plain = FuncFormatter(lambda value, _: f"{value:,.0f}")
    if origin.chainage or origin.reversed:
        ways: Any = origin.chainage_of, origin.x_of
        above = axes.secondary_xaxis("top", functions=ways)
        above.set_xlabel("chainage of the survey [m]")
        above.xaxis.set_major_formatter(plain)
    if origin.elevation:
        level = Origin(origin.elevation)
        ways = level.chainage_of, level.x_of
        beside = axes.secondary_yaxis("right", functions=ways)
        beside.set_ylabel("elevation of the survey [m]")
        beside.yaxis.set_major_formatter(plain)
