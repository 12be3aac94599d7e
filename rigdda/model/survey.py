"""Surveyed profiles: reading from files, and conversion to the slope of a site."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import files
from rigdda.errors import BadInput
from rigdda.model.site_tables import Origin

Floats = NDArray[np.float64]

TEXT_ENDINGS = (".csv", ".txt", ".tsv", ".xyz", ".dat")
"""Endings of text files with a table of coordinates."""

SURVEYS = (".csv", ".tsv", ".xyz", ".dat", ".dxf", ".dwg", ".xls", ".xlsx", ".ods")
"""Endings of files that hold a survey rather than a site."""

CHAINAGES = (
    "chainage", "station", "stationing", "distance", "horizontal distance", "dist", "ch", "sta",
    "s", "x",
)  # fmt: skip
ELEVATIONS = (
    "elevation", "ground elevation", "elev", "level", "reduced level", "ground level", "rl",
    "altitude", "alt", "z", "height", "h", "y",
)  # fmt: skip
EASTINGS = ("easting", "east", "e")
NORTHINGS = ("northing", "north", "n")
"""Names of columns, in small letters and without units."""

METRES = {
    "m", "metre", "metres", "meter", "meters", "mtr", "mtrs", "masl", "mamsl", "mahd", "mnn",
    "mnhn", "mum", "m\xfcm", "m\xfcnn", "mslm", "msnm",
}  # fmt: skip
"""Spellings of metres, and of metres above a datum, with letters only."""

FOREIGN = {
    "mm": "millimetres", "millimetres": "millimetres", "millimeters": "millimetres",
    "cm": "centimetres", "centimetres": "centimetres", "centimeters": "centimetres",
    "dm": "decimetres", "decimetres": "decimetres", "decimeters": "decimetres",
    "km": "kilometres", "kilometres": "kilometres", "kilometers": "kilometres",
    "in": "inches", "inch": "inches", "inches": "inches",
    "yd": "yards", "yds": "yards", "yard": "yards", "yards": "yards",
    "mi": "miles", "mile": "miles", "miles": "miles",
    **dict.fromkeys(
        ("ft", "fts", "foot", "feet", "lf", "sft", "usft", "ftus", "usfeet", "ussft",
         "ussurveyfeet", "ussurveyfoot", "surveyfeet", "surveyfoot", "internationalfeet", "intlft",
         "ift", "ftasl", "ftamsl", "feetasl", "ftnavd"),
        "feet",
    ),
}  # fmt: skip
"""Spellings of units that are not metres, with letters only."""

NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
STATION = re.compile(r"([+-]?)(\d+)\+(\d{3}(?:[.,]\d+)?)")
"""A chainage with the kilometres before a plus sign, such as 12+345.60."""

THOUSANDS = re.compile(r"[+-]?\d{1,3}([ '.,\u2019\u00a0\u202f]\d{3})+([.,]\d+)?")
GROUPED = re.compile(r"[+-]?\d{1,3}(,\d{3})+")

CLOSE = 1e-3
"""Distance of two points of a survey below which one is taken for a repetition [m]."""

LOCAL = 1000.0
"""Size of a coordinate above which it is taken for one of a grid, so that an offset is taken off
[m]."""

ROUND = 100.0
"""An offset is a whole multiple of this [m], so that it is easily added by mental arithmetic."""

LOWEST_GROUND, SUMMIT = -450.0, 9_000.0
"""Elevations [m] beyond which there is no ground on land."""

SPIKE, OUTLIER = 3.0, 0.3
"""Height over both neighbours [m] from which a point is doubted, and the least slope down to each
of them [-]."""

WORSE = 2.0
"""Quotient of the heights over their neighbours from which on one of two points is to blame."""

DIGITS = 6
"""Decimals of the coordinates of a site in metres: subtraction leaves noise in later ones."""

GREATEST_HEIGHT, GREATEST_LENGTH = 5_000.0, 20_000.0
"""Height and length of a profile or a slope [m] above which the unit is probably wrong, for example
millimetres."""

BACKWARD = 0.25
"""Share of the segments that may turn back: above it, rows are out of order."""

OFF_LINE = 0.02
"""Distance of a point from the straight line between the ends of a profile in plan, over its
length, above which chainage is measured along the points."""

UNAMBIGUOUS = ("\t", ";")
"""Separators of columns that never stand within a number."""

NAME_COLUMNS = (
    "name its columns in the first line: chainage and elevation, or easting, northing and "
    "elevation; distances along the slope and numbers of points are no chainages; with decimal "
    "commas separate columns by semicolons"
)
"""What to do with a table whose columns are not understood."""

SLOW_POINTS = 2000
"""Points of a profile above which simulations are slow."""


class Survey(NamedTuple):
    """A profile as it was surveyed."""

    points: Floats
    """Chainages and elevations in the order of the file, (n, 2) [m]."""
    plan: tuple[float, float, float] | None = None
    """Easting and northing of chainage 0 [m] and the direction of growing chainage [deg]; None if
    the survey has no plan coordinates."""
    notes: tuple[str, ...] = ()
    """What was done to the points, and what about them is doubtful, in sentences."""


class Profile(NamedTuple):
    """The ground of a site: short coordinates that grow downhill."""

    points: Floats
    """Corners (x, y) from the crest downhill, (n, 2) [m]."""
    origin: Origin
    """Position of x = 0 and y = 0 in the survey."""
    notes: tuple[str, ...]
    """What was done to the survey, and what about it is doubtful, in sentences."""


def read_survey(path: Path, layer: str | None = None) -> Survey:
    """Return the profile of a CSV file or a DXF drawing.

    Parameters
    ----------
    path : Path
        The file. The columns of a table are found by their names, such as chainage and elevation;
        without names, a table has two columns of numbers. Columns are separated by commas,
        semicolons, tabs or spaces, and the decimal sign may be a comma.
    layer : str, optional
        Layer of the polyline of a drawing that has several.

    Raises
    ------
    BadInput
        If the file cannot be read or holds no profile in metres. The message names the line.
    """
    ending = path.suffix.lower()
    if ending == ".dxf":
        from rigdda.model import drawing

        vertices, notes = drawing.polyline(path, layer)
        survey = from_vertices(str(path), vertices)
        return survey._replace(notes=(*notes, *survey.notes))
    if layer is not None:
        raise BadInput("--layer", layer, "leave it out: only a DXF drawing has layers")
    if ending not in TEXT_ENDINGS:
        hint = "save the profile as a CSV file with the columns chainage and elevation, or as DXF"
        raise BadInput("--profile", str(path), hint)
    return parse_table(str(path), files.read("--profile", path))


def parse_table(name: str, text: str) -> Survey:
    """Return the profile of a table in a text; errors call it `name`.

    Raises
    ------
    BadInput
        As `read_survey` does.
    """
    separator, rows = _rows(name, text)
    has_names = not any(map(_looks_numeric, rows[0][1]))
    head, body = (rows[0][1], rows[1:]) if has_names else ([], rows)
    units = body.pop(0) if body and has_names and _are_units(body[0][1]) else None
    for line, cells in body:
        if head and len(cells) > len(head) and any(cells[len(head) :]):
            hint = "name all columns in the first line; with decimal commas use semicolons"
            raise BadInput(f"{name} line {line}", f"{len(cells)} columns", hint)
    if not body:
        raise BadInput(name, "no numbers", "give at least two rows of chainage and elevation [m]")
    columns = _named(name, rows[0]) if head else _unnamed(name, body)
    if separator not in UNAMBIGUOUS or not head:
        _check_lengths(name, separator, head, body, columns)
    if units is not None:
        _check_units(name, *units, columns)
    _check_decimal_signs(name, separator, body, columns)
    values = np.array(
        [[_number(name, line, cells, what, at) for what, at in columns] for line, cells in body]
    )
    if len(values) < 2:
        raise BadInput(name, f"{len(values)} point", "give at least two points")
    if not head and len(values) > 2 and (np.diff(values[:, 0]) == 1.0).all():
        hint = (
            "name the columns in the first line, chainage and elevation, if these are chainages "
            "and not the numbers of points"
        )
        raise BadInput(f"{name} line {body[0][0]}", "a first column that counts by ones", hint)
    return Survey(values) if len(columns) == 2 else from_vertices(name, values)


def _rows(name: str, text: str) -> tuple[str | None, list[tuple[int, list[str]]]]:
    """Return what separates columns, and the cells of each line that is not empty.

    The cells of a line stand beside its number.
    """
    lines = [
        (i, line)
        for i, line in enumerate(text.splitlines(), 1)
        if line.strip(" ,;\t") and not line.lstrip().startswith("#")
    ]
    stated = re.fullmatch(r"(?i)sep=(.)", lines[0][1].strip()) if lines else None
    lines = lines[1:] if stated else lines
    if not lines:
        raise BadInput(name, "empty", "give a table of chainage and elevation [m]")
    separator = stated[1] if stated else _separator([line.strip() for _, line in lines])
    if separator != "\t":  # leading and trailing tabs are the separators of empty cells
        lines = [(i, line.strip()) for i, line in lines]
    try:
        if separator is None:
            return separator, [(i, line.split()) for i, line in lines]
        return separator, [
            (i, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))])
            for i, line in lines
        ]
    except csv.Error as error:
        raise BadInput(name, "not a table", f"save it as CSV again ({error})") from None


def _separator(lines: Sequence[str]) -> str | None:
    """Return what separates the cells of a table, None for spaces."""
    for separator in ("\t", ";"):
        if all(separator in line for line in lines):
            return separator
    words = [line.split() for line in lines[-1:]]
    if all(len(cells) > 1 and all(map(_looks_numeric, cells)) for cells in words):
        return None
    return ","


def _plain(cell: str) -> tuple[str, str]:
    """Return a cell without typographic signs and the mark of a text cell, and its unit."""
    text = cell.strip().lstrip("'\u2019").strip()
    text = text.replace("\u2212", "-").replace("\u2013", "-")
    found = re.fullmatch(r"([+-]?[\d.,+]+(?:[eE][+-]?\d+)?)\s*([^\W\d_].*|\[.*\]|\(.*\))?", text)
    return (found[1], _letters(found[2] or "")) if found else (text, "")


def _letters(unit: str) -> str:
    """Return the letters of a unit, in small letters."""
    return "".join(c for c in unit.casefold() if c.isalpha())


def _looks_numeric(cell: str) -> bool:
    """Return whether a cell is meant as a number, also as one that cannot be read."""
    text, unit = _plain(cell)
    known = not unit or unit in METRES or unit in FOREIGN
    number = NUMBER.fullmatch(text) or STATION.fullmatch(text) or THOUSANDS.fullmatch(text)
    return known and number is not None


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a row holds the units of the columns."""
    units = [_letters(cell) for cell in cells if cell]
    return any(unit in METRES or unit in FOREIGN for unit in units) and not any(
        map(_looks_numeric, cells)
    )


def _check_units(
    name: str, line: int, cells: Sequence[str], columns: Sequence[tuple[str, int]]
) -> None:
    """Check that a row of units names no other unit than metres for the columns that are read."""
    for _, at in columns:
        unit = _letters(cells[at]) if at < len(cells) else ""
        if unit and unit not in METRES:
            raise BadInput(f"{name} line {line}", cells[at], f"give metres: {_in_words(unit)}")


def _in_words(unit: str) -> str:
    """Return what is wrong with a unit that is not metres."""
    return f"the numbers are in {FOREIGN[unit]}" if unit in FOREIGN else "the unit is not known"


def _named(name: str, row: tuple[int, list[str]]) -> list[tuple[str, int]]:
    """Return the columns that are read, by the names in the first row, and their places.

    Two of them are chainage and elevation; three are easting, northing and elevation.
    """
    line, head = row
    where, names = f"{name} line {line}", [_plain_name(cell) for cell in head]

    def places(known: Sequence[str], but: Sequence[str] = ()) -> list[int]:
        return [k for k, word in enumerate(names) if word in known and word not in but]

    east, north = places(EASTINGS), places(NORTHINGS)
    elevation = places(ELEVATIONS, ("y",))
    if "x" in names and "y" in names and elevation:  # a plan, as y is no elevation
        east, north = east or places(("x",)), north or places(("y",))
        chainage = places(CHAINAGES, ("x",))
    else:
        elevation, chainage = places(ELEVATIONS), places(CHAINAGES)
    used = [elevation, chainage] if chainage else [elevation, east, north]
    for found, what in zip(used, ("elevations", "chainages", "northings"), strict=False):
        if len(found) > 1:
            several = " and ".join(head[k] for k in found)
            hint = f"keep one column of {what}, and delete or rename the others"
            raise BadInput(where, several, hint)
    if not all(used):
        raise BadInput(where, ", ".join(head), NAME_COLUMNS)
    words = ("elevation", "chainage") if chainage else ("elevation", "easting", "northing")
    columns = [(word, found[0]) for word, found in zip(words, used, strict=True)]
    for _, at in columns:
        _check_unit(where, head[at])
    return columns[1:] + columns[:1]


def _unnamed(name: str, body: Sequence[tuple[int, list[str]]]) -> list[tuple[str, int]]:
    """Return the columns of chainage and elevation of a table without names: its two of numbers."""
    count = min(len(cells) for _, cells in body)
    numeric = [
        k
        for k in range(count)
        if 2 * sum(_looks_numeric(cells[k]) for _, cells in body) > len(body)
    ]
    if len(numeric) != 2:
        found = f"{len(body[0][1])} columns without names"
        raise BadInput(f"{name} line {body[0][0]}", found, NAME_COLUMNS)
    return [("chainage", numeric[0]), ("elevation", numeric[1])]


def _split_name(cell: str) -> tuple[str, str | None]:
    """Return the name in the head of a column, and its unit if it has one.

    A unit stands in brackets, or is the last of several words, such as in elev_ft.
    """
    found = re.fullmatch(r"([^\[({<]*)[\[({<](.*)[\])}>]?(.*)", cell.strip())
    if found:
        return _words(found[1] + " " + found[3].strip("])}>")), _letters(found[2])
    if cell.rstrip().endswith(("'", '"', "\u2032", "\u2033")):
        return _words(cell), "ft" if cell.rstrip()[-1] in "'\u2032" else "in"
    words = _words(cell).split()
    for first in range(1, len(words)):
        unit = "".join(words[first:])
        if unit in METRES or unit in FOREIGN:
            return " ".join(words[:first]), unit
    return " ".join(words), None


def _words(text: str) -> str:
    """Return the words of a name, in small letters."""
    return " ".join(re.findall(r"[^\W_]+", text.casefold()))


def _plain_name(cell: str) -> str:
    """Return the name of a column without its unit, in small letters."""
    return _split_name(cell)[0]


def _check_unit(where: str, cell: str) -> None:
    """Check that the unit in the head of a column is metres; a unit that is not known is not."""
    unit = _split_name(cell)[1]
    if unit is None or unit in METRES:
        return
    raise BadInput(where, cell, f"give metres, and write (m) after the name: {_in_words(unit)}")


def _check_decimal_signs(
    name: str,
    separator: str | None,
    body: Sequence[tuple[int, list[str]]],
    columns: Sequence[tuple[str, int]],
) -> None:
    """Check that all numbers have the same decimal sign and none has separators of thousands."""
    found: dict[str, str] = {}
    for line, cells in body:
        for what, at in columns:
            text = _plain(cells[at])[0] if at < len(cells) else ""
            where = f"{name} line {line}: {what}"
            signs = set(text) & set(".,")
            if len(signs) > 1 or (separator == "," and GROUPED.fullmatch(text)):
                raise BadInput(where, text, "write it without separators of thousands")
            for sign in signs:
                found.setdefault(sign, text)
            if len(found) > 1:
                one, other = found.values()
                hint = (
                    "use one decimal sign and no separators of thousands: the table also has "
                    f"{one if text == other else other}"
                )
                raise BadInput(where, text, hint)


def _check_lengths(
    name: str,
    separator: str | None,
    head: Sequence[str],
    body: Sequence[tuple[int, list[str]]],
    columns: Sequence[tuple[str, int]],
) -> None:
    """Check that no row has a number too many, which is often the part after a decimal comma.

    Such a row is longer than others and has a number next to the last column, or is longer than the
    header and has a number anywhere beyond that column. Other numbers may belong to remarks.
    """
    last = max(at for _, at in columns)
    shortest = min(len(cells) for cells in [*([head] if head else []), *(row for _, row in body)])
    for line, cells in body:
        beyond = [_looks_numeric(cell) for cell in cells[last + 1 :]]
        next_to_last = beyond[:1] == [True] and len(cells) > shortest
        if head:
            next_to_last = next_to_last and shortest <= last + 1
        if next_to_last or (head and len(cells) > len(head) and any(beyond)):
            hint = "give every row the same number of cells, also where the last ones are empty"
            if separator == ",":
                hint += "; with decimal commas, separate columns by semicolons"
            raise BadInput(f"{name} line {line}", (separator or " ").join(cells), hint)


def _number(name: str, line: int, cells: Sequence[str], what: str, at: int) -> float:
    """Return a number of a table; its decimal sign may be a comma."""
    where = f"{name} line {line}: {what}"
    cell = cells[at] if at < len(cells) else ""
    if not cell:
        raise BadInput(where, cell, "give a number in metres, or delete the line")
    text, unit = _plain(cell)
    if unit and unit not in METRES:
        raise BadInput(where, cell, f"give a number in metres: {_in_words(unit)}")
    if what == "chainage" and (found := STATION.fullmatch(text)):
        size = 1000.0 * float(found[2]) + float(found[3].replace(",", "."))
        return -size if found[1] == "-" else size
    if what == "chainage" and re.fullmatch(r"[+-]?\d+\+[\d.,]+", text):
        hint = "write stations as kilometres and metres, such as 0+150, or in metres"
        raise BadInput(where, cell, hint)
    if not NUMBER.fullmatch(text):
        packed = THOUSANDS.fullmatch(text)
        hint = "write it without separators of thousands" if packed else "give a number in metres"
        raise BadInput(where, cell, hint)
    value = float(text.replace(",", "."))
    if not math.isfinite(value):
        raise BadInput(where, cell, "give a finite number in metres")
    return value


def from_vertices(name: str, vertices: Floats) -> Survey:
    """Return the profile of a line in space or in the plane, (n, 3) or (n, 2) [m].

    In the plane x is the chainage and y the elevation. In space, chainage is measured in plan from
    the first point: along the straight line to the last one if no point lies far beside it, and
    along the line itself if it bends.

    Raises
    ------
    BadInput
        If the line ends above the point where it begins.
    """
    if vertices.shape[1] == 2:
        return Survey(vertices)
    flat, start = vertices[:, :2], vertices[0, :2]
    way = flat[-1] - start
    length = float(np.hypot(*way))
    if length < CLOSE:
        hint = "let the profile run from the crest to beyond the road: its ends are at one point"
        raise BadInput(name, flat[-1].tolist(), hint)
    along = (flat - start) @ way / length
    aside = float(np.abs((flat - start) @ [-way[1], way[0]] / length).max())
    note = "chainage is measured in plan, from the first point towards the last"
    if aside > OFF_LINE * length:
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(flat, axis=0).T))])
        note = (
            f"chainage is measured in plan along the line, which bends: it is {along[-1]:.1f} m "
            f"long, and points lie up to {aside:.1f} m beside the straight line of {length:.1f} m "
            "between its ends, to which positions in plan refer"
        )
    azimuth = math.degrees(math.atan2(way[0], way[1])) % 360.0
    plan = float(start[0]), float(start[1]), azimuth
    return Survey(np.column_stack([along, vertices[:, 2]]), plan, (note,))


def profile_of(name: str, survey: Survey, road: tuple[float, float] | None = None) -> Profile:
    """Return the ground of a site from a survey: downhill, and without the offset of a grid.

    Parameters
    ----------
    name : str
        What errors call the survey.
    survey : Survey
        The points.
    road : (float, float), optional
        Chainages of the edges of the road, as surveyed [m].

    Raises
    ------
    BadInput
        If the points are not a profile in metres from a crest to below a road.
    """
    notes = list(survey.notes)
    _check_length(name, survey.points)
    _check_elevations(name, survey.points)
    points = _distinct(name, survey.points, notes)
    if points[0, 0] == points[-1, 0]:
        hint = (
            "let the profile run from the crest to beyond the road: its ends have the same chainage"
        )
        raise BadInput(name, points[-1].tolist(), hint)
    if points[0, 0] > points[-1, 0]:
        points = points[::-1]
        notes.append("the points were listed against the chainage; their order was reversed")
    _check_shape(name, points)
    is_reversed = _rises_to_crest(name, points, road)
    if is_reversed:
        points = points[::-1]
        notes.append("the chainage of the survey grows uphill; x of the site grows downhill")
    origin = _origin(points, is_reversed, survey.plan)
    sign = -1.0 if is_reversed else 1.0
    moved = points - [origin.chainage, origin.elevation]
    moved = (moved * [sign, 1.0]).round(DIGITS) + 0.0  # no -0.0
    if origin.chainage or origin.elevation:
        notes.append(
            f"x = 0 is chainage {origin.chainage:,.10g} of the survey, and y = 0 is elevation "
            f"{origin.elevation:,.10g}"
        )
    notes += [
        f"point at chainage {points[k, 0]:,.10g}, elevation {points[k, 1]:,.10g}: "
        + spike_words(height)
        for k, height in spikes(points)
    ]
    _add_warnings(moved, notes)
    return Profile(moved, origin, tuple(notes))


def _distinct(name: str, points: Floats, notes: list[str]) -> Floats:
    """Return the points without those that repeat the one before."""
    repeats = np.concatenate([[False], (np.diff(points, axis=0) == 0.0).all(axis=1)])
    if count := int(repeats.sum()):
        notes.append(f"repeated points were dropped: {count}")
    left = points[~repeats]
    if len(left) < 2:
        raise BadInput(name, f"{len(left)} point", "give at least two different points")
    return left


def _check_length(name: str, points: Floats) -> None:
    """Check that a profile is no longer than one in metres can be."""
    long, tall = np.ptp(points, axis=0).tolist()
    if long > GREATEST_LENGTH:
        hint = f"give metres: at most {GREATEST_LENGTH:g} m long and {GREATEST_HEIGHT:g} m high"
        raise BadInput(name, f"{long:g} m long and {tall:g} m high", hint)


def _check_elevations(name: str, points: Floats) -> None:
    """Check that all elevations are those of ground, and none stands for a missing one."""
    y = points[:, 1]
    wrong = np.flatnonzero((y < LOWEST_GROUND) | (y > SUMMIT))
    if wrong.size == 0:
        wrong = np.array(_zeros(points), dtype=np.intp)
    if wrong.size:
        k = int(wrong[0])
        hint = (
            f"delete the point or give its elevation: no ground lies at {y[k]:g} m there, which "
            "may stand for a missing value"
        )
        raise BadInput(f"{name} point {k + 1}", points[k].tolist(), hint)


def _zeros(points: Floats) -> list[int]:
    """Return the points of elevation 0 far from the ground on both sides of them."""
    y, found = points[:, 1], []
    for k in np.flatnonzero(y == 0.0):
        before, after = np.flatnonzero(y[:k] != 0.0), np.flatnonzero(y[k:] != 0.0) + k
        if before.size and after.size:
            sides = points[[before[-1], after[0]]]
            runs = np.maximum(np.abs(sides[:, 0] - points[k, 0]), CLOSE)
            same = sides[0, 1] * sides[1, 1] > 0.0
            far = np.abs(sides[:, 1]) >= np.maximum(SPIKE, OUTLIER * runs)
            if same and far.all():
                found.append(int(k))
    return found


def spikes(points: Floats) -> list[tuple[int, float]]:
    """Return the points that lie far above or below both neighbours, with the height above [m].

    Such a point is often a typing error. Heights of pits are negative. A point that lies far off
    only because of a neighbour that lies much farther off is not among them.
    """
    found = dict(_far_off(points))
    return [(k, up) for k, up in found.items() if not _misled(points, found, k)]


def _misled(points: Floats, found: dict[int, float], k: int) -> bool:
    """Return whether point `k` of those found is no longer far off without a worse neighbour."""
    for near in (k - 1, k + 1):
        if abs(found.get(near, 0.0)) > WORSE * abs(found[k]):
            rest = dict(_far_off(np.delete(points, near, axis=0)))
            if k - (near < k) not in rest:
                return True
    return False


def _far_off(points: Floats) -> list[tuple[int, float]]:
    """Return all points that lie far above or below both neighbours, with the height above [m]."""
    found = []
    for k in range(1, len(points) - 1):
        (x0, y0), (x, y), (x1, y1) = points[k - 1], points[k], points[k + 1]
        up = y - max(y0, y1) if y > max(y0, y1) else min(0.0, y - min(y0, y1))
        steep = min(abs(y - y0) / max(abs(x - x0), CLOSE), abs(y - y1) / max(abs(x1 - x), CLOSE))
        if abs(up) >= SPIKE and steep >= OUTLIER:
            found.append((k, float(up)))
    return found


def spike_words(height: float) -> str:
    """Return what is odd about a point that lies `height` [m] above both of its neighbours."""
    way = "above" if height > 0.0 else "below"
    return f"it lies {abs(height):.1f} m {way} both of its neighbours; is it a typing error?"


def _check_shape(name: str, points: Floats) -> None:
    """Check that points with growing chainage are a profile in metres."""
    x, y = points.T
    tall = float(np.ptp(y))
    if tall > GREATEST_HEIGHT:
        hint = f"give metres: at most {GREATEST_HEIGHT:g} m high"
        raise BadInput(name, f"{tall:g} m high", hint)
    if tall == 0.0:
        raise BadInput(name, f"all points at elevation {y[0]:g}", "give a profile with a slope")
    back = np.diff(x) < 0.0
    if back.mean() > BACKWARD:
        first = int(np.flatnonzero(back)[0])
        hint = "sort the points along the profile: the chainage goes back and forth"
        raise BadInput(f"{name} point {first + 2}", points[first + 1].tolist(), hint)
    if x.min() < x[0] or x.max() > x[-1]:
        far = int(x.argmin()) if x.min() < x[0] else int(x.argmax())
        hint = "begin and end with the points of least and greatest chainage: add ground beyond it"
        raise BadInput(f"{name} point {far + 1}", points[far].tolist(), hint)
    if not shapely.LineString(points).is_simple:
        hint = "put the points in order along the ground: the profile crosses itself"
        raise BadInput(name, f"{len(points)} points", hint)


def _rises_to_crest(name: str, points: Floats, road: tuple[float, float] | None) -> bool:
    """Return whether the slope rises where the chainage grows, from the road at the start."""
    (start, low), (end, high) = points[[0, -1]]
    if road is not None:
        if not (start <= min(road) and max(road) <= end):
            hint = f"put it on the profile, which runs from chainage {start:.10g} to {end:.10g}"
            raise BadInput("--road", list(road), hint)
        x, y = points.T
        at = float(np.interp(0.5 * sum(road), x, y))
        if high > low and at > 0.5 * (high + y.min()):
            hint = (
                f"check it: the road would be at elevation {at:g}, in the upper half of a profile "
                f"that rises to {high:g} at chainage {end:.10g}"
            )
            raise BadInput("--road", list(road), hint)
    if high == low:
        hint = "let the profile begin at the crest and end below, beyond the road"
        raise BadInput(name, f"both ends at elevation {low:g}", hint)
    return bool(high > low)


def _origin(points: Floats, is_reversed: bool, plan: tuple[float, float, float] | None) -> Origin:
    """Return what to take off points that are listed downhill, and its place in plan."""
    x, y = points.T
    if is_reversed:
        chainage = float(x[0])
    else:
        chainage = ROUND * math.floor(x[0] / ROUND) if np.abs(x).max() > LOCAL else 0.0
    elevation = ROUND * math.floor(y.min() / ROUND) if np.abs(y).max() > LOCAL else 0.0
    if plan is None:
        return Origin(chainage, elevation, is_reversed)
    east, north, azimuth = plan
    turn = math.radians(azimuth)
    return Origin(
        chainage,
        elevation,
        is_reversed,
        round(east + chainage * math.sin(turn), DIGITS),
        round(north + chainage * math.cos(turn), DIGITS),
        round((azimuth + 180.0) % 360.0 if is_reversed else azimuth, DIGITS),
    )


def _add_warnings(points: Floats, notes: list[str]) -> None:
    """Add what about a profile is doubtful."""
    steps = np.diff(points, axis=0)
    near = np.flatnonzero(np.hypot(*steps.T) < CLOSE)
    if near.size:
        at = ", ".join(f"{points[k, 0]:g}" for k in near[:5])
        notes.append(f"points are nearer to each other than 1 mm at x = {at}: remove one of each")
    back = np.flatnonzero(steps[:, 0] < 0.0)
    if back.size:
        at = ", ".join(f"{points[k, 0]:g}" for k in back[:5])
        notes.append(
            f"the ground overhangs at x = {at}: no band of loose rock and no earthwork can be there"
        )
    if len(points) > SLOW_POINTS:
        notes.append(f"{len(points)} points make simulations slow: thin the survey to some hundred")
