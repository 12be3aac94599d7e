"""Hard cases of shape: slivers, pebbles below boulders, wedges, exact coincidences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from experiments.hard_cases.case import Case, History
from experiments.hard_cases.stacks import STANDS, end_speed, on_level, stands
from rigdda import Block, Scene, Terrain
from rigdda.validation.scenes import GRAVITY, box, incline, masses, ngon, rock
from rigdda.validation.single_block import slide

HALF = math.radians(5.0)
"""Half of the angle of a sharp wedge [rad]."""

BOULDER, PEBBLE = 5.0, 0.05
"""Sides of boulders and pebbles [m], for a mass ratio of 1e4."""


def way_error(slope_deg: float, friction_deg: float) -> Callable[[History], float]:
    """Return the relative error of the distance of the first block down a slope, from rest [-]."""

    def error(history: History) -> float:
        exact = slide(slope_deg, friction_deg, history.times[-1])
        return abs(math.dist(history.poses[-1, 0, :2], history.poses[0, 0, :2]) / exact - 1.0)

    return error


def pile_of_slivers() -> Scene:
    """Return a pile of ten plates 10 m long and 5 cm thick."""
    return on_level(*(box(0.0, 0.025 + 0.05 * i, 10.0, 0.05) for i in range(10)))


def pebbles() -> Scene:
    """Return a boulder on three pebbles, with another boulder on top."""
    small = [box(x, 0.5 * PEBBLE, PEBBLE, PEBBLE) for x in (-2.0, 0.3, 2.0)]
    large = [box(0.0, PEBBLE + BOULDER * (0.5 + i), BOULDER, BOULDER) for i in range(2)]
    return on_level(*small, *large)


def wedge_shape(low: float, high: float) -> np.ndarray:
    """Return the part of a wedge between two heights above its apex, (4, 2) [m]."""
    t = math.tan(HALF)
    return np.array([(-low * t, low), (low * t, low), (high * t, high), (-high * t, high)])


def wedge_in_notch() -> Scene:
    """Return a frictionless sharp wedge in a notch of the ground that fits it exactly."""
    t = math.tan(HALF)
    edge = [(-8.0, 8.0), (-8.0 * t, 8.0), (-0.5 * t, 0.5), (0.5 * t, 0.5), (8.0 * t, 8.0)]
    return Scene(Terrain([*edge, (8.0, 8.0)]), (Block(wedge_shape(1.0, 6.0)),), rock(0.0))


def wall_pressure_error(history: History) -> float:
    """Return the relative error of the sum of the wall forces, 2 N = W/sin(half angle) [-]."""
    weight = GRAVITY * float(masses(history.scene)[0][0])
    force = float(history.sim.contacts()["normal_force"].sum())
    return abs(force * math.sin(HALF) / weight - 1.0)


def wedge_between_blocks() -> Scene:
    """Return a heavy frictionless wedge that drives two blocks apart on level ground."""
    t = math.tan(HALF)
    jaw = np.array([(1.0 * t, 0.0), (3.0, 0.0), (3.0, 6.0), (7.0 * t, 6.0)])
    wedge = wedge_shape(3.0, 9.0) - np.array([0.0, 1.0])
    left = jaw * (-1.0, 1.0)
    ground = Terrain([(-50.0, 0.0), (50.0, 0.0)])
    return Scene(ground, (Block(wedge, 26e3), Block(jaw), Block(left)), rock(0.0))


def drive_error(history: History) -> float:
    """Return the relative error of the wedge's distance [-]: a = m g/(m + 2 M tan^2 b)."""
    wedge, jaw, _ = masses(history.scene)[0]
    pull = wedge * GRAVITY / (wedge + 2.0 * jaw * math.tan(HALF) ** 2)
    way = history.poses[0, 0, 1] - history.poses[-1, 0, 1]
    return float(abs(way / (0.5 * pull * history.times[-1] ** 2) - 1.0))


def corner_on_corner() -> Scene:
    """Return a square on its corner that falls exactly onto the corner of another square."""
    radius = 0.5 * math.sqrt(2.0)
    fixed = Block(ngon(4, radius, (0.0, radius)), fixed=True)
    return on_level(fixed, Block(ngon(4, radius, (0.0, 3.0 * radius + 0.5))))


def coincident() -> Scene:
    """Return two identical blocks in the same position."""
    return on_level(box(0.0, 0.5), box(0.0, 0.5))


def overlapping(depth: float) -> Callable[[], Scene]:
    """Return a builder of three cubes that overlap by `depth` [m]."""

    def build() -> Scene:
        step = 1.0 - depth
        return on_level(box(0.0, 0.5), box(step, 0.5), box(0.3, 0.5 + step))

    return build


def top_speed(history: History) -> float:
    """Return the greatest speed in any frame [m/s]."""
    return float(np.hypot(*history.velocities[..., :2].reshape(-1, 2).T).max())


CASES = (
    Case(
        "sliver-slides-1-200",
        "way [-]: g t^2/2 (sin th - cos th tan phi)",
        lambda: incline(30.0, 20.0, 10.0, 0.05)[0],
        2.0,
        way_error(30.0, 20.0),
        1e-3,
    ),
    stands("slivers-piled-1-200", pile_of_slivers, 0.05),
    stands("pebbles-below-boulders", pebbles, PEBBLE),
    Case(
        "wedge-in-notch",
        "wall forces [-]: W/sin b",
        wedge_in_notch,
        5.0,
        wall_pressure_error,
        1e-2,
        settings={"sleeping": False},
    ),
    Case(
        "wedge-between-blocks",
        "way [-]: m g/(m + 2 M tan^2 b) t^2/2",
        wedge_between_blocks,
        0.4,
        drive_error,
        1e-2,
    ),
    Case(
        "corner-on-corner",
        "speed at the end [m/s]: it rests",
        corner_on_corner,
        10.0,
        end_speed,
        STANDS,
    ),
    Case(
        "coincident-blocks",
        "refused: blocks are in one another",
        coincident,
        20.0,
        top_speed,
        1.0,
        gain=0.5,
        settled=15.0,
        refused=True,
    ),
    Case(
        "overlapping-start",
        "greatest speed [m/s]: no burst, and the overlap does not grow",
        overlapping(0.009),
        20.0,
        top_speed,
        1.0,
        gain=0.1,
        settled=15.0,
    ),
    Case(
        "deeply-overlapping-start",
        "refused: blocks are in one another",
        overlapping(0.4),
        20.0,
        top_speed,
        1.0,
        gain=0.5,
        settled=15.0,
        refused=True,
    ),
)
