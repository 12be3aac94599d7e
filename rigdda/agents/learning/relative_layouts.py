"""Relative layouts: types and relative places of barriers that can be applied to every site.

A relative layout is a list of tables like those of a layout file. In place of the chainage `x`, a
table has `station`, a fraction of the barrier zone from its uphill end. Mesh has `rank`, the number
of the option of the site.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from rigdda import BadInput, Barrier, Ditch, Embankment, Fence, GravityWall, Layout
from rigdda.agents.designers.constant import place
from rigdda.agents.designers.menu import Menu
from rigdda.barriers.layout import from_table

NOTHING = "[]"
"""The relative layout without barriers."""

DITCHES = tuple(itertools.product((1.0, 1.5, 2.0, 2.5, 3.0), (3.0, 5.0, 8.0)))
"""Depths and widths of single ditches [m]."""
EMBANKMENTS = (1.5, 2.0, 3.0, 4.0, 5.0, 6.0)
"""Heights of single embankments [m]."""
FENCES = (
    (100, 2.0), (250, 2.0), (250, 3.0), (500, 2.0), (500, 3.0), (500, 4.0), (1000, 3.0),
    (1000, 4.0), (1500, 3.0), (2000, 4.0), (2000, 5.0), (3000, 4.0), (3000, 6.0), (5000, 5.0),
)  # fmt: skip
"""Energy classes [kJ] and heights [m] of single fences."""
WALLS = ((1.0, 0.6), (1.5, 0.8), (2.0, 1.0), (3.0, 1.5))
"""Heights and thicknesses of gravity walls [m]."""
PLACES, FENCE_PLACES = (0.5, 0.75, 1.0), (0.0, 0.15, 0.3, 0.5, 0.75, 0.9, 1.0)
"""Stations of single earthworks and walls, and of single fences."""
RANKS = (0, 1, 2, 3)
"""Numbers of options of mesh."""

UPPER = tuple(
    (Fence(0.0, height, energy_class=name), station)
    for name, height in ((250, 2.0), (500, 3.0), (1000, 3.0), (2000, 4.0))
    for station in (0.0, 0.3, 0.5, 0.75)
)
"""Fences and stations that are combined with a barrier at the foot of the zone."""
FOOT: tuple[Barrier, ...] = (
    Ditch(0.0, 2.0, 5.0),
    Ditch(0.0, 3.0, 8.0),
    Embankment(0.0, 2.0, 1.0),
    Embankment(0.0, 4.0, 1.0),
    GravityWall(0.0, 1.5, 0.8),
)
"""Barriers at the foot of the zone that are combined with others."""


def candidates() -> list[str]:
    """Return the relative layouts among which a catalogue is chosen, no barrier first."""
    found = [NOTHING, *map(as_json, [*_singles(), *_pairs()])]
    return list(dict.fromkeys(found))


def as_json(tables: Sequence[dict[str, Any]]) -> str:
    """Return a relative layout as JSON."""
    return json.dumps(list(tables))


def placed(menu: Menu, relative: str) -> Layout | None:
    """Return a relative layout on a site, or None if it cannot be built there.

    Each barrier stands at the nearest place to its station where it may be built.

    Raises
    ------
    BadInput
        If the relative layout is not one that this version knows.
    """
    problem, found = menu.problem, list[Barrier]()
    try:
        tables = json.loads(relative)
        for table in tables:
            one = _barrier(menu, table)
            if one is None:
                return None
            found.append(one)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        hint = f"this is not a relative layout of this version ({error}): train the policy again"
        raise BadInput("layouts", relative, hint) from None
    layout = tuple(sorted(found, key=lambda barrier: barrier.x))
    allowed = {*problem.kinds}.issuperset(barrier.kind for barrier in layout)
    fits = allowed and len(layout) <= problem.max_barriers and problem.fits(layout)
    return layout if fits else None


def _barrier(menu: Menu, table: dict[str, Any]) -> Barrier | None:
    """Return a barrier of a relative layout on a site, or None if it cannot be built there."""
    kind = table["kind"]
    if kind not in menu.problem.kinds:
        return None
    if kind == "mesh":
        options = menu.singles("mesh")
        return options[table["rank"]] if table["rank"] < len(options) else None
    sizes = {name: value for name, value in table.items() if name not in ("kind", "station")}
    barrier = from_table("layouts", {"kind": kind, "x": 0.0, **sizes})
    return next(iter(place(menu, barrier, table["station"])), None)


def _at(barrier: Barrier, station: float) -> dict[str, Any]:
    """Return the table of a barrier at a station."""
    table = msgspec.to_builtins(barrier)
    del table["x"]
    return {**table, "station": station}


def _mesh(rank: int) -> dict[str, Any]:
    return {"kind": "mesh", "rank": rank}


def _singles() -> Iterator[list[dict[str, Any]]]:
    """Yield single barriers."""
    low: list[Barrier] = [Ditch(0.0, depth, width) for depth, width in DITCHES]
    low += [Embankment(0.0, height, 1.0) for height in EMBANKMENTS]
    low += [GravityWall(0.0, height, thickness) for height, thickness in WALLS]
    for barrier, station in itertools.product(low, PLACES):
        yield [_at(barrier, station)]
    for (name, height), station in itertools.product(FENCES, FENCE_PLACES):
        yield [_at(Fence(0.0, height, energy_class=name), station)]
    for rank in RANKS:
        yield [_mesh(rank)]


def _pairs() -> Iterator[list[dict[str, Any]]]:
    """Yield pairs: fences or ditches above a barrier at the foot of the zone, and mesh with one."""
    above = [*UPPER, (Ditch(0.0, 2.0, 5.0), 0.5), (Ditch(0.0, 2.0, 5.0), 0.75)]
    for (upper, station), foot in itertools.product(above, FOOT):
        yield [_at(upper, station), _at(foot, 1.0)]
    for rank in RANKS:
        for foot in FOOT:
            yield [_mesh(rank), _at(foot, 1.0)]
        for upper, station in UPPER[2::4]:  # one station of each class
            yield [_mesh(rank), _at(upper, station)]
