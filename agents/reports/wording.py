"""Barriers and numbers in the words of an engineer who orders and signs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rigdda import (
    Barrier,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Mesh,
    Site,
)
from rigdda.barriers import Built

if TYPE_CHECKING:
    pass


def standing(layout: Iterable[Barrier]) -> tuple[Built, ...]:
    """Return the barriers of a layout that are in a scene, in its order: all but meshes."""
    return tuple(barrier for barrier in layout if not isinstance(barrier, Mesh))


def short(barrier: Barrier) -> str:
    """Return a barrier as the label of a picture: its kind, class and size."""
    match barrier:
        case Mesh():
            return f"mesh: {barrier.option}"
        case Ditch():
            return f"ditch {barrier.depth:.1f} m deep, {barrier.width:.1f} m wide"
        case Fence():
            return f"fence {strength(barrier)}, {barrier.height:.1f} m high"
    return f"{barrier.words} {barrier.height:.1f} m high"


def strength(fence: Fence) -> str:
    """Return what a fence withstands, in words: its energy class, or its capacity per metre."""
    if fence.energy_class is not None:
        return f"{fence.energy_class:,g} kJ"
    assert fence.capacity is not None
    return f"{fence.capacity / 1e3:,.0f} kJ/m"


def order(barrier: Barrier, site: Site) -> str:
    """Return what to order, where it stands, and what room it leaves, in words."""
    if isinstance(barrier, Mesh):
        option = site.mesh(barrier.option)
        return f"mesh {option.name!r}: {option.area:g} m2 per metre, {option.price:g} EUR/m2"
    ground, road = site.profile, site.road
    above = ground.height(barrier.x) - ground.height(road.start)
    place = f"at x = {barrier.x:.1f} m, {road.start - barrier.x:.1f} m uphill of the road's edge"
    if abs(above) >= 1.0:
        place += f" and {above:.0f} m above it" if above > 0.0 else f" and {-above:.0f} m below it"
    match barrier:
        case Fence():
            return f"{short(barrier)}, {place}{_room(barrier, site)}"
        case Ditch():
            return f"{short(barrier)}, {place}"
        case Embankment():
            return f"{short(barrier)}, crest {barrier.width:.1f} m wide, {place}"
        case GravityWall():
            return f"{short(barrier)}, {barrier.thickness:.1f} m thick, {place}"
    return f"{short(barrier)}, {place}"


def _room(fence: Fence, site: Site) -> str:
    """Return how far a fence gives way, and what is left to the road, in words."""
    if fence.elongation is None:
        return ""
    clear = site.road.start - fence.end - fence.elongation
    return f"; it gives way by {fence.elongation:.1f} m, to {clear:.1f} m from the road"


def euros(value: float) -> str:
    """Return an amount of money: whole euros from 100 on, three figures below."""
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def span(interval: Sequence[float]) -> str:
    """Return an interval of money."""
    low, high = interval
    return f"{euros(low)} to {euros(high)}"


def percent(share: float) -> str:
    """Return a probability or a share in per cent: two figures below ten."""
    value = 100.0 * share
    return f"{value:.0f} %" if value >= 9.95 or value == 0.0 else f"{value:.2g} %"
