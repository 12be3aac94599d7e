"""Surveyed profiles: how they are read from files, and become the slope of a site."""

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

TEXTS = (".csv", ".txt", ".tsv", ".xyz", ".dat")
"""Endings of text files with a table of coordinates."""

SURVEYS = (".csv", ".tsv", ".xyz", ".dat", ".dxf", ".dwg", ".xls", ".xlsx", ".ods")
"""Endings of files that hold a survey rather than a site."""

CHAINAGES = ("chainage", "station", "stationing", "distance", "dist", "ch", "sta", "s", "x")
ELEVATIONS = ("elevation", "elev", "level", "rl", "altitude", "alt", "z", "height", "h", "y")
EASTINGS = ("easting", "east", "e")
NORTHINGS = ("northing", "north", "n")
"""Names of columns, in the order in which they are preferred."""

FOREIGN = {
    "mm": "millimetres", "cm": "centimetres", "km": "kilometres", "ft": "feet", "feet": "feet",
    "in": "inches", "inch": "inches", "yd": "yards",
}  # fmt: skip
"""Units in the header of a column that are not metres."""

NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
PLAIN = re.compile(r"[+-]?\d+([.,]\d+)?")

CLOSE = 1e-3
"""Distance of two points of a survey below which one is taken for a repetition [m]."""

LOCAL = 1000.0
"""Size of a coordinate above which it is taken for one of a grid, so that an offset is taken off
[m]."""

ROUND = 100.0
"""An offset is a whole multiple of this [m], so that it is easily added in the head."""

DIGITS = 6
"""Decimals of the coordinates of a site in metres: subtraction leaves noise in later ones."""

HIGHEST, LONGEST = 5_000.0, 20_000.0
"""Height and length of a profile [m] above which it is not in metres."""

BACKWARD = 0.25
"""Share of the segments that may turn back: above it, rows are out of order."""

OFF_LINE = 0.02
"""Distance of a point from the line of the profile in plan, over its length, that is reported."""

MANY = 2000
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
    """Where the survey has x = 0 and y = 0."""
    notes: tuple[str, ...]
    """What was done to the survey, and what about it is doubtful, in sentences."""


def read_survey(path: Path, layer: str | None = None) -> Survey:
    """Return the profile of a CSV file or a DXF drawing.

    Parameters
    ----------
    path : Path
        The file. The columns of a table are found by their names, such as chainage and elevation,
        or are its only two columns of numbers. They are separated by commas, semicolons, tabs or
        spaces, and the decimal sign may be a comma.
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

        return from_vertices(str(path), drawing.polyline(path, layer))
    if layer is not None:
        raise BadInput("--layer", layer, "leave it out: only a DXF drawing has layers")
    if ending not in TEXTS:
        mend = "save the profile as a CSV file with the columns chainage and elevation, or as DXF"
        raise BadInput("--profile", str(path), mend)
    return parse_table(str(path), files.read("--profile", path))


def parse_table(name: str, text: str) -> Survey:
    """Return the profile of a table in a text; errors call it `name`.

    Raises
    ------
    BadInput
        As `read_survey` does.
    """
    rows = _rows(name, text)
    head = [] if all(NUMBER.fullmatch(cell) for cell in rows[0][1][:2]) else rows[0][1]
    body = rows[1:] if head else rows
    for line, cells in body:
        if head and len(cells) > len(head) and any(cells[len(head) :]):
            mend = "name all columns in the first line; with decimal commas use semicolons"
            raise BadInput(f"{name} line {line}", f"{len(cells)} columns", mend)
    if not body:
        raise BadInput(name, "no numbers", "give at least two rows of chainage and elevation [m]")
    columns = _columns(name, head, body)
    values = np.array(
        [[_number(name, line, cells, what, at) for what, at in columns] for line, cells in body]
    )
    if len(values) < 2:
        raise BadInput(name, f"{len(values)} point", "give at least two points")
    return Survey(values) if len(columns) == 2 else from_vertices(name, values)


def _rows(name: str, text: str) -> list[tuple[int, list[str]]]:
    """Return the cells of each line that is not empty, with the number of the line."""
    lines = [
        (i, line.strip())
        for i, line in enumerate(text.splitlines(), 1)
        if line.strip(" ,;\t") and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise BadInput(name, "empty", "give a table of chainage and elevation [m]")
    separator = _separator([line for _, line in lines])
    try:
        if separator is None:
            return [(i, line.split()) for i, line in lines]
        return [
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
    if all(len(cells) > 1 and all(map(PLAIN.fullmatch, cells)) for cells in words):
        return None
    return ","


def _columns(
    name: str, head: Sequence[str], body: Sequence[tuple[int, list[str]]]
) -> list[tuple[str, int]]:
    """Return what the columns that are read are called, and their places.

    Two of them are chainage and elevation; three are easting, northing and elevation.
    """
    names = [_plain_name(name, cell) for cell in head]
    elevation = _first(names, ELEVATIONS)
    plan = _first(names, EASTINGS), _first(names, NORTHINGS)
    chainage = _first(names, CHAINAGES)
    if {"x", "y", "z"} <= set(names) and names[chainage or 0] == "x":
        plan, chainage = (names.index("x"), names.index("y")), None
        elevation = names.index("z")
    if elevation is not None and chainage is not None and chainage != elevation:
        return [("chainage", chainage), ("elevation", elevation)]
    if elevation is not None and plan[0] is not None and plan[1] is not None:
        return [("easting", plan[0]), ("northing", plan[1]), ("elevation", elevation)]
    count = min(len(cells) for _, cells in body)
    numeric = [k for k in range(count) if NUMBER.fullmatch(body[0][1][k])]
    if len(numeric) == 2 and all(names[k] not in NORTHINGS for k in numeric if names):
        return [("chainage", numeric[0]), ("elevation", numeric[1])]
    found = ", ".join(head) or f"{len(body[0][1])} columns without names"
    mend = (
        "name its columns in the first line: chainage and elevation, or easting, northing and "
        "elevation; with decimal commas separate columns by semicolons"
    )
    raise BadInput(f"{name} line {body[0][0] - bool(head)}", found, mend)


def _first(names: Sequence[str], known: Sequence[str]) -> int | None:
    """Return the place of the column whose name comes first among those known."""
    return next((names.index(name) for name in known if name in names), None)


def _plain_name(name: str, cell: str) -> str:
    """Return the name of a column without its unit, in small letters."""
    found = re.fullmatch(r"\s*(.*?)[\s_]*(?:[\[(]\s*(.*?)\s*[\])]|[\s_](\w+))?\s*", cell)
    word, unit = (found[1], found[2] or found[3]) if found else (cell, None)
    if unit is not None and unit.casefold() in FOREIGN:
        mend = f"give metres: the column is in {FOREIGN[unit.casefold()]}"
        raise BadInput(f"{name} line 1", cell, mend)
    return str(word).casefold()


def _number(name: str, line: int, cells: Sequence[str], what: str, at: int) -> float:
    """Return a number of a table; its decimal sign may be a comma."""
    where = f"{name} line {line}: {what}"
    text = cells[at] if at < len(cells) else ""
    if not text:
        raise BadInput(where, text, "give a number in metres, or delete the line")
    if not NUMBER.fullmatch(text):
        packed = re.fullmatch(r"[+-]?\d{1,3}([ '.,\u2019\u00a0\u202f]\d{3})+([.,]\d+)?", text)
        mend = "write it without separators of thousands" if packed else "give a number in metres"
        raise BadInput(where, text, mend)
    value = float(text.replace(",", "."))
    if not math.isfinite(value):
        raise BadInput(where, text, "give a finite number in metres")
    return value


def from_vertices(name: str, vertices: Floats) -> Survey:
    """Return the profile of a line in space or in the plane, (n, 3) or (n, 2) [m].

    In the plane x is the chainage and y the elevation. In space, chainage is measured from the
    first point along the straight line in plan to the last one.

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
        mend = "let the profile run from the crest to beyond the road: its ends are in one place"
        raise BadInput(name, flat[-1].tolist(), mend)
    along = (flat - start) @ way / length
    aside = float(np.abs((flat - start) @ [-way[1], way[0]] / length).max())
    notes = ["chainage is measured in plan, from the first point towards the last"]
    if aside > OFF_LINE * length:
        notes.append(
            f"points lie up to {aside:.1f} m beside the straight line between the ends of the "
            "profile, onto which they are projected: a fall line that bends is longer"
        )
    azimuth = math.degrees(math.atan2(way[0], way[1])) % 360.0
    plan = float(start[0]), float(start[1]), azimuth
    return Survey(np.column_stack([along, vertices[:, 2]]), plan, tuple(notes))


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
        If the points are no profile from a crest to below a road, in metres.
    """
    notes = list(survey.notes)
    points = _distinct(name, survey.points, notes)
    if points[0, 0] == points[-1, 0]:
        mend = (
            "let the profile run from the crest to beyond the road: its ends have the same chainage"
        )
        raise BadInput(name, points[-1].tolist(), mend)
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


def _check_shape(name: str, points: Floats) -> None:
    """Check that points with growing chainage are a profile in metres."""
    x, y = points.T
    long, tall = float(np.ptp(x)), float(np.ptp(y))
    if long > LONGEST or tall > HIGHEST:
        mend = f"give metres: at most {LONGEST:g} m long and {HIGHEST:g} m high"
        raise BadInput(name, f"{long:g} m long and {tall:g} m high", mend)
    if tall == 0.0:
        raise BadInput(name, f"all points at elevation {y[0]:g}", "give a profile with a slope")
    back = np.diff(x) < 0.0
    if back.mean() > BACKWARD:
        first = int(np.flatnonzero(back)[0])
        mend = "sort the points along the profile: the chainage goes back and forth"
        raise BadInput(f"{name} point {first + 2}", points[first + 1].tolist(), mend)
    if x.min() < x[0] or x.max() > x[-1]:
        far = int(x.argmin()) if x.min() < x[0] else int(x.argmax())
        mend = "begin and end with the points of least and greatest chainage: add ground beyond it"
        raise BadInput(f"{name} point {far + 1}", points[far].tolist(), mend)
    if not shapely.LineString(points).is_simple:
        mend = "put the points in order along the ground: the profile crosses itself"
        raise BadInput(name, f"{len(points)} points", mend)


def _rises_to_crest(name: str, points: Floats, road: tuple[float, float] | None) -> bool:
    """Return whether the slope rises where the chainage grows, from the road at the start."""
    (start, low), (end, high) = points[[0, -1]]
    if road is not None:
        if not (start <= min(road) and max(road) <= end):
            mend = f"put it on the profile, which runs from chainage {start:.10g} to {end:.10g}"
            raise BadInput("--road", list(road), mend)
        x, y = points.T
        at = float(np.interp(0.5 * sum(road), x, y))
        if high > low and at > 0.5 * (high + y.min()):
            mend = (
                f"check it: the road would be at elevation {at:g}, in the upper half of a profile "
                f"that rises to {high:g} at chainage {end:.10g}"
            )
            raise BadInput("--road", list(road), mend)
    if high == low:
        mend = "let the profile begin at the crest and end below, beyond the road"
        raise BadInput(name, f"both ends at elevation {low:g}", mend)
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
    if len(points) > MANY:
        notes.append(f"{len(points)} points make simulations slow: thin the survey to some hundred")
