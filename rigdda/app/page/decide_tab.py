"""The tab Decide: the search for the best layout, cost against risk, and prices."""

from __future__ import annotations

import hashlib
import html
from functools import partial
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.models import ColumnDataSource, HoverTool, TapTool
from bokeh.plotting import figure

from rigdda import BadInput, Layout, Site
from rigdda.agents.designers import DEFAULT, DESIGNERS
from rigdda.app.page import placing
from rigdda.app.page.barriers_tab import NAMES, alternatives_html, shown
from rigdda.app.page.forms import Bound, button, heading, in_words, legend, paragraph, text
from rigdda.app.page.jobs import (
    CANCELLED,
    FAILED,
    INTERRUPTED,
    RUNNING,
    VERIFIED,
    Tried,
    tried,
)
from rigdda.app.page.known_layout import MOST_BARRIERS
from rigdda.app.page.locking import on_change, watch
from rigdda.app.page.section import plain_axes
from rigdda.app.page.theme import SERIES, TALL, WRAPPED
from rigdda.app.reports.wording import unchanged
from rigdda.envs.siting import Rules
from rigdda.fields import described
from rigdda.ground.prices import Consequences, Prices

if TYPE_CHECKING:
    from rigdda.app.page.workspace import Host

WIDE = 430
"""Width of the column of prices [pixels]."""

TARGETS = {
    "--target": "At most: P(reaches the road) [-]",
    "--failure": "At most: P(a barrier fails) [-]",
    "--target-risk": "At most: individual risk [per year]",
}
"""Limits of every design event, and of the individual risk, by the option of the search."""

STAGES = (
    ("verified, on releases that the search did not use", SERIES[1]),
    ("not verified", SERIES[0]),
)
"""Colours of the layouts in the diagram."""

COST = "Z, the sum of both axes [EUR per metre of road and year]"

BEST = 8
"""Number of layouts in the table."""

BUDGET, VERIFY = 4_000, 500
"""Usual numbers of releases of a search on the page, and of the verification of a layout."""

SLOW = 10
"""Number of looks of the page between two looks at the files of the search."""


class DecideTab:
    """The tab Decide."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.job = page.workspace.search
        self._found: list[Tried] = []
        self._count = 0
        self._listed: list[Layout] = []
        self._meets: dict[Layout, bool] = {}  # on the site `_checked`
        self._checked: Site | None = None
        self._bound: list[Bound] = []
        self._structure: Any = None
        self._designer = pn.widgets.Select(
            label="Search method", options=list(DESIGNERS), value=DEFAULT, width=130
        )
        self._budget = pn.widgets.IntInput(
            label="Releases of the search", value=BUDGET, start=2, step=1000, width=150
        )
        self._verify = pn.widgets.IntInput(
            label="Releases to verify each", value=VERIFY, start=10, step=100, width=150
        )
        self._cost = pn.widgets.FloatInput(
            label="At most to build [EUR per metre]", value=None, start=0.0, width=190
        )
        self._targets = {
            option: pn.widgets.FloatInput(label=words, value=None, start=0.0, end=1.0, step=0.01,
                                          width=210)
            for option, words in TARGETS.items()
        }  # fmt: skip
        self._kinds = pn.widgets.CheckBoxGroup(
            label="Kinds", options={}, inline=True, stylesheets=[WRAPPED]
        )
        self._start = button("Start the search", self._begin, primary=True)
        self._cancel = button("Cancel", lambda: self.page.act(self.job.cancel))
        self._resume = button("Resume", lambda: self.page.act(self.job.resume))
        self._bar = pn.indicators.Progress(value=0, max=100, width=300, margin=(14, 8))
        self._status = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._only = pn.widgets.Checkbox(
            label="Only layouts that meet every check of their barriers", value=False
        )
        watch(self._only, self._show_found)
        self._points = ColumnDataSource({"x": [], "y": [], "colour": [], "words": [], "place": []})
        self._plot = self._diagram()
        self._legend = pn.pane.HTML(legend(STAGES), margin=(6, 8))
        self._diagrams = pn.Column(sizing_mode="stretch_width")
        self._table = pn.Column(sizing_mode="stretch_width")
        self._revision = -1
        self._compared = pn.pane.HTML("", sizing_mode="stretch_width", margin=(8, 8))
        self._prices = pn.Column(width=WIDE, scroll=True, styles=TALL)
        self.panel = pn.Row(
            pn.Column(
                pn.Row(self._designer, self._budget, self._verify, self._cost),
                pn.Row(*self._targets.values()),
                pn.Row(pn.pane.HTML("Kinds:", width=50, margin=(8, 8)), self._kinds),
                pn.Row(self._start, self._cancel, self._resume, self._bar),
                self._status, self._diagrams, self._only, self._table, self._compared,
                sizing_mode="stretch_width",
            ),
            self._prices,
            sizing_mode="stretch_width",
        )  # fmt: skip

    def show(self) -> None:
        """Show the site as it is now."""
        if not self.project.has_site:
            self._status.object = paragraph("Import a survey first, in the tab Slope.")
            return
        site = self.project.site
        kinds = {NAMES[k]: k for k in placing.kinds_for(site)}
        if self._kinds.options != kinds:
            self._kinds.options = kinds
            self._kinds.value = [k for k in kinds.values() if k != "wall"]
        self._targets["--target-risk"].visible = site.traffic is not None
        if not self._bound:
            self._build()
        for one in self._bound:
            one.refresh()
        self._look()
        self._revision = -1

    def tick(self) -> None:
        """Show what the search has found meanwhile."""
        live = self.page.workspace.live
        if self._revision != live.revision and self.project.has_site:
            self._revision = live.revision
            compared = alternatives_html(self.project, live)
            if compared != self._compared.object:
                self._compared.object = compared
        self._count += 1
        if self._count % SLOW == 0:
            self._look()

    def _diagram(self) -> Any:
        plot = figure(
            height=290, sizing_mode="stretch_width",
            tools="pan,wheel_zoom,box_zoom,reset",
            title="Cost against risk; a click takes a layout",
            x_axis_label="capital and upkeep [EUR per metre of road and year]",
            y_axis_label="harm and repair [EUR per metre and year]",
        )  # fmt: skip
        plot.toolbar.logo = None
        plot.title.text_color = self.theme.text
        plot.title.text_font_style = "normal"
        found = plot.scatter("x", "y", source=self._points, size=9, fill_color="colour",
                             line_color=self.theme.paper, fill_alpha=0.85)  # fmt: skip
        plot.add_tools(
            TapTool(renderers=[found], description="take a layout"),
            HoverTool(renderers=[found], tooltips=[("", "@words")], description="layouts"),
        )
        plain_axes(plot, self.theme)
        on_change(self._points.selected, "indices", self._picked)
        return plot

    def _begin(self) -> None:
        """Start the search that the form describes."""
        self.show()  # the button may be quicker than the tab
        self.page.act(lambda: self.job.start(self._arguments()))

    def _arguments(self) -> list[str]:
        """Return the arguments of the search that the form describes.

        Raises
        ------
        BadInput
            If no kind of barrier is chosen, or there is no site.
        """
        _ = self.project.site  # raises an error without a site
        if not self._kinds.value:
            raise BadInput("kinds", [], "choose at least one kind of barrier")
        if self._budget.value is None or self._verify.value is None:
            hint = "give the numbers of releases of the search and of the verification"
            raise BadInput("releases", None, hint)
        asked = ["--designer", self._designer.value, "--kinds", ",".join(self._kinds.value)]
        asked += ["--budget", str(self._budget.value), "--verify", str(self._verify.value)]
        asked += ["--ground-samples", "0"]
        if self._cost.value is not None:
            asked += ["--max-cost", f"{self._cost.value:g}"]
        for option, one in self._targets.items():
            if one.value is not None and one.visible:
                asked += [option, f"{one.value:g}"]
        key = hashlib.sha256("\0".join([self.project.current.site, *asked]).encode()).hexdigest()
        out = self.project.folder / f"design-{key[:8]}"
        return ["design", str(self.project.where.site), *asked, "--out", str(out)]

    def _look(self) -> None:
        """Look at the search and at what it has written."""
        state, job = self.job.state, self.job
        self._start.disabled = state == RUNNING
        self._cancel.disabled = state != RUNNING
        self._resume.disabled = state not in (CANCELLED, INTERRUPTED, FAILED)
        folder = self.page.workspace.design_folder
        found = tried(folder) if folder is not None else []
        words = {"": "No search has been started.", FAILED: f"The search failed: {job.words}"}
        told = words.get(state, f"The search is {state}.")
        if state == RUNNING and job.line:
            told += f" {job.line.rstrip('.')}."
        done = max((one.simulations for one in found), default=0)
        command = f"<code>{html.escape(job.command)}</code>" if job.command else ""
        self._status.object = (
            f"<p role='status' style='margin:2px 0'>{html.escape(told)} "
            f"{done:,} releases, {len(found):,} layouts.</p>{command}"
        )
        self._bar.visible = state == RUNNING
        most = 1.5 * float(self.job.option("--budget") or BUDGET)
        self._bar.value = min(99, int(100 * done / most))
        if found != self._found:
            self._found = found
            self._show_found()

    def _words(self, one: Tried) -> str:
        """Return the barriers of a layout in words, with their chainages."""
        return "; ".join(b.label_and_place for b in one.layout) or unchanged(self.project.site)

    def _met(self, layout: Layout) -> bool:
        """Return whether all barriers of a layout meet their checks."""
        site = self.project.site
        if site != self._checked:
            self._checked, self._meets = site, {}
        if layout not in self._meets:
            rules = Rules(site, site.barrier_zone, checks="required")
            broken = rules.violations(layout, placing.kinds_for(site), MOST_BARRIERS)
            self._meets[layout] = next(broken, None) is None
        return self._meets[layout]

    def _show_found(self) -> None:
        found = sorted(self._found, key=lambda one: (one.stage != VERIFIED, one.objective))
        if self._only.value:
            found = [one for one in found[:60] if self._met(one.layout)]
        if bool(found) != bool(len(self._diagrams)):  # without points it has no ranges
            self._diagrams[:] = [self._legend, self._plot] if found else []
        self._listed = [one.layout for one in found]
        self._points.data = {
            "x": [one.capital for one in found],
            "y": [one.risk for one in found],
            "colour": [SERIES[1] if one.stage == VERIFIED else SERIES[0] for one in found],
            "words": [self._words(one) for one in found],
            "place": list(range(len(found))),
        }
        rows: list[Any] = [heading(f"The best layouts so far, with {COST}")] if found else []
        for one in found[:BEST]:
            verified = "verified" if one.stage == VERIFIED else "not verified"
            ends = f"{shown(one.objective)} ({shown(one.low)} to {shown(one.high)})"
            words = f"Z = {ends}, {verified}, {one.releases:,} releases: {self._words(one)}"
            rows.append(
                pn.Row(
                    button("Take", partial(self._take, one.layout), width=70),
                    text(words), sizing_mode="stretch_width",
                )
            )  # fmt: skip
        self._table[:] = rows

    def _picked(self, new: list[int]) -> None:
        if new and new[0] < len(self._listed):
            self._take(self._listed[new[0]])
            self._points.selected.indices = []

    def _take(self, layout: Layout) -> None:
        words = "took a layout of the search"
        if self.page.act(lambda: self.project.change_layout(layout, words)):
            self.page.say("The layout is taken; the tab Barriers shows it.")

    def _build(self) -> None:
        """Build the sliders of prices and consequences."""
        rows: list[Any] = [
            heading("Prices and consequences"),
            text(
                "Nothing is simulated when one of them changes: the figures in the tab Barriers "
                "follow at once. A search keeps the prices that it began with."
            ),
        ]
        for table, kind in (("consequences", Consequences), ("prices", Prices)):
            for field in described(kind):
                if isinstance(field.default, float) and field.default > 0.0:
                    path = (table, field.name)
                    widget = pn.widgets.EditableFloatSlider(
                        label=in_words(field.name, field.unit), start=0.0,
                        end=3.0 * field.default, step=field.default / 100.0, width=WIDE - 60,
                        margin=(2, 8),
                    )  # fmt: skip
                    self._bound.append(
                        Bound(widget, partial(self._value, *path), partial(self._set, path),
                              "value_throttled")
                    )  # fmt: skip
                    rows += [text(f"{field.text.split('. ')[0].rstrip('.')}:"), widget]
        self._prices[:] = rows

    def _value(self, table: str, name: str) -> float:
        return float(getattr(getattr(self.project.site, table), name))

    def _set(self, path: tuple[str, str], value: float) -> None:
        words = f"set {path[0]}, {path[1].replace('_', ' ')}"
        self.page.act(lambda: self.project.set_value(path, round(float(value), 6), words))
