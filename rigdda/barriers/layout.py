"""Layouts of barriers: the ground with their earthworks, layout files and descriptions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import msgspec
import tomli_w

from rigdda import check, fields
from rigdda.barriers.base import Barrier, Earthwork, Floats, Standing
from rigdda.barriers.ditch import Ditch
from rigdda.barriers.embankment import Embankment
from rigdda.barriers.fence import Fence
from rigdda.barriers.gravity_wall import GravityWall
from rigdda.barriers.mesh import Mesh
from rigdda.barriers.removal import Removal
from rigdda.barriers.wall import Wall
from rigdda.errors import BadInput
from rigdda.fields import about
from rigdda.files import atomic, is_file, read
from rigdda.ground.terrain import Terrain

Built = Standing | Earthwork
"""Barriers that are part of a scene: all kinds except mesh and removal."""

Layout = tuple[Barrier, ...]

KINDS: dict[str, type[Barrier]] = {
    str(kind.__struct_config__.tag): kind
    for kind in (Fence, Ditch, Embankment, GravityWall, Wall, Mesh, Removal)
}
"""Kinds of barrier by name in layout files, in the order of the scores in encoded layouts. This is
the only place where kinds are registered."""


def earthworks(
    terrain: Terrain, layout: Iterable[Barrier], surface: str
) -> tuple[Terrain, dict[Barrier, Floats]]:
    """Return the ground with the ditches and embankments of a layout, and their outlines.

    They are built from the crest down, each on the ground left by those uphill of it.

    Parameters
    ----------
    terrain : Terrain
        The natural ground.
    layout : iterable of Barrier
        The barriers; those that are not earthworks are ignored.
    surface : str
        Name of the surface of embankments.

    Returns
    -------
    ground : Terrain
        The new ground.
    outlines : dict of barrier to (n, 2) array
        Corners of the cut or fill of each [m].

    Raises
    ------
    BadInput
        If one does not fit.
    """
    works = sorted((b for b in layout if isinstance(b, Earthwork)), key=lambda b: b.x)
    ground, outlines = _graded(terrain, tuple(works), surface)
    return ground, dict(zip(works, outlines, strict=True))


@lru_cache(maxsize=64)
def _graded(
    terrain: Terrain, works: tuple[Earthwork, ...], surface: str
) -> tuple[Terrain, tuple[Floats, ...]]:
    """Return the ground after earthworks, and their outlines; cached for repeated releases."""
    outlines: list[Floats] = []
    for work in works:
        outline, terrain = work.build(terrain, surface)
        outline.flags.writeable = False
        outlines.append(outline)
    return terrain, tuple(outlines)


def as_layout(layout: Any) -> Layout:
    """Return a layout as a tuple.

    Raises
    ------
    BadInput
        If it is not a sequence of barriers, or has a mesh option or a removal twice.
    """
    what = "barriers: rigdda.Wall, GravityWall, Fence, Ditch, Embankment, Mesh or Removal"
    barriers: Layout = check.sequence("layout", layout, Barrier, what)
    first: dict[str, int] = {}
    for i, barrier in enumerate(barriers):
        if isinstance(barrier, Mesh) and first.setdefault(barrier.option, i) != i:
            hint = f"use each mesh option at most once: barriers[{first[barrier.option]}] has it"
            raise BadInput(f"barriers[{i}].option", barrier.option, hint)
        if isinstance(barrier, Removal) and barrier in barriers[:i]:
            hint = "remove each existing barrier once"
            raise BadInput(f"barriers[{i}].x", barrier.x, hint)
    return barriers


def from_table(where: str, table: Any) -> Barrier:
    """Return the barrier of a table in a layout file; the default kind is a wall.

    Raises
    ------
    BadInput
        If the kind is unknown, a field is unknown, missing or not a number, or a value is outside
        its range; the message names it.
    """
    if not isinstance(table, dict):
        raise BadInput(where, table, "give a table")
    kind = KINDS[check.one_of(f"{where}.kind", table.get("kind", "wall"), KINDS)]
    given = {name: value for name, value in table.items() if name != "kind"}
    values = fields.checked(kind, given, where)
    try:
        return kind(**values)
    except BadInput as bad:
        raise BadInput(f"{where}: {bad.field}", bad.value, bad.hint) from None


def from_record(where: str, table: Any) -> Barrier:
    """Return the barrier of a table of a recorded scene, adapted to the width of an event.

    It may be denser than barriers of layout files, see `Barrier.for_width`.

    Raises
    ------
    BadInput
        As `from_table` does.
    """
    if not isinstance(table, dict) or "density" not in table:
        return from_table(where, table)
    density = check.number(f"{where}.density", table["density"], 0.0, open_low=True, unit="kg/m3")
    rest = {name: value for name, value in table.items() if name != "density"}
    return from_table(where, rest)._with(density=density)


def to_tables(layout: Sequence[Barrier]) -> list[dict[str, Any]]:
    """Return the tables of a layout file; the inverse of `from_table`."""
    return [msgspec.to_builtins(barrier) for barrier in layout]


def standing(layout: Iterable[Barrier]) -> tuple[Built, ...]:
    """Return the barriers of a layout that are part of a scene, in order.

    Existing barriers of a site are not among them, see `rigdda.Site.standing`.
    """
    return tuple(barrier for barrier in layout if isinstance(barrier, Built))


def describe(barrier: Barrier, digits: int = 1) -> str:
    """Return a description of a barrier, with `digits` decimals of its lengths."""

    def metres(value: float) -> str:
        return f"{value:.{digits}f} m"

    return f"{barrier.words} at {metres(barrier.x)}, {barrier.sizes(metres)}"


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Read a layout from a TOML or JSON file with one table in `barriers` per barrier.

    Each table has the parameters of its class, and `kind` = "wall" (the default), "gravity_wall",
    "fence", "ditch", "embankment", "mesh" or "removal".

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown, a value is outside its range or a mesh option
        occurs twice.
    """
    file = Path(path)
    if not is_file(file):
        raise BadInput("layout", str(path), "name an existing TOML or JSON file")
    form = "JSON" if file.suffix == ".json" else "TOML"
    return parse_layout(read("layout", file), str(path), form)


def parse_layout(text: str, name: str, form: str = "TOML") -> Layout:
    """Return the layout in the text of a layout file, which is called `name` in error messages.

    Raises
    ------
    BadInput
        As `load_layout` does.
    """
    layout = fields.read(_LayoutFile, fields.parse("layout", name, text, form)).barriers
    return as_layout([from_table(f"barriers[{i}]", table) for i, table in enumerate(layout)])


def save_layout(layout: Sequence[Barrier], path: str | os.PathLike[str]) -> None:
    """Write a layout as TOML, or as JSON if the path ends in .json."""
    data = {"barriers": to_tables(as_layout(layout))}
    with atomic(path) as part:
        if str(path).endswith(".json"):
            part.write_bytes(msgspec.json.format(msgspec.json.encode(data)))
        else:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")


class _LayoutFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of a layout file. An empty file is invalid; `barriers = []` is an empty layout."""

    barriers: Annotated[tuple[dict[str, Any], ...], about("The barriers; there may be none.")]
