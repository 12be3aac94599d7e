"""The tab Barriers: place barriers, drag them, and see what they let through and cost."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import panel as pn
from bokeh.models import HoverTool, PointDrawTool

from rigdda import Layout
from rigdda.app.page import placing
from rigdda.app.page.falls import Fall, Release
from rigdda.app.page.forms import Bound, button, heading, in_words, legend, number, paragraph, table
from rigdda.app.page.known_layout import LiveFigures
from rigdda.app.page.live import CHECKED
from rigdda.app.page.placing import Grip
from rigdda.app.page.section import HandleSource, Section
from rigdda.app.page.theme import SERIES, TALL
from rigdda.app.reports.wording import unchanged
from rigdda.barriers.fence import FENCE_CLASSES

if TYPE_CHECKING:
    from rigdda.app.page.live import Live
    from rigdda.app.page.state import Project
    from rigdda.app.page.workspace import Host

DRAWN = 200
"""Number of releases whose paths are drawn."""

WIDE = 470
"""Width of the column of figures [pixels]."""

PATHS = (("stops before the road", SERIES[0]), ("reaches the road", SERIES[1]))
"""Colours of the paths."""

NAMES = {
    "fence": "Fence", "ditch": "Ditch", "embankment": "Embankment", "gravity_wall": "Gravity wall",
    "wall": "Rigid wall", "mesh": "Mesh", "removal": "Removal",
}  # fmt: skip
"""Names of the kinds on the buttons."""


class BarriersTab:
    """The tab Barriers."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.live = page.workspace.live
        self.section = Section(self.theme, "Section with barriers")
        self._grips: list[Grip] = []
        self._handles = HandleSource(self.section.plot, self._dragged)
        self._draw_handles()
        self._release: Release | None = None
        self._drawn = 0
        self._for: Any = None
        self._seen = -1
        self._structure: Any = None
        self._bound: list[Bound] = []
        self._palette = pn.FlexBox(sizing_mode="stretch_width")
        self._paths = pn.pane.HTML("", margin=(0, 8))
        self._forms = pn.Column(sizing_mode="stretch_width")
        self._figures = pn.pane.HTML("", width=WIDE - 40, margin=(0, 8))
        self._rules = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._command = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._kept: list[str] = []
        self._compared = pn.pane.HTML("", width=WIDE - 40)
        self._alternatives = pn.Column(width=WIDE - 40)
        self._name = pn.widgets.TextInput(label="Name of an alternative", width=200)
        self.panel = pn.Row(
            pn.Column(
                self._palette, self._paths, self.section.plot,
                self._rules, self._forms, self._command,
                sizing_mode="stretch_width",
            ),
            pn.Column(
                self._figures, heading("Alternatives"),
                pn.Row(self._name, button("Keep this layout", self._keep, margin=(18, 8))),
                self._compared, self._alternatives, width=WIDE, scroll=True, styles=TALL,
            ),
            sizing_mode="stretch_width",
        )  # fmt: skip

    def show(self) -> None:
        """Show the layout as it is now."""
        if not self.project.has_site:
            self._rules.object = paragraph("Import a survey first, in the tab Slope.")
            return
        site, layout = self.project.site, self.project.layout
        self.section.show(site, layout)
        self._show_grips()
        kinds = placing.kinds_for(site)
        if [one.label for one in self._palette] != [f"Add {NAMES[k].lower()}" for k in kinds]:
            self._palette[:] = [
                button(f"Add {NAMES[kind].lower()}", partial(self._add, kind)) for kind in kinds
            ]
        structure = [type(barrier) for barrier in layout]
        if structure != self._structure:
            self._structure = structure
            self._build(layout)
        for one in self._bound:
            one.refresh()
        if self._for != (site, layout):
            self._for = site, layout
            self._start()
        self._show_alternatives()
        self._seen = -1

    def tick(self) -> None:
        """Show the paths and the figures that were computed meanwhile."""
        self._stream()
        if self._seen != self.live.revision:
            self._seen = self.live.revision
            found = self.live.figures
            if found is not None and found.layout == self.project.layout:
                self._show_figures(found)
            if self._kept:
                self._compared.object = alternatives_html(self.project, self.live)

    def _draw_handles(self) -> None:
        plot = self.section.plot
        found = plot.scatter(
            "x", "y", source=self._handles.source, marker="circle", size=14, line_width=2,
            fill_color=self.theme.paper, line_color=self.theme.accent,
        )  # fmt: skip
        drag = PointDrawTool(renderers=[found], add=False, description="drag the barriers")
        plot.add_tools(
            drag,
            HoverTool(renderers=[found], tooltips=[("", "@words")], description="names of handles"),
        )
        plot.toolbar.active_drag = drag

    def _show_grips(self) -> None:
        self._grips = placing.grips(self.project.site, self.project.layout)
        self._handles.show(
            {
                "x": [grip.x for grip in self._grips],
                "y": [grip.y for grip in self._grips],
                "words": [grip.words for grip in self._grips],
            }
        )

    def _dragged(self, place: int, x: float, y: float) -> None:
        """Change the barrier whose handle was dragged."""
        grip = self._grips[place]
        site, layout = self.project.site, self.project.layout
        make = partial(placing.dragged, site, layout, grip, x, y)
        self._change(make, f"dragged the {grip.words}")
        self._show_grips()

    def _change(self, make: Callable[[], Layout], words: str) -> None:
        self.page.act(lambda: self.project.change_layout(make(), words))

    def _add(self, kind: str) -> None:
        def make() -> Layout:
            layout = self.project.layout
            new = placing.new_barrier(self.project.site, layout, kind)
            return tuple(sorted((*layout, new), key=lambda barrier: barrier.x))

        self._change(make, f"added a {NAMES[kind].lower()}")

    def _remove(self, index: int) -> None:
        layout = self.project.layout
        self._change(
            lambda: tuple(b for i, b in enumerate(layout) if i != index),
            f"removed the {layout[index].words}",
        )

    def _set(self, index: int, field: str, value: Any) -> None:
        def make() -> Layout:
            layout = self.project.layout
            new = placing.with_field(layout[index], field, value)
            return tuple(new if i == index else b for i, b in enumerate(layout))

        self._change(make, f"set the {field.replace('_', ' ')}")

    def _build(self, layout: Layout) -> None:
        """Build the forms anew, for a layout of other kinds than before."""
        self._bound = []
        rows = []
        for i, barrier in enumerate(layout):
            words = f"{i + 1}. {barrier.words}"
            inputs = [self._input(i, "x", "Chainage [metres]", 110)]
            for field in placing.fields_of(barrier):
                if isinstance(getattr(barrier, field.name), int | float):
                    label = in_words(field.name, field.unit)
                    inputs.append(self._input(i, field.name, label, 150))
            head = pn.pane.HTML(f"<b>{html.escape(words)}</b>", width=100, margin=(22, 8))
            remove = button("Remove", partial(self._remove, i), width=80, margin=(18, 8))
            rows.append(pn.FlexBox(head, *inputs, remove, sizing_mode="stretch_width"))
        self._forms[:] = rows

    def _input(self, i: int, field: str, label: str, width: int) -> Any:
        get: Callable[[], Any] = partial(self._get, i, field)
        write = partial(self._set, i, field)
        if field == "energy_class":
            options = {f"{name:,}": name for name in FENCE_CLASSES}
            widget = pn.widgets.Select(
                label="Energy class [kilojoules]", options=options, width=width, margin=(2, 8)
            )
            found = Bound(widget, get, write)
        else:
            found = number(label, get, write, placing.STEP, width)
        self._bound.append(found)
        return found.widget

    def _get(self, i: int, field: str) -> Any:
        layout = self.project.layout
        return getattr(layout[i], field, None) if i < len(layout) else None

    def _start(self) -> None:
        """Begin to draw the paths of releases with the layout."""
        if self._release is not None:
            self._release.stop()
        site = self.project.site
        single = [e.name for e in site.events if e.number == (1, 1) and site.source(e.source).band]
        event = (single or list(site.event_names))[0]
        self._paths.object = f"{html.escape(event)}: {legend(PATHS)}"
        self._release = Release(site, self.project.layout, event)
        self._drawn = 0
        self.section.ways.data = {"xs": [], "ys": [], "colour": [], "words": []}
        self._release.more(DRAWN if single else 3)
        self.page.workspace.draw_first(self._release)

    def _stream(self) -> None:
        if self._release is None or len(self._release.falls) == self._drawn:
            return
        falls = self._release.falls[self._drawn :]
        self._drawn += len(falls)
        self.section.ways.stream(ways(falls, self._colour))

    def _colour(self, fall: Fall) -> str:
        return SERIES[1] if fall.reaches else SERIES[0]

    def _show_figures(self, found: LiveFigures) -> None:
        """Show the figures of the layout, each with what it is of."""
        self._rules.object = _rules(found, self.theme.bad)
        road = self.project.site.road.start
        self._figures.object = figures_html(found, self.theme.bad, self.theme.quiet) + "".join(
            paragraph(f"{words}: {clear + 0.0:.2f} metres clear of the road when deflected")
            for words, clear in clearances(found.layout, road)
        )
        command = self.page.workspace.study_command
        words = "The command that computes the same figures, after each round of releases:"
        self._command.object = (
            f"<p style='margin:6px 0 0;color:{self.theme.quiet}'>{words}</p>"
            f"<code class='command'>{html.escape(command)}</code>"
            if found.releases
            else ""
        )

    def _keep(self) -> None:
        self.page.act(lambda: self.project.keep(self._name.value))
        self._show_alternatives()

    def _show_alternatives(self) -> None:
        found = self.project.alternatives
        self._compared.object = alternatives_html(self.project, self.live)
        if list(found) == self._kept:
            return
        self._kept = list(found)
        self._alternatives[:] = [
            pn.Row(
                pn.pane.HTML(html.escape(name), width=180, margin=(12, 8)),
                button("Take", partial(self._take, name), width=80),
                button("Drop", partial(self._drop, name), width=80),
            )
            for name in found
        ]

    def _take(self, name: str) -> None:
        self.page.act(lambda: self.project.take(name))

    def _drop(self, name: str) -> None:
        self.project.drop(name)
        self._show_alternatives()


def ways(falls: list[Fall], colour: Callable[[Fall], str]) -> dict[str, list[Any]]:
    """Return the data of paths for a section, rounded to centimetres.

    Lists are sent in one message. Bokeh would send each array in two messages of its own, and
    hundreds of messages take longer than the simulation.
    """
    return {
        "xs": [fall.x.round(2).tolist() for fall in falls],
        "ys": [fall.y.round(2).tolist() for fall in falls],
        "colour": [colour(fall) for fall in falls],
        "words": [f"{fall.event}, seed {fall.seed}: {fall.end}" for fall in falls],
    }


def _named(line: str, layout: Layout) -> str:
    """Return a message in which barriers have the names of their handles, such as "ditch 2"."""

    def name(found: re.Match[str]) -> str:
        k = int(found[1])
        return f"{layout[k].words} {k + 1}, " if k < len(layout) else found[0]

    return re.sub(r"layout\[(\d+)\]\.?(?=\w)", name, line)


def _rules(found: LiveFigures, bad: str) -> str:
    """Return what forbids the layout, as a list, and why there are no figures."""
    lines = [*found.broken, *([found.fault] if found.fault else [])]
    items = "".join(f"<li>{html.escape(_named(line, found.layout))}</li>" for line in lines)
    listed = f"<ul style='margin:2px 0;padding-left:20px'>{items}</ul>"
    out = _alert("This layout may not be built:", listed, bad) if lines else ""
    if found.error:
        out += _alert("The figures cannot be computed:", html.escape(found.error), bad)
    return out


def _alert(head: str, body: str, bad: str) -> str:
    """Return a message in HTML about what is wrong."""
    return f"<div role='alert' style='color:{bad}'><b>{head}</b> {body}</div>"


def shown(value: float) -> str:
    """Return a figure with all digits that the command writes, shortened where it is long."""
    if not math.isfinite(value):
        return "none"
    return f"{value:,.1f}" if abs(value) >= 100.0 else f"{value:.4g}"


def alternatives_html(project: Project, live: Live) -> str:
    """Return the table that compares the alternatives of a project; empty without any."""
    rows: list[tuple[str, ...]] = []
    bare: Mapping[str, Any] | None = None
    for name, layout in project.alternatives.items():
        words = "; ".join(b.label for b in layout) or unchanged(project.site)
        found = live.known(project.site, layout)
        rows.append((f"{name}: {words}", *_compared(found)))
        if found is not None:
            bare = bare or found.bare
    if not rows:
        return ""
    if bare:
        ends = f"{shown(bare['objective_low'])} to {shown(bare['objective_high'])}"
        rows.append(("without them", shown(bare["objective"]), ends, shown(bare["cost"]), "", ""))
    head = ("alternative", "Z", "95 % interval", "to build",
            "reaches the road, worst event [%]", "releases")  # fmt: skip
    caption = "Unverified; Z in EUR per metre of road and year, to build in EUR per metre"
    return table(head, rows, caption)


def _compared(found: LiveFigures | None) -> tuple[str, ...]:
    """Return the figures of an alternative in the table."""
    if found is None or found.costs is None:
        told = "" if found is None else found.fault or found.error
        told = told or "to be computed"
        return (told, "", "", "", "")
    c = found.costs
    reach = max((row["reach"] for row in found.events), default=math.nan)
    ends = f"{shown(c['objective_low'])} to {shown(c['objective_high'])}"
    return (shown(c["objective"]), ends, shown(c["cost"]), f"{100 * reach:.2f}",
            f"{found.releases:,}")  # fmt: skip


def figures_html(found: LiveFigures, bad: str, quiet: str) -> str:
    """Return the figures of a layout as HTML tables; those in data attributes have all digits."""
    doing = f"<p style='color:{quiet};margin:2px 0'>{html.escape(found.doing)}&nbsp;</p>"
    head = (
        "<h2 style='font-size:15px;margin:8px 0 2px'>This layout "
        f"<span style='border:1px solid {bad};color:{bad};padding:0 6px;font-weight:400'>"
        "unverified</span></h2>"
    )
    if found.costs is None:
        return head + doing
    out = head + _exact(found) + doing
    rows = []
    for row in found.events:
        ends = f"{100 * row['reach_low']:.2f} to {100 * row['reach_high']:.2f}"
        fails = "-" if math.isnan(row["failure"]) else f"{100 * row['failure']:.2f}"
        rows.append(
            (row["event"], f"{100 * row['reach']:.2f}", ends, fails, f"{row['releases']:,}")
        )
    heads = ("event", "reaches the road [%]", "95 % interval", "a barrier fails [%]", "releases")
    out += table(heads, rows, "Probability in a release of each event")
    out += table(*_money(found), "EUR per metre of road and year")
    if found.individual is not None:
        value, low, high = found.individual
        out += paragraph(f"Individual risk: {value:.2g} ({low:.2g} to {high:.2g}) per year")
    if found.checks is not None:
        out += _checks(found, bad)
    elif found.broken:
        out += paragraph("The barriers are checked when the layout keeps all rules.")
    elif found.layout:
        out += paragraph(
            f"The checks of the barriers follow after {CHECKED} releases of each event."
        )
    return out + "".join(paragraph(f"Rate of {note}.") for note in found.notes)


def _money(found: LiveFigures) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the head and the rows of the table of Z and its parts."""
    c, bare = found.costs, found.bare
    assert c is not None and bare is not None
    rows: list[tuple[str, ...]] = []
    for name, words in (
        ("objective", "Z, all together"),
        ("capital", "capital and upkeep"),
        ("harm", "harm on the road"),
        ("repair", "repair"),
    ):
        low, high = c.get(f"{name}_low"), c.get(f"{name}_high")
        ends = "" if low is None or high is None else f"{shown(low)} to {shown(high)}"
        rows.append((words, shown(c[name]), ends, shown(bare[name])))
    rows.append(("to build [EUR per metre]", shown(c["cost"]), "", shown(bare["cost"])))
    return ("", "this layout", "95 % interval", "without it"), rows


def _exact(found: LiveFigures) -> str:
    """Return an empty element with all digits of the figures, for programs that read the page."""
    assert found.costs is not None
    data = {f"layout-{k}": v for k, v in found.costs.items() if isinstance(v, float)}
    for row in found.events:
        data |= {f"{row['event']}-{k}": v for k, v in row.items() if isinstance(v, float | int)}
    cells = "".join(
        f"<data class='exact' title='{html.escape(k, quote=True)}' value='{v}'></data>"
        for k, v in data.items()
    )
    return f"<div hidden>{cells}</div>"


def _checks(found: LiveFigures, bad: str) -> str:
    """Return the uses of all checks, red above their limits."""
    assert found.checks is not None
    rows = []
    for check in found.checks.table:
        rows.append(
            (
                f"{check.barrier}: {check.check}",
                f"{check.use:.2f}" if math.isfinite(check.use) else "infinite",
                f"{check.limit:g}",
                "" if check.satisfied else "NOT MET",
            )
        )
    out = table(("check", "use", "at most", ""), rows, "Use of each check")
    out = out.replace("NOT MET", f"<b style='color:{bad};white-space:nowrap'>NOT MET</b>")
    for line in found.checks.idle:
        out += paragraph(f"No block of the design events reaches the {line}.")
    return out


def clearances(layout: Layout, road: float) -> list[tuple[str, float]]:
    """Return the label of each barrier that deflects, and its clear distance from the road [m]."""
    return [(b.label, round(road - b.end - b.deflection, 6)) for b in layout if b.deflection > 0.0]
