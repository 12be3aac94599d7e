"""Barriers on the page: new ones, their handles, and what dragging a handle means."""

from __future__ import annotations

from typing import Any, NamedTuple

import msgspec

from rigdda import BadInput, Barrier, Ditch, Embankment, Fence, Layout, Mesh, Removal, Site
from rigdda.app.page.section import Floats, graded
from rigdda.barriers import KINDS, from_table
from rigdda.barriers.base import occupied
from rigdda.barriers.fence import FENCE_CLASSES
from rigdda.envs.siting import FeasiblePlaces
from rigdda.fields import Described, described

STEP = 0.1
"""Dragged chainages and lengths are whole multiples of this [m]."""


class Grip(NamedTuple):
    """A handle of a barrier in the section."""

    place: int
    """Place of the barrier in the layout."""
    field: str
    """The field that it changes."""
    x: float
    y: float
    words: str


def kinds_for(site: Site) -> list[str]:
    """Return the kinds of barrier that can be placed on a site."""
    left_out = set()
    if not site.meshes:
        left_out.add("mesh")
    if not site.removals:
        left_out.add("removal")
    return [name for name in KINDS if name not in left_out]


def new_barrier(site: Site, layout: Layout, kind: str) -> Barrier:
    """Return a barrier of a kind of usual size at the lowest place where the rules allow it.

    Raises
    ------
    BadInput
        If there is no such place beside the other barriers of the layout.
    """
    if kind == "mesh":
        taken = {b.option for b in layout if isinstance(b, Mesh)}
        option = next((o for o in site.meshes if o.name not in taken), None)
        if option is None:
            raise BadInput("mesh", kind, "remove the mesh that the layout has")
        return Mesh(sum(site.mesh_span(option.name)) / 2.0, option.name)
    if kind == "removal":
        left = [one for one in site.removals if one not in layout]
        if not left:
            raise BadInput("removal", kind, "every removable barrier is removed already")
        return left[0]
    place = FeasiblePlaces(site, site.barrier_zone)
    zone, ground = site.barrier_zone, site.profile
    catalogue = list(KINDS[kind].catalogue(zone))
    taken_spans = []
    for other in layout:
        if not isinstance(other, Mesh | Removal):
            taken_spans.append(occupied(other, other.works(ground)))
    middle = len(catalogue) // 2
    for barrier in sorted(catalogue, key=lambda b: abs(catalogue.index(b) - middle)):
        at = msgspec.structs.replace(barrier, x=zone.end)
        found = place.nearest(at, taken_spans)
        if found is not None:
            there = found[0]
            return _rounded(place, there)
    words = KINDS[kind].__name__
    raise BadInput(words, "no place", "no place in the zone allows one: move or remove another")


def _rounded_sizes(barrier: Barrier) -> Barrier:
    """Return a barrier whose lengths are whole multiples of `STEP`."""
    for length in barrier.lengths:
        value = getattr(barrier, length.field)
        barrier = with_field(barrier, length.field, round(round(value / STEP) * STEP, 6))
    return barrier


def _rounded(place: FeasiblePlaces, barrier: Barrier) -> Barrier:
    """Return a barrier of round sizes at a round chainage if the rules allow it there."""
    for one in (_rounded_sizes(barrier), barrier):
        for x in (round(one.x, 1), round(one.x - STEP / 2, 1), round(one.x + STEP / 2, 1)):
            there = place.put(one, x)
            if there is None:
                continue
            try:
                place.check("barrier", there)
            except BadInput:
                continue
            return there
    return barrier


def with_field(barrier: Barrier, field: str, value: Any) -> Barrier:
    """Return a barrier with another value of a field.

    The elongation of a fence of an energy class follows its class, and so does the range of its
    height. A fence that is given by its capacity keeps its elongation.

    Raises
    ------
    BadInput
        If the value is outside its range.
    """
    table = msgspec.to_builtins(barrier) | {field: value}
    if isinstance(barrier, Fence) and barrier.energy_class is not None:
        table.pop("elongation")
        if field == "energy_class":
            row = FENCE_CLASSES[value]
            table["height"] = min(max(barrier.height, row.lowest), row.height)
    return from_table("barrier", table)


def fields_of(barrier: Barrier) -> list[Described]:
    """Return the fields of a barrier that a form shows, other than its place."""
    names = {length.field for length in barrier.lengths} | {"energy_class"}
    return [field for field in described(type(barrier)) if field.name in names]


def grips(site: Site, layout: Layout) -> list[Grip]:
    """Return the handles of the barriers of a layout."""
    ground, standing = graded(site, layout)
    drawn: dict[Barrier, Floats] = {barrier: outline for barrier, outline, _ in standing}
    left = float(site.slope.points[0][0])
    right = float(site.slope.points[-1][0])
    found = []
    for i, barrier in enumerate(layout):
        if isinstance(barrier, Mesh | Removal):
            continue
        words = f"{barrier.words} {i + 1}"
        base = ground.height(min(max(barrier.x, left), right))
        found.append(Grip(i, "x", barrier.x, base, f"place of the {words}"))
        outline = drawn.get(barrier)
        if outline is None:
            continue
        end = min(barrier.x + barrier.extent, right)
        if isinstance(barrier, Ditch):
            floor, middle = float(outline[:, 1].min()), (barrier.x + end) / 2.0
            found.append(Grip(i, "depth", middle, floor, f"depth of the {words}"))
            found.append(Grip(i, "width", end, ground.height(end), f"width of the {words}"))
        else:
            top = float(outline[:, 1].max())
            crest = outline[outline[:, 1] >= top - 1e-6, 0]
            at = float(crest.mean())
            found.append(Grip(i, "height", at, top, f"height of the {words}"))
            if isinstance(barrier, Embankment):
                edge = float(crest.max())
                found.append(Grip(i, "width", edge, top, f"width of the crest of the {words}"))
    return found


def dragged(site: Site, layout: Layout, grip: Grip, x: float, y: float) -> Layout:
    """Return the layout after a handle has been dragged to a place.

    Raises
    ------
    BadInput
        If the barrier cannot have the size that results.
    """
    barrier = layout[grip.place]
    match grip.field:
        case "x":
            value = x
        case "width":
            value = max(STEP, getattr(barrier, grip.field) + x - grip.x)
        case "depth":
            value = max(STEP, getattr(barrier, grip.field) + grip.y - y)
        case _:
            value = max(STEP, getattr(barrier, grip.field) + y - grip.y)
    value = round(round(value / STEP) * STEP, 6)
    if isinstance(barrier, Fence) and grip.field == "height" and barrier.energy_class is not None:
        row = FENCE_CLASSES[barrier.energy_class]
        value = min(max(value, row.lowest), row.height)
    changed = with_field(barrier, grip.field, value)
    return tuple(changed if i == grip.place else b for i, b in enumerate(layout))
