"""The report of results folders: one HTML page that needs no other file and no network.

`EXHIBITS` of `report_contents` lists the tables and pictures of results folders that the report
shows, and `SECTIONS` the functions that yield its other content. `site_description` describes the
site file.
"""

from __future__ import annotations

import os
import re
import shlex
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import rigdda
from rigdda import BadInput, Site
from rigdda.agents.run_record import RunRecord
from rigdda.app.reports import findings
from rigdda.app.reports.findings import DesignAnswer, FailedCheck, Money, OtherLayout, headline
from rigdda.app.reports.html_blocks import (
    FIELD,
    Block,
    Figures,
    Heading,
    Items,
    Listing,
    Paragraph,
    ResultsFolder,
    Row,
    listed,
    picture,
    plain,
    table,
)
from rigdda.app.reports.report_contents import EXHIBITS, Exhibit
from rigdda.app.reports.site_description import (
    default_values,
    site_blocks,
    site_differences,
    stated_assumptions,
)
from rigdda.app.reports.stations import PASSING_RATE, of_design_events
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
)
from rigdda.envs.problem import Targets
from rigdda.files import atomic

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
"""Tables that are too long to show, with their content."""

Folders = Sequence[ResultsFolder]


@dataclass(frozen=True, slots=True)
class ReportSection:
    """A section: its name in `EXHIBITS`, its title, and the function for its other content."""

    name: str
    title: str
    opening: Callable[[Folders], Iterable[Block]] = lambda folders: ()


METHOD_LIMITS = (
    "The section is two-dimensional. Blocks do not leave its plane, and channels or ridges that "
    "gather or spread rock along the road are not represented.",
    "A block is as long along the road as the root of its cross-section; the masses and energies "
    "of whole blocks are based on this assumption. Releases of several blocks are strips as wide "
    "as their event: their volumes, the cost of closure and clearing and the load on fences, whose "
    "energy class acts on this width, follow from it.",
    "Blocks are rigid and do not break. A block that shatters loses energy, and its fragments may "
    "fly farther.",
    "Snow and water are neglected, and so are trees, except those of a table [[forest]].",
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
    """Return blocks, below a heading if there are several folders and the blocks are not empty."""
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
    """Yield the main result: what to build and what it saves, or the simulated rockfall."""
    designs = [folder for folder in folders if folder.files("layouts.csv", "design")]
    answers = {folder.label: _repriced(folder) for folder in folders}
    many = len(designs) + sum(line is not None for line in answers.values()) > 1
    for folder in designs:
        yield from _titled([*_design_blocks(folder)], f"Design in {folder.label}", many)
    for label, line in answers.items():
        if line is not None:
            yield from _titled([_first_line(line)], f"Design with other values in {label}", many)
    passing = [block for f in folders if f.files("stations.csv") for block in _passing(f)]
    yield from _titled(passing, "What comes down", bool(designs))
    site = _site_of(folders)
    lines = [f"{line}" for folder in folders for line in _findings(folder, len(folders) > 1)]
    if site is not None and (designs or any(answers.values())):
        lines += default_values(site)
    if lines:
        yield Heading("What limits this answer")
        yield Items(lines)


def _repriced(folder: ResultsFolder) -> str | None:
    """Return the answer that `rigdda reprice` printed, or None if it did not write the folder."""
    record = folder.records.get("reprice")
    lines = () if record is None else record.findings
    return next((line for line in lines if findings.is_headline(line)), None)


def _findings(folder: ResultsFolder, many: bool) -> Iterator[str]:
    """Yield the findings of the commands in a folder, which they printed.

    The answer of `rigdda reprice` is left out, because it stands above them.
    """
    answer = _repriced(folder)
    for record in folder.records.values():
        for line in (line for line in record.findings if line != answer):
            text = line[0].upper() + line[1:] + ("" if line.endswith((".", "?", "!")) else ".")
            yield f"{folder.label}: {text}" if many else text


def _design_blocks(folder: ResultsFolder) -> Iterator[Block]:
    """Yield what to build, where, what it costs and what it saves."""
    needed = ("chosen", "objective_low", "objective_high", "comparable")
    _, rows = folder.table("layouts.csv", needed)
    chosen = next((row for row in rows if row["chosen"] == "True"), None)
    if chosen is None:
        hint = "no row is the chosen one: run the command that made it again"
        raise BadInput(FIELD, str(folder.path / "layouts.csv"), hint)
    site, targets = folder.site, chosen["targets"]
    layout = rigdda.load_layout(folder.path / "layout.toml")
    yield _first_line(headline(_answer(folder, chosen, rows)))
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


def _first_line(line: str) -> Paragraph:
    """Return the answer of a command as a paragraph that tells whether to build."""
    return Paragraph(line, "answer" if line.startswith("Build") else "warning")


def _answer(folder: ResultsFolder, chosen: Row, rows: Sequence[Row]) -> DesignAnswer:
    """Return what the first line of a design needs, from its files.

    `rows` are those of the table of layouts, of which one is `chosen`.
    """
    site, options = folder.site, folder.records["design"].options
    layout = rigdda.load_layout(folder.path / "layout.toml")
    words = [order(barrier, site) if site is not None else barrier.label for barrier in layout]
    return DesignAnswer(
        layout="; ".join(words),
        bare=before(site) if site is not None else "without barriers",
        z=_ends(chosen),
        nothing=_ends(rows[0]),
        targets=chosen["targets"] or None,
        asked=_asked(folder),
        required=options.get("checks") == "required",
        failed=_failed(folder),
        reaching=_reaching(folder, chosen["layout"]),
        cap=options.get("max_cost"),
        others=[
            OtherLayout(row["layout"], row["barriers"], _ends(row), row["targets"] or None)
            for row in rows
            if row["comparable"] == "True" and row is not chosen
        ],
        bare_targets=rows[0]["targets"] or None,
    )


def _failed(folder: ResultsFolder) -> list[FailedCheck]:
    """Return the checks that the new barriers of a design do not meet.

    Those of existing barriers do not count, as in `findings.failed_checks`.
    """
    needed = ("barrier", "x_m", "check", "use", "limit", "satisfied", "existing")
    _, rows = folder.table("checks.csv", needed) if folder.files("checks.csv") else ([], [])
    return [
        FailedCheck(
            f"{row['barrier']}, at {float(row['x_m']):.1f} m",
            row["check"],
            float(row["use"]) / float(row["limit"]),
        )
        for row in rows
        if row["satisfied"] == "False" and row["existing"] == "False"
    ]


def _ends(row: Row) -> Money:
    """Return Z of a row with the ends of its interval."""
    return float(row["objective"]), float(row["objective_low"]), float(row["objective_high"])


def _asked(folder: ResultsFolder) -> str:
    """Return the targets of a design in words."""
    options = folder.records["design"].options
    return findings.asked_words(
        Targets(options.get("target"), options.get("failure"), options.get("target_risk"))
    )


def _reaching(folder: ResultsFolder, layout: str) -> tuple[str, float]:
    """Return the design event that most often reaches the road with a layout, and how often [-].

    Events without releases are left out.
    """
    _, rows = folder.table("chances.csv") if folder.files("chances.csv") else ([], [])
    own = {
        row["event"]: float(row["reach"])
        for row in rows
        if row["layout"] == layout and row["design"] == "True" and row["reach"]
    }
    most = max(own, key=lambda name: own[name], default="")
    return most, own.get(most, 0.0)


def _money_of(row: Row) -> str:
    return euros(float(row["objective"]))


def _ends_of(row: Row) -> str:
    return span(_ends(row)[1:])


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
    """Yield the probabilities of the design events with a layout, and without it.

    An event without releases has none.
    """
    _, rows = folder.table("chances.csv") if folder.files("chances.csv") else ([], [])
    for row in rows:
        if row["design"] == "True" and row["layout"] == name:
            what = f"“{row['event']}” reaches the road"
            if not row["reach"]:
                yield what, "not known", "no release of this event was drawn"
                continue
            earlier = next(r for r in rows if r["event"] == row["event"] and r["layout"] == without)
            reach, bound = float(row["reach"]), float(row["reach_bound"])
            rest = f"at most {at_most(bound)}; {bare} {percent(float(earlier['reach']))}"
            yield what, percent(reach), rest
            if name != without and row["failure"]:  # it is empty if no barrier can fail
                fails, bound = float(row["failure"]), float(row["failure_bound"])
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
    if folder.site is not None and len({row["event"] for row in rows}) > 1:
        lines += [f"{line[0].upper()}{line[1:]}." for line in of_design_events(folder.site, rows)]
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
        f"{where}{figure(float(rate['mean']))} releases a year pass on 100 m of slope; 95 % of the "
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
    records = [(folder, record) for folder in folders for record in folder.records.values()]
    kept = "The file run.json of a results folder has all options"
    kept += " and the site as it was used." if any(r.site for _, r in records) else "."
    if any(r.command == "corridor" for _, r in records):
        kept += (
            " For a corridor, the folder corridor-as-used has the corridor and its sites as they "
            "were used."
        )
    yield Paragraph(f"On one machine, the same version gives the same numbers bit for bit. {kept}")
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
