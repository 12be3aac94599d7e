"""The section of a slope as a Bokeh figure to scale, with ground, road, barriers and paths."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from bokeh.events import PanStart
from bokeh.models import ColumnDataSource, HoverTool, Range1d
from bokeh.plotting import figure
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Site
from rigdda.app.page.locking import on_change
from rigdda.app.page.theme import Theme
from rigdda.app.reports.source_outlines import sources
from rigdda.barriers import Built, Earthwork, earthworks
from rigdda.ground.terrain import Terrain
from rigdda.model.survey import spikes

Floats = NDArray[np.float64]

MARGIN = 0.06
"""Share of the length and the height of the ground that is free around it."""

BORDER = 62
"""Space left of an axis, so that figures below one another are aligned [pixels]."""

WIDTH, HEIGHT = 775, 400
"""Size of the figure in a window 1280 pixels wide, in which it has its least height [pixels]."""

WIDEST = 1400
"""Largest width of the figure, so that what follows it stays visible in a wide window [pixels]."""

MOVED = 1e-6
"""Distance from which on a handle has been moved [m]."""


def plain_axes(plot: Any, theme: Theme) -> None:
    """Give a figure the colours of the page."""
    plot.background_fill_color = plot.border_fill_color = theme.paper
    plot.outline_line_color = None
    plot.grid.grid_line_color = theme.grid
    for axis in plot.axis:
        axis.axis_line_color = axis.major_tick_line_color = theme.quiet
        axis.minor_tick_line_color = None
        axis.major_label_text_color = theme.quiet
        axis.axis_label_text_color = theme.text
        axis.axis_label_text_font_style = "normal"
    for legend in plot.legend:
        legend.background_fill_color = theme.paper
        legend.background_fill_alpha = 0.8
        legend.label_text_color = theme.text
        legend.border_line_color = None


def ground_colour(theme: Theme, used: Sequence[str], name: str) -> str:
    """Return the colour of a ground among those that a slope has, in their order."""
    return theme.grounds[list(used).index(name) % len(theme.grounds)]


class Section:
    """A figure of the slope.

    Parameters
    ----------
    theme : Theme
        The colours.
    name : str
        Title of the figure.
    height : int
        Its height in a window 1280 pixels wide [pixels].
    coordinates : bool
        Whether it shows the coordinates and the inclination of the ground under the cursor.

    Attributes
    ----------
    plot : bokeh.plotting.figure
        The figure.
    """

    def __init__(self, theme: Theme, name: str, height: int = HEIGHT, coordinates: bool = False):
        self.theme, self._coordinates = theme, coordinates
        self.plot = figure(
            min_height=height, max_width=WIDEST, aspect_ratio=WIDTH / height,
            sizing_mode="scale_width", match_aspect=True,
            tools="pan,wheel_zoom,box_zoom,reset", active_scroll="wheel_zoom", active_drag="pan",
            x_axis_label="chainage [metres]", y_axis_label="elevation [metres]",
            toolbar_location="right", name=name, min_border_left=BORDER,
        )  # fmt: skip
        self.plot.toolbar.logo = None
        self.plot.title.text = name
        self.plot.title.text_color = theme.text
        self.plot.title.text_font_style = "normal"
        self._ground = ColumnDataSource({"xs": [], "ys": [], "colour": [], "ground": []})
        self._line = ColumnDataSource({"x": [], "y": [], "slope": []})
        self._road = ColumnDataSource({"x": [], "y": []})
        self._zone = ColumnDataSource({"xs": [], "ys": []})
        self._rock = ColumnDataSource({"xs": [], "ys": []})
        self._standing = ColumnDataSource({"xs": [], "ys": [], "colour": [], "words": []})
        self._odd = ColumnDataSource({"x": [], "y": [], "words": []})
        self.ways = ColumnDataSource({"xs": [], "ys": [], "colour": [], "words": []})
        self._draw()
        plain_axes(self.plot, theme)
        self.plot.legend.location = "top_right"
        self.plot.legend.click_policy = "hide"
        self.plot.legend.label_text_font_size = "12px"

    def _draw(self) -> None:
        plot, theme = self.plot, self.theme
        plot.patches("xs", "ys", source=self._ground, fill_color="colour", line_color="colour")
        self.ways_renderer = plot.multi_line(
            "xs", "ys", source=self.ways, line_color="colour", line_width=1.2, line_alpha=0.75
        )
        self.ways_renderer.nonselection_glyph = None
        line = plot.line("x", "y", source=self._line, line_color=theme.text, line_width=1.5)
        plot.line("x", "y", source=self._road, line_color=theme.road, line_width=7,
                  legend_label="road")  # fmt: skip
        plot.multi_line("xs", "ys", source=self._zone, line_color=theme.accent, line_width=3,
                        line_dash="4 3", legend_label="barriers may stand")  # fmt: skip
        plot.multi_line("xs", "ys", source=self._rock, line_color=theme.rock, line_width=5,
                        legend_label="rock starts here")  # fmt: skip
        plot.patches("xs", "ys", source=self._standing, fill_color="colour", line_color="colour",
                     line_width=3)  # fmt: skip
        odd = plot.scatter("x", "y", source=self._odd, marker="x", size=15, line_width=3,
                           line_color=theme.bad)  # fmt: skip
        plot.add_tools(
            HoverTool(renderers=[odd], description="outliers", tooltips=[("doubtful", "@words")])
        )
        if self._coordinates:
            plot.add_tools(
                HoverTool(
                    renderers=[line], mode="vline", line_policy="prev", description="coordinates",
                    attachment="above",
                    tooltips=[("chainage", "$x{0.00} metres"), ("elevation", "$y{0.00} metres"),
                              ("slope here", "@slope{0.0} degrees")],
                )
            )  # fmt: skip

    def show(self, site: Site, layout: Layout = ()) -> None:
        """Draw a site and a layout, see `graded`; a barrier that cannot stand is left out."""
        self._show_ground(site)
        ground = site.profile
        x = np.array(site.slope.points)[:, 0]

        def line(start: float, end: float, up: float = 0.0) -> tuple[list[float], list[float]]:
            inner = sorted(at for at in x.tolist() if start < at < end)
            at = [start, *inner, end]
            return at, [ground.height(one) + up for one in at]

        tall = float(np.ptp(np.array(site.slope.points)[:, 1]))
        self._road.data = dict(zip("xy", line(site.road.start, site.road.end), strict=True))
        rooms = [line(low, high, 0.02 * tall) for low, high in site.rooms]
        self._zone.data = {"xs": [a for a, _ in rooms], "ys": [b for _, b in rooms]}
        rock = sources(site)
        self._rock.data = {"xs": [r[:, 0] for r in rock], "ys": [r[:, 1] for r in rock]}
        found = spikes(np.array(site.slope.points, dtype=np.float64))
        self._odd.data = {
            "x": [site.slope.points[k][0] for k, _ in found],
            "y": [site.slope.points[k][1] for k, _ in found],
            "words": [f"{abs(h):.1f} metres off both neighbours" for _, h in found],
        }
        self._show_barriers(site, layout)

    def _show_ground(self, site: Site) -> None:
        points, names = site.slope.chain()
        low = min(y for _, y in points)
        bottom = low - 0.12 * (max(y for _, y in points) - low)
        used = list(dict.fromkeys(names))
        data: dict[str, list[Any]] = {"xs": [], "ys": [], "colour": [], "ground": []}
        k = 0
        for name, group in groupby(names):
            count = len(list(group))
            piece = points[k : k + count + 1]
            k += count
            data["xs"].append([x for x, _ in piece] + [piece[-1][0], piece[0][0]])
            data["ys"].append([y for _, y in piece] + [bottom, bottom])
            data["colour"].append(ground_colour(self.theme, used, name))
            data["ground"].append(name)
        self._ground.data = data
        angle = [math.degrees(math.atan2(a[1] - b[1], b[0] - a[0])) for a, b in pairwise(points)]
        self._line.data = {
            "x": [x for x, _ in points], "y": [y for _, y in points], "slope": [*angle, angle[-1]],
        }  # fmt: skip

    def _show_barriers(self, site: Site, layout: Layout) -> None:
        data: dict[str, list[Any]] = {"xs": [], "ys": [], "colour": [], "words": []}
        for barrier, outline, words in graded(site, layout).barriers:
            data["xs"].append(outline[:, 0])
            data["ys"].append(outline[:, 1])
            data["colour"].append(self.theme.accent if barrier in layout else self.theme.quiet)
            data["words"].append(words)
        self._standing.data = data


class Graded(NamedTuple):
    """The slope with a layout, as simulations have it."""

    ground: Terrain
    """The ground with the earthworks of the barriers."""
    barriers: list[tuple[Built, Floats, str]]
    """The barriers that stand, each with its outline and its label."""


def graded(site: Site, layout: Layout) -> Graded:
    """Return the slope with a layout and the existing barriers.

    A barrier that cannot stand together with those before it is returned as it would stand alone,
    and left out if it cannot stand alone either, or removes what is not there.
    """
    found = _graded(site, layout)
    if found is not None:
        return found
    kept: Layout = ()
    apart = []
    for barrier in layout:
        if _graded(site, (*kept, barrier)) is None:
            apart.append(barrier)
        else:
            kept = (*kept, barrier)
    found = _graded(site, kept) or Graded(site.profile, [])
    for barrier in apart:
        alone = _graded(site, (barrier,)) or Graded(site.profile, [])
        found.barriers.extend(one for one in alone.barriers if one[0] == barrier)
    return found


def _graded(site: Site, layout: Layout) -> Graded | None:
    """Return the slope with a layout; None if a barrier of it cannot stand."""
    try:
        built, labels = site.standing(layout), site.labels(layout)
        ground, moved = earthworks(site.profile, built, site.soil)
        corners = [moved[b] if isinstance(b, Earthwork) else b.outline(ground) for b in built]
    except BadInput:
        return None
    return Graded(ground, list(zip(built, corners, labels, strict=True)))


def spanned(values: Sequence[float]) -> Range1d:
    """Return a range that holds values, with a margin."""
    low, high = min(values), max(values)
    margin = MARGIN * (high - low or 1.0)
    return Range1d(low - margin, high + margin)


KEPT = 16
"""Number of positions that were given to the browser and are remembered."""


class HandleSource:
    """Positions of handles that a user drags, shown as glyphs of a plot.

    The browser returns the positions of all handles after each pan of the plot, whether it has
    moved one or not, and perhaps before it has drawn what it was given last. The column `given`
    says which positions its own are based on, so that only handles that it has moved count. If it
    has moved several that lie on top of each other, the nearest to the beginning of the pan counts.

    Parameters
    ----------
    plot : bokeh.plotting.figure
        The plot.
    dragged : callable
        Function of the place of a handle that was dragged, and of its new coordinates.

    Attributes
    ----------
    source : ColumnDataSource
        The positions, with the columns x and y, and perhaps words.
    """

    def __init__(self, plot: Any, dragged: Callable[[int, float, float], None]):
        self.source = ColumnDataSource({"x": [], "y": [], "given": []})
        self._dragged = dragged
        self._count = 0
        self._given: dict[int, tuple[list[float], list[float]]] = {}
        self._start: tuple[float, float] | None = None
        self._showing = False
        plot.on_event(PanStart, self._begin)
        on_change(self.source, "data", self._changed)

    def show(self, data: dict[str, list[Any]]) -> None:
        """Show handles at other positions."""
        self._count += 1
        self._given[self._count] = list(data["x"]), list(data["y"])
        self._given.pop(self._count - KEPT, None)
        self._showing = True
        self.source.data = data | {"given": [self._count] * len(data["x"])}
        self._showing = False

    def _begin(self, event: Any) -> None:
        self._start = (float(event.x), float(event.y))

    def _changed(self, new: Any) -> None:
        if self._showing or not len(new["given"]):
            return
        known = self._given.get(int(new["given"][0]))
        latest = self._given[self._count]
        if known is None or not len(known[0]) == len(new["x"]) == len(latest[0]):
            return
        before = list(zip(*known, strict=True))
        after = [(float(x), float(y)) for x, y in zip(new["x"], new["y"], strict=True)]
        moved = [k for k, old in enumerate(before) if math.dist(old, after[k]) > MOVED]
        if moved:
            start = self._start or before[moved[0]]
            k = min(moved, key=lambda k: math.dist(before[k], start))
            self._dragged(k, *after[k])
