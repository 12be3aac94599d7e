"""The tab Slope: the survey, the ground, the road, where rock starts, and the events."""

from __future__ import annotations

import html
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import panel as pn
from bokeh.models import HoverTool, PointDrawTool

from rigdda import BadInput, Site
from rigdda.app.page import edits, parts
from rigdda.app.page.findings import Findings, Found
from rigdda.app.page.forms import Bound, button, choice, heading, number, text
from rigdda.app.page.handles import DIGITS, Handle, handles
from rigdda.app.page.loading import IMPORTING
from rigdda.app.page.locking import soon
from rigdda.app.page.section import HandleSource, Section, ground_colour
from rigdda.app.page.theme import TALL
from rigdda.app.reports.wording import survey_grid
from rigdda.app.value_origins import accepted
from rigdda.ground.grounds import GROUNDS, Ground
from rigdda.model.site_tables import ARRIVAL, RELEASE
from rigdda.model.survey import spikes

if TYPE_CHECKING:
    from rigdda.app.page.workspace import Host

Path_ = tuple[str | int, ...]

Key = tuple[Any, ...]
"""What a row of the forms depends on, other than values."""

MOST = 40
"""Points of the survey up to which each of them can be dragged."""

WIDE = 430
"""Width of the forms [pixels]."""

COUNTED = {"all releases of rock": RELEASE, "rock that reaches the road": ARRIVAL}
"""What a return period counts, in words."""


class SlopeTab:
    """The tab Slope."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.section = Section(self.theme, "Section of the slope", coordinates=True)
        self._handles: list[Handle] = []
        self._rows: dict[Key, FormRow] = {}
        self._places = HandleSource(self.section.plot, self._dragged)
        self._points = HandleSource(self.section.plot, self._dragged_point)
        self._draw_handles()
        self._checks = Findings()
        page.workspace.workers.add(self._checks)
        self._told: Found | None = None
        self._findings = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._accept = button("Accept these values", self._accept_values, visible=False)
        self._forms = pn.Column(width=WIDE, scroll=True, styles=TALL)
        self._import = self._importer()
        self._left = pn.Column(self._findings, self._accept, sizing_mode="stretch_width")
        self.panel = pn.Row(
            self._left,
            self._forms,
            sizing_mode="stretch_width",
        )

    def show(self) -> None:
        """Show the site as it is now."""
        if not self.project.has_site:
            self._forms[:] = [self._import]
            self._left[:], self._rows = [self._findings, self._accept], {}
            words = "There is no site yet: import a survey."
            self._findings.object = f"<p>{words}</p>"
            return
        site = self.project.site
        self.section.show(site)
        if self._left[0] is self._findings:  # without a ground, the figure has no ranges
            self._left[:] = [self.section.plot, self._findings, self._accept]
        self._handles = handles(site)
        self._places.show(
            {
                "x": [one.x for one in self._handles],
                "y": [one.y for one in self._handles],
                "words": [one.words for one in self._handles],
            }
        )
        near = site.slope.points if len(site.slope.points) <= MOST else ()
        self._points.show({"x": [p[0] for p in near], "y": [p[1] for p in near]})
        self._build(site)
        for row in self._rows.values():
            for one in row.bound:
                one.refresh()

    def tick(self) -> None:
        """Check a site that has changed, and show what was found."""
        if self.project.has_site:
            self._checks.ask(self.project.site, self.project.where.site)
        found = self._checks.found
        if found is not None and found is not self._told:
            self._told = found
            self._show_found(found)

    def _draw_handles(self) -> None:
        plot, theme = self.section.plot, self.theme
        places = plot.scatter(
            "x", "y", source=self._places.source, marker="circle", size=13, line_width=2,
            fill_color=theme.paper, line_color=theme.accent,
        )  # fmt: skip
        points = plot.scatter(
            "x", "y", source=self._points.source, marker="square", size=7, line_width=1,
            fill_color=theme.paper, line_color=theme.text, legend_label="points of the survey",
        )  # fmt: skip
        drag = PointDrawTool(renderers=[places, points], add=False, description="drag the handles")
        plot.add_tools(drag)
        plot.toolbar.active_drag = drag
        plot.add_tools(
            HoverTool(
                renderers=[places], description="names of the handles", attachment="below",
                tooltips=[("", "@words"), ("chainage", "@x{0.00} metres")],
            )
        )  # fmt: skip

    def _dragged(self, place: int, x: float, _: float) -> None:
        """Move what a handle stands for."""
        one = self._handles[place]
        if abs(x - one.x) > 10.0**-DIGITS / 2:
            self._change(one.moved(x), f"moved the {one.words}")
        self.show()

    def _dragged_point(self, k: int, x: float, y: float) -> None:
        """Move a point of the survey."""
        place = [round(x, DIGITS), round(y, DIGITS)]
        self.page.act(
            partial(self.project.set_value, ("slope", "points", k), place, f"moved point {k + 1}")
        )
        self.show()

    def _show_found(self, found: Found) -> None:
        """Show what `rigdda check` finds without releases, as a list."""
        odd, left = found.odd, found.placeholders
        head = "Nothing looks odd." if not odd else f"{len(odd)} to look at:"
        head = found.fault or head
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in odd)
        rest = (
            f"<p>The site file marks these values as placeholders. Change them, or accept them if "
            f"they are right: {html.escape(', '.join(left))}.</p>"
        )
        command = f"rigdda check {self.project.where.site}"
        quiet = f"color:{self.theme.quiet}"
        self._findings.object = (
            f"<p style='margin:8px 0 0;{quiet}'>{html.escape(survey_grid(self.project.site))}</p>"
            f"<h2 style='font-size:15px;margin:8px 0 2px'>{html.escape(head)}</h2>"
            f"<ul style='margin:2px 0;padding-left:20px'>{lines}</ul>"
            f"<p style='{quiet}'>The same, with a few releases: "
            f"<code>{html.escape(command)}</code></p>{rest if left else ''}"
        )
        self._accept.visible = bool(left)

    def _accept_values(self) -> None:
        self._edit(accepted, "accepted the placeholders")

    def _set(self, path: Path_, words: str) -> Callable[[Any], None]:
        """Return a function that writes a value of the site file."""

        def write(value: Any) -> None:
            self.page.act(partial(self.project.set_value, path, value, f"set {words}"))

        return write

    def _number(self, label: str, path: Path_, **more: Any) -> Any:
        found = number(label, partial(_value, self.project, path), self._set(path, label), **more)
        self._bound.append(found)
        return found.widget

    def _build(self, site: Site) -> None:
        """Build the rows of the forms that the site needs and that are not there yet."""
        before, self._rows = self._rows, {}
        for key, build in self._needed(site):
            if key in before:
                self._rows[key] = before[key]
                continue
            self._bound: list[Bound | Words] = []
            self._rows[key] = FormRow(build(), self._bound)
        if list(self._rows) != list(before):
            self._forms[:] = [one for row in self._rows.values() for one in row.panels]

    def _needed(self, site: Site) -> Iterator[tuple[Key, Callable[[], list[Any]]]]:
        """Yield the rows of the forms, each with what it depends on other than values."""
        for k, height in spikes(np.array(site.slope.points, dtype=np.float64)):
            yield ("outlier", k, round(height, 3)), partial(self._outlier, site, k, height)
        yield ("rock",), lambda: [heading("Where rock starts")]
        for i, source in enumerate(site.sources):
            yield ("source", i, source.band is None), partial(self._source, i, source.band is None)
        yield ("new band",), lambda: [button("Add a source band", self._add_band)]
        yield ("road",), self._places_of_road
        yield ("grounds",), lambda: [heading("Grounds")]
        for name in dict.fromkeys(site.slope.chain()[1]):
            known = site.surfaces[name].ground in GROUNDS
            yield ("ground", name, known), partial(self._ground_row, name, known)
        surface = site.slope.surface
        yield ("slope", surface), lambda: [text(f"The slope is {surface}, except on stretches:")]
        for i, stretch in enumerate(site.slope.surfaces):
            yield ("stretch", i, stretch.surface), partial(self._stretch, i, stretch.surface)
        yield ("new stretch",), self._new_stretch
        yield ("events",), lambda: [heading("Events")]
        sources = tuple(source.name for source in site.sources)
        for i, event in enumerate(site.events):
            place = sources.index(event.source)
            sized = site.sources[place].band is not None and event.area is not None
            from_ = place if sized else None
            yield ("event", i, sources, from_), partial(self._event, i, sources, from_)
        yield ("new event",), lambda: [button("Add an event", self._add_event)]
        yield ("description",), self._description
        yield (
            ("import",),
            lambda: [
                pn.Card(self._import, title="Import a survey", collapsed=True, width=WIDE - 30)
            ],
        )

    def _description(self) -> list[Any]:
        """Return the inputs for the name and the description of the site."""
        name = Bound(
            pn.widgets.TextInput(label="Name of the site", width=340, margin=(2, 8)),
            partial(_value, self.project, ("name",)), self._set(("name",), "the name of the site"),
        )  # fmt: skip
        words = Bound(
            pn.widgets.TextAreaInput(
                label="What is known of the slope, and by whom; it begins the report", width=380,
                height=90, margin=(2, 8),
            ),
            partial(_value, self.project, ("description",)),
            self._set(("description",), "the description of the site"),
        )  # fmt: skip
        self._bound += [name, words]
        return [heading("Description"), name.widget, words.widget]

    def _outlier(self, site: Site, k: int, height: float) -> list[Any]:
        """Return how an outlier of the survey is mended."""
        x, y = site.slope.points[k]
        words = (
            f"Point {k + 1} at chainage {x:g}, elevation {y:g} metres, is {abs(height):.1f} "
            f"metres {'above' if height > 0 else 'below'} both neighbours."
        )
        return [
            heading("A doubtful point of the survey"),
            text(words),
            pn.Row(
                button("Put it on the line", partial(self._put_on_line, k)),
                button("Remove the point", partial(self._remove_point, k)),
            ),
        ]

    def _put_on_line(self, k: int) -> None:
        (x0, y0), (x, _), (x1, y1) = self.project.site.slope.points[k - 1 : k + 2]
        share = (x - x0) / (x1 - x0) if x1 != x0 else 0.5
        place = [x, round(y0 + share * (y1 - y0), 3)]
        self.page.act(
            lambda: self.project.set_value(("slope", "points", k), place, f"mended point {k + 1}")
        )

    def _remove_point(self, k: int) -> None:
        self.page.act(
            lambda: self.project.change_site(
                lambda old: edits.without(old, ("slope", "points", k)), f"removed point {k + 1}"
            )
        )

    def _source(self, i: int, massive: bool) -> list[Any]:
        """Return the inputs for a source of rock."""
        get = partial(_value, self.project, ("sources", i, "name"))
        name = self._name("Name of the source", get, partial(self._rename_source, i))
        head = pn.Row(name, self._remover(partial(self._remove_source, i), "this source"))
        if massive:
            words = "A mass cut by joints, or surveyed blocks; edit it in the site file."
            return [head, text(words)]
        ends = [
            self._number(f"{words} end [metres]", ("sources", i, "band", k))
            for k, words in enumerate(("Upper", "Lower"))
        ]
        return [head, pn.Row(*ends)]

    def _name(self, label: str, get: Callable[[], Any], write: Callable[[Any], None]) -> Any:
        """Return an input for a name."""
        found = Bound(pn.widgets.TextInput(label=label, width=230, margin=(2, 8)), get, write)
        self._bound.append(found)
        return found.widget

    def _remover(self, do: Callable[[], object], what: str) -> Any:
        """Return a button that removes something."""
        return button("Remove", do, width=85, margin=(18, 8, 0, 8), description=f"Remove {what}")

    def _edit(self, change: Callable[[str], str], words: str) -> None:
        self.page.act(lambda: self.project.change_site(change, words))

    def _add_band(self) -> None:
        site = self.project.site
        self._edit(lambda old: parts.with_band(old, site), "added a source band")

    def _remove_source(self, i: int) -> None:
        site = self.project.site
        words = f"removed {site.sources[i].name} and its events"
        self._edit(lambda old: parts.without_source(old, site, i), words)

    def _rename_source(self, i: int, name: str) -> None:
        site = self.project.site
        self._edit(lambda old: parts.renamed_source(old, site, i, name), f"named a source {name}")

    def _places_of_road(self) -> list[Any]:
        return [
            heading("Road and barrier zone"),
            pn.Row(
                self._number("Road, uphill edge [metres]", ("road", "start")),
                self._number("Road, downhill edge [metres]", ("road", "end")),
            ),
            pn.Row(
                self._number("Zone, uphill end [metres]", ("barrier_zone", "start")),
                self._number("Zone, downhill end [metres]", ("barrier_zone", "end")),
            ),
        ]

    def _ground_row(self, name: str, known: bool) -> list[Any]:
        """Return the choice of the ground of a surface, and what it is."""
        library = {one.replace("_", " "): one for one in GROUNDS}
        options = library if known else {"own values": None} | library
        bound = choice(
            f"Ground of {name}",
            options,
            partial(self._ground, name),
            partial(self._set_ground, name),
            330,
        )
        told = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._bound += [bound, Words(told, partial(self._ground_words, name))]
        return [bound.widget, told]

    def _stretch(self, i: int, surface: str) -> list[Any]:
        """Return the inputs for a stretch of a ground."""
        name = surface.replace("_", " ")
        ends = [
            self._number(f"{name} {words} [metres]", (*parts.STRETCHES, i, end), width=145)
            for end, words in (("start", "from"), ("end", "to"))
        ]
        remove = self._remover(partial(self._remove_stretch, i), "this stretch")
        return [pn.Row(*ends, remove)]

    def _new_stretch(self) -> list[Any]:
        """Return the form that lays another stretch."""
        ground = pn.widgets.Select(
            label="Ground of a new stretch", width=330, margin=(2, 8),
            options={name.replace("_", " "): name for name in GROUNDS},
        )  # fmt: skip
        ends = [
            pn.widgets.FloatInput(label=f"{words} [metres]", value=None, width=145, margin=(2, 8))
            for words in ("From", "To")
        ]
        lay = button(
            "Add", lambda: self._add_stretch(ground.value, *(one.value for one in ends)),
            width=85, margin=(18, 8, 0, 8), description="Lay this ground over the others there",
        )  # fmt: skip
        return [ground, pn.Row(*ends, lay)]

    def _add_stretch(self, ground: str, start: float | None, end: float | None) -> None:
        site = self.project.site

        def change(old: str) -> str:
            if start is None or end is None:
                hint = "enter the chainages where the stretch begins and where it ends"
                raise BadInput("new stretch", None, hint)
            return parts.with_stretch(old, site, ground, start, end)

        self._edit(change, f"added a stretch of {ground.replace('_', ' ')}")

    def _remove_stretch(self, i: int) -> None:
        site = self.project.site
        words = f"removed a stretch of {site.slope.surfaces[i].surface}"
        self._edit(lambda old: parts.without_stretch(old, site, i), words)

    def _ground(self, name: str) -> str | None:
        found = self.project.site.surfaces[name].ground
        return found if found in GROUNDS else None

    def _ground_words(self, name: str) -> str:
        ground = GROUNDS.get(self.project.site.surfaces[name].ground or "")
        if ground is None:
            return "<p style='margin:0'>Its values are given one by one in the site file.</p>"
        spans = (
            f"friction {ground.friction_deg.low:g} to {ground.friction_deg.high:g} degrees, "
            f"restitution {ground.restitution.low:g} to {ground.restitution.high:g}, "
            f"rolling resistance {ground.rolling.low:g} to {ground.rolling.high:g}"
        )
        quiet = f"margin:0;color:{self.theme.quiet}"
        used = list(dict.fromkeys(self.project.site.slope.chain()[1]))
        colour = ground_colour(self.theme, used, name) if name in used else "none"
        mark = f"display:inline-block;width:22px;height:11px;background:{colour}"
        told = f"{html.escape(ground.words)}: {spans}"
        return f"<p style='{quiet}'><span style='{mark}'></span> {told}</p>"

    def _event(self, i: int, sources: tuple[str, ...], place: int | None) -> list[Any]:
        """Return the inputs for an event; `place` is that of its band if it has sizes of blocks."""
        get = partial(_value, self.project, ("events", i, "name"))
        name = self._name("Name of the event", get, partial(self._rename_event, i))
        source = choice(
            "Rock from", list(sources), partial(_value, self.project, ("events", i, "source")),
            self._set(("events", i, "source"), "the source of an event"), 230,
        )  # fmt: skip
        period = number(
            "Return period on 100 metres [years]", partial(_period, self.project, i),
            partial(self._set_period, i), 1.0, 230, start=1e-3,
        )  # fmt: skip
        design = Bound(
            pn.widgets.Checkbox(label="Design event", margin=(18, 8)),
            partial(_design, self.project, i),
            self._set(("events", i, "design"), "design event"),
        )
        counted = choice(
            "The return period counts", COUNTED,
            partial(_value, self.project, ("events", i, "rate_of")),
            self._set(("events", i, "rate_of"), "what a return period counts"), 230,
        )  # fmt: skip
        self._bound += [source, period, design, counted]
        rows = [
            pn.Row(name, self._remover(partial(self._remove_event, i), "this event")),
            source.widget,
            pn.Row(period.widget, design.widget),
            counted.widget,
        ]
        return rows if place is None else rows + self._sizes(i, place)

    def _add_event(self) -> None:
        site = self.project.site
        self._edit(lambda old: parts.with_event(old, site), "added an event")

    def _remove_event(self, i: int) -> None:
        words = f"removed {self.project.site.events[i].name}"
        self._edit(lambda old: parts.without_event(old, self.project.site, i), words)

    def _sizes(self, i: int, place: int) -> list[Any]:
        """Return the inputs for the volumes of the blocks of an event, and their shapes."""
        volumes = [
            number(
                f"{words} volume [cubic metres]", partial(_volume, self.project, i, k),
                partial(self._set_volume, i, k), 0.1, 170, start=1e-4,
            )
            for k, words in enumerate(("Least", "Greatest"))
        ]  # fmt: skip
        self._bound += volumes
        event = self.project.site.events[i]
        power_law = event.volume_median is None and not event.volumes
        exponent = ("events", i, "exponent")
        shape = [
            *([self._number("Exponent of volumes [-]", exponent, step=0.1, width=150)]
              if power_law else []),
            number(
                "Longest over broadest [-]",
                partial(_value, self.project, ("sources", place, "aspect", 1)),
                partial(self._set_aspect, place), 0.1, 170, start=1.0,
            ),
        ]  # fmt: skip
        return [pn.Row(*(one.widget for one in volumes)), pn.Row(*shape)]

    def _set_period(self, i: int, years: float) -> None:
        values: dict[Path_, Any] = {
            ("events", i, "rate"): None,
            ("events", i, "section_length"): None,
            ("events", i, "return_period"): years,
        }
        self._change(values, "set the return period")

    def _set_volume(self, i: int, k: int, volume: float) -> None:
        both = [_volume(self.project, i, j) for j in (0, 1)]
        both[k] = volume
        values: dict[Path_, Any] = {("events", i, "area"): None, ("events", i, "volume"): both}
        self._change(values, "set the volume of blocks")

    def _set_ground(self, name: str, ground: str | None) -> None:
        """Set the ground of a surface; values of its own would hide those of the ground."""
        values: dict[Path_, Any] = {("surfaces", name, "ground"): ground}
        if ground is not None:
            values |= {("surfaces", name, field): None for field in Ground._fields[1:]}
        self._change(values, f"set the ground of {name}")

    def _rename_event(self, i: int, name: str) -> None:
        site = self.project.site
        self._edit(lambda old: parts.renamed_event(old, site, i, name), "set the name of an event")

    def _set_aspect(self, place: int, longest: float) -> None:
        least = self.project.site.sources[place].aspect[0]
        values: dict[Path_, Any] = {("sources", place, "aspect"): [min(least, longest), longest]}
        self._change(values, "set the shape of blocks")

    def _change(self, values: dict[Path_, Any], words: str) -> None:
        self.page.act(lambda: self.project.set_values(values, words))

    def _importer(self) -> Any:
        """Return the form that makes a site of a survey."""
        name = pn.widgets.TextInput(label="Name of the site", value="section", width=340)
        file = pn.widgets.FileInput(
            label="Survey (CSV or DXF)", accept=".csv,.txt,.tsv,.xyz,.dat,.dxf", width=340
        )
        layer = pn.widgets.TextInput(label="Layer of a drawing, if it has several", width=340)
        road = [
            pn.widgets.FloatInput(label=f"Road, {w} edge [metres]", value=None, width=160)
            for w in ("one", "other")
        ]

        def begin() -> None:
            self.page.say("One moment: the survey is read.")
            soon(make)

        def make() -> None:
            notes: list[str] = []
            ends = [one.value for one in road]
            if self.page.act(
                lambda: notes.extend(
                    self._import_survey(name.value, file, layer.value or None, ends)
                )
            ):
                self.page.say(" — ".join([f"The site is made of {file.filename}", *notes]))

        return pn.Column(
            text("A table (CSV) with chainage and elevation in metres, or a drawing (DXF) with a "
                 "polyline. The edges of the road are chainages of the survey. What is left "
                 "empty becomes a placeholder to replace."),
            name, file, layer, pn.Row(*road),
            button("Make the site", begin, primary=True),
            width=WIDE - 40,
        )  # fmt: skip

    def _import_survey(
        self, name: str, file: Any, layer: str | None, road: list[Any]
    ) -> tuple[str, ...]:
        """Make a site of the survey in the place of the present one, and return what to note."""
        with IMPORTING:
            from rigdda.app import new_site

        if not file.value:
            raise BadInput("survey", None, "choose a file first")
        if road.count(None) == 1:
            raise BadInput("road", str(road), "give both edges of the road, or neither")
        ends = (road[0], road[1]) if None not in road else None
        with tempfile.TemporaryDirectory() as folder:
            suffix = Path(file.filename or "").suffix.lower()
            copy = Path(folder) / f"survey{suffix}"
            copy.write_bytes(file.value)
            request = new_site.SiteRequest(road=ends, layer=layer)
            try:
                made, found = new_site.compose(name, copy, request)
            except BadInput as bad:
                own = str(bad.field).replace(str(copy), file.filename)
                raise BadInput(own, bad.value, bad.hint) from None
        self.project.change_site(lambda _: made, f"imported {file.filename}")
        return tuple(found.notes)


class FormRow(NamedTuple):
    """A row of the forms."""

    panels: list[Any]
    bound: list[Bound | Words]
    """What follows the project."""


class Words:
    """A text that follows the project."""

    def __init__(self, pane: Any, get: Callable[[], str]):
        self.pane, self._get = pane, get
        self.refresh()

    def refresh(self) -> None:
        """Show the text as it is now."""
        self.pane.object = self._get()


def _value(project: Any, path: Path_) -> Any:
    """Return the value of a site at the path of its file."""
    found = project.site
    for key in path:
        found = (
            found[key] if isinstance(key, int) or isinstance(found, dict) else getattr(found, key)
        )
    return found


def _period(project: Any, i: int) -> float:
    """Return the mean time between two events on 100 m [years]."""
    rate = project.site.events[i].rate
    return float(f"{1.0 / rate:.10g}") if rate > 0.0 else float("inf")


def _design(project: Any, i: int) -> bool:
    return bool(project.site.events[i].design)


def _volume(project: Any, i: int, k: int) -> float:
    """Return the least or the greatest volume of the blocks of an event [m3]."""
    return float(f"{project.site.events[i].area[k] ** 1.5:.6g}")
