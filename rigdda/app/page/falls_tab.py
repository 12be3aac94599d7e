"""The tab Falls: releases as they are computed, where they end, a collector, and replays."""

from __future__ import annotations

import html
import shlex
import threading
import traceback
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.events import Tap
from bokeh.models import ColumnDataSource, HoverTool, LinearAxis, PointDrawTool, Range1d
from bokeh.plotting import figure

from rigdda import Error
from rigdda.app.page.barriers_tab import shown, ways
from rigdda.app.page.falls import ENDS, Fall, Release, nearest, shares
from rigdda.app.page.forms import button, heading, in_words, legend, paragraph, table
from rigdda.app.page.locking import holding, on_change, watch
from rigdda.app.page.replays import replay_arguments
from rigdda.app.page.section import BORDER, WIDEST, Section, plain_axes
from rigdda.app.page.state import LAYOUT
from rigdda.app.page.theme import SCALE, SERIES, TALL
from rigdda.app.reports import simulation_report, stations
from rigdda.app.reports.stations import QUANTITIES, Passing
from rigdda.passages import Passages, passages

if TYPE_CHECKING:
    from rigdda.app.page.workspace import Host

BATCH = 200
"""Number of releases of one press of the button."""

SMALL = 140
"""Height of a small figure [pixels]."""

WIDE = 430
"""Width of the column of figures [pixels]."""

BY_END, BY_EVENT, BY_SPEED, BY_ENERGY = (
    "where it ends", "event", "greatest speed", "greatest energy",
)  # fmt: skip
"""What colours the paths."""

END_COLOURS = dict(zip(ENDS.values(), (SERIES[k] for k in (4, 2, 5, 1, 3)), strict=True))
"""Colour of each end."""

COLLECTED = ("energy", "velocity", "height", "height_normal")
"""Quantities of the collector."""

BINS = 24
"""Number of intervals of the histogram."""

HEAD = 1.08
"""Quotient of the top of an axis and the greatest value that it shows."""

REACH = 0.015
"""Distance from a click in which a path is found, as a share of the width of the figure."""


class Passed:
    """Passages at the collector and along the slope, computed by a thread.

    They are those that `rigdda simulate` computes for the same releases. The figures are of one
    event, so that they do not depend on its rate, which may be that of arrivals.

    Attributes
    ----------
    found : Passing or None
        The passages at the station; None until they are computed.
    slope : list of dict or None
        The rows along the slope, as in along_slope.csv.
    fault : str
        Why nothing was computed; empty if it was.
    """

    def __init__(self, site: Any, layout: Any, event: str, releases: int, station: float):
        self.site, self.layout, self.event = site, layout, event
        self.releases, self.station = releases, station
        self.found: Passing | None = None
        self.rows: list[dict[str, Any]] = []
        self.slope: list[dict[str, Any]] | None = None
        self.fault = ""
        self._thread = threading.Thread(target=self._work, name="collector", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Do nothing: the passages are computed at once."""

    def join(self) -> None:
        """Wait until the passages are computed."""
        self._thread.join()

    def _work(self) -> None:
        try:
            seeds = [(seed, self.event) for seed in range(self.releases)]
            even = simulation_report.along(self.site).tolist()
            lines = sorted({*even, self.station})
            found: Passages = passages(self.site, self.layout, seeds, lines)
            passing = Passing(self.site, [self.event], np.ones(len(self.site.events)), found)
            self.rows = stations.summary(passing, [lines.index(self.station)], names=COLLECTED)
            places = [lines.index(x) for x in even]
            self.slope = stations.summary(
                passing, places, [self.event], ("energy", "velocity", "height_top")
            )
            self.found = passing
        except Error as error:
            self.fault = str(error)
        except Exception as error:  # shown on the page
            traceback.print_exc()
            self.fault = f"{type(error).__name__}: {error}"


class FallsTab:
    """The tab Falls."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.section = Section(self.theme, "Releases; a click on a path replays it", 280)
        self._release: Release | None = None
        self._passed: Passed | None = None
        self._shown: Any = None
        self._drawn = 0
        self._for: Any = None
        self._replayed: Fall | None = None
        self._event = pn.widgets.Select(label="Event", options=[], width=150)
        self._built = pn.widgets.Checkbox(label="With the layout", value=True, margin=(24, 8))
        self._by = pn.widgets.Select(
            label="Colour by", options=[BY_END, BY_EVENT, BY_SPEED, BY_ENERGY], width=150
        )
        self._go = button(f"Release {BATCH}", self._more, primary=True, margin=(18, 8))
        self._stop = button("Stop", self._end, margin=(18, 8))
        self._status = pn.pane.HTML("", margin=(22, 8), width=300)
        self._legend = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._shares = pn.pane.HTML("", width=WIDE - 40)
        self._collector = pn.pane.HTML("", width=WIDE - 40)
        self._station = pn.widgets.FloatInput(label="Collector at chainage [metres]", width=185)
        labels = {in_words(QUANTITIES[q].words, QUANTITIES[q].unit): q for q in COLLECTED}
        self._what = pn.widgets.Select(label="Quantity", options=labels, width=185)
        self._command = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._envelope = ColumnDataSource({"x": [], "energy": [], "height": []})
        self._bars = ColumnDataSource({"left": [], "right": [], "top": []})
        self._curve = ColumnDataSource({"x": [], "y": []})
        self._line = ColumnDataSource({"x": [], "y": [], "words": []})
        self._block = ColumnDataSource({"xs": [], "ys": []})
        self._hits = ColumnDataSource({"x": [], "y": []})
        self._track = ColumnDataSource({"x": [], "energy": [], "height": []})
        self._time = pn.widgets.FloatSlider(
            label="Time of the replay [seconds]",
            start=0.0,
            end=1.0,
            step=0.02,
            width=280,
        )
        self._play = pn.widgets.Toggle(label="Play", width=80, margin=(12, 8))
        self._rerun = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._view = button("Open in rerun", self._open_viewer, margin=(12, 8))
        self._viewed = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._draw()
        for widget in (self._event, self._built):
            watch(widget, self._reset)
        watch(self._by, self._recolour)
        watch(self._station, self._moved)
        watch(self._what, self._show_collector)
        watch(self._time, self._show_block)
        self._replaying = pn.Column(
            heading("Replay"), pn.Row(self._time, self._play), self._rerun, self._view,
            self._viewed, self._tracks, visible=False,
        )  # fmt: skip
        self._put = pn.Row(self._event, self._built, self._by, self._go, self._stop, self._status)
        self.panel = pn.Row(
            pn.Column(self._put, self._legend, self.section.plot, self._envelopes, self._heights,
                      self._command,
                      sizing_mode="stretch_width"),
            pn.Column(self._replaying, self._shares, heading("Collector"),
                      pn.Row(self._station, self._what), self._histogram, self._collector,
                      width=WIDE, scroll=True, styles=TALL),
            sizing_mode="stretch_width",
        )  # fmt: skip

    def show(self) -> None:
        """Show the site and the layout as they are now."""
        if not self.project.has_site:
            self._status.object = paragraph("Import a survey first, in the tab Slope.")
            return
        site, layout = self.project.site, self.project.layout
        self.section.show(site, layout if self._built.value else ())
        if self._for == (site, layout):
            return
        self._for = site, layout
        if self._event.options != list(site.event_names):
            self._event.options = list(site.event_names)
            self._event.value = site.event_names[0]
        low, high = site.slope.points[0][0], site.slope.points[-1][0]
        if self._station.value is None or not low < self._station.value < high:
            self._station.value = site.road.start
        if self._station.value == 0.0 and site.road.start != 0.0:
            self._station.value = site.road.start
        self._reset()

    def tick(self) -> None:
        """Show the releases that were computed meanwhile."""
        self._stream()
        if self._passed is not None and self._passed is not self._shown:
            if self._passed.fault:
                self._collector.object = paragraph(self._passed.fault)
                self._shown = self._passed
            elif self._passed.found is not None:
                self._shown = self._passed
                self._show_collector()
                self._show_envelopes()
        if self._replaying.visible and self._viewed.object != (now := self._viewing_words()):
            self._viewed.object = now
        if self._play.value and self._replayed is not None:
            later = self._time.value + 0.05
            self._play.value = later <= self._time.end
            self._time.value = min(later, self._time.end)

    def _draw(self) -> None:
        plot, theme = self.section.plot, self.theme
        plot.patches("xs", "ys", source=self._block, fill_color=theme.rock, line_color=theme.text,
                     line_width=2)  # fmt: skip
        plot.scatter("x", "y", source=self._hits, marker="star", size=10, fill_color=theme.bad,
                     line_color=theme.bad)  # fmt: skip
        plot.line("x", "y", source=self._line, line_color=theme.accent, line_width=2,
                  line_dash="6 3", legend_label="collector")  # fmt: skip
        grip = plot.scatter("x", "y", source=self._line, marker="circle", size=13, line_width=2,
                            fill_color=theme.paper, line_color=theme.accent)  # fmt: skip
        drag = PointDrawTool(renderers=[grip], add=False, description="drag the collector")
        plot.add_tools(
            drag,
            HoverTool(renderers=[self.section.ways_renderer], tooltips=[("", "@words")],
                      description="names of the paths"),
        )  # fmt: skip
        plot.toolbar.active_drag = drag
        on_change(self._line, "data", self._dragged)
        # a tool for taps would disable the tool that drags the collector, which takes taps, too
        plot.on_event(Tap, lambda event: holding(partial(self._tapped, event)))
        self._envelopes = self._small(
            "95 % of passing blocks are below", "", "energy [kJ]", plot.x_range
        )  # fmt: skip
        self._envelopes.line("x", "energy", source=self._envelope, line_color=SERIES[0],
                             line_width=2)  # fmt: skip
        self._heights = self._small(
            "Highest point of 95 % of passing blocks above the ground", "chainage [metres]",
            "height [m]", plot.x_range,
        )  # fmt: skip
        self._heights.line("x", "height", source=self._envelope, line_color=SERIES[2],
                           line_width=2)  # fmt: skip
        self._histogram = self._small("Blocks that pass the collector", "value", "blocks", None)
        self._histogram.quad(left="left", right="right", top="top", bottom=0, source=self._bars,
                             fill_color=SERIES[0], line_color=theme.paper)  # fmt: skip
        self._beside(self._histogram, "share", "share below [%]").end = 100.0 * HEAD
        self._histogram.line("x", "y", source=self._curve, line_color=SERIES[1], line_width=2,
                             y_range_name="share")  # fmt: skip
        self._tracks = self._small(
            "Energy, and height of the centre above ground (dashed)", "chainage [metres]",
            "energy [kJ]", None,
        )  # fmt: skip
        self._tracks.line("x", "energy", source=self._track, line_color=SERIES[0], line_width=2)
        self._above = self._beside(self._tracks, "height", "height [m]")
        self._tracks.line("x", "height", source=self._track, line_color=SERIES[1], line_width=2,
                          line_dash="4 2", y_range_name="height")  # fmt: skip

    def _beside(self, plot: Any, name: str, label: str) -> Range1d:
        """Give a figure a second vertical axis, in the colour of its line, and return its range."""
        found = Range1d(0, 1)
        plot.extra_y_ranges[name] = found
        axis = LinearAxis(y_range_name=name, axis_label=label)
        plot.add_layout(axis, "right")
        plain_axes(plot, self.theme)
        axis.axis_label_text_color = SERIES[1]
        axis.ticker.desired_num_ticks = 4
        return found

    def _small(self, title: str, x: str, y: str, x_range: Any) -> Any:
        """Return a small figure."""
        plot = figure(height=SMALL, max_width=WIDEST, sizing_mode="stretch_width", tools="",
                      title=title, min_border_left=BORDER,
                      x_axis_label=x, y_axis_label=y, toolbar_location=None, visible=False,
                      x_range=Range1d(0, 1) if x_range is None else x_range,
                      y_range=Range1d(0, 1))  # fmt: skip
        plot.title.text_color = self.theme.text
        plot.title.text_font_style = "normal"
        plot.yaxis.ticker.desired_num_ticks = 4
        plain_axes(plot, self.theme)
        return plot

    def _reset(self) -> None:
        """Forget the releases, as something that they depend on has changed."""
        if self._release is not None:
            self._release.stop()
        self._release, self._passed, self._shown, self._replayed = None, None, None, None
        self._drawn = 0
        self.section.ways.data = {"xs": [], "ys": [], "colour": [], "words": []}
        for source in (self._envelope, self._bars, self._curve, self._block, self._hits,
                       self._track):  # fmt: skip
            source.data = {name: [] for name in source.data}
        for plot in (self._envelopes, self._heights, self._histogram, self._tracks):
            plot.visible = False
        self._shares.object = self._collector.object = self._rerun.object = ""
        self._status.object = paragraph("Nothing is released yet.")
        self._replaying.visible = False
        self._viewed.object = ""
        self._command.object = ""
        if self.project.has_site:
            self.section.show(self.project.site, self._layout)
            self._show_line()
        self._show_legend()

    @property
    def _layout(self) -> Any:
        return self.project.layout if self._built.value else ()

    def _more(self) -> None:
        """Release more rock."""
        self.show()  # the button may be quicker than the tab
        if not self.project.has_site or not self._event.value:
            return
        if self._release is None:
            self._release = Release(self.project.site, self._layout, self._event.value)
            self.page.workspace.workers.add(self._release)
        self._release.more(BATCH)

    def _end(self) -> None:
        if self._release is not None:
            self._release.stop()

    def _stream(self) -> None:
        release = self._release
        if release is None:
            return
        if len(release.falls) > self._drawn:
            new = release.falls[self._drawn :]
            self._drawn += len(new)
            if self._by.value in (BY_SPEED, BY_ENERGY):
                self._recolour()
            else:
                self.section.ways.stream(ways(new, self._colour))
            self._show_shares()
        words = f"{release.done:,} of {release.asked:,} releases"
        self._status.object = paragraph(release.fault or words)
        idle = not release.running and release.done
        if idle and (self._passed is None or self._passed.releases != release.done):
            self._collect()

    def _collect(self) -> None:
        """Compute what passes the collector, of the releases that are shown."""
        release = self._release
        if release is None or not release.done or release.running or self._station.value is None:
            return
        self._passed = Passed(
            self.project.site, self._layout, self._event.value, release.done,
            float(self._station.value),
        )  # fmt: skip
        self.page.workspace.workers.add(self._passed)
        self._collector.object = paragraph("What passes the collector is being computed.")
        self._show_command(release.done)

    def _show_command(self, count: int) -> None:
        project = self.project
        parts = ["rigdda", "simulate", str(project.where.site)]
        if self._layout:
            parts += ["--layout", str(project.folder / "layout.toml")]
        parts += ["--event", self._event.value, "--releases", str(count)]
        parts += ["--station", f"{self._station.value:.10g}", "--seed", "0"]
        words = f"<p style='margin:6px 0 0;color:{self.theme.quiet}'>The same figures:</p>"
        self._command.object = words + f"<code>{html.escape(shlex.join(parts))}</code>"

    def _colour(self, fall: Fall) -> str:
        match self._by.value:
            case "event":
                names = self.project.site.event_names
                return SERIES[names.index(fall.event) % len(SERIES)]
            case "greatest speed":
                return self._scaled(float(fall.speed.max()), self._top("speed"))
            case "greatest energy":
                return self._scaled(float(fall.energy.max()), self._top("energy"))
            case _:
                return END_COLOURS[fall.end]

    def _top(self, name: str) -> float:
        falls = self._release.falls[: self._drawn] if self._release else []
        return max((float(getattr(fall, name).max()) for fall in falls), default=1.0) or 1.0

    def _scaled(self, value: float, top: float) -> str:
        return SCALE[min(int(len(SCALE) * value / top), len(SCALE) - 1)]

    def _recolour(self) -> None:
        falls = self._release.falls[: self._drawn] if self._release else []
        tops = {"speed": self._top("speed"), "energy": self._top("energy")}
        top = tops.get(self._by.value.removeprefix("greatest "))
        if top is None:
            self.section.ways.data = ways(falls, self._colour)
        else:
            name = self._by.value.removeprefix("greatest ")
            self.section.ways.data = ways(
                falls, lambda fall: self._scaled(float(getattr(fall, name).max()), top)
            )
        self._show_legend()

    def _show_legend(self) -> None:
        by = self._by.value
        if by == BY_END:
            items = list(END_COLOURS.items())
        elif by == BY_EVENT and self.project.has_site:
            items = list(zip(self.project.site.event_names, SERIES, strict=False))
        else:
            name = by.removeprefix("greatest ")
            top, unit = self._top(name), {"speed": "metres per second", "energy": "kilojoules"}
            items = [
                (f"up to {top * (k + 1) / len(SCALE):.3g} {unit.get(name, '')}", colour)
                for k, colour in enumerate(SCALE)
            ]
        self._legend.object = legend(items)

    def _show_shares(self) -> None:
        falls = self._release.falls if self._release else []
        rows = [
            (end, f"{100 * s.probability:.1f}", f"{100 * s.low:.1f} to {100 * s.high:.1f}")
            for end, s in shares(falls).items()
        ]
        where = "with the layout" if self._layout else "without the layout"
        caption = f"Where {len(falls):,} blocks end, {where}"
        self._shares.object = table(("", "blocks [%]", "95 % interval"), rows, caption)

    def _show_envelopes(self) -> None:
        assert self._passed is not None
        rows = [r for r in self._passed.slope or [] if r["quantity"] == "energy"]
        tall = [r for r in self._passed.slope or [] if r["quantity"] == "height_top"]
        self._envelope.data = {
            "x": [r["x_m"] for r in rows],
            "energy": [r["q95"] for r in rows],
            "height": [r["q95"] for r in tall],
        }
        for plot, found in ((self._envelopes, rows), (self._heights, tall)):
            seen = [r["q95"] for r in found if np.isfinite(r["q95"])]
            plot.visible = bool(seen)
            if seen:
                _fit(plot, None, seen)

    def _show_collector(self) -> None:
        if self._shown is None or self._shown.found is None:
            return
        passing, name = self._shown.found, self._what.value
        quantity = QUANTITIES[name]
        lines = passing.found.stations.tolist()
        passed = passing.passages(self._shown.event, lines.index(self._shown.station))
        values = np.sort(quantity.of(passed))
        unit = in_words(quantity.words, quantity.unit)
        self._histogram.xaxis.axis_label = unit
        if len(values):
            counts, edges = np.histogram(values, BINS)
            self._bars.data = {"left": edges[:-1], "right": edges[1:], "top": counts}
            share = 100.0 * np.arange(1, len(values) + 1) / len(values)
            self._curve.data = {"x": values, "y": share}
            _fit(self._histogram, edges, counts)
        self._histogram.visible = bool(len(values))
        row = next(r for r in self._shown.rows if r["quantity"] == name)
        rows = [
            (words, shown(row[q]), _ends(row[f"{q}_low"], row[f"{q}_high"]))
            for words, q in (("mean", "mean"), ("half are below", "q50"), ("95 % below", "q95"),
                             ("99 % below", "q99"))
        ]  # fmt: skip
        caption = f"{row['n']:,} blocks of {row['releases']:,} releases pass the collector"
        self._collector.object = table((unit, "value", "95 % interval"), rows, caption)

    def _show_line(self) -> None:
        site = self.project.site
        if self._station.value is None:
            return
        x = float(self._station.value)
        low, high = site.slope.points[0][0], site.slope.points[-1][0]
        if not low < x < high:
            return
        tall = 0.25 * float(np.ptp(np.array(site.slope.points)[:, 1]))
        y = site.profile.height(x)
        self._line_x = x
        self._line.data = {"x": [x, x], "y": [y, y + tall], "words": ["collector"] * 2}

    def _dragged(self, new: Any) -> None:
        moved = [float(x) for x in new["x"] if abs(float(x) - self._line_x) > 1e-6]
        if moved:
            self._station.value = round(moved[0], 1)
            self._show_line()

    def _moved(self) -> None:
        if self.project.has_site and self._station.value is not None:
            self._show_line()
            self._collect()

    def _tapped(self, event: Any) -> None:
        """Replay the release whose path was clicked."""
        falls = self._release.falls[: self._drawn] if self._release else []
        if event.x is None or event.y is None or not falls:
            return
        fall = nearest(falls, float(event.x), float(event.y), REACH * self._width())
        if fall is not None:
            self.page.act(partial(self._replay, fall))

    def _width(self) -> float:
        """Return the length of slope that the figure shows [m]."""
        shown_range = self.section.plot.x_range
        points = self.project.site.slope.points
        low, high = (
            given if isinstance(given, int | float) and np.isfinite(given) else own
            for given, own in (
                (shown_range.start, points[0][0]), (shown_range.end, points[-1][0])
            )
        )  # fmt: skip
        return float(high - low)

    def _replay(self, fall: Fall) -> None:
        self._replayed = fall
        self._hits.data = dict(zip("xy", fall.impacts, strict=True))
        ground = np.interp(fall.x, *fall.found.ground.points.T)  # with earthworks
        self._track.data = {"x": fall.x, "energy": fall.energy, "height": fall.y - ground}
        _fit(self._tracks, fall.x, fall.energy)
        self._above.end = HEAD * (float(self._track.data["height"].max()) or 1.0)
        self._tracks.visible = True
        self._time.end = fall.duration
        self._time.value = 0.0
        parts = ["rigdda", *self._replay_arguments(fall)]
        words = (
            f"{fall.event}, seed {fall.seed}: {fall.end}. A block of {fall.mass:.3g} tonnes, at "
            f"most {fall.energy.max():,.0f} kilojoules and {fall.speed.max():.3g} metres per "
            "second."
        )
        self._rerun.object = (
            f"{paragraph(words)}"
            f"<p style='margin:2px 0;color:{self.theme.quiet}'>To record it for rerun: "
            f"<code>{html.escape(shlex.join(parts))}</code></p>"
        )
        self._replaying.visible = True
        self._show_block()

    def _viewing_words(self) -> str:
        words = self.page.workspace.viewing.look()
        return paragraph(words) if words else ""

    def _replay_arguments(self, fall: Fall) -> list[str]:
        layout = self.project.folder / LAYOUT if self._layout else None
        return replay_arguments(self.project.where.site, layout, fall.event, fall.seed)

    def _open_viewer(self) -> None:
        """Record the release of the replay and open it in the rerun viewer."""
        fall, now = self._replayed, self.project.current
        if fall is not None:
            asked, texts = self._replay_arguments(fall), f"{now.site}\0{now.layout}"
            self.page.act(lambda: self.page.workspace.viewing.open(asked, texts))

    def _show_block(self) -> None:
        """Draw the block of the replay at the time of the slider."""
        if self._replayed is not None:
            outline = self._replayed.outline(self._time.value)
            self._block.data = {"xs": [outline[:, 0]], "ys": [outline[:, 1]]}


def _ends(low: float, high: float) -> str:
    """Return an interval; empty if there are no values."""
    if np.isfinite(low) and np.isfinite(high):
        return f"{shown(low)} to {shown(high)}"
    if np.isfinite(low):
        return f"above {shown(low)}"
    return f"below {shown(high)}" if np.isfinite(high) else ""


def _fit(plot: Any, x: Any, y: Any) -> None:
    """Fit the axes of a figure to values; without x its axis is that of another figure."""
    if x is not None:
        margin = 0.02 * (float(np.max(x) - np.min(x)) or 1.0)
        plot.x_range.start, plot.x_range.end = float(np.min(x)) - margin, float(np.max(x)) + margin
    plot.y_range.start, plot.y_range.end = 0.0, HEAD * (float(np.nanmax(y)) or 1.0)
