"""Invariance under shift, rotation and reflection of a scene and reordering of its blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigdda.geometry import polygon_properties
from rigdda.measurement import measure as outcome_of
from rigdda.measurement import stations, watch
from rigdda.model.scene import Block, Scene, Terrain
from rigdda.model.settings import Settings
from rigdda.model.site import Site
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import GRAVITY, Floats, polygon, rock, rough

SLOPE = np.array([(-40.0, 30.0), (-10.0, 8.0), (0.0, 5.0), (30.0, -10.0), (80.0, -12.0)])
DURATION = 0.6
"""Time in which the blocks hit the ground, spin and slide, but do not meet yet [s]."""

MOVE, TURN, ORDER = np.array([5000.0, 2000.0]), math.radians(25.0), (2, 0, 3, 1)
"""Rigid motion [m, rad] and new order of the blocks."""


def parts(lab: Lab) -> list[tuple[Floats, tuple[float, float, float]]]:
    """Return corners and velocities of four well-separated blocks."""
    rng = lab.random()
    places = [(-30.0, 24.2), (-12.0, 11.5), (5.0, 4.5), (22.0, -4.0)]
    return [
        (polygon(rough(rng, n), p), (2.0, -1.0, w))
        for n, p, w in zip((4, 5, 6, 7), places, (0.5, -0.5, 1.0, 0.0), strict=True)
    ]


def still(points: Floats) -> Floats:
    """Return points unchanged."""
    return points


def flight(
    lab: Lab,
    place: Callable[[Floats], Floats] = still,
    turn: Callable[[Floats], Floats] = still,
    mirror: bool = False,
    order: Sequence[int] = (0, 1, 2, 3),
    **scene: Any,
) -> Floats:
    """Return the poses after the flight in the changed scene, (4, 3), in the order of `parts`.

    `place` transforms points and `turn` transforms directions.
    """
    blocks = []
    for i in order:
        corners, (vx, vy, omega) = parts(lab)[i]
        x, y = turn(np.array([vx, vy]))
        blocks.append(Block(place(corners), velocity=(x, y, -omega if mirror else omega)))
    chain = place(SLOPE)
    terrain = Terrain(chain[::-1] if mirror else chain)
    sim = lab.simulate(Scene(terrain, tuple(blocks), rock(30.0, 0.3), damping=0.2, **scene))
    sim.step(lab.steps(DURATION))
    poses = np.empty((4, 3))
    poses[list(order)] = sim.poses
    return poses


def measured(lab: Lab, poses: Floats) -> tuple[Measured]:
    """Return the distances of poses from those of the unchanged scene, over the distances moved."""
    plain = flight(lab)
    start = np.array([polygon_properties(corners)[1] for corners, _ in parts(lab)])
    way = np.linalg.norm(plain[:, :2] - start, axis=1)
    return (Measured(np.linalg.norm(poses - plain, axis=1) / way),)


def measure_shift(lab: Lab) -> tuple[Measured]:
    """Shift the scene."""
    return measured(lab, flight(lab, lambda p: p + MOVE) - [*MOVE, 0.0])


def measure_order(lab: Lab) -> tuple[Measured]:
    """Reorder the blocks."""
    return measured(lab, flight(lab, order=ORDER))


def measure_mirror(lab: Lab) -> tuple[Measured]:
    """Mirror the scene horizontally."""
    left = np.array([-1.0, 1.0])
    poses = flight(lab, lambda p: p * left, lambda v: v * left, mirror=True)
    return measured(lab, poses * [-1.0, 1.0, -1.0])


def measure_turn(lab: Lab) -> tuple[Measured]:
    """Rotate the scene together with gravity."""
    gravity = tuple(polygon([0.0, -GRAVITY], angle=TURN))
    poses = flight(
        lab, lambda p: polygon(p, angle=TURN), lambda v: polygon(v, angle=TURN), gravity=gravity
    )
    poses[:, :2] = polygon(poses[:, :2], angle=-TURN)
    return measured(lab, poses)


def measure_balance(lab: Lab) -> tuple[Measured, Measured]:
    """Release the site `quick` with its blocks in two orders; mass must be conserved."""
    site = Site.load("quick")
    drawn = site.draw(lab.seed, "mass")
    scene = site.scene(drawn)
    total, mass = [], []
    for step in (1, -1):
        new = Scene(scene.terrain, scene.blocks[::step], scene.surfaces, damping=scene.damping)
        sim = Metered(lab, new, Settings(dt=lab.dt), stations=stations(site, ()), watch=watch(site))
        outcome = outcome_of(site, sim.run(site.motion.duration), drawn.event, drawn.width)
        total.append(
            outcome.slope_fraction
            + outcome.held_fraction
            + outcome.road_fraction
            + outcome.beyond_fraction
        )
        mass.append(outcome.released_mass)
    return Measured(total, 1.0), Measured(mass[1], mass[0])


def case(name: str, change: str, measure: Callable[[Lab], Sequence[Measured]]) -> Case:
    """Return the case of one change."""
    check = Check("change over way", f"none: {change}", "-", 1e-6, "bound")
    return Case(name, (check,), measure)


CASES = (
    case("shift", "same mechanics elsewhere", measure_shift),
    case("order", "same blocks", measure_order),
    case("mirror", "same mechanics mirrored", measure_mirror),
    case("turn", "gravity turns with the scene", measure_turn),
    Case(
        "mass-balance",
        (
            Check("sum of fractions", "1", "-", 0.0, "absolute"),
            Check("reordered mass", "that of the first order", "kg", 1e-12, "relative"),
        ),
        measure_balance,
    ),
)
