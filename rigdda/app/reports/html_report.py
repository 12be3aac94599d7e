"""The report of results folders: one HTML page that needs no other file and no network.

`EXHIBITS` lists the tables and pictures of results folders that it shows, `SECTIONS` what is said
besides them; what a site file states (grounds, events and prices) is one of the sections.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

import rigdda
from rigdda import BadInput, Site, Surface
from rigdda.agents.run_record import RunRecord
from rigdda.app import site_check
from rigdda.app.reports import findings
from rigdda.app.reports.findings import DesignAnswer, FailedCheck, headline
from rigdda.app.reports.html_blocks import (
    FIELD,
    Block,
    Column,
    Figures,
    Heading,
    Items,
    Listing,
    Paragraph,
    ResultsFolder,
    Row,
    Table,
    bounded,
    interval,
    listed,
    money,
    picture,
    plain,
    spread,
    table,
    value,
    words,
)
from rigdda.app.reports.stations import ALL_EVENTS, PASSING_RATE, QUANTITIES
from rigdda.app.reports.stations import PRINTED as MAIN
from rigdda.app.reports.tables import RISKS
from rigdda.app.reports.wording import (
    at_most,
    before,
    euros,
    figure,
    order,
    percent,
    small,
    span,
    tenth,
)
from rigdda.barriers import describe, from_table
from rigdda.envs.problem import Targets
from rigdda.fields import described
from rigdda.files import atomic
from rigdda.ground.grounds import GROUNDS, Span
from rigdda.ground.prices import Consequences, Prices

PER_YEAR = "EUR per metre of road and year"
"""Unit of annual costs."""


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A table or picture of a results folder that is shown in a section.

    Parameters
    ----------
    section : str
        Name of the section.
    files : str
        Name of the file, or a pattern such as "station_*.png". Of a picture that ends in .png, the
        vector picture beside it is shown.
    title, words : str
        Title and explanation. In the title, {part} is what the star in the pattern stands for.
    columns : tuple of Column
        Columns of a table; by default all of the file.
    shown : callable
        Function of a row that returns whether the row is shown.
    command : str
        Command whose file is meant; empty if any.
    """

    section: str
    files: str
    title: str
    words: str = ""
    columns: tuple[Column, ...] = ()
    shown: Callable[[Row], bool] = lambda row: True
    command: str = ""


def _main(row: Row) -> bool:
    """Return whether a row of the table of stations is shown: of single events only the main."""
    return row["event"] == ALL_EVENTS or row["quantity"] in (*MAIN, PASSING_RATE)


def _called(name: str, barriers: str) -> str:
    """Return the name of a layout with its barriers."""
    bare = ("", "no barrier", name)
    return name if barriers in bare else f"{name}: {barriers}"


def _barriers(text: str) -> str:
    """Return the barriers of a JSON list of tables, as in a layout file, in words."""
    try:
        found = [from_table(f"barriers[{i}]", row) for i, row in enumerate(json.loads(text))]
    except (ValueError, TypeError, BadInput):
        return text
    return "; ".join(map(describe, found)) or "no new barrier"


def _budget(text: str) -> str:
    """Return a budget: an amount of money, or the word that stands for none."""
    try:
        return euros(float(text))
    except ValueError:
        return text


def _quantity(name: str, unit: str) -> str:
    """Return the name of a quantity with its unit."""
    said = QUANTITIES[name].words if name in QUANTITIES else name.replace("_", " ")
    return f"{said} [{unit}]"


EXHIBITS = (
    Exhibit(
        "passing",
        "section.png",
        "Trajectories and envelopes",
        "Some trajectories of each event to scale, and the heights and energies that 95 % of the "
        "passing blocks stay below, from all releases.",
        command="simulate",
    ),
    Exhibit(
        "passing",
        "stations.csv",
        "What passes the stations",
        "Means, and quantiles with the ends of their 95 % intervals, from n passing blocks; “?” "
        "where there are too few blocks for an end. Energies are those of a whole block. The "
        "passing rate counts releases with at least one passing block.",
        (
            value("x [m]", "x_m", plain),
            words("event", "event"),
            Column("quantity", ("quantity", "unit"), _quantity, number=False),
            value("n", "n"),
            value("mean", "mean"),
            value("50 %", "q50"),
            value("90 %", "q90"),
            interval("95 %", "q95"),
            interval("99 %", "q99"),
        ),
        _main,
    ),
    Exhibit("passing", "station_*m.png", "Histograms at x = {part} m",
            "Shares of the passing blocks, and the quantiles over all events."),
    Exhibit("passing", "along_slope.png", "Along the slope",
            "Quantiles over all events, and how often a release passes."),
    Exhibit("passing", "run_out.png", "Run-out",
            "How often rock stops beyond each chainage, also beyond the road."),
    Exhibit(
        "passing",
        "stopping.csv",
        "Run-out of half and of 95 % of the rock",
        "Chainage within which this share of the rock of all releases comes to rest, also beyond "
        "the road, with its 95 % interval. Blocks count by mass, and events by rate. It is a lower "
        "bound if it depends on rock that left the surveyed ground or still moved at the end, of "
        "which the shares are given.",
        (
            words("event", "event"),
            value("share of the rock", "share", percent),
            interval("x [m]", "x_m", tenth),
            words("", "bound"),
            value("left the ground", "left", percent),
            value("still moving", "moving", percent),
            value("releases", "releases"),
            value("blocks", "n"),
        ),
    ),
    Exhibit(
        "layouts",
        "layouts.csv",
        "Cost of each layout",
        f"Z is the sum of capital and upkeep, expected harm on the road and expected repair, in "
        f"{PER_YEAR} with 95 % intervals. To build: EUR per metre of road. Debris: volume on the "
        "road, relative to the first layout. rule: the fence of UNI 11211-4; rock shed: a "
        "reference with full protection. All layouts were verified on the same number of releases "
        "that the search did not use.",
        (
            Column("layout", ("layout", "barriers"), _called, number=False),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            interval("harm", "harm", euros),
            interval("repair", "repair", euros),
            money("to build", "cost"),
            value("debris", "debris_share", percent),
            words("targets", "targets"),
            value("releases", "releases"),
        ),
        command="design",
    ),
    Exhibit(
        "layouts",
        "chances.csv",
        "Probabilities by event",
        "Probability that a block of a release reaches the road and that a barrier fails, with "
        "one-sided 95 % upper bounds, from the given number of releases; and the expected harm and "
        f"repair of the event in {PER_YEAR}.",
        (
            words("event", "event"),
            words("design event", "design"),
            words("layout", "layout"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            money("harm and repair", "cost"),
            value("releases", "releases"),
        ),
    ),
    Exhibit("layouts", "section.png", "The slope without and with the layout",
            "Some trajectories of each event to scale. Below, the heights and energies that 95 % "
            "of the passing blocks stay below without it.", command="design"),
    Exhibit("layouts", "cost.png", "Cost and risk",
            "Annual capital cost of layouts against their remaining risk. Z is the same along the "
            "thin lines."),
    Exhibit(
        "layouts",
        "layouts.csv",
        "Cost of each layout of the study",
        f"Z is the sum of capital and upkeep, expected harm on the road and expected repair, in "
        f"{PER_YEAR} with 95 % intervals. To build: EUR per metre of road.",
        (
            words("layout", "layout"),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            interval("harm", "harm", euros),
            interval("repair", "repair", euros),
            money("to build", "cost"),
        ),
        command="study",
    ),
    Exhibit(
        "layouts",
        "events.csv",
        "Probabilities and energies by event",
        "Probability that a block of a release reaches the road and that a barrier fails, with "
        "one-sided 95 % upper bounds; 95 % quantiles of the largest energies on the road and of a "
        f"hit in kJ per metre of width; harm and repair of the event in {PER_YEAR}.",
        (
            words("event", "event"),
            words("layout", "layout"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            money("on the road", "energy_on_road_95"),
            money("hit", "energy_of_hit_95"),
            money("harm and repair", "harm_and_repair"),
            value("releases", "releases"),
        ),
        command="study",
    ),
    Exhibit(
        "layouts",
        "differences.csv",
        "Differences of layouts",
        f"Z of the first layout minus Z of the second in {PER_YEAR}, with 95 % intervals on common "
        "releases.",
        (
            words("layout", "one"),
            words("minus", "two"),
            spread("difference", ("difference", "low", "high"), euros),
            words("they differ", "differ"),
            value("releases", "releases"),
        ),
        command="study",
    ),
    Exhibit("layouts", "sections.png", "Layouts of the study in section", command="study"),
    Exhibit("layouts", "costs.png", "Costs of the layouts of the study", command="study"),
    Exhibit(
        "layouts",
        "worst.csv",
        "The worst releases of the study",
        "Releases with the most energy on the road, and releases in which a barrier fails. "
        "`rigdda replay` with the event and the seed shows each of them.",
        (
            words("layout", "layout"),
            words("why", "why"),
            words("event", "event"),
            value("seed", "seed"),
            value("energy on the road [kJ/m]", "energy_on_road"),
            value("volume on the road [m3]", "road_volume"),
        ),
        command="study",
    ),
    Exhibit("layouts", "worst.png", "The worst releases of the study in section", command="study"),
    Exhibit(
        "layouts",
        "costs.csv",
        "Costs with other prices, rates or consequences",
        f"The layouts of the design, priced anew. Z and its parts in {PER_YEAR}; to build: EUR per "
        "metre of road.",
        (
            words("layout", "layout"),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            money("harm", "harm"),
            money("repair", "repair"),
            money("to build", "cost"),
            words("targets", "targets"),
            words("verified", "verified"),
            value("releases", "releases"),
        ),
        command="reprice",
    ),
    Exhibit(
        "checks",
        "checks.csv",
        "Checks of the barriers",
        "Demand and capacity of each barrier, and their ratio (use) beside its limit.",
        (
            words("barrier", "barrier"),
            value("x [m]", "x_m", plain),
            words("check", "check"),
            value("demand", "demand"),
            value("capacity", "capacity"),
            words("unit", "unit"),
            value("use", "use"),
            value("limit", "limit"),
            words("satisfied", "satisfied"),
            words("note", "note"),
        ),
    ),
    Exhibit("checks", "design_sheet.csv", "Design sheets of the fences",
            "The design of each fence, factor by factor."),
    Exhibit("checks", "demand.png", "What the rule demands along the slope",
            "Class and height of a fence that the engineering rule demands at each chainage."),
    Exhibit(
        "risk",
        "risk.csv",
        "Risk to life and traffic of each layout",
        "Expected numbers per year on the section of road below the site, with 95 % intervals: "
        "vehicles that falling rock hits, vehicles that run into debris, deaths, deaths per km of "
        "road, and the probability that one commuter is killed.",
        (
            words("layout", "layout"),
            interval("vehicles hit", "hit", small),
            interval("run into debris", "run_into", small),
            interval("deaths", "fatalities", small),
            interval("deaths per km", "per_km", small),
            interval("one commuter", "individual", small),
        ),
    ),
    Exhibit("sureness", "sensitivity.csv", "Sensitivity to the inputs",
            "Influence of each input on each output, the most important first."),
    Exhibit("sureness", "tornado.png", "Sensitivity to the inputs",
            "Average change of the outputs over the range of each input, and the index of each."),
    Exhibit("sureness", "band.csv", "The layouts on other grounds",
            f"Z in {PER_YEAR} and probabilities of each layout on grounds within the plausible "
            "range."),
    Exhibit("sureness", "band.png", "The layouts on other grounds",
            "Z of each layout on each ground, ordered by Z of the first layout."),
    Exhibit("sureness", "fit.csv", "Fit to observations",
            "Fitted numbers with 95 % intervals, and how well the fit predicts observations that "
            "were left out."),
    Exhibit("sureness", "fit.png", "Fit to observations"),
    Exhibit(
        "frontier",
        "frontier.csv",
        "Cheapest layouts for each probability",
        "The cheapest layout that was evaluated for each probability that a block of a design "
        "event reaches the road, with one-sided 95 % upper bounds. To build: EUR per metre of "
        f"road; Z in {PER_YEAR}, of layouts that were verified.",
        (
            Column("layout", ("barriers",), _barriers, number=False),
            money("to build", "cost"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            interval("Z", "objective", euros),
            words("verified", "verified"),
            value("releases", "releases"),
        ),
    ),
    Exhibit("frontier", "frontier.png", "Cost and probability",
            "Probability that a block reaches the road against the cost to build."),
    Exhibit(
        "corridor",
        "budgets.csv",
        "What each budget achieves",
        "Money spent and gain in EUR and EUR per year, with 95 % intervals; share of the gain of "
        "unlimited money; saving of one more EUR per year.",
        (
            Column("budget", ("budget",), _budget, number=False),
            words("method", "method"),
            money("spent", "spent"),
            interval("gain", "gain", euros),
            value("share", "share_of_unlimited", percent),
            value("sections built", "sections_built"),
            value("one more EUR saves", "shadow_price"),
        ),
    ),
    Exhibit("corridor", "gain.png", "Gain and budget"),
    Exhibit("corridor", "strip.png", "What is built along the corridor"),
    Exhibit(
        "corridor",
        "sections.csv",
        "What is built in each section",
        f"Cost and gain of a section in EUR and EUR per year; Z in {PER_YEAR}.",
        (
            Column("budget", ("budget",), _budget, number=False),
            words("section", "section"),
            value("length [m]", "length", plain),
            words("layout", "layout"),
            money("cost", "cost"),
            money("gain", "gain"),
            interval("Z", "Z", euros),
            money("Z without", "Z_without_barriers"),
        ),
    ),
    Exhibit("corridor", "priorities.csv", "What should be built next"),
)  # fmt: skip
"""What is shown of each results folder, in the order of the report. A new table or picture needs
one entry here; tables without an entry are listed in the appendix."""

LONG_TABLES = {
    "evaluations.csv": "layouts that the search evaluated",
    "outcomes.csv": "one row for each release: what reached the road and each barrier",
    "passages.csv": "one row for each passage of a block at a station",
    "along_slope.csv": "quantiles at evenly spaced stations along the slope",
    "run_out.csv": "how often rock stops beyond each chainage",
    "stops.csv": "where each block stopped",
    "study.csv": "one row for each release with each layout",
    "points.csv": "one row for each block of the lumped-mass model",
    "demand.csv": "what the engineering rule demands at stations along the slope",
    "samples.csv": "one row for each point of a sensitivity analysis",
    "posterior.csv": "samples of the fitted numbers",
    "fronts.csv": "all layouts of each section of a corridor",
}
"""Tables that are too long to show, and what they hold."""


PROPERTIES = {
    "friction_deg": ("friction angle", "deg"),
    "restitution": ("restitution", "-"),
    "rolling": ("rolling resistance", "-"),
    "restitution_speed": ("impact speed of half restitution", "m/s"),
    "roughness": ("depth of pits", "m"),
}
"""Words and units of the properties of a ground."""

SPREADS = {
    "friction_deg": "friction_sd_deg",
    "restitution": "restitution_sd",
    "rolling": "rolling_sd",
}
"""Fields with the standard deviations of properties that vary."""


def site_blocks(site: Site) -> Iterator[Block]:
    """Yield the description of the site, a section, and sentences on what was computed."""
    yield Paragraph(site.description)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "site.png"
        site_check.draw(file, site)
        caption = "Ground, sources of rock, barrier zone and road, to scale."
        yield picture(file.with_suffix(".svg"), "Section of the site", caption, "site")
    yield Items([_sentence(line, site.name) for line in site_check.facts(site)])


def _sentence(line: str, name: str) -> str:
    """Return a line as a sentence; one that begins with the name of the site keeps it."""
    return f"{line}." if line.startswith(name) else f"{line[0].upper()}{line[1:]}."


def event_table(site: Site) -> Table:
    """Return the table of the events with their rates and sizes."""
    rows = []
    for event in site.events:
        source = site.source(event.source)
        number, areas = site_check.blocks_of(event, source)
        volumes = [area**1.5 for area in areas]
        rows.append((
            event.name,
            source.name,
            "yes" if event.design else "no",
            figure(event.rate),
            figure(1.0 / event.rate) if event.rate > 0.0 else "never",
            number,
            site_check.range_of(volumes),
            site_check.range_of([volume * source.density / 1e3 for volume in volumes]),
        ))  # fmt: skip
    head = ("event", "source", "design event", "1/year", "years", "blocks", "m³", "t")
    words = (
        "How often each event happens on 100 m of slope, as a rate and as a return period, and the "
        "number, volume and mass of its blocks. A block is as long along the road as the root of "
        "its cross-section. Targets apply to design events."
    )
    return listed("Events", words, head, rows, head[3:])


def ground_table(site: Site) -> Table:
    """Return the table of the surfaces: values, plausible ranges and their sources."""
    rows = [row for name in _used(site) for row in _surface(name, site.surfaces[name])]
    words = (
        "Values of rigid blocks with corners, with their plausible ranges where the ground is in "
        "the library. ±: standard deviation from release to release. They are the least certain "
        "input; where a source is “assumed”, only an observation can confirm the value."
    )
    head = ("surface", "property", "value", "range", "source")
    return listed("Ground", words, head, rows, ("value", "range"))


def _used(site: Site) -> list[str]:
    """Return the surfaces of the ground, from the crest on, and then all others of the site."""
    return [*dict.fromkeys((*site.slope.chain()[1], *site.surfaces))]


def _surface(name: str, surface: Surface) -> Iterator[tuple[str, ...]]:
    """Yield a row for each property of a surface."""
    ground = GROUNDS.get(surface.ground)
    called = f"{name} ({ground.words})" if ground else name
    for field, (meaning, unit) in PROPERTIES.items():
        value = getattr(surface, field)
        if value is None or (value == 0.0 and field == "roughness"):
            continue
        spread = getattr(surface, SPREADS[field]) if field in SPREADS else 0.0
        text = plain(value) + (f"\u00a0±\u00a0{plain(spread)}" if spread else "")
        known = getattr(ground, field) if ground else None
        known = known if isinstance(known, Span) else None
        ends = f"{plain(known.low)}\u00a0to\u00a0{plain(known.high)}" if known else "-"
        yield called, f"{meaning} [{unit}]", text, ends, _source(value, known)
        called = ""


def _source(value: float, known: Span | None) -> str:
    """Return where a value comes from."""
    if known is None:
        return "site file"
    if value == known.typical:
        return known.source
    return f"site file; library: {plain(known.typical)}, {known.source}"


def price_blocks(site: Site) -> Iterator[Block]:
    """Yield the tables of prices, of the cost of rock on the road and of the traffic."""
    yield _value_table("Prices of barriers", "price", site.prices)
    yield _value_table("Cost of rock on the road", "price", site.consequences)
    if site.traffic is not None:
        yield _value_table("Traffic", "quantity", site.traffic)


def _value_table(title: str, what: str, given: msgspec.Struct) -> Table:
    """Return the table of values of a site file, each with its unit and whether it is a default."""
    usual = {field.name: _default(field) for field in msgspec.structs.fields(given)}
    rows = []
    for field in described(type(given)):
        value = getattr(given, field.name)
        if field.name == "source" or value in ("", None):
            continue
        same = value == usual[field.name]
        unit = f" [{field.unit}]" if field.unit not in ("", "-") else ""
        rows.append(
            (field.text.rstrip(".") + unit, _written(value), "default" if same else "given")
        )
    source = getattr(given, "source", "")
    words = f"Source: {source}." if source else ""
    return listed(title, words, (what, "value", "from"), rows)


def _default(field: msgspec.structs.FieldInfo) -> Any:
    """Return the default of a field; `msgspec.NODEFAULT` if it has none."""
    if field.default_factory is not msgspec.NODEFAULT:
        return field.default_factory()
    return field.default


def _written(value: Any) -> str:
    """Return a number, or a table of numbers, as text."""
    if isinstance(value, dict):
        return "; ".join(
            f"{name.replace('_', ' ')}: {_written(one)}" for name, one in value.items()
        )
    return f"{value:,.10g}" if isinstance(value, int | float) else str(value)


def default_values(site: Site) -> list[str]:
    """Return warnings about prices that are still the defaults of the program."""
    found = []
    for subject, given, usual in (
        ("The prices of barriers are", site.prices, Prices()),
        ("The costs of rock on the road are", site.consequences, Consequences()),
    ):
        if given == usual:
            found.append(
                f"{subject} the defaults of the program, which are orders of magnitude: replace "
                "them before a decision."
            )
    return found


def site_differences(site: Site, other: Site) -> list[str]:
    """Return what differs between two sites, one line for each value."""
    return [*_differ("", msgspec.to_builtins(site), msgspec.to_builtins(other))]


def _differ(path: str, one: Any, other: Any) -> Iterator[str]:
    """Yield the values that differ, with their paths in the site file."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys((*one, *other)):
            yield from _differ(f"{path}.{key}".lstrip("."), one.get(key), other.get(key))
    elif (
        isinstance(one, list | tuple) and isinstance(other, list | tuple) and len(one) == len(other)
    ):
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            name = a.get("name", i) if isinstance(a, dict) else i
            yield from _differ(f"{path}.{name}", a, b)
    elif one != other:
        yield f"{path} = {_short(other)} instead of {_short(one)}"


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def stated_assumptions(site: Site) -> Iterator[Block]:
    """Yield the assumptions: events, grounds and prices, with their sources."""
    for warning in default_values(site):
        yield Paragraph(warning, "warning")
    yield event_table(site)
    yield ground_table(site)
    yield from price_blocks(site)


Folders = Sequence[ResultsFolder]


@dataclass(frozen=True, slots=True)
class ReportSection:
    """A section: its name in `EXHIBITS`, its title, and what it says besides the exhibits."""

    name: str
    title: str
    opening: Callable[[Folders], Iterable[Block]] = lambda folders: ()


METHOD_LIMITS = (
    "The section is two-dimensional. Blocks do not leave its plane, and channels or ridges that "
    "gather or spread rock along the road are not seen.",
    "A block is as long along the road as the root of its cross-section. Volumes, masses and "
    "energies of whole blocks rest on this.",
    "Blocks are rigid and do not break. A block that shatters loses energy, and its fragments may "
    "fly farther.",
    "Trees, snow and water are neglected.",
    "The loss of energy at the ground is the least certain input. Where it was not fitted to "
    "observed run-outs, deposits or impacts, results may change by more than their intervals.",
    "Intervals describe the random variation of the releases only. They do not cover errors of the "
    "profile, the ground, the rates of events, the sizes of blocks or the prices.",
    "Rates of events are inputs. Costs and rates of passage are proportional to them.",
    "Barriers are idealised: a fence yields until its elongation is used up, a wall slides or "
    "overturns as a rigid body, a ditch fills up. Foundations, anchors and the stability of the "
    "slope itself are not designed.",
    "The program supports a decision. The engineer who signs it is responsible for it.",
)
"""Limits of the method."""


def _titled(blocks: list[Block], title: str, many: bool) -> list[Block]:
    """Return blocks below a heading if there are several folders, and any blocks at all."""
    return [Heading(title), *blocks] if many and blocks else blocks


def shown_exhibits(section: str, folders: Folders) -> list[Block]:
    """Return the tables and pictures of all folders that a section shows."""
    many, found = len(folders) > 1, list[Block]()
    for k, folder in enumerate(folders):
        own = [e for e in EXHIBITS if e.section == section]
        blocks = [
            block for i, e in enumerate(own) for block in _show(e, folder, f"{section}{k}{i}")
        ]
        found += _titled(blocks, f"Results in {folder.label}", many)
    return found


def _show(exhibit: Exhibit, folder: ResultsFolder, mark: str) -> Iterator[Block]:
    """Yield an exhibit for each file of a folder that matches it."""
    before, _, after = exhibit.files.partition("*")
    for i, name in enumerate(folder.files(exhibit.files, exhibit.command)):
        title = exhibit.title.format(part=name.removeprefix(before).removesuffix(after))
        if name.endswith(".csv"):
            yield table(folder, name, title, exhibit.words, exhibit.columns, exhibit.shown)
        else:
            yield picture(folder.picture(name), title, exhibit.words, f"{mark}{i}")


def summary_section(folders: Folders) -> Iterator[Block]:
    """Yield the main result: what to build and what that saves, or which rock comes down."""
    designs = [folder for folder in folders if folder.files("layouts.csv", "design")]
    for folder in designs:
        yield from _titled([*_design_blocks(folder)], f"Design in {folder.label}", len(designs) > 1)
    passing = [block for f in folders if f.files("stations.csv") for block in _passing(f)]
    yield from _titled(passing, "What comes down", bool(designs))
    site = _site_of(folders)
    lines = [f"{line}" for folder in folders for line in _findings(folder, len(folders) > 1)]
    if site is not None and designs:
        lines += default_values(site)
    if lines:
        yield Heading("What limits this answer")
        yield Items(lines)


def _findings(folder: ResultsFolder, many: bool) -> Iterator[str]:
    """Yield the findings of the commands in a folder, which they printed."""
    for record in folder.records.values():
        for line in record.findings:
            text = line[0].upper() + line[1:] + ("" if line.endswith((".", "?", "!")) else ".")
            yield f"{folder.label}: {text}" if many else text


def _design_blocks(folder: ResultsFolder) -> Iterator[Block]:
    """Yield what to build, where, what it costs and what it saves."""
    _, rows = folder.table("layouts.csv", ("chosen", "objective_low", "objective_high"))
    chosen = next((row for row in rows if row["chosen"] == "True"), None)
    if chosen is None:
        hint = "no row is the chosen one: run the command that made it again"
        raise BadInput(FIELD, str(folder.path / "layouts.csv"), hint)
    site, targets = folder.site, chosen["targets"]
    layout = rigdda.load_layout(folder.path / "layout.toml")
    line = headline(_answer(folder, chosen, rows[0]))
    yield Paragraph(line, "answer" if line.startswith("Build") else "warning")
    if site is not None and site.existing:
        yield Items(findings.existing_barriers(site, layout))
    if targets == "met":
        yield Paragraph(f"This layout meets the target that {_asked(folder)}.", "good")
    z, nothing = _money_of(chosen), _money_of(rows[0])
    bare = before(site) if site is not None else "without barriers"
    yield Figures([
        ("To build", f"{euros(float(chosen['cost']))} EUR", "per metre of road"),
        ("Annual cost Z", f"{z} EUR", f"per metre and year with it ({_ends_of(chosen)})"),
        (bare.capitalize(), f"{nothing} EUR", f"per metre and year ({_ends_of(rows[0])})"),
        *_chances(folder, chosen["layout"], rows[0]["layout"], bare),
        *_individual(folder, chosen["layout"], rows[0]["layout"], bare),
    ])  # fmt: skip


def _answer(folder: ResultsFolder, chosen: Row, nothing: Row) -> DesignAnswer:
    """Return what the first line of a design needs, from its files."""
    site, options = folder.site, folder.records["design"].options
    layout = rigdda.load_layout(folder.path / "layout.toml")
    words = [order(barrier, site) if site is not None else barrier.label for barrier in layout]
    _, rows = folder.table("checks.csv") if folder.files("checks.csv") else ([], [])
    failed = [
        FailedCheck(
            f"{row['barrier']}, at {float(row['x_m']):.1f} m",
            row["check"],
            float(row["use"]) / float(row["limit"]),
        )
        for row in rows
        if row["satisfied"] == "False"
    ]
    names = ("objective", "objective_low", "objective_high")
    return DesignAnswer(
        layout="; ".join(words),
        bare=before(site) if site is not None else "without barriers",
        z=(float(chosen[names[0]]), float(chosen[names[1]]), float(chosen[names[2]])),
        nothing=(float(nothing[names[0]]), float(nothing[names[1]]), float(nothing[names[2]])),
        targets=chosen["targets"] or None,
        asked=_asked(folder),
        required=options.get("checks") == "required",
        failed=failed,
        reaching=_reaching(folder, chosen["layout"]),
    )


def _asked(folder: ResultsFolder) -> str:
    """Return the targets of a design in words."""
    options = folder.records["design"].options
    return findings.asked_words(
        Targets(options.get("target"), options.get("failure"), options.get("target_risk"))
    )


def _reaching(folder: ResultsFolder, layout: str) -> tuple[str, float]:
    """Return the design event that most often reaches the road with a layout, and how often [-]."""
    _, rows = folder.table("chances.csv") if folder.files("chances.csv") else ([], [])
    own = {
        row["event"]: float(row["reach"])
        for row in rows
        if row["layout"] == layout and row["design"] == "True"
    }
    most = max(own, key=lambda name: own[name], default="")
    return most, own.get(most, 0.0)


def _money_of(row: Row) -> str:
    return euros(float(row["objective"]))


def _ends_of(row: Row) -> str:
    return span((float(row["objective_low"]), float(row["objective_high"])))


def _individual(
    folder: ResultsFolder, name: str, without: str, bare: str
) -> Iterator[tuple[str, str, str]]:
    """Yield the individual risk with a layout and without it, if the site gives traffic."""
    _, rows = folder.table(RISKS) if folder.files(RISKS) else ([], [])
    own = {row["layout"]: row for row in rows}
    if name in own and without in own:
        now, then = (float(own[layout]["individual"]) for layout in (name, without))
        high = float(own[name]["individual_high"])
        rest = f"a year, at most {small(high, 'up')}; {bare} {then:.2g}"
        yield "A commuter is killed", f"{now:.2g}", rest


def _chances(
    folder: ResultsFolder, name: str, without: str, bare: str
) -> Iterator[tuple[str, str, str]]:
    """Yield the probabilities of the design events with a layout, and without it."""
    _, rows = folder.table("chances.csv") if folder.files("chances.csv") else ([], [])
    for row in rows:
        if row["design"] == "True" and row["layout"] == name:
            earlier = next(r for r in rows if r["event"] == row["event"] and r["layout"] == without)
            reach, bound = float(row["reach"]), float(row["reach_bound"])
            rest = f"at most {at_most(bound)}; {bare} {percent(float(earlier['reach']))}"
            yield f"“{row['event']}” reaches the road", percent(reach), rest
            fails, bound = float(row["failure"]), float(row["failure_bound"])
            if name != without:
                yield f"A barrier fails in “{row['event']}”", percent(fails), (
                    f"at most {at_most(bound)}"
                )  # fmt: skip


def _passing(folder: ResultsFolder) -> Iterator[Block]:
    """Yield what passes the stations of a simulation, in sentences."""
    _, rows = folder.table("stations.csv")
    last = rows[-1]["event"] if rows else ""
    record = folder.records.get("simulate")
    layout = record.options.get("layout") if record else None
    bare = before(folder.site) if folder.site is not None else "without barriers"
    what = f"with the layout of {layout}" if layout else bare
    lines = []
    for row in rows:
        if row["event"] == last and row["quantity"] == PASSING_RATE:
            own = {r["quantity"]: r for r in rows if r["x_m"] == row["x_m"] and r["event"] == last}
            lines.append(_station(row, own, what))
    if lines:
        yield Items(lines)


def _station(rate: Row, own: dict[str, Row], what: str) -> str:
    """Return a sentence on what passes a station."""
    where = f"At x = {plain(float(rate['x_m']))} m, {what}, "
    if int(rate["n"]) == 0:
        return f"{where}no block passes in {int(rate['releases']):,} releases."
    energy, height, normal = own["energy"], own["height"], own.get("height_normal")
    level = "" if normal is None else f", {figure(float(normal['q95']))} m normal to the slope"
    return (
        f"{where}{figure(float(rate['mean']))} releases a year pass on 100 m of road; 95 % of the "
        f"{int(rate['n']):,} passing blocks have less than {figure(float(energy['q95']))} kJ, and "
        f"the centres of 95 % are lower than {figure(float(height['q95']))} m above the ground"
        f"{level}."
    )


def _site_of(folders: Folders) -> Site | None:
    return next((folder.site for folder in folders if folder.site is not None), None)


def site_section(folders: Folders) -> Iterator[Block]:
    """Yield the site, and how the sites of other folders differ from it."""
    first = _site_of(folders)
    if first is None:
        return
    yield from site_blocks(first)
    for folder in folders:
        if folder.site is not None and folder.site != first:
            yield Paragraph(f"The site of {folder.label} differs from this one:")
            yield Items(site_differences(first, folder.site))


def assumed_section(folders: Folders) -> Iterator[Block]:
    """Yield the assumptions of the site."""
    first = _site_of(folders)
    if first is not None:
        yield from stated_assumptions(first)


def limits_section(_: Folders) -> Iterator[Block]:
    """Yield the limits of the method."""
    yield Items(METHOD_LIMITS)


def repeat_section(folders: Folders) -> Iterator[Block]:
    """Yield commands, seeds and versions, with which the results can be repeated."""
    yield Paragraph(
        "On one machine, the same version gives the same numbers bit for bit. The results folders "
        "hold the site as it was used and all options in run.json."
    )
    records = [(folder, record) for folder in folders for record in folder.records.values()]
    commands = [shlex.join(["rigdda", *record.arguments]) for _, record in records]
    yield Listing("\n".join(commands))
    head = ("results", "command", "began (UTC)", "ended (UTC)", "seed", "rigdda")
    rows = [_run(folder, record) for folder, record in records]
    yield listed("Runs", "", head, rows)
    versions = dict.fromkeys(record.versions for _, record in records)
    names = ("rigdda", "mechanics", "numba", "numpy", "python", "machine")
    rows = [[getattr(v, name) for name in names] for v in versions]
    yield listed("Versions", "mechanics: version of everything that affects a result.", names, rows)
    rest = [_options(record) for _, record in records]
    yield listed("Options", "All options, also those that were not typed.", ("command", "options"),
                 rest)  # fmt: skip


def _run(folder: ResultsFolder, record: RunRecord) -> list[str]:
    seed = record.options.get("seed")
    began, ended = (time[:19].replace("T", " ") for time in (record.started, record.ended))
    return [folder.label, record.command, began, ended, "-" if seed is None else str(seed),
            record.versions.rigdda]  # fmt: skip


def _options(record: RunRecord) -> list[str]:
    said = [f"{name} = {'-' if v is None else v}" for name, v in record.options.items()]
    return [record.command, ", ".join(said)]


WHOLE_ROWS = 40
"""Rows up to which a table without an exhibit is shown as a whole."""

WHOLE_COLUMNS = 12
"""Columns up to which a table without an exhibit is shown as a whole."""


def appendix_section(folders: Folders) -> Iterator[Block]:
    """Yield the tables that are in no section: small ones as a whole, others by name."""
    rows = []
    for folder in folders:
        shown = {name for e in EXHIBITS for name in folder.files(e.files, e.command)}
        for name in (name for name in folder.others() if name not in shown):
            head, found = folder.table(name)
            if name not in LONG_TABLES and len(found) <= WHOLE_ROWS and len(head) <= WHOLE_COLUMNS:
                yield table(folder, name, f"{folder.label}/{name}", "All rows of the file.")
            else:
                what = LONG_TABLES.get(name, f"columns: {', '.join(head)}")
                rows.append((f"{folder.label}/{name}", what, f"{len(found):,}"))
    if rows:
        names = ("file", "what it holds", "rows")
        yield listed("Tables that are too long to show", "", names, rows, ("rows",))
    sites: dict[str, list[str]] = {}
    for folder in folders:
        for text in dict.fromkeys(record.site for record in folder.records.values()):
            sites.setdefault(text, []).append(folder.label)
    for text, labels in sites.items():
        if text:
            yield Listing(compact(text), f"Site file of {', '.join(labels)}, with all defaults")


NUMBERS = re.compile(r"\[\s+((?:[-+.\de]+,\s+)+)\]")
"""A list of numbers in TOML, one on each line."""


def compact(text: str) -> str:
    """Return a TOML text with each list of numbers on one line."""
    short = NUMBERS.sub(lambda found: f"[{', '.join(found[1].replace(',', ' ').split())}]", text)
    return short if tomllib.loads(short) == tomllib.loads(text) else text


SECTIONS = (
    ReportSection("summary", "Summary", summary_section),
    ReportSection("site", "Site", site_section),
    ReportSection("assumptions", "Assumptions and their sources", assumed_section),
    ReportSection("passing", "What comes down"),
    ReportSection("layouts", "Layouts compared"),
    ReportSection("corridor", "Corridor"),
    ReportSection("checks", "Checks"),
    ReportSection("risk", "Risk to life and traffic"),
    ReportSection("sureness", "How sure the answer is"),
    ReportSection("frontier", "What other targets cost"),
    ReportSection("limits", "Limits of the method", limits_section),
    ReportSection("repeat", "How to repeat the results", repeat_section),
    ReportSection("appendix", "Appendix", appendix_section),
)
"""Sections of a report in their order. One without content is left out."""


def filled(folders: Folders) -> list[tuple[ReportSection, list[Block]]]:
    """Return the sections that have content, with their blocks."""
    shown = {
        s.name: shown_exhibits(s.name, folders) for s in SECTIONS
    }  # first, as they check the files
    found = [(s, [*s.opening(folders), *shown[s.name]]) for s in SECTIONS]
    return [(section, blocks) for section, blocks in found if blocks]


REPORT_FILE = "report.html"
"""Name of the page in its folder."""

TEMPLATES = Path(__file__).parent


def compose(folders: Sequence[ResultsFolder]) -> str:
    """Return the page.

    Raises
    ------
    BadInput
        If a file of a folder is damaged.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    sections = filled(folders)
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"unbroken": unbroken, "together": together}
    page = environment.get_template("report.html.jinja")
    site = next((folder.site for folder in folders if folder.site is not None), None)
    subject = folders[0].label if site is None else site.name
    return page.render(
        title=f"Rockfall protection: {subject}",
        made=datetime.now(UTC).strftime("%d %B %Y"),
        style=Markup((TEMPLATES / "report.css").read_text(encoding="utf-8")),
        sections=sections,
        folders=folders,
        version=next(iter(folders[0].records.values())).versions.rigdda,
        trusted=Markup,
    )


UNITS = re.compile(r"(?<=[\d?]) (?=(?:%|‰|m|kJ|MJ|t|kg|deg|EUR|m2|m3|m²|m³|m/s|years?)(?:\W|$))")
"""Space between a number and its unit."""


def unbroken(text: str) -> str:
    """Return a text whose lines do not break between a number and its unit."""
    return UNITS.sub("\u00a0", text)


BRACKET = re.compile(r"\([^()]*\)")
"""An interval or a bound in brackets."""


def together(text: str) -> str:
    """Return the text of a number whose interval in brackets stays on one line."""
    return BRACKET.sub(lambda found: found[0].replace(" ", "\u00a0"), unbroken(text))


def write_report(page: str, out: str | os.PathLike[str]) -> Path:
    """Write a page into a folder, and return its path."""
    file = Path(out) / REPORT_FILE
    with atomic(file) as part:
        part.write_text(page, encoding="utf-8")
    return file
