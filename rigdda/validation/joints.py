"""Joints between blocks: sliding over flush joints, and the strength of a joint.

A block slides over flush joints between other blocks: on a plane, along a wall, in a slot. The
sides of the blocks must not stop it, so that it moves as on one smooth face.

A joint breaks where a linear traction along it exceeds its strength. It is loaded in tension,
pulled with an eccentricity e, which it resists up to N = sigma_t L / (1 + 6 e / L); and in shear,
pushed at its level or above it, up to S = c L + N tan phi.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from rigdda.model.loads import PointLoad
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, GRAVITY, Floats, box, masses, rock, shifts

JOINT_SLIDE_STEPS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
SLIDE_TIME = 1.6
"""Duration of a slide [s]."""

COURSE = 30
"""Number of blocks of 1 m in a row, longer than any slide in that time."""

CLEARANCE = 1e-4
"""Clearance of a block in a slot [m]."""


class JointSlide(NamedTuple):
    """A slide over joints: slope and friction [deg], initial speed [m/s], gravity [m/s2]."""

    slope: float
    friction: float
    speed: float = 0.0
    gravity: float = GRAVITY
    free: bool = False  # whether the blocks below are free, on rough ground

    def way(self) -> float:
        """Return v t + g t^2/2 (sin th - cos th tan phi), up to the stopping point [m]."""
        slope = math.radians(self.slope)
        drag = math.cos(slope) * math.tan(math.radians(self.friction))
        pull = self.gravity * (math.sin(slope) - drag)
        time = min(SLIDE_TIME, -self.speed / pull) if pull < 0.0 else SLIDE_TIME
        return self.speed * time + 0.5 * pull * time**2

    def scene(self) -> tuple[Scene, Floats]:
        """Return the blocks, the sliding one first, and the downslope direction."""
        slope = math.radians(self.slope)
        down = np.array([math.cos(slope), -math.sin(slope)])
        out = np.array([math.sin(slope), math.cos(slope)])
        x, y = 1.3 * down + 0.25 * out
        slider = box(x, y, 1.0, 0.5, -slope, velocity=(*(self.speed * down), 0.0))
        places = [i * down - 0.5 * out for i in range(COURSE)]
        row = [box(x, y, angle=-slope, fixed=not self.free) for x, y in places]
        if not self.free:
            return Scene(None, (slider, *row), rock(self.friction), gravity=self.gravity), down
        # the last block supports the row
        x, y = COURSE * down - 0.5 * out
        row.append(box(x, y, angle=-slope, fixed=True))
        ground = Terrain([-3.0 * down - out, 2.0 * COURSE * down - out])
        return Scene(ground, (slider, *row), rock(self.friction)), down


def fall_along(friction_deg: float, clearance: float | None) -> Scene:
    """Return a block beside a wall of stacked fixed blocks, or in a slot between two walls."""
    slider = box(1.0 + 0.5 * (clearance or 0.0), 15.3)
    sides = (0.0,) if clearance is None else (0.0, 2.0 + clearance)
    stack: list[Block] = [box(x, float(i), fixed=True) for x in sides for i in range(20)]
    return Scene(None, (slider, *stack), rock(friction_deg))


def measure_slide(lab: Lab, slide: JointSlide) -> tuple[Measured]:
    """Simulate a slide over the row with all steps."""
    ways = []
    for dt in JOINT_SLIDE_STEPS:
        scene, down = slide.scene()
        sim = lab.simulate(scene, dt)
        start = sim.poses
        sim.step(round(SLIDE_TIME / dt))
        ways.append(shifts(start, sim.poses, down))
    return (Measured(ways, slide.way()),)


def measure_fall(lab: Lab, clearance: float | None) -> tuple[Measured]:
    """Simulate falls along a wall or in a slot with all steps, smooth and rough."""
    ways = []
    for dt in JOINT_SLIDE_STEPS:
        for friction in (0.0, 30.0):
            sim = lab.simulate(fall_along(friction, clearance), dt)
            sim.step(round(1.2 / dt))
            ways.append(15.3 - sim.poses[0, 1])
    return (Measured(ways, 0.5 * GRAVITY * 1.2**2),)


def slide_case(name: str, slide: JointSlide) -> Case:
    """Return the case of one slide."""
    form = "v t + g t^2/2 (sin th - cos th tan phi)"
    check = Check("way, 1-20 ms", form, "m", 1e-2, "relative")
    return Case(name, (check,), lambda lab: measure_slide(lab, slide))


def fall_case(name: str, clearance: float | None) -> Case:
    """Return the case of a fall along joints."""
    check = Check("way, 1-20 ms", "g t^2/2: nothing presses", "m", 1e-2, "relative")
    return Case(name, (check,), lambda lab: measure_fall(lab, clearance))


SLIDES_OVER_JOINTS = (
    slide_case("joints-35-20", JointSlide(35.0, 20.0)),
    slide_case("joints-35-0", JointSlide(35.0, 0.0)),
    slide_case("joints-0-20", JointSlide(0.0, 20.0, 10.0)),
    slide_case("joints-0-0", JointSlide(0.0, 0.0, 10.0)),
    slide_case("joints-weightless", JointSlide(0.0, 20.0, 3.0, 0.0)),
    slide_case("joints-free-35-20", JointSlide(35.0, 20.0, free=True)),
    slide_case("joints-free-0-20", JointSlide(0.0, 20.0, 6.0, free=True)),
    fall_case("joints-wall", None),
    fall_case("joints-slot", CLEARANCE),
)


STRENGTH_STEPS = (1e-3, 5e-3, 1e-2)
JOINT_FRICTION_DEG = 30.0
"""Friction angle of the joint [deg]."""

STRENGTH = 1e5
"""Tensile strength of the joint; its cohesion is a tenth of it [Pa]."""

ECCENTRICITIES = (0.0, 0.1, 0.25, 0.5)
"""Eccentricities of the pull over the joint length of 1 m [-]."""

ARMS = (0.0, 0.5, 1.0)
"""Heights of the push above the joint of a block 2 m high [m]."""

PULL_TIME = 0.3
"""Time after which a broken joint has visibly separated [s]."""

HALVINGS = 6


def breaking(lab: Lab, scene: Scene, dt: float) -> bool:
    """Return whether the block of a scene moves."""
    sim = lab.simulate(scene, dt)
    start = sim.poses
    sim.step(round(PULL_TIME / dt))
    return bool(np.abs(sim.poses - start).max() > 1e-3)


def pulled(eccentricity: float, share: float) -> Scene:
    """Return a block on a joint, pulled upwards with a fraction of the breaking force."""
    block = box(0.0, 0.5)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    pull = share * STRENGTH / (1.0 + 6.0 * eccentricity)
    # pull and compensation of the weight, combined into one eccentric force
    load = PointLoad(0, (pull * eccentricity / (pull + weight), 1.0), (0.0, pull + weight))
    surface = Surface(JOINT_FRICTION_DEG, cohesion=100.0 * STRENGTH, tension=STRENGTH)
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def pushed(arm: float, share: float) -> Scene:
    """Return a block of 1 by 2 m on a joint, pushed by a fraction of the breaking force."""
    block = box(0.0, 1.0, 1.0, 2.0)
    weight = GRAVITY * float(masses(Scene(None, (block,)))[0][0])
    push = share * (0.1 * STRENGTH + weight * math.tan(math.radians(JOINT_FRICTION_DEG)))
    surface = Surface(JOINT_FRICTION_DEG, cohesion=0.1 * STRENGTH, tension=10.0 * STRENGTH)
    load = PointLoad(0, (0.0, arm), (push, 0.0))
    return Scene(Terrain(FLAT), (block,), {"rock": surface}, loads=(load,))


def strength(lab: Lab, build: Callable[[float], Scene], dt: float) -> float:
    """Return the breaking force of a joint over the closed form, by bisection."""
    low, high = 0.25, 4.0
    for _ in range(HALVINGS):
        share = math.sqrt(low * high)
        low, high = (low, share) if breaking(lab, build(share), dt) else (share, high)
    return math.sqrt(low * high)


def measure_strength(
    lab: Lab, build: Callable[[float, float], Scene], places: tuple[float, ...]
) -> tuple[Measured]:
    """Break joints with all steps."""
    found = [strength(lab, partial(build, x), dt) for x in places for dt in STRENGTH_STEPS]
    return (Measured(found, 1.0),)


TENSION = Check("pull, e 0-0.5 L", "sigma_t L / (1 + 6 e / L)", "-", 0.04, "relative")
SHEAR = Check("push, height 0-1 m", "c L + N tan phi", "-", 0.04, "relative")
JOINT_STRENGTH = (
    Case("joint-tension", (TENSION,), lambda lab: measure_strength(lab, pulled, ECCENTRICITIES)),
    Case("joint-shear", (SHEAR,), lambda lab: measure_strength(lab, pushed, ARMS)),
)
