"""Whether anything holds an event: single barriers as large as they come, across the zone."""

from __future__ import annotations

import msgspec
import numpy as np

from rigdda import Barrier, Ditch, Embankment, Fence, Layout
from rigdda.agents.menu import Menu
from rigdda.agents.seeds import release_seeds
from rigdda.barriers import Standing
from rigdda.envs import DesignProblem
from rigdda.geometry import polygon_properties

STATIONS = 3
"""Places across the zone where each kind is tried, the last one near the road."""

LARGE = 0.9
"""Least size of what is tried over the largest that may be built of its kind [-]."""

RELEASES = 4
"""Releases of the event with each."""

HOLDS = 0.5
"""An event is held if at most this share of its releases reaches the road."""


def tried(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts of one barrier, of each kind the largest that may be built, at most places.

    Mesh is none of them: it makes an event rarer, and holds no part of it.
    """
    menu, found = Menu(problem), list[Barrier]()
    for kind in problem.kinds:
        barriers = [_thick(menu, b) for b in menu.lone(kind)] if kind != "mesh" else []
        least = LARGE * max(map(_size, barriers), default=0.0)
        large = sorted((b for b in barriers if _size(b) >= least), key=lambda b: b.x)
        places = np.linspace(0, len(large) - 1, min(STATIONS, len(large))).round().astype(int)
        found += [large[i] for i in places.tolist()]
    return tuple((barrier,) for barrier in found)


def _size(barrier: Barrier) -> float:
    """Return what the barriers of a kind are compared by."""
    match barrier:
        case Fence():
            assert barrier.energy_class is not None  # of a menu
            return barrier.energy_class * barrier.height
        case Ditch():
            return barrier.depth * barrier.width
        case Embankment() | Standing():
            return barrier.height
    return 0.0


def _thick(menu: Menu, barrier: Barrier) -> Barrier:
    """Return an embankment or a wall as thick as may be where it stands."""
    name = {"embankment": "width", "gravity_wall": "thickness"}.get(barrier.kind)
    if name is None:
        return barrier
    thick = msgspec.structs.replace(barrier, **{name: menu.zone.max_thickness})
    return menu.put(thick, barrier.x) or barrier


def unheld(problem: DesignProblem, event: str, seed: int) -> str:
    """Return in words that no barrier holds an event, if none of the largest does; else nothing.

    Nothing, too, where none may be built.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    layouts = tried(problem)
    seeds = {event: release_seeds("ensemble", seed, RELEASES)}
    for layout in layouts:
        outcomes = problem.sample(layout, seeds)
        if sum(outcome.reached for outcome in outcomes) <= HOLDS * len(outcomes):
            return ""
    if not layouts:
        return ""
    volume = _volume(problem, event, seeds[event][0])
    return (
        f"no single barrier that may be built, at its largest, holds the event {event!r} "
        f"({volume:.2g} m3 per metre) back"
    )


def _volume(problem: DesignProblem, event: str, seed: int) -> float:
    """Return the rock that comes down in a release of an event [m3 per metre]."""
    blocks = problem.site.draw(seed, event).blocks
    return float(sum(polygon_properties(block.vertices)[0] for block in blocks))
