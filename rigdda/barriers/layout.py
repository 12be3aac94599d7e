"""Layouts of barriers: the ground that they leave, their files, their words."""

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
from rigdda.barriers.wall import Wall
from rigdda.errors import BadInput
from rigdda.fields import about
from rigdda.files import atomic, read
from rigdda.model.terrain import Terrain

Built = Standing | Earthwork
"""What a scene has: all kinds but mesh."""

Layout = tuple[Barrier, ...]

KINDS: dict[str, type[Barrier]] = {
    str(kind.__struct_config__.tag): kind
    for kind in (Fence, Ditch, Embankment, GravityWall, Wall, Mesh)
}
"""Registered kinds of barrier by their names in layout files, in the order of the numbers of a
design. A kind is registered here and nowhere else."""


def earthworks(
    terrain: Terrain, layout: Iterable[Barrier], surface: str
) -> tuple[Terrain, dict[Barrier, Floats]]:
    """Return the ground with the ditches and embankments of a layout, and what each moved.

    They are built from the crest down, each on the ground that those above it left.

    Parameters
    ----------
    terrain : Terrain
        The natural ground.
    surface : str
        Surface of embankments.

    Returns
    -------
    ground : Terrain
        The ground with them.
    outlines : dict of barrier to (n, 2) array
        Corners of what each digs out or fills in [m].

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
    """Return the ground after earthworks, and their outlines: asked for by every release."""
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
        If it is not a sequence of barriers.
    """
    what = "barriers: rigdda.Wall, GravityWall, Fence, Ditch, Embankment or Mesh"
    return check.sequence("layout", layout, Barrier, what)


def from_table(where: str, table: Any) -> Barrier:
    """Return the barrier of a table of a layout file, by default a wall.

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
        raise BadInput(f"{where}: {bad.field}", bad.value, bad.mend) from None


def to_tables(layout: Sequence[Barrier]) -> list[dict[str, Any]]:
    """Return the tables of a layout file; `from_table` gives each barrier back."""
    return [msgspec.to_builtins(barrier) for barrier in layout]


def standing(layout: Iterable[Barrier]) -> tuple[Built, ...]:
    """Return the barriers of a layout that are in a scene, in its order: all but meshes."""
    return tuple(barrier for barrier in layout if isinstance(barrier, Built))


def describe(barrier: Barrier, digits: int = 1) -> str:
    """Return a barrier in words, lengths with so many digits after the point."""

    def metres(value: float) -> str:
        return f"{value:.{digits}f} m"

    return f"{barrier.words} at {metres(barrier.x)}, {barrier.sizes(metres)}"


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Read a layout from a TOML or JSON file with one table `barriers` a barrier.

    Each table has the parameters of its class, and `kind` = "wall" (the default), "gravity_wall",
    "fence", "ditch", "embankment" or "mesh".

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput("layout", str(path), "name an existing TOML or JSON file")
    form = "JSON" if file.suffix == ".json" else "TOML"
    tables = fields.parse("layout", str(path), read("layout", file), form)
    layout = fields.read(_LayoutFile, tables).barriers
    return tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(layout))


def save_layout(layout: Sequence[Barrier], path: str | os.PathLike[str]) -> None:
    """Write a layout as TOML, or as JSON if the path ends in .json."""
    data = {"barriers": to_tables(as_layout(layout))}
    with atomic(path) as part:
        if str(path).endswith(".json"):
            part.write_bytes(msgspec.json.format(msgspec.json.encode(data)))
        else:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")


class _LayoutFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An empty file is no layout; `barriers = []` is one without barriers."""

    barriers: Annotated[tuple[dict[str, Any], ...], about("The barriers; there may be none.")]
