"""Barriers that stand on a slope already.

They are part of every layout of a site, also of the empty one, unless a layout removes or replaces
them. Their construction is already paid: they cost only their upkeep and, after a failure, their
repair.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import msgspec

from rigdda import fields
from rigdda.barriers import (
    KINDS,
    Barrier,
    Built,
    Earthwork,
    Fence,
    Layout,
    Removal,
    earthworks,
    from_table,
)
from rigdda.barriers.base import Metres, meet, occupied
from rigdda.barriers.fence import WornFence
from rigdda.barriers.grading import FLATTEST_SLOPE, LEAST_SLOPE
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.ground.terrain import Terrain
from rigdda.rounding import chainage

EXISTING_KINDS = ("fence", "ditch", "embankment", "gravity_wall", "wall")
"""Kinds that may stand already. Mesh is not among them, because the rates of events are those with
it."""

SIZES = ("height", "depth", "width", "thickness", "side_slope", "energy_class")
"""Sizes of barriers."""

SAME_PLACE = 1e-6
"""Greatest distance between the chainages of a barrier and of its removal [m]."""

Cost = Annotated[float, about(ge=0.0, le=1e6)]
Condition = Annotated[float, about(ge=0.05, le=1.0)]
SideSlope = Annotated[float, about(ge=LEAST_SLOPE, le=FLATTEST_SLOPE)]
Class = Annotated[int, about(ge=1)]


@documented
class Existing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A barrier that already stands on the slope.

    Its kind, station and sizes are given as in a layout file, with the present sizes: for a sagging
    net, the height that is left; for a ditch, the depth above the rock that lies in it. The profile
    of the slope is the ground without the barrier.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """

    kind: Annotated[str, about("Kind of barrier.", choices=EXISTING_KINDS)]
    x: Annotated[float, about("Chainage of its uphill face or edge.", "m")]
    height: Annotated[
        Metres | None, about("Height today. Needed for all kinds except a ditch.", "m")
    ] = None
    depth: Annotated[Metres | None, about("Depth of a ditch today. Needed for a ditch.", "m")] = (
        None
    )
    width: Annotated[
        Metres | None,
        about("Width of a ditch, for which it is needed, or of the crest of an embankment.", "m"),
    ] = None
    thickness: Annotated[
        Metres | None, about("Thickness of a wall, a gravity wall or a fence.", "m")
    ] = None
    side_slope: Annotated[
        SideSlope | None,
        about(
            "Run over rise of the sides of a ditch or an embankment. The default is that of layout "
            "files.",
            "-",
        ),
    ] = None
    energy_class: Annotated[
        Class | None,
        about(
            "Energy class of a fence when it was new. Needed for a fence. It also determines the "
            "elongation and the price of rebuilding.",
            "kJ",
        ),
    ] = None
    condition: Annotated[
        Condition,
        about(
            "Share of the energy of its class that a fence still absorbs. It does not reduce the "
            "height; give the present height. For other kinds, give the present sizes instead.",
            "-",
        ),
    ] = 1.0
    removable: Annotated[
        bool,
        about(
            "Whether it may be removed. A new barrier that stands in its place or within 0.5 m, "
            "including the elongation of a fence, replaces it. No new barrier may stand there if "
            "it is not removable."
        ),
    ] = False
    removal: Annotated[
        Cost | None,
        about("Cost of the removal, without surcharge for access. The default is 0.", "EUR/m"),
    ] = None

    def __post_init__(self) -> None:
        fields.check(self, "existing: ")

    @property
    def barrier(self) -> Built:
        """The barrier as it is today.

        Raises
        ------
        BadInput
            If its sizes are not those of its kind.
        """
        return _barrier(self, "existing")


@lru_cache(maxsize=256)
def _barrier(existing: Existing, where: str) -> Built:
    """Return an existing barrier; errors begin with `where`."""
    table = {name: getattr(existing, name) for name in ("kind", "x", *SIZES)}
    given = {name: value for name, value in table.items() if value is not None}
    if existing.kind == "fence":
        if existing.energy_class is None:
            hint = "add the energy class that the fence had when it was new"
            raise BadInput(f"{where}.energy_class", None, hint)
    elif existing.condition < 1.0:
        hint = f"leave it out: give the sizes that the {existing.kind.replace('_', ' ')} has today"
        raise BadInput(f"{where}.condition", existing.condition, hint)
    _check_sizes(existing, where)
    found = from_table(where, given)
    assert isinstance(found, Built)
    if isinstance(found, Fence) and existing.condition < 1.0:
        return WornFence(**msgspec.structs.asdict(found), condition=existing.condition)
    return found


def _check_sizes(existing: Existing, where: str) -> None:
    """Check that only sizes of its kind are given; errors begin with `where`."""
    fields_of_kind = KINDS[existing.kind].__struct_fields__
    own = [name for name in SIZES if name in fields_of_kind]
    for name in SIZES:
        if getattr(existing, name) is not None and name not in own:
            words = existing.kind.replace("_", " ")
            hint = f"leave it out: the keys for the sizes of a {words} are {', '.join(own)}"
            raise BadInput(f"{where}.{name}", getattr(existing, name), hint)


def barriers(existing: Sequence[Existing]) -> tuple[Built, ...]:
    """Return the barriers of a list, in order."""
    return tuple(one.barrier for one in existing)


def check_existing(
    existing: Sequence[Existing], ground: Terrain, soil: str, road: float
) -> tuple[Built, ...]:
    """Return the barriers after checking that they can stand where they do.

    Parameters
    ----------
    existing : sequence of Existing
        The barriers.
    ground : Terrain
        The natural ground.
    soil : str
        Surface of embankments.
    road : float
        Chainage of the uphill edge of the road [m].

    Raises
    ------
    BadInput
        If a size is wrong, one does not stand on the slope or uphill of the road, or two overlap.
    """
    found: list[tuple[Built, tuple[float, float]]] = []
    low, high = float(ground.points[0, 0]), float(ground.points[-1, 0])
    for i, one in enumerate(existing):
        where = f"existing[{i}]"
        if one.removal is not None and not one.removable:
            hint = "leave it out, or add removable = true"
            raise BadInput(f"{where}.removal", one.removal, hint)
        barrier = _barrier(one, where)
        if not low <= barrier.x <= high:
            hint = f"put it on the slope, at least {chainage(low)} and at most {chainage(high)}"
            raise BadInput(f"{where}.x", barrier.x, hint)
        try:
            if isinstance(barrier, Earthwork):
                earthworks(ground, (barrier,), soil)
            works = barrier.works(ground)
        except BadInput as bad:
            raise BadInput(f"{where}: {bad.field}", bad.value, bad.hint) from None
        if works[1] > road:
            hint = f"put all of it, up to {chainage(works[1])}, uphill of the road, which begins at"
            raise BadInput(f"{where}.x", barrier.x, f"{hint} {chainage(road)}")
        for other, span in found:
            if works[0] < span[1] and span[0] < works[1]:
                hint = (
                    f"it overlaps the existing {other.words} at {chainage(other.x)}: correct one "
                    "of them"
                )
                raise BadInput(f"{where}.x", barrier.x, hint)
        found.append((barrier, works))
    return tuple(barrier for barrier, _ in found)


@lru_cache(maxsize=4096)
def remaining(existing: tuple[Existing, ...], ground: Terrain, layout: Layout) -> tuple[Built, ...]:
    """Return the existing barriers that a layout neither removes nor replaces.

    Raises
    ------
    BadInput
        If the layout removes a barrier that does not exist or may not be removed, or one of its
        barriers stands where a barrier stands that may not be removed.
    """
    removed = {i for at, one in enumerate(layout) for i in _removed(existing, at, one)}
    out: list[Built] = []
    for i, one in enumerate(existing):
        barrier = one.barrier
        if i in removed or barrier in layout:
            continue
        if one.removable and replacing(barrier, ground, layout) is not None:
            continue
        _check_clear(barrier, ground, layout)
        out.append(barrier)
    return tuple(out)


def _removed(existing: tuple[Existing, ...], at: int, removal: Barrier) -> list[int]:
    """Return the index of the barrier that a removal names, if it is one."""
    if not isinstance(removal, Removal):
        return []
    found = [
        i for i, e in enumerate(existing) if e.removable and abs(e.x - removal.x) <= SAME_PLACE
    ]
    if not found:
        known = ", ".join(chainage(one.x) for one in existing if one.removable)
        hint = f"give {known}" if known else "leave it out: the site has no removable barrier"
        raise BadInput(f"barriers[{at}].x", removal.x, hint)
    return found


def replacing(barrier: Built, ground: Terrain, layout: Layout) -> Built | None:
    """Return the first barrier of a layout that stands in the place of an existing one, or None."""
    own = occupied(barrier, barrier.works(ground))
    for other in layout:
        if isinstance(other, Built) and meet(own, occupied(other, other.works(ground))):
            return other
    return None


def replaced(
    existing: tuple[Existing, ...], ground: Terrain, layout: Layout
) -> dict[Barrier, float]:
    """Return the cost of removing what each barrier of a layout replaces [EUR/m].

    It does not include the cost of the removals in the layout.
    """
    removed = {i for at, one in enumerate(layout) for i in _removed(existing, at, one)}
    out: dict[Barrier, float] = {}
    for i, one in enumerate(existing):
        if one.removable and i not in removed and one.barrier not in layout:
            new = replacing(one.barrier, ground, layout)
            if new is not None:
                out[new] = out.get(new, 0.0) + (one.removal or 0.0)
    return out


def _check_clear(barrier: Built, ground: Terrain, layout: Layout) -> None:
    """Check that no barrier of a layout overlaps an existing one that stays."""
    low, high = barrier.works(ground)
    for i, other in enumerate(layout):
        if isinstance(other, Built):
            start, end = other.works(ground)
            if start < high and low < end:
                hint = (
                    f"keep clear of the existing {barrier.words} at {chainage(low)} to "
                    f"{chainage(high)}"
                )
                raise BadInput(f"barriers[{i}].x", other.x, hint)
