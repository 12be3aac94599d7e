"""A block slides over flush joints between other blocks: on a plane, along a wall, in a slot.

The sides of the blocks must not stop it, so that it moves as on one smooth face.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, Floats, box, rock, shifts

STEPS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
TIME = 1.6
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
        time = min(TIME, -self.speed / pull) if pull < 0.0 else TIME
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
    for dt in STEPS:
        scene, down = slide.scene()
        sim = lab.simulate(scene, dt)
        start = sim.poses
        sim.step(round(TIME / dt))
        ways.append(shifts(start, sim.poses, down))
    return (Measured(ways, slide.way()),)


def measure_fall(lab: Lab, clearance: float | None) -> tuple[Measured]:
    """Simulate falls along a wall or in a slot with all steps, smooth and rough."""
    ways = []
    for dt in STEPS:
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


CASES = (
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
