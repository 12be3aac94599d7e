"""Whether anything holds an event: single barriers as large as they come, across the zone."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from agents.seeds import release_seeds
from envs import DesignProblem
from envs.sizes import SLENDER
from rigdda import BadInput, Barrier, Ditch, Embankment, Fence, GravityWall, Layout
from rigdda.barriers import FENCE_CLASSES
from rigdda.geometry import polygon_properties

STATIONS = 3
"""Places across the zone where each kind is tried."""

RELEASES = 4
"""Releases of the event with each."""

HOLDS = 0.5
"""An event is held if at most this share of its releases reaches the road."""


def tried(problem: DesignProblem) -> tuple[Layout, ...]:
    """Return layouts of one barrier as large as the zone and its kind allow, at several places."""
    zone = problem.zone
    places = np.linspace(zone.start, zone.end, STATIONS + 2)[:-1].tolist()
    return tuple((b,) for x in places for b in _largest(problem, x) if problem.fits((b,)))


def _largest(problem: DesignProblem, x: float) -> Iterator[Barrier]:
    """Yield the largest barrier of each kind at a place; one that cannot be built there is left."""
    zone = problem.zone
    top = max(FENCE_CLASSES)
    makers: dict[str, Callable[[], Barrier]] = {
        "fence": lambda: Fence(
            x, min(zone.max_height, FENCE_CLASSES[top].height), energy_class=top
        ),
        "ditch": lambda: Ditch(x, zone.max_depth, zone.max_width),
        "embankment": lambda: Embankment(x, zone.max_height, zone.max_thickness),
        "gravity_wall": lambda: GravityWall(
            x, min(zone.max_height, zone.max_thickness / SLENDER), zone.max_thickness
        ),
    }
    for kind, make in makers.items():
        if kind in problem.kinds:
            try:
                yield make()
            except BadInput:
                continue


def unheld(problem: DesignProblem, event: str, seed: int) -> str:
    """Return in words that no barrier holds an event, if none of the largest does; else nothing.

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
    volume = _volume(problem, event, seeds[event][0])
    return (
        f"no single barrier within the zone, at its largest, holds the event {event!r} "
        f"({volume:.2g} m3 per metre) back"
    )


def _volume(problem: DesignProblem, event: str, seed: int) -> float:
    """Return the rock that comes down in a release of an event [m3 per metre]."""
    blocks = problem.site.draw(seed, event).blocks
    return float(sum(polygon_properties(block.vertices)[0] for block in blocks))
