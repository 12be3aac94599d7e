"""A block on a plane with Coulomb friction, sliding or at rest."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from rigdda.model.loads import PointLoad
from rigdda.model.scene import Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import FLAT, GRAVITY, Floats, box, incline, masses, rock, shifts

LOW = 0.4
"""Height of a block 1 m wide that slides at 45 degrees without toppling [m]."""

DAMPING = 1.0
"""Mass-proportional damping [1/s]."""

STEPS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
"""Steps at which slabs slide [s]."""

PULSE, YIELD, PULSE_TIME = 0.5, 0.2, 0.3
"""Newmark's pulse: base acceleration and friction coefficient [g], duration [s]."""


def slide(slope_deg: float, friction_deg: float, time: float) -> float:
    """Return the distance [m] from rest: s = g t^2/2 (sin th - cos th tan phi)."""
    slope, friction = math.radians(slope_deg), math.radians(friction_deg)
    pull = GRAVITY * (math.sin(slope) - math.cos(slope) * math.tan(friction))
    return 0.5 * pull * time**2


def damped_slide(slope_deg: float, friction_deg: float, damping: float, time: float) -> float:
    """Return the distance [m] from rest with damping: s = a/c (t - (1 - exp(-c t))/c).

    From v' = a - c v, with a = g (sin th - cos th tan phi) and the damping c.
    """
    pull = 2.0 * slide(slope_deg, friction_deg, 1.0)
    return pull / damping * (time - (1.0 - math.exp(-damping * time)) / damping)


def newmark(pulse: float, limit: float, time: float) -> float:
    """Return the displacement [m] of a block on a base under a rectangular pulse (Newmark 1965).

    D = V^2/(2 g N) (1 - N/A), V = A g T, for a pulse A g of T seconds and yield at N g.
    """
    speed = pulse * GRAVITY * time
    return speed**2 / (2.0 * GRAVITY * limit) * (1.0 - limit / pulse)


def measure_slide(
    lab: Lab, slope_deg: float, friction_deg: float, height: float, time: float
) -> tuple[Measured]:
    """Simulate a block that slides from rest."""
    scene, down = incline(slope_deg, friction_deg, 1.0, height)
    sim = lab.simulate(scene)
    start = sim.poses
    sim.step(lab.steps(time))
    way = shifts(start, sim.poses, down)
    return (Measured(way, slide(slope_deg, friction_deg, time)),)


def slab_scene(
    slope_deg: float, friction_deg: float, speed: float, kink_deg: float = 0.0, rolling: float = 0.3
) -> tuple[Scene, Floats]:
    """Return a scene with a slab of 3.5 x 1 m on a slope, and the downslope direction.

    With kinks, the line changes its direction at every metre, by this angle [deg] to either side in
    turn: its slopes are half of it above and below the mean slope, and its crests lie on the plane.
    """
    slope, half = math.radians(slope_deg), math.radians(0.5 * kink_deg)
    down = np.array([math.cos(slope), -math.sin(slope)])
    out = np.array([math.sin(slope), math.cos(slope)])
    x, y = (0.5 * out).tolist()
    block = box(x, y, 3.5, 1.0, -slope, velocity=(*(speed * down), 0.0))
    if kink_deg:
        places = np.arange(-5, 101)
        depth = math.sin(half) * (places % 2)
        line = places[:, None] * math.cos(half) * down - depth[:, None] * out
    else:
        line = np.array([-5.0 * down, 100.0 * down])
    surfaces = {"rock": Surface(friction_deg=friction_deg, restitution=0.0, rolling=rolling)}
    return Scene(Terrain(line), (block,), surfaces), down


def measure_slab(
    lab: Lab, kink_deg: float = 0.0, rolling: float = 0.3, steps: Sequence[float] = STEPS
) -> tuple[Measured, Measured]:
    """Simulate slabs that slide for 2 s, from rest and with speed, at several steps."""
    ways, speeds = [], []
    for slope_deg, friction_deg, speed, dt in itertools.product(
        (35.0, 60.0), (20.0, 32.0), (0.0, 5.0), steps
    ):
        if kink_deg and slope_deg - friction_deg < 5.0:
            continue  # near the limit of friction, kinks change the way by 0.8 % without rolling
        scene, down = slab_scene(slope_deg, friction_deg, speed, kink_deg, rolling)
        sim = lab.simulate(scene, dt, sleeping=False)
        start = sim.poses
        sim.step(round(2.0 / dt))
        from_rest = slide(slope_deg, friction_deg, 2.0)
        ways.append((shifts(start, sim.poses, down), 2.0 * speed + from_rest))
        speeds.append((float(sim.velocities[0, :2] @ down), speed + from_rest))
    return Measured(*np.transpose(ways)), Measured(*np.transpose(speeds))


def measure_damped(lab: Lab) -> tuple[Measured]:
    """Simulate a slide from rest with mass-proportional damping."""
    plain, down = incline(30.0, 20.0)
    sim = lab.simulate(Scene(plain.terrain, plain.blocks, plain.surfaces, damping=DAMPING))
    start = sim.poses
    sim.step(lab.steps(2.0))
    way = shifts(start, sim.poses, down)
    return (Measured(way, damped_slide(30.0, 20.0, DAMPING, 2.0)),)


def measure_creep(lab: Lab, sim: Metered) -> tuple[Measured, Measured]:
    """Measure the creep of a block at rest, from 1 s to 60 s and from 10 s to 60 s."""
    sim.step(lab.steps(1.0))
    first = sim.poses[:, :2]
    sim.step(lab.steps(9.0))
    later = sim.poses[:, :2]
    sim.step(lab.steps(50.0))
    last = sim.poses[:, :2]
    return (
        Measured(np.linalg.norm(last - first, axis=1)),
        Measured(np.linalg.norm(last - later, axis=1)),
    )


def measure_hold(lab: Lab, friction_deg: float) -> tuple[Measured, Measured]:
    """Measure the creep of a block on a slope of 30 degrees that is too rough for sliding."""
    scene, _ = incline(30.0, friction_deg)
    return measure_creep(lab, lab.simulate(scene, sleeping=False))


def measure_pressed(lab: Lab) -> tuple[Measured, Measured]:
    """Measure the creep of a block pressed into a slope of 30 degrees by ten times its weight."""
    plain, down = incline(30.0, 35.0)
    weight = GRAVITY * masses(plain)[0][0]
    force = 10.0 * weight * np.array([down[1], -down[0]])  # into the slope
    centre = plain.blocks[0].vertices.mean(axis=0)
    scene = Scene(
        plain.terrain,
        plain.blocks,
        plain.surfaces,
        loads=(PointLoad(0, tuple(centre), tuple(force)),),
    )
    return measure_creep(lab, lab.simulate(scene, sleeping=False))


def measure_newmark(lab: Lab) -> tuple[Measured]:
    """Shake level ground under a block by one rectangular pulse; the block slides to rest."""
    push = PULSE * GRAVITY
    history = [(0.0, push, 0.0), (PULSE_TIME, push, 0.0), (PULSE_TIME, 0.0, 0.0)]
    scene = Scene(
        Terrain(FLAT),
        (box(0.0, 0.25, 1.0, 0.5),),
        rock(math.degrees(math.atan(YIELD))),
        base_motion=np.array(history),
    )
    sim = lab.simulate(scene)
    sim.step(lab.steps(2.0))
    return (Measured(abs(sim.poses[0, 0]), newmark(PULSE, YIELD, PULSE_TIME)),)


def slide_case(
    name: str, slope_deg: float, friction_deg: float, height: float, time: float, bar: float
) -> Case:
    """Return the case of one slide."""
    check = Check("way", "g t^2/2 (sin th - cos th tan phi)", "m", bar, "relative")
    return Case(
        name,
        (check,),
        lambda lab: measure_slide(lab, slope_deg, friction_deg, height, time),
        smooth=True,
    )


HOLDS = (
    Check("creep, 1-60 s", "none: phi > th", "m", 1e-4, "bound"),
    # rounding errors of 10,000 steps
    Check("creep, 10-60 s", "none: phi > th", "m", 1e-8, "bound"),
)

SLABS = (
    Check("way", "v t + g t^2/2 (sin th - cos th tan phi)", "m", 5e-3, "relative"),
    Check("speed", "v + g t (sin th - cos th tan phi)", "m/s", 5e-3, "relative"),
)

CASES = (
    Case("slab", SLABS, measure_slab),
    Case("slab-kinks", SLABS, lambda lab: measure_slab(lab, 1.0)),
    slide_case("slide-30-20", 30.0, 20.0, 1.0, 2.0, 1e-4),
    slide_case("slide-45-30", 45.0, 30.0, LOW, 2.0, 1e-4),
    slide_case("slide-35-34-2s", 35.0, 34.0, 1.0, 2.0, 2e-3),
    slide_case("slide-35-34-10s", 35.0, 34.0, 1.0, 10.0, 1e-4),
    slide_case("slide-30.2-30", 30.2, 30.0, 1.0, 5.0, 1e-4),
    Case(
        "slide-damped",
        (Check("way", "a/c (t - (1 - exp(-c t))/c)", "m", 5e-3, "relative"),),
        measure_damped,
        smooth=True,
    ),
    Case("hold-30-30.5", HOLDS, lambda lab: measure_hold(lab, 30.5)),
    Case("hold-30-35", HOLDS, lambda lab: measure_hold(lab, 35.0)),
    Case("hold-pressed", HOLDS, measure_pressed),
    Case(
        "newmark",
        (Check("way", "V^2/(2 g N) (1 - N/A), V = A g T (Newmark 1965)", "m", 1e-3, "relative"),),
        measure_newmark,
        smooth=True,
    ),
)
