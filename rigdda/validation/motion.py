"""Motion of free blocks: flight, area under rotation, invariances and the balance of energy.

- Free fall, and fall with mass-proportional damping.
- A spinning block keeps its area; without post-correction it expands as predicted.
- A scene can be shifted, rotated or reflected and its blocks reordered, and nothing else changes.
- The energy ledger of a whole release balances.
"""

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
from rigdda.validation.scenes import GRAVITY, Floats, box, ngon, polygon, rock, rough

FLIGHT_DURATION = 3.0
"""Duration of the falls [s]."""


def fall(damping: float, time: float) -> tuple[float, float]:
    """Return distance [m] and speed [m/s] after `time` [s] from rest: v' = g - a v.

    v = g/a (1 - exp(-a t)), s = g/a (t - (1 - exp(-a t))/a); without damping g t and g t^2/2.
    """
    if damping == 0.0:
        return 0.5 * GRAVITY * time * time, GRAVITY * time
    lost = (1.0 - math.exp(-damping * time)) / damping
    return GRAVITY / damping * (time - lost), GRAVITY * lost


def measure_fall(lab: Lab, damping: float) -> tuple[Measured, Measured]:
    """Simulate the fall of a block."""
    sim = lab.simulate(Scene(None, (box(),), rock(), damping=damping))
    sim.step(lab.steps(FLIGHT_DURATION))
    way, speed = fall(damping, FLIGHT_DURATION)
    return Measured(-sim.poses[0, 1], way), Measured(-sim.velocities[0, 1], speed)


def fall_checks(equations: tuple[str, str], bar: float) -> tuple[Check, Check]:
    """Return the checks of a fall."""
    return (
        Check("way", equations[0], "m", bar, "relative"),
        Check("speed", equations[1], "m/s", bar, "relative"),
    )


FREE_FLIGHT = (
    Case("free-fall", fall_checks(("g t^2/2", "g t"), 1e-12), lambda lab: measure_fall(lab, 0.0)),
    Case(
        "damped-fall",
        fall_checks(("g/a (t - (1 - exp(-a t))/a)", "g/a (1 - exp(-a t))"), 1e-5),
        lambda lab: measure_fall(lab, 0.6),
        smooth=True,
    ),
)


SPIN_TURNS = 1000
SPIN_RATE = 2.0 * math.pi * 20.0
"""Rate of rotation [rad/s]."""

ROTATIONS_PER_STEP = (1e-3, 1e-2, 5e-2)
"""Rotations per step of the linear displacement function [rad]."""


def spinning(rate: float) -> Scene:
    """Return a heptagon that spins at `rate` [rad/s] in free space."""
    return Scene(None, (Block(ngon(7), velocity=(0.0, 0.0, rate)),), rock(), gravity=0.0)


def measure_spin(lab: Lab) -> tuple[Measured, Measured]:
    """Rotate a block many times."""
    sim = lab.simulate(spinning(SPIN_RATE))
    before = polygon_properties(sim.vertices(0))[0]
    steps = lab.steps(SPIN_TURNS * 2.0 * math.pi / SPIN_RATE)
    sim.step(steps)
    area = polygon_properties(sim.vertices(0))[0]
    return Measured(area, before), Measured(sim.poses[0, 2], SPIN_RATE * steps * lab.dt)


def growth(rotation: float) -> float:
    """Return the growth of area per turn [-] by the linear displacement function.

    Each step of dr [rad] maps x to x + dr k x, which multiplies areas by 1 + dr^2 and rotates by
    atan dr: (1 + dr^2)^(2 pi/atan dr) - 1, about 2 pi dr.
    """
    return math.exp(2.0 * math.pi * math.log1p(rotation**2) / math.atan(rotation)) - 1.0


def measure_growth(lab: Lab) -> tuple[Measured]:
    """Rotate a block once without post-correction, with several rotations per step."""
    found = []
    for rotation in ROTATIONS_PER_STEP:
        sim = lab.simulate(spinning(rotation / lab.dt), post_correction=False)
        before = polygon_properties(sim.vertices(0))[0]
        sim.step(round(2.0 * math.pi / math.atan(rotation)))
        found.append(polygon_properties(sim.vertices(0))[0] / before - 1.0)
    return (Measured(found, np.array([growth(rotation) for rotation in ROTATIONS_PER_STEP])),)


ROTATION = (
    Case(
        "spin-1000",
        (
            Check("area", "that at the start", "m2", 1e-12, "relative"),
            Check("angle", "w t", "rad", 1e-9, "relative"),
        ),
        measure_spin,
    ),
    Case(
        "spin-linear",
        (Check("growth in a turn", "(1 + dr^2)^(2 pi/atan dr) - 1", "-", 5e-2, "relative"),),
        measure_growth,
    ),
)


INVARIANCE_SLOPE = np.array([(-40.0, 30.0), (-10.0, 8.0), (0.0, 5.0), (30.0, -10.0), (80.0, -12.0)])
INVARIANCE_DURATION = 0.6
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
    chain = place(INVARIANCE_SLOPE)
    terrain = Terrain(chain[::-1] if mirror else chain)
    sim = lab.simulate(Scene(terrain, tuple(blocks), rock(30.0, 0.3), damping=0.2, **scene))
    sim.step(lab.steps(INVARIANCE_DURATION))
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


def invariance_case(name: str, change: str, measure: Callable[[Lab], Sequence[Measured]]) -> Case:
    """Return the case of one change."""
    check = Check("change over way", f"none: {change}", "-", 1e-6, "bound")
    return Case(name, (check,), measure)


INVARIANCE = (
    invariance_case("shift", "same mechanics elsewhere", measure_shift),
    invariance_case("order", "same blocks", measure_order),
    invariance_case("mirror", "same mechanics mirrored", measure_mirror),
    invariance_case("turn", "gravity turns with the scene", measure_turn),
    Case(
        "mass-balance",
        (
            Check("sum of fractions", "1", "-", 0.0, "absolute"),
            Check("reordered mass", "that of the first order", "kg", 1e-12, "relative"),
        ),
        measure_balance,
    ),
)


STATE_ENERGIES = ("kinetic", "potential", "elastic")
"""Energies of the state; all other entries of the ledger are work done on the blocks so far."""


def measure_ledger(lab: Lab) -> tuple[Measured]:
    """Release the site shu-hwa-paper for 25 s; the change of state must equal the work done."""
    sim = lab.simulate(Site.load("shu-hwa-paper").realise(seed=lab.seed))
    start = sim.energy()
    sim.step(lab.steps(25.0))
    end = sim.energy()
    change = {name: getattr(end, name) - getattr(start, name) for name in end._fields}
    state = sum(value for name, value in change.items() if name in STATE_ENERGIES)
    work = sum(value for name, value in change.items() if name not in STATE_ENERGIES)
    return (Measured(abs(state - work) / -change["potential"]),)


ENERGY_BALANCE = (
    Case(
        "energy-ledger",
        (Check("gap over release", "none: first law", "-", 1e-3, "bound"),),
        measure_ledger,
    ),
)
