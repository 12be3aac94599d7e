"""Numbers of the scene and the settings, and how surfaces meet."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Fence
from rigdda.constants import (
    CUTS,
    DEFLECTED,
    PENETRATION_RATIO,
    PLAIN_CONTACT,
    SINKING,
    SLACK_RATIO,
    STEADY_STEP,
)
from rigdda.errors import BadInput
from rigdda.pack.bodies import free_bodies
from rigdda.records import (
    INTERFACE,
    PARAMETERS,
    Bodies,
    Interfaces,
)
from rigdda.scene import Scene
from rigdda.settings import SOLVERS, Settings

LARGEST_FALL = 0.25
"""Greatest displacement that gravity gives a block in a step, over its size [-]. With 0.31 thin
blocks sink into one another, with more than a half they go through the ground."""


FALL_BELOW = 20.0
"""Depth below the lowest terrain at which a block that left the site is retired [m]."""


def check_step(settings: Settings, block: int, size: float, gravity: float) -> None:
    """Refuse a step in which gravity alone moves the smallest block by most of its size [m]."""
    fall = gravity * settings.dt**2
    if fall > LARGEST_FALL * size and settings.mode == "dynamic":
        most = math.sqrt(LARGEST_FALL * size / gravity)
        mend = f"give at most {most:.2g} s: block {block} is small, {size:.2g} m, and would fall "
        raise BadInput("dt", settings.dt, mend + f"{fall:.2g} m more in every step")


def pack_interfaces(scene: Scene, names: list[str]) -> Interfaces:
    """Return how each two surfaces meet.

    Fences, which come last, are of the surface of barriers, but plastic and without strength.
    """
    fences = any(isinstance(b, Fence) for b in scene.barriers)
    every = [*names, scene.barrier_surface] if fences else names
    found = np.zeros((len(every), len(every)), dtype=INTERFACE)
    found["friction"] = frictions(scene, len(every))
    for i, a in enumerate(names):
        for j, b in enumerate(names):
            surface = scene.interface(a, b)
            plain = surface.restitution is None
            found["restitution"][i, j] = PLAIN_CONTACT if plain else surface.restitution
            found["cohesion"][i, j], found["tension"][i, j] = surface.cohesion, surface.tension
    return found.view(np.recarray)


def frictions(scene: Scene, size: int) -> list[list[float]]:
    """Return the coefficient of friction of each two of `size` surfaces, see `pack_interfaces`."""
    every = list(scene.surfaces)
    every += [scene.barrier_surface] * (size - len(every))
    return [[math.tan(math.radians(scene.friction_deg(a, b))) for b in every] for a in every]


def rock_numbers(scene: Scene, settings: Settings, bodies: Bodies) -> dict[str, float]:
    """Return the numbers that depend on the blocks."""
    free = [i for i, b in enumerate(scene.blocks) if not b.fixed]
    mass = bodies["mass"][free]
    area = mass / [scene.blocks[i].density for i in free]
    size = math.sqrt(np.add.reduce(area) / len(free))
    gravity = math.hypot(*scene.gravity_vector)
    least = int(area.argmin())
    check_step(settings, free[least], math.sqrt(area[least]), gravity)
    steady = STEADY_STEP * math.sqrt(size / gravity) if gravity > 0.0 else math.inf
    static = settings.mode == "static"
    coarse = settings.dt > steady and not static
    numbers = {
        "displacement_limit": settings.displacement_limit * size,
        "deflection_limit": math.inf if static else DEFLECTED * size,
        "sinking_limit": SINKING * size if coarse else math.inf,
        "first_cut": 1,
        "block_weight": np.add.reduce(mass) / len(free) * (gravity or 9.81),
        "penetration": settings.penetration or PENETRATION_RATIO * size,
        "slack": SLACK_RATIO * size,
    }
    if coarse:
        halvings = round(math.log2(settings.dt / steady))
        numbers["first_cut"] = min(max(1, halvings), CUTS)
    return numbers


def write_rock_numbers(levels: NDArray[np.void], numbers: dict[str, float]) -> None:
    """Write what `rock_numbers` gives, for a step and its parts: these are not cut back."""
    for name, value in numbers.items():
        levels[name] = value
    levels["sinking_limit"][1:] = math.inf


def pack_parameters(
    scene: Scene, settings: Settings, bodies: Bodies, interfaces: Interfaces
) -> NDArray[np.void]:
    """Return the numbers of the scene and the settings: for the step, halves of it, and parts."""
    gx, gy = scene.gravity_vector
    static = settings.mode == "static"
    shaken = scene.base_motion is not None
    floor = -np.inf
    if scene.terrain is not None and gx == 0.0 and gy < 0.0:
        floor = scene.terrain.points[:, 1].min() - FALL_BELOW
    numbers = {
        "blocks": free_bodies(scene),
        "gravity_x": gx,
        "gravity_y": gy,
        "gravity": math.hypot(gx, gy),
        "field_x": gx,
        "field_y": gy,
        "damping": scene.damping,
        "damping_in_contact_only": scene.damping_when == "contact",
        "tolerance": settings.tolerance,
        "sweep_tolerance": settings.sweep_tolerance,
        "iterations": settings.open_close_iterations,
        "static": static,
        "post_correction": settings.post_correction,
        "islands": settings.islands,
        "solver": SOLVERS.index(settings.solver),
        "relaxation": settings.relaxation,
        "sleeping": settings.sleeping and not (static or shaken or scene.supports),
        "timing": settings.timing,
        "floor": floor,
        "bonded": (interfaces["cohesion"] + interfaces["tension"]).any(),
    }
    levels = np.zeros(CUTS + 2, dtype=PARAMETERS)
    for name, value in numbers.items():
        levels[name] = value
    levels["dt"] = settings.dt / 2.0 ** np.arange(CUTS + 2)
    write_rock_numbers(levels, rock_numbers(scene, settings, bodies))
    return levels.view(np.recarray)
