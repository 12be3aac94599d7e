"""Corridors: sections of a road below several slopes, which share one budget for protection.

A corridor is a TOML file with a name, a budget and sections; each section has a site and a length::

    name = "pass road"
    budget = [500_000, 1_000_000]     # EUR

    [[sections]]
    site = "verge-301"                # a name or a file
    length = 120.0                    # m

Instead of tables, `table = "sections.csv"` names a CSV file with one row per section. Each price
and consequence in the corridor file replaces that of every site; the others remain. The traffic in
the corridor file replaces that of every site. The length of road in the traffic is always that of
the section.
"""

from __future__ import annotations

import csv
import io
import os
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import msgspec
import tomli_w

from rigdda import check, fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.files import atomic, is_file, read
from rigdda.ground.prices import Consequences, Prices
from rigdda.model.site import CORRIDOR_KEYS, Site
from rigdda.model.traffic import Traffic

MOST_SECTIONS = 10_000
"""Maximum number of sections of a corridor."""

LARGEST_BUDGET = 1e12
"""Maximum budget [EUR, EUR/year]."""

FOLDER = resources.files("rigdda") / "sites" / "corridors"
"""Folder with the files of the built-in corridors."""


@documented
class SectionTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A section in a corridor file.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    site: Annotated[
        str,
        about(
            "Name of a built-in or generated site, or a site file relative to the corridor file."
        ),
    ]
    length: Annotated[float, about("Length of road below the slope.", "m", gt=0.0, le=1e6)]
    name: Annotated[
        str, about("Name of the section, such as its chainage on the road; by default the site.")
    ] = ""
    reach: (
        Annotated[
            float,
            about(
                "Greatest acceptable probability that a block of a design event reaches the road.",
                "-",
                gt=0.0,
                le=1.0,
            ),
        ]
        | None
    ) = None
    failure: (
        Annotated[
            float,
            about(
                "Greatest acceptable probability that a barrier fails in a design event.",
                "-",
                gt=0.0,
                le=1.0,
            ),
        ]
        | None
    ) = None
    individual: (
        Annotated[
            float,
            about(
                "Greatest acceptable probability that a commuter is killed. It needs `[traffic]`.",
                "1/year",
                gt=0.0,
                le=1.0,
            ),
        ]
        | None
    ) = None

    def __post_init__(self) -> None:
        fields.check(self)


TARGETS = ("reach", "failure", "individual")
"""Fields of a section that are targets, see `rigdda.envs.Targets`."""


class CorridorFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The tables of a corridor file."""

    name: Annotated[str, about("Name of the corridor.")]
    budget: Annotated[
        Any, about("Budget for construction in EUR: one number, or a list to compare.")
    ]
    sections: Annotated[tuple[SectionTable, ...], about("Sections, in order along the road.")] = ()
    table: Annotated[
        str,
        about(
            "CSV file with one row per section, instead of `sections`. Its columns are those of a "
            "section; empty cells have the default."
        ),
    ] = ""
    yearly_budget: Annotated[
        float,
        about(
            "Greatest annual cost of all barriers: annuities and upkeep.", "EUR/year", ge=0.0,
            le=LARGEST_BUDGET,
        ),
    ] | None = None  # fmt: skip
    prices: Annotated[
        dict[str, Any],
        about("Prices that replace those of every site, each by its key, see the site file."),
    ] = {}  # msgspec copies it
    consequences: Annotated[
        dict[str, Any], about("Consequences that replace those of every site, each by its key.")
    ] = {}
    traffic: Annotated[
        dict[str, Any] | None,
        about(
            "Traffic on the road, instead of that of every site; `section_length` is the length of "
            "the section."
        ),
    ] = None


class CorridorSection(msgspec.Struct, frozen=True):
    """A stretch of road below one slope.

    Parameters
    ----------
    site : Site
        The slope, with the prices of the corridor. If it has traffic, the `section_length` of the
        traffic becomes the length of the section.
    length : float
        Length of road [m].
    name : str
        Name of the section.
    reach, failure : float, optional
        Greatest acceptable probabilities in the design events of the site.
    individual : float, optional
        Greatest acceptable individual risk [1/year]; the site needs a table `[traffic]`.

    Raises
    ------
    BadInput
        If a value is outside its range.
    """

    site: Site
    length: float
    name: str
    reach: float | None = None
    failure: float | None = None
    individual: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.site, Site):
            raise BadInput("site", self.site, "give a rigdda.Site")
        table = SectionTable(self.site.name, self.length, self.name, **self.targets)
        for name in ("length", *TARGETS):
            msgspec.structs.force_setattr(self, name, getattr(table, name))
        if self.site.traffic is not None:
            replace = msgspec.structs.replace
            traffic = replace(self.site.traffic, section_length=self.length)
            msgspec.structs.force_setattr(self, "site", replace(self.site, traffic=traffic))

    @property
    def targets(self) -> dict[str, float | None]:
        """The targets by name; None is no target."""
        return {name: getattr(self, name) for name in TARGETS}


class Corridor(msgspec.Struct, frozen=True):
    """Sections of a road and the budgets for their protection.

    Parameters
    ----------
    name : str
        Name of the corridor.
    sections : tuple of CorridorSection
        Sections in order along the road.
    budgets : tuple of float
        Budgets for construction [EUR], increasing.
    yearly_budget : float, optional
        Greatest annual cost of all barriers [EUR/year].

    Raises
    ------
    BadInput
        If there is no section, two sections have the same name, or a value is of the wrong type or
        outside its range.
    """

    name: str
    sections: tuple[CorridorSection, ...]
    budgets: tuple[float, ...]
    yearly_budget: float | None = None

    def __post_init__(self) -> None:
        _set = msgspec.structs.force_setattr
        if not isinstance(self.name, str):
            raise BadInput("name", self.name, "give a text")
        what = "rigdda.CorridorSection"
        sections = check.sequence("sections", self.sections, CorridorSection, what)
        _set(self, "sections", sections)
        if not 1 <= len(sections) <= MOST_SECTIONS:
            hint = f"give 1 to {MOST_SECTIONS:,} sections"
            raise BadInput("sections", len(sections), hint)
        names = [section.name for section in sections]
        for name in names:
            if names.count(name) > 1:
                raise BadInput("sections.name", name, "give each section a name of its own")
        _set(self, "budgets", checked_budgets("budgets", self.budgets))
        if self.yearly_budget is not None:
            yearly = check.number(
                "yearly_budget", self.yearly_budget, 0.0, LARGEST_BUDGET, unit="EUR/year"
            )
            _set(self, "yearly_budget", yearly)

    @property
    def length(self) -> float:
        """Length of road of all sections [m]."""
        return sum(section.length for section in self.sections)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Corridor:
        """Read a corridor from a TOML file, or return a built-in corridor by its name.

        Raises
        ------
        BadInput
            If there is no such file or name, or the file is not a valid corridor.
        """
        return _corridor(*_parsed(source))

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write the corridor and the sites of its sections into a folder; return the TOML file.

        Raises
        ------
        BadInput
            If a site cannot be represented in TOML.
        """
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        files: dict[str, Site] = {}
        tables = []
        for i, section in enumerate(self.sections):
            file = f"site-{i + 1}.toml"
            files[file] = section.site
            table = {"name": section.name, "site": file, "length": section.length}
            wanted = {name: value for name, value in section.targets.items() if value is not None}
            tables.append(table | wanted)
        for file, site in files.items():
            site.save(out / file)
        data: dict[str, Any] = {"name": self.name, "budget": list(self.budgets)}
        if self.yearly_budget is not None:
            data["yearly_budget"] = self.yearly_budget
        path = out / "corridor.toml"
        with atomic(path) as part:
            part.write_text(tomli_w.dumps(data | {"sections": tables}), encoding="utf-8")
        return path


def names() -> list[str]:
    """Return the names of the built-in corridors."""
    files = (file.name for file in FOLDER.iterdir())
    return sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))


def is_corridor(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is a TOML file with the sections of a corridor."""
    file = Path(path)
    if file.suffix != ".toml" or not is_file(file):
        return False
    data = fields.parse("corridor", str(path), read("corridor", file))
    return not data.keys().isdisjoint(CORRIDOR_KEYS)


def site_files(source: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Return the site files of a corridor, each once; other sites have no file.

    Raises
    ------
    BadInput
        As `Corridor.load` does.
    """
    file, folder = _parsed(source)
    texts = (table.site for table in _tables(file, folder))
    return tuple(folder / text for text in dict.fromkeys(texts) if text.endswith(".toml"))


def checked_budgets(field: str, budgets: Any) -> tuple[float, ...]:
    """Return budgets [EUR] as an increasing tuple; `field` names them in messages.

    Raises
    ------
    BadInput
        If there is none, or one is not a number between 0 and 1e12.
    """
    given = budgets if isinstance(budgets, list | tuple) else [budgets]
    if not given:
        raise BadInput(field, budgets, "give at least one budget in EUR")
    found = {check.number(field, value, 0.0, LARGEST_BUDGET, unit="EUR") for value in given}
    return tuple(sorted(found))


def _parsed(source: str | os.PathLike[str]) -> tuple[CorridorFile, Path]:
    """Return the tables of a corridor file, and the folder to which its file names are relative."""
    if not isinstance(source, str | os.PathLike):
        raise BadInput("corridor", source, "name a TOML file or a built-in corridor")
    path = Path(source)
    if path.suffix != ".toml" and not is_file(path):
        if str(source) not in names():
            hint = f"name a TOML file or one of {', '.join(names())}"
            raise BadInput("corridor", str(source), hint)
        text, folder = (FOLDER / f"{source}.toml").read_text(encoding="utf-8"), Path()
    elif not is_file(path):
        raise BadInput("corridor", str(source), "name an existing TOML file")
    else:
        text, folder = read("corridor", path), path.parent
    data = fields.parse("corridor", str(source), text)
    return CorridorFile(**fields.checked(CorridorFile, data)), folder


def _tables(file: CorridorFile, folder: Path) -> tuple[SectionTable, ...]:
    """Return the sections of a corridor file, which may be in a CSV file."""
    if bool(file.table) == bool(file.sections):
        hint = 'give either tables [[sections]] or table = "sections.csv"'
        raise BadInput("sections", len(file.sections), hint)
    return _rows(folder / file.table) if file.table else file.sections


def _corridor(file: CorridorFile, folder: Path) -> Corridor:
    """Return the corridor of a file; file names in it are relative to `folder`."""
    tables = _tables(file, folder)
    if file.traffic and "section_length" in file.traffic:
        hint = "leave it out: it is the length of each section"
        raise BadInput("traffic.section_length", file.traffic["section_length"], hint)
    sites: dict[str, Site] = {}
    sections = []
    for i, table in enumerate(tables):
        where = f"sections.{table.name}" if table.name else f"sections[{i}]"
        if table.site not in sites:
            try:
                sites[table.site] = _priced(_site(table.site, folder), file)
            except BadInput as bad:
                raise BadInput(f"{where}.{bad.field}", bad.value, bad.hint) from None
        name = table.name or table.site.removesuffix(".toml")
        site = sites[table.site]
        if file.traffic is not None:
            given = {**file.traffic, "section_length": table.length}
            site = msgspec.structs.replace(site, traffic=fields.read(Traffic, given, "traffic"))
        targets = {key: getattr(table, key) for key in TARGETS}
        sections.append(CorridorSection(site, table.length, name, **targets))
    budgets = checked_budgets("budget", file.budget)
    return Corridor(file.name, tuple(sections), budgets, file.yearly_budget)


def _site(text: str, folder: Path) -> Site:
    """Return a site by its name or its file."""
    return Site.load(folder / text if text.endswith(".toml") else text)


def _priced(site: Site, file: CorridorFile) -> Site:
    """Return a site with the prices and consequences of the corridor."""
    changed: dict[str, Any] = {}
    for name, table in (("prices", Prices), ("consequences", Consequences)):
        own, given = getattr(site, name), fields.checked(table, getattr(file, name), name)
        for key, value in given.items():
            if isinstance(value, dict):
                given[key] = getattr(own, key) | value
        if given:
            changed[name] = msgspec.structs.replace(own, **given)
    return msgspec.structs.replace(site, **changed) if changed else site


def _rows(path: Path) -> tuple[SectionTable, ...]:
    """Return the sections in a CSV file.

    Raises
    ------
    BadInput
        If the file is missing or empty, or a cell is invalid.
    """
    if not is_file(path):
        raise BadInput("table", str(path), "name an existing CSV file")
    lines = csv.reader(io.StringIO(read("table", path), newline=""))
    try:
        rows = [(lines.line_num, [cell.strip() for cell in row]) for row in lines if row]
    except csv.Error as error:
        raise BadInput("table", str(path), f"repair line {lines.line_num}: {error}") from None
    known = [field.name for field in fields.described(SectionTable)]
    head = rows[0][1] if rows else []
    for name in head:
        if name not in known:
            raise BadInput("table", name, f"use the columns {', '.join(known)}")
    check.distinct("table", head)
    found = []
    for line, row in rows[1:]:
        where = f"{path.name} row {line}"
        if len(row) != len(head):
            raise BadInput(where, len(row), f"give {len(head)} cells, as in the first row")
        cells = {name: text for name, text in zip(head, row, strict=True) if text}
        found.append(fields.read(SectionTable, _numbers(cells, where), where))
    if not found:
        raise BadInput("table", str(path), "give at least one row below the first")
    return tuple(found)


def _numbers(cells: dict[str, str], where: str) -> dict[str, Any]:
    """Return the cells of a row with their numbers converted."""
    out: dict[str, Any] = dict(cells)
    for name in ("length", *TARGETS):
        if name in cells:
            try:
                out[name] = check.parsed(cells[name])
            except ValueError:
                raise BadInput(f"{where}.{name}", cells[name], "give a number") from None
    return out
