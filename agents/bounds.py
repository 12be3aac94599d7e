"""What of a layout lies on a bound: there the answer may be the zone's rather than the slope's."""

from __future__ import annotations

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Mesh, Wall
from rigdda.agents.menu import Menu
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import CLASSES
from rigdda.envs.siting import MIN_HEIGHT

NEAR = 0.05
"""Distance from a bound at which a length lies on it [m]."""


def on_bound(problem: DesignProblem, layout: Layout) -> tuple[str, ...]:
    """Return what lies on a bound of the zone, of its kind or of the list of classes, in words.

    The bounds of mesh, and those by what stands next to a barrier, do not count; nor does the
    greatest height of a class of fence, as the next class is higher and dearer.
    """
    names = []
    for barrier in layout:
        if not isinstance(barrier, Mesh):
            found = [*_place(problem, barrier), *_size(problem, barrier)]
            names += [f"{barrier.words}: {words}" for words in found]
    return tuple(names)


def _place(problem: DesignProblem, barrier: Barrier) -> list[str]:
    """Return which ends of the zone a barrier stands at."""
    zone, road = problem.zone, problem.site.road.start
    start, end = problem.place.works(barrier)
    found = []
    if start - zone.start <= NEAR:
        found.append("start of the zone")
    if zone.end - end <= NEAR:
        found.append("end of the zone")
    if isinstance(barrier, Fence):
        assert barrier.elongation is not None  # of its class
        if road - end - barrier.elongation <= NEAR:
            found.append("clearance to the road")
    return found


def _size(problem: DesignProblem, barrier: Barrier) -> list[str]:
    """Return which sizes of a barrier are the least or greatest."""
    zone = problem.zone
    if isinstance(barrier, Fence):
        assert barrier.energy_class is not None
        found = _ends(barrier.height, MIN_HEIGHT, zone.max_height, "height")
        if barrier.energy_class in (CLASSES[0], CLASSES[-1]):
            found.append("lowest class" if barrier.energy_class == CLASSES[0] else "highest class")
        return found
    if isinstance(barrier, Ditch):
        depth = _ends(barrier.depth, MIN_HEIGHT, zone.max_depth, "depth")
        return depth + _ends(barrier.width, zone.min_width, zone.max_width, "width")
    assert isinstance(barrier, Embankment | GravityWall | Wall)
    what = "width" if isinstance(barrier, Embankment) else "thickness"
    height = _ends(barrier.height, MIN_HEIGHT, zone.max_height, "height")
    crest = Menu(problem).crest if isinstance(barrier, Embankment) else 0.0
    least, most = max(crest, zone.min_thickness), zone.max_thickness
    return height + _ends(getattr(barrier, what), least, most, what)


def _ends(value: float, low: float, high: float, name: str) -> list[str]:
    """Return whether a length is the least or the greatest."""
    found = [f"least {name}"] if value - low <= NEAR else []
    return found + ([f"greatest {name}"] if high - value <= NEAR else [])
