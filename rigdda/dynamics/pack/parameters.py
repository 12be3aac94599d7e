"""Numbers of the scene and the settings, and how surfaces meet."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Fence
from rigdda.dynamics.constants import (
    MARGIN_RATIO,
    PENETRATION_RATIO,
    PLAIN_CONTACT,
)
from rigdda.dynamics.pack.bodies import free_bodies
from rigdda.dynamics.records import (
    INTERFACE,
    PARAMETERS,
    Bodies,
    Interfaces,
)
from rigdda.errors import BadInput
from rigdda.model.scene import Scene
from rigdda.model.settings import EARTH, SOLVERS, Settings, longest_step

FALL_BELOW = 20.0
"""Depth below the lowest terrain at which a block that left the site is retired [m]."""


def check_step(settings: Settings, areas: NDArray[np.float64], gravity: float) -> None:
    """Refuse a step that is too long for free blocks of these areas [m2]."""
    most = longest_step(areas, gravity)
    if settings.dt > most and settings.mode == "dynamic":
        sizes = np.sqrt(areas)
        mend = (
            f"give at most {math.floor(1e5 * most) / 1e5:g} s: the blocks are {sizes.min():.2g} to "
            f"{sizes.max():.2g} m large, and contacts would sink in"
        )
        raise BadInput("dt", settings.dt, mend)


def pack_interfaces(scene: Scene, names: list[str]) -> Interfaces:
    """Return how each two surfaces meet.

    Fences, which come last, are of the surface of barriers, but plastic, without strength and
    without friction: a net moves along with what it holds.
    Damping that a surface leaves open is that of the scene.
    """
    fences = any(isinstance(b, Fence) for b in scene.barriers)
    every = [*names, scene.barrier_surface] if fences else names
    found = np.zeros((len(every), len(every)), dtype=INTERFACE)
    found["friction"] = frictions(scene, len(every))
    found["friction"][len(names) :] = found["friction"][:, len(names) :] = 0.0
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            surface = scene.interface(a, b)
            plain = surface.restitution is None
            found["restitution"][i, j] = PLAIN_CONTACT if plain else surface.restitution
            found["cohesion"][i, j], found["tension"][i, j] = surface.cohesion, surface.tension
    found["damping"] = dampings(scene, len(every))
    return found.view(np.recarray)


def frictions(scene: Scene, size: int) -> list[list[float]]:
    """Return the coefficient of friction of each two of `size` surfaces, see `pack_interfaces`."""
    every = list(scene.surfaces)
    every += [scene.barrier_surface] * (size - len(every))
    return [[math.tan(math.radians(scene.friction_deg(a, b))) for b in every] for a in every]


def dampings(scene: Scene, size: int) -> list[list[float]]:
    """Return the damping of each two of `size` surfaces [1/s], see `pack_interfaces`."""
    every = list(scene.surfaces)
    every += [scene.barrier_surface] * (size - len(every))
    pairs = [[scene.interface(a, b).damping for b in every] for a in every]
    return [[scene.damping if d is None else d for d in row] for row in pairs]


def rock_numbers(scene: Scene, settings: Settings, bodies: Bodies) -> dict[str, float]:
    """Return the numbers that depend on the blocks."""
    free = [i for i, b in enumerate(scene.blocks) if not b.fixed]
    mass = bodies["mass"][free]
    area = mass / [scene.blocks[i].density for i in free]
    size = math.sqrt(np.add.reduce(area) / len(free))
    gravity = math.hypot(*scene.gravity_vector)
    check_step(settings, area, gravity)
    return {
        "block_weight": np.add.reduce(mass) / len(free) * (gravity or EARTH),
        "penetration": settings.penetration or PENETRATION_RATIO * size,
        "margin": MARGIN_RATIO * size,
    }


def pack_parameters(
    scene: Scene, settings: Settings, bodies: Bodies, interfaces: Interfaces
) -> NDArray[np.void]:
    """Return the numbers of the scene and the settings: of a step, and of parts of one."""
    gx, gy = scene.gravity_vector
    static = settings.mode == "static"
    shaken = scene.base_motion is not None
    floor = -np.inf
    if scene.terrain is not None and gx == 0.0 and gy < 0.0:
        floor = scene.terrain.points[:, 1].min() - FALL_BELOW
    numbers = {
        "dt": settings.dt,
        "blocks": free_bodies(scene),
        "gravity_x": gx,
        "gravity_y": gy,
        "gravity": math.hypot(gx, gy),
        "field_x": gx,
        "field_y": gy,
        "damping": scene.damping,
        "damping_in_flight": scene.damping if scene.damping_when == "always" else 0.0,
        "tolerance": settings.tolerance,
        "sweep_tolerance": settings.sweep_tolerance,
        "iterations": settings.open_close_iterations,
        "static": static,
        "post_correction": settings.post_correction,
        "islands": settings.islands,
        "solver": SOLVERS.index(settings.solver),
        "relaxation": settings.relaxation,
        "sleeping": settings.sleeping and not (static or shaken or scene.supports),
        "floor": floor,
        "bonded": (interfaces["cohesion"] + interfaces["tension"]).any(),
    }
    parameters = np.zeros(1, dtype=PARAMETERS)
    for name, value in (numbers | rock_numbers(scene, settings, bodies)).items():
        parameters[name] = value
    return parameters.view(np.recarray)
