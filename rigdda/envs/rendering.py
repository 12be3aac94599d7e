"""Images of a slope with the ground, the road, the barriers and the blocks.

Matplotlib is imported on first use.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Fence, Layout, Mesh, Run, Site, Terrain
from rigdda.barriers.base import STANDS
from rigdda.display import BARRIER, GROUND, OLD, ROAD, ROCK, ZONE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

Floats = NDArray[np.float64]

SIZE = (8.0, 4.5)
"""Width and height of an image [inch], at 100 pixels per inch."""

PROPORTION = 2.0
"""Aspect ratio of the plotted area: the image without its title and axis labels."""

CUT, FAILED = "#dbe7f3", "#d62846"
"""Colours of the inside of a ditch and of failed barriers."""

MATERIALS = {
    "hard_rock": "#b3aea6",
    "weathered_rock": "#c4b196",
    "coarse_talus": "#dccb9a",
    "fine_scree": "#e8ddba",
    "hard_soil": "#b98d5b",
    "meadow": "#9fbf7f",
    "asphalt": "#5c6066",
    "concrete": "#d3d7dc",
}
"""Colours of surfaces by their ground of the library."""

OTHER_COLOURS = (GROUND, "#b9c4a4", "#d8b9a0", "#a9b7c0", "#cfc0d6")
"""Colours of surfaces without a ground of the library, in turn."""

STRETCH = 0.3
"""Opacity of the band over which a fence may give way."""

POST = 5.0
"""Line width of a fence post [points], wide enough to be visible on a slope of 200 m."""

DASHED = (0.0, (1.2, 0.6))
"""Line style of barriers that stand already."""

BAND = 0.02
"""Thickness of the band that represents mesh, as a share of the height of the image."""

LABEL_GAP = 16.0
"""Distance of a label from the top of its barrier [points]."""


class Label(NamedTuple):
    """Label of a barrier, and the point to which it refers [m]."""

    words: str
    at: tuple[float, float]
    colour: str = BARRIER


def draw(
    axes: Axes,
    run: Run,
    road: tuple[float, float],
    frame: int = -1,
    old: Sequence[Barrier] = (),
) -> None:
    """Draw one frame of a run in metres, with equal axis scales.

    Parameters
    ----------
    axes : matplotlib axes
        Where to draw.
    run : Run
        A release on a slope.
    road : (float, float)
        Chainages of the uphill and downhill edges of the road [m].
    frame : int
        Index of the frame; by default the last.
    old : sequence of Barrier
        Which of the barriers stand already.
    """
    terrain = run.ground
    assert terrain is not None
    x, y = terrain.points.T
    axes.fill_between(x, y, y.min() - np.ptp(y), color=GROUND, linewidth=0)
    inner = x[(x > road[0]) & (x < road[1])]
    lane = [road[0], *inner, road[1]]
    axes.plot(lane, [terrain.height(at) for at in lane], color=ROAD, linewidth=5,
              solid_capstyle="butt")  # fmt: skip
    for i, barrier in enumerate(run.scene.barriers):
        worn = barrier.x in {one.x for one in old}
        stands = run.state(i, frame) == STANDS
        colour = FAILED if not stands else OLD if worn else BARRIER
        start = run.outline(i, 0)
        foot = float(start[:, 0].mean()), float(start[:, 1].max()) - barrier.left_height(0.0)
        draw_barrier(axes, barrier, run.outline(i, frame), foot, colour, worn)
    for i in range(len(run.scene.blocks)):
        axes.fill(*run.corners(i, frame).T, color=ROCK, edgecolor="white", linewidth=0.2,
                  zorder=4)  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def materials(site: Site) -> dict[str, str]:
    """Return the colour of each surface of the ground of a site, by its name."""
    out: dict[str, str] = {}
    for name in dict.fromkeys(site.profile.surfaces):
        library = site.surfaces[name].ground if name in site.surfaces else None
        taken = sum(colour in OTHER_COLOURS for colour in out.values())
        out[name] = (
            MATERIALS[library]
            if library in MATERIALS
            else OTHER_COLOURS[taken % len(OTHER_COLOURS)]
        )
    return out


def draw_ground(axes: Axes, site: Site, ground: Terrain, bottom: float) -> None:
    """Draw the ground in the colours of its materials, see `materials`.

    Parameters
    ----------
    ground : Terrain
        The ground with its earthworks.
    bottom : float
        Elevation down to which it is filled [m].
    """
    colours = materials(site)
    begin = 0
    for name, segments in groupby(ground.surfaces):
        end = begin + len(list(segments))
        x, y = ground.points[begin : end + 1].T
        colour, begin = colours.get(name, GROUND), end
        axes.fill_between(x, y, bottom, color=colour, linewidth=0, alpha=0.55, zorder=2)
        axes.plot(x, y, color=colour, linewidth=4, zorder=2.2, solid_capstyle="butt")
    axes.plot(*ground.points.T, color="#4a4239", linewidth=0.7, zorder=2.4)


def draw_elongation(axes: Axes, site: Site, fence: Fence) -> None:
    """Draw the space downhill of a fence into which it gives way, as a light band."""
    x, path, foot = fence.x, fence.deflection, site.profile.height(fence.x)
    high, low = foot + fence.height, foot + fence.left_height(path)
    corners = [(x, foot), (x, high), (x + path, low), (x + path, foot)]
    axes.fill(*np.array(corners).T, facecolor=BARRIER, edgecolor="none", alpha=STRETCH,
              zorder=4.2)  # fmt: skip


def draw_barrier(
    axes: Axes,
    barrier: Barrier,
    outline: Floats,
    foot: tuple[float, float] | None = None,
    colour: str = BARRIER,
    old: bool = False,
) -> None:
    """Draw a barrier: a fence as a post, a ditch as a hatched cut, all others as filled bodies.

    Parameters
    ----------
    axes : matplotlib axes
        Where to draw.
    barrier : Barrier
        Any barrier except mesh.
    outline : (n, 2) array
        Its corners; for an earthwork those of the soil that was moved [m].
    foot : (float, float), optional
        Foot of the posts of a fence, which lean downhill after a deflection [m]; by default
        vertically below the top.
    colour : str
        Colour of its faces and edges.
    old : bool
        Whether it stands already; then its lines are dashed.
    """
    line = DASHED if old else "solid"
    if isinstance(barrier, Fence):
        x, top = outline[2:].mean(axis=0).tolist()
        foot = foot or (x, top - barrier.height)
        axes.plot([foot[0], x], [foot[1], top], color=colour, linewidth=POST, linestyle=line,
                  solid_capstyle="butt", zorder=3.5)  # fmt: skip
    elif barrier.drawn == "line":
        axes.fill(*outline.T, facecolor=CUT, edgecolor=colour, hatch="////", linewidth=1.5,
                  linestyle=line, zorder=3)  # fmt: skip
    else:
        face = "white" if old else colour
        axes.fill(*outline.T, facecolor=face, edgecolor=colour, linewidth=1.5, linestyle=line,
                  zorder=3)  # fmt: skip


def draw_mesh(axes: Axes, site: Site, mesh: Mesh, thickness: float) -> tuple[float, float]:
    """Draw mesh as a hatched band over the rock that it holds; return its lower end.

    Parameters
    ----------
    axes : matplotlib axes
        Where to draw.
    site : Site
        The site.
    mesh : Mesh
        The mesh.
    thickness : float
        Thickness of the band [m].
    """
    x, y = site.ground_between(*site.mesh_span(mesh.option)).T
    axes.fill_between(x, y, y + thickness, facecolor="white", edgecolor=BARRIER, hatch="xxxx",
                      linewidth=1.0, zorder=3.5)  # fmt: skip
    return float(x[-1]), float(y[-1] + thickness)


def name_places(axes: Axes, site: Site, zone: tuple[float, float]) -> None:
    """Draw the barrier zone as a line on the ground, and label it and the road from below."""
    x, y = site.ground_between(*zone).T
    axes.plot(x, y, color=ZONE, linewidth=5, solid_capstyle="butt", zorder=2.5)
    for words, (start, end), side in (
        ("barrier zone", zone, "right"),
        ("road", (site.road.start, site.road.end), "center"),
    ):
        middle = 0.5 * (start + end)
        axes.annotate(
            words,
            (middle, site.profile.height(middle)),
            xytext=(-6 if side == "right" else 0, -8),
            textcoords="offset points",
            ha=side,
            va="top",
            fontsize=9,
            zorder=6,
        )


def write_labels(figure: Figure, labels: Sequence[tuple[Axes, Sequence[Label]]]) -> None:
    """Write the labels of each axes of a figure above their points without overlaps.

    The limits of the axes must be final; their places are no longer changed by the layout of the
    figure. Each label starts above its point, moves up if another label is in the way, and moves
    left if it would leave the axes.
    """
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes, own in labels:
        _write_labels(axes, own, figure.dpi / 72.0)


def _write_labels(axes: Axes, labels: Sequence[Label], point: float) -> None:
    """Write labels above their points; `point` is the size of a point in pixels."""
    frame = axes.get_window_extent()
    font: dict[str, Any] = {"fontsize": 9, "fontweight": "bold"}
    taken: list[Bbox] = []
    for label in sorted(labels, key=lambda one: -one.at[0]):
        x, y = axes.transData.transform(label.at)
        measured = axes.text(*label.at, label.words, **font)
        box = measured.get_window_extent()
        measured.remove()
        left = max(min(x, frame.x1 - box.width), frame.x0)
        bottom = min(_free(taken, left, box, y + LABEL_GAP * point), frame.y1 - box.height)
        begins = min(max((x - left) / box.width, 0.0), 1.0)  # where the leader line meets the label
        axes.annotate(
            label.words,
            label.at,
            xytext=((left - x) / point, (bottom - y) / point),
            textcoords="offset points",
            va="bottom",
            color=label.colour,
            zorder=7.0 - 0.01 * len(taken),  # so that its leader line passes behind other labels
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.0},
            arrowprops={
                "arrowstyle": "-", "color": label.colour, "shrinkA": 0.0, "shrinkB": 0.0,
                "relpos": (begins, 0.0),
            },
            **font,
        ).set_in_layout(False)  # fmt: skip
        taken.append(box.translated(left - box.x0, bottom - box.y0))


def _free(taken: Sequence[Bbox], left: float, box: Bbox, bottom: float) -> float:
    """Return the lowest position >= `bottom` at which a label overlaps no other [pixels]."""
    for other in sorted(taken, key=lambda one: one.y0):
        apart = left >= other.x1 + 4.0 or left + box.width <= other.x0 - 4.0
        if not apart and bottom < other.y1 + 2.0 and bottom + box.height > other.y0 - 2.0:
            bottom = other.y1 + 4.0
    return bottom


def picture(run: Run, site: Site, layout: Layout, title: str) -> NDArray[np.uint8]:
    """Return the last frame of a release as an RGB image, (450, 800, 3).

    Parameters
    ----------
    run : Run
        A release on the site with the layout.
    site, layout : Site, tuple of Barrier
        The site and the layout.
    title : str
        Title of the image.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(
        SIZE, dpi=100, layout="constrained"
    )  # not registered with pyplot: need not be closed
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw(axes, run, (site.road.start, site.road.end), old=site.existing_barriers)
    name_places(axes, site, (site.barrier_zone.start, site.barrier_zone.end))
    axes.set_title(title, parse_math=False)
    left, right, bottom, top = window(run, site)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    labels = []
    for i, words in enumerate(site.labels(layout)):
        state, top_point = run.state(i), top_of(run.outline(i))
        if state == STANDS:
            colour = OLD if words.startswith("existing") else BARRIER
            labels.append(Label(words, top_point, colour))
        else:
            labels.append(Label(f"{words}: {state}", top_point, FAILED))
    for mesh in layout:
        if isinstance(mesh, Mesh):
            labels.append(Label(mesh.label, draw_mesh(axes, site, mesh, BAND * (top - bottom))))
    write_labels(figure, [(axes, labels)])
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def top_of(outline: Floats) -> tuple[float, float]:
    """Return the middle of the top of an outline [m]."""
    return float(outline[:, 0].mean()), float(outline[:, 1].max())


def window(run: Run, site: Site) -> tuple[float, float, float, float]:
    """Return the left, right, bottom and top limits for the last frame of a run [m].

    They range from the highest source or block to beyond the road or the furthest block.
    """
    blocks = np.concatenate(
        [run.corners(i, f) for i in range(len(run.scene.blocks)) for f in (0, -1)]
    )
    points = np.array(site.slope.points)
    left = min(blocks[:, 0].min(), site.barrier_zone.start)
    right = max(blocks[:, 0].max(), site.road.end)
    way = right - left
    left, right = max(left - 0.08 * way, points[0, 0]), min(right + 0.06 * way, points[-1, 0])
    y = site.ground_between(left, right)[:, 1]
    high = max(float(y.max()), blocks[:, 1].max())
    tall = high - y.min()
    bottom, top = float(y.min()) - 0.15 * tall, high + 0.2 * tall
    wider = max(PROPORTION * (top - bottom) - (right - left), 0.0)
    taller = max((right - left) / PROPORTION - (top - bottom), 0.0)
    return left - 0.5 * wider, right + 0.5 * wider, bottom - 0.3 * taller, top + 0.7 * taller
