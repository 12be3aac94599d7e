"""What a barrier bears before thrust moves it."""

from __future__ import annotations

import math
from itertools import pairwise

from rigdda.barriers import Embankment, Fence, GravityWall, section
from rigdda.scene import Scene


def resistance(scene: Scene, index: int) -> float:
    """Return the thrust that a barrier bears [N/m], inf for one that none can move.

    A fence bears the force of `Fence.resistance` of what rests against it; gravity walls and
    embankments bear their weight times the friction of their base.
    """
    barrier = scene.barriers[index]
    match barrier:
        case Fence():
            return barrier.resistance
        case GravityWall():
            own = scene.barrier_surface
        case Embankment():
            own = scene.fill
        case _:
            return math.inf
    outline = scene.outline(index)
    weight = -scene.gravity_vector[1] * barrier.density * section(outline)
    low, high = outline[:, 0].min(), outline[:, 0].max()
    angle = min(scene.interface(own, name).friction_deg for name in _under(scene, low, high))
    return weight * math.tan(math.radians(angle))


def _under(scene: Scene, low: float, high: float) -> set[str]:
    """Return the surfaces of the natural ground between two chainages."""
    assert scene.terrain is not None
    extents = (sorted(ends) for ends in pairwise(scene.terrain.points[:, 0]))
    return {
        name
        for (start, end), name in zip(extents, scene.terrain.surfaces, strict=True)
        if start < high and end > low
    }
