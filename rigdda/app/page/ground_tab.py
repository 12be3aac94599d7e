"""The tab Ground: observations over the section, numbers of the grounds, the match and the fit."""

from __future__ import annotations

import html
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, HoverTool, Range1d
from bokeh.plotting import figure

from rigdda import BadInput, Site
from rigdda.app.page import ground
from rigdda.app.page.barriers_tab import shown, ways
from rigdda.app.page.falls import Fall, Release
from rigdda.app.page.forms import Bound, button, heading, in_words, paragraph, table, text
from rigdda.app.page.ground import Compared, Match, Observations
from rigdda.app.page.handles import surface_words
from rigdda.app.page.jobs import CANCELLED, FAILED, FINISHED, INTERRUPTED, RUNNING
from rigdda.app.page.locking import watch
from rigdda.app.page.section import Section, plain_axes
from rigdda.app.page.theme import SERIES, TALL, WRAPPED
from rigdda.app.reports.wording import survey_grid
from rigdda.app.uncertainty.observations import DEPOSIT, OBSERVED_RUN_OUT
from rigdda.app.uncertainty.parameters import Parameter
from rigdda.app.uncertainty.parameters import ground as grounds_of
from rigdda.fields import described
from rigdda.ground.surface import Surface

if TYPE_CHECKING:
    from rigdda.app.page.workspace import Host

WIDE = 430
"""Width of the column of numbers [pixels]."""

DRAWN = 60
"""Number of releases whose paths are drawn."""

STEPS = 100
"""Number of steps of a slider."""

SLOW = 10
"""Number of looks of the page between two looks at the files of the fit."""

WORDS = {
    "friction_deg": "friction angle",
    "restitution": "restitution",
    "rolling": "rolling resistance",
}
"""Numbers of a ground in words."""

FORMS = (
    "Tables (CSV) with the column event and one of: run_out_m, the chainage at which a block "
    "stopped; start_m, end_m and share, mass_t or volume_m3, a deposit; station_m, quantity and "
    "value, blocks that pass a station. A table with a column impact_m holds impact marks, which "
    "are shown only."
)
"""What files of observations contain."""


class GroundTab:
    """The tab Ground."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.job = page.workspace.fit
        self.match = Match()
        page.workspace.workers.add(self.match)
        self._seen = Observations({}, np.zeros(0), ())
        self._for: Any = None
        self._told: Compared | None = None
        self._structure: Any = None
        self._bound: list[Bound] = []
        self._count = self._drawn = 0
        self._release: Release | None = None
        self._parameters: dict[str, Parameter] = {}
        self.section = Section(self.theme, "Observed and computed on the section", 290)
        self._stops = ColumnDataSource({"x": [], "y": [], "words": []})
        self._marks = ColumnDataSource({"x": [], "y": []})
        self._hits = ColumnDataSource({"x": [], "y": []})
        self._deposits = ColumnDataSource({"xs": [], "ys": [], "words": []})
        self._real = ColumnDataSource({"x": [], "y": []})
        self._made = ColumnDataSource({"x": [], "y": []})
        self._draw()
        self._curves = self._diagram()
        self._set = pn.widgets.Select(label="Observations", options=[], width=260)
        watch(self._set, self._show_match)
        self._score = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._sliders = pn.Column(width=WIDE - 20)
        self._grid = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._files = pn.Column(width=WIDE - 20)
        self._upload = pn.widgets.FileInput(accept=".csv", width=WIDE - 60)
        self._build_fit()
        right = pn.Column(
            heading("Observations"), text(FORMS), self._grid, self._upload,
            button("Add the observations", self._add), self._files, self._sliders,
            width=WIDE, scroll=True, styles=TALL,
        )  # fmt: skip
        self.panel = pn.Row(
            pn.Column(self.section.plot, pn.Row(self._set, self._score), self._curves, *self._fit,
                      sizing_mode="stretch_width"),
            right, sizing_mode="stretch_width",
        )  # fmt: skip

    def show(self) -> None:
        """Show the site and its observations as they are now."""
        if not self.project.has_site:
            self._score.object = paragraph("Import a survey first, in the tab Slope.")
            return
        site = self.project.site
        paths = ground.files(self.project.folder)
        stamps = [(path, path.stat().st_mtime_ns) for path in paths]
        self._parameters = {one.path: one for one in grounds_of(site)}
        self._grid.object = paragraph(survey_grid(site))
        structure = tuple(self._parameters)
        if structure != self._structure:
            self._structure = structure
            self._build(site)
        for one in self._bound:
            one.refresh()
        if self._for != (site, stamps):
            self._for = site, stamps
            self._read(site)
        self._look()

    def tick(self) -> None:
        """Show what was computed meanwhile."""
        self._stream()
        found = self.match.found
        if found is not None and found is not self._told:
            self._told = found
            self._show_match()
        elif self.match.fault:
            self._score.object = paragraph(self.match.fault)
        self._count += 1
        if self._count % SLOW == 0:
            self._look()

    def _draw(self) -> None:
        plot, theme = self.section.plot, self.theme
        plot.scatter("x", "y", source=self._hits, marker="dot", size=6, line_color=theme.quiet,
                     fill_color=theme.quiet, legend_label="computed impacts")  # fmt: skip
        heaps = plot.multi_line("xs", "ys", source=self._deposits, line_color=SERIES[1],
                                line_width=6, line_alpha=0.7,
                                legend_label="observed deposit")  # fmt: skip
        stops = plot.scatter("x", "y", source=self._stops, marker="inverted_triangle", size=12,
                             fill_color=SERIES[1], line_color=theme.paper,
                             legend_label="observed stops")  # fmt: skip
        plot.scatter("x", "y", source=self._marks, marker="x", size=11, line_width=3,
                     line_color=theme.bad, legend_label="observed impact marks")  # fmt: skip
        plot.add_tools(HoverTool(renderers=[stops, heaps], tooltips=[("", "@words")],
                                 description="observations"))  # fmt: skip

    def _diagram(self) -> Any:
        plot = figure(height=180, sizing_mode="stretch_width", tools="", toolbar_location=None,
                      title="Cumulative share of blocks", y_axis_label="share [-]",
                      x_range=Range1d(0, 1), y_range=Range1d(0, 1.02))  # fmt: skip
        plot.title.text_color = self.theme.text
        plot.title.text_font_style = "normal"
        plot.step("x", "y", source=self._real, mode="after", line_color=SERIES[1], line_width=2,
                  legend_label="observed")  # fmt: skip
        plot.line("x", "y", source=self._made, line_color=SERIES[0], line_width=2,
                  legend_label="computed")  # fmt: skip
        plot.legend.location = "top_left"  # where no curve is
        plain_axes(plot, self.theme)
        plot.visible = False
        return plot

    def _build_fit(self) -> None:
        """Build the form that starts the fit."""
        self._fitted = pn.widgets.CheckBoxGroup(
            options={}, inline=True, sizing_mode="stretch_width", stylesheets=[WRAPPED]
        )
        self._budget = pn.widgets.IntInput(
            label="Parameter sets", value=ground.BUDGET, start=8, step=8, width=130
        )
        self._releases = pn.widgets.IntInput(
            label="Releases for each", value=ground.RELEASES, start=10, step=10, width=130
        )
        act = self.page.act
        self._start = button("Fit", self._begin, primary=True, margin=(18, 8))
        self._cancel = button("Cancel", lambda: act(self.job.cancel), margin=(18, 8))
        self._resume = button("Resume", lambda: act(self.job.resume), margin=(18, 8))
        self._bar = pn.indicators.Progress(value=0, max=100, width=220, margin=(28, 8))
        self._status = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._apply = button("Write the fitted numbers into the site file", self._write)
        self._fit = [
            heading("Fit"),
            pn.Row(pn.pane.HTML("Numbers to fit:", width=110, margin=(8, 8)), self._fitted,
                   sizing_mode="stretch_width"),
            pn.Row(self._budget, self._releases, self._start, self._cancel, self._resume,
                   self._bar),
            self._status, self._apply,
        ]  # fmt: skip

    def _build(self, site: Site) -> None:
        """Build the sliders of the grounds anew, for a site with other grounds than before."""
        self._bound = []
        labels = {f"{_field(p)} of {surface_words(_surface(p))}": p for p in self._parameters}
        self._fitted.options = labels
        self._fitted.value = [p for p in labels.values() if p.endswith(".rolling")][:1]
        rows: list[Any] = [heading("Grounds, within the ranges of the library")]
        for path, one in self._parameters.items():
            widget = pn.widgets.EditableFloatSlider(
                label=f"{_label(path)}, {surface_words(_surface(path))}",
                start=one.low, end=one.high,
                step=(one.high - one.low) / STEPS, width=WIDE - 60, margin=(2, 8),
            )  # fmt: skip
            get = partial(self._value, path)
            self._bound.append(Bound(widget, get, partial(self._change, path), "value_throttled"))
            rows.append(widget)
        self._sliders[:] = rows

    def _value(self, path: str) -> float:
        return float(getattr(self.project.site.surfaces[_surface(path)], path.split(".")[-1]))

    def _change(self, path: str, value: float) -> None:
        words = f"set {_field(path)} of {surface_words(_surface(path))}"
        place = tuple(path.split("."))
        self.page.act(lambda: self.project.set_value(place, round(float(value), 6), words))

    def _read(self, site: Site) -> None:
        """Read the observations, show them, and compare them with the site."""
        paths = ground.files(self.project.folder)
        try:
            self._seen = ground.observed(paths, site)
            self._score.object = "" if self._seen.sets else paragraph("No observations yet.")
        except BadInput as bad:
            self._seen = Observations({}, np.zeros(0), ())
            self._score.object = paragraph(str(bad))
        self._files[:] = [
            pn.Row(
                pn.pane.HTML(html.escape(path.name), width=240, margin=(12, 8)),
                button("Remove", partial(self._remove, path), width=90),
            )
            for path in paths
        ]
        names = list(self._seen.sets)
        if self._set.options != names:
            self._set.options = names
            self._set.value = names[0] if names else None
        self.section.show(site)
        self._show_observed(site)
        self._told = None
        self.match.ask(site, self._seen.sets)
        self._begin_paths(site)

    def _show_observed(self, site: Site) -> None:
        height = site.profile.height
        stops: dict[str, list[Any]] = {"x": [], "y": [], "words": []}
        heaps: dict[str, list[Any]] = {"xs": [], "ys": [], "words": []}
        for one in self._seen.sets.values():
            if one.quantity == OBSERVED_RUN_OUT:
                for x in one.values.tolist():
                    stops["x"].append(x)
                    stops["y"].append(height(x))
                    stops["words"].append(f"{one.event} stopped at {x:g} metres")
            elif one.quantity == DEPOSIT:
                ends = zip(one.values[:-1], one.values[1:], one.shares, strict=True)
                for a, b, share in ((a, b, s) for a, b, s in ends if s > 0.0):
                    heaps["xs"].append([a, b])
                    heaps["ys"].append([height(a), height(b)])
                    heaps["words"].append(f"{one.event}: {100 * share:.0f} % of the deposit")
        self._stops.data, self._deposits.data = stops, heaps
        marks = self._seen.marks.tolist()
        self._marks.data = {"x": marks, "y": [height(x) for x in marks]}

    def _begin_paths(self, site: Site) -> None:
        """Begin to compute the paths that are drawn: those of the first observed event."""
        if self._release is not None:
            self._release.stop()
        events = [one.event for one in self._seen.sets.values()] or list(site.event_names)
        self._release, self._drawn = Release(site, (), events[0]), 0
        self.page.workspace.workers.add(self._release)
        self.section.ways.data = {"xs": [], "ys": [], "colour": [], "words": []}
        self._hits.data = {"x": [], "y": []}
        self._release.more(DRAWN)

    def _stream(self) -> None:
        if self._release is None or len(self._release.falls) == self._drawn:
            return
        falls = self._release.falls[self._drawn :]
        self._drawn += len(falls)
        self.section.ways.stream(ways(falls, self._colour))
        hits = [fall.impacts for fall in falls]
        self._hits.stream({k: np.concatenate([hit[i] for hit in hits]) for i, k in enumerate("xy")})

    def _colour(self, fall: Fall) -> str:
        return SERIES[0]

    def _show_match(self) -> None:
        """Show the cumulative curves of the chosen observations, and the score."""
        found, name = self._told, self._set.value
        self._curves.visible = found is not None and name in found.observed
        if found is None or name not in found.observed:
            return
        real, made = np.sort(found.observed[name]), np.sort(found.computed[name])
        one = self._seen.sets[name]
        low, high = min(real[0], made[0]), max(real[-1], made[-1])
        margin = 0.03 * (high - low or 1.0)
        for source, values in ((self._real, real), (self._made, made)):
            share = np.arange(1, len(values) + 1) / len(values)
            source.data = {
                "x": np.concatenate([[low - margin], values, [high + margin]]),
                "y": np.concatenate([[0.0], share, [1.0]]),
            }
        self._curves.x_range.start, self._curves.x_range.end = low - margin, high + margin
        self._curves.xaxis.axis_label = in_words(one.quantity, one.unit)
        mixed = any(s.passes for s in self._seen.sets.values())
        unit = "standard deviations" if mixed else "metres"
        told = f"Score {found.score:.3g} {unit}: mean distance of the observed values from the "
        told += f"computed distribution; of {found.releases} releases of each event. "
        told += f"Mean observed {real.mean():.3g}, computed {made.mean():.3g} {one.unit}."
        self._score.object = paragraph(told)

    def _add(self) -> None:
        def add() -> None:
            if not self._upload.value:
                raise BadInput("observations", None, "choose a file first")
            name, content = str(self._upload.filename), bytes(self._upload.value)
            ground.keep(self.project.folder, name, content, self.project.site)

        if self.page.act(add):
            self.show()

    def _remove(self, path: Any) -> None:
        path.unlink(missing_ok=True)
        self.show()

    def _begin(self) -> None:
        self.show()  # the button may be quicker than the tab

        def start() -> None:
            chosen = [self._parameters[path] for path in self._fitted.value]
            project = self.project
            arguments = ground.fit_arguments(
                project.where.site, self._seen, chosen, self._budget.value, self._releases.value,
                project.folder, project.current.site,
            )  # fmt: skip
            self.job.start(arguments)

        self.page.act(start)

    def _look(self) -> None:
        """Look at the fit and at what it has written."""
        job, state = self.job, self.job.state
        self._start.disabled = state == RUNNING
        self._cancel.disabled = state != RUNNING
        self._resume.disabled = state not in (CANCELLED, INTERRUPTED, FAILED)
        self._bar.visible = state == RUNNING
        folder = self.page.workspace.fit_folder
        told = {"": "No fit has been started.", FAILED: f"The fit failed: {job.words}"}
        words = told.get(state, f"The fit is {state}.")
        if state == RUNNING and folder is not None:
            done, asked = ground.tried(folder), int(job.option("--budget") or ground.BUDGET)
            self._bar.value = min(99, int(100 * done / asked))
            words += f" {done} of about {asked} parameter sets."
        rows = ground.fit_rows(folder) if folder is not None and state == FINISHED else []
        self._apply.visible = bool(rows)
        lines = [
            (f"{_label('.'.join(one.path))}, {one.path[1]}", shown(one.fitted),
             f"{shown(one.low)} to {shown(one.high)}", "" if one.identified else "not identified")
            for one in rows
        ]  # fmt: skip
        found = table(("number", "fitted", "95 % interval", ""), lines) if lines else ""
        command = f"<code>{html.escape(job.command)}</code>" if job.command else ""
        self._status.object = f"<p role='status' style='margin:2px 0'>{html.escape(words)}</p>"
        self._status.object += found + command

    def _write(self) -> None:
        """Write the fitted numbers into the site file."""
        folder = self.page.workspace.fit_folder
        rows = ground.fit_rows(folder) if folder is not None else []
        values: dict[tuple[str | int, ...], Any] = {r.path: round(r.fitted, 6) for r in rows}
        self.page.act(lambda: self.project.set_values(values, "wrote the fitted ground"))


def _surface(path: str) -> str:
    """Return the name of the surface of a number of the ground."""
    return path.split(".")[1]


def _field(path: str) -> str:
    """Return the name of a number of the ground in words."""
    return WORDS[path.split(".")[2]]


def _label(path: str) -> str:
    """Return the name of a number of the ground with its unit."""
    field = next(one for one in described(Surface) if one.name == path.split(".")[2])
    return in_words(_field(path), field.unit)
