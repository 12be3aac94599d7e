"""A regular polygon that rolls down a slope with plastic impacts: the rimless wheel."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, ngon, rock, shifts

SIDES, RADIUS, SLOPE, RATE, DURATION = 16, 1.0, math.radians(8.0), 2.2, 3.0
"""Number of corners, circumradius [m], slope [rad], initial rate of rotation [rad/s], time [s]."""


def wheel(sides: int, radius: float, slope: float, rate: float, time: float) -> float:
    """Return the distance of the centre along the slope [m].

    This is the rimless wheel of McGeer (1990) with the radius of gyration k of a solid polygon. The
    wheel rotates about one corner at a time, ph'' = g r sin(ph + th)/(k^2 + r^2) with ph from -pi/n
    to pi/n. Then the next corner hits the ground and w+/w- = (k^2 + r^2 cos(2 pi/n))/(k^2 + r^2),
    with k^2 = r^2/6 (1 + 2 cos^2(pi/n)). The wheel must not lift off: w^2 r < g cos(ph + th).
    """
    half, r2 = math.pi / sides, radius**2
    k2 = r2 / 6.0 * (1.0 + 2.0 * math.cos(half) ** 2)
    kept = (k2 + r2 * math.cos(2.0 * half)) / (k2 + r2)

    def turn(_: float, state: np.ndarray) -> tuple[float, float]:
        return state[1], GRAVITY * radius * math.sin(state[0] + slope) / (k2 + r2)

    def strike(_: float, state: np.ndarray) -> float:
        return float(state[0]) - half

    strike.terminal = True  # type: ignore[attr-defined]
    angle, now, way = -half, 0.0, 0.0
    while True:
        part = solve_ivp(
            turn, (now, time), (angle, rate), "DOP853", events=strike, rtol=1e-12, atol=1e-12
        )
        angle, rate = part.y[:, -1]
        if (part.y[1] ** 2 * radius > GRAVITY * np.cos(part.y[0] + slope)).any():
            raise ValueError("the wheel lifts off: choose a smaller rate or slope")
        if part.status == 0:
            return way + radius * (math.sin(angle) + math.sin(half))
        way += 2.0 * radius * math.sin(half)
        now, angle, rate = part.t[-1], -half, kept * rate


def roll(lab: Lab, sides: int, radius: float, slope: float, rate: float, time: float) -> float:
    """Return the distance [m] of a polygon that starts flat and rotates about its lower corner.

    The arguments are those of `wheel`.
    """
    half = math.pi / sides
    down = np.array([math.cos(slope), -math.sin(slope)])
    out = np.array([math.sin(slope), math.cos(slope)])
    centre = radius * math.cos(half) * out
    # clockwise about the lower corner: v = -w (-arm_y, arm_x), arm from the corner to the centre
    arm = centre - radius * math.sin(half) * down
    velocity = (rate * arm[1], -rate * arm[0], -rate)
    corners = ngon(sides, radius, centre, -0.5 * math.pi + half - slope)
    block = Block(corners, velocity=velocity)
    terrain = Terrain([-5.0 * down, 100.0 * down])
    sim = lab.simulate(Scene(terrain, (block,), rock(60.0)))
    start = sim.poses
    sim.step(lab.steps(time))
    return shifts(start, sim.poses, down)


def measure(lab: Lab) -> tuple[Measured]:
    """Simulate the rolling polygon."""
    wanted = (SIDES, RADIUS, SLOPE, RATE, DURATION)
    return (Measured(roll(lab, *wanted), wheel(*wanted)),)


def case(name: str, bar: float, dt: float | None = None) -> Case:
    """Return the case with the default step or with `dt` [s]."""
    check = Check("way in 3 s", "rimless wheel (McGeer 1990)", "m", bar, "relative")
    return Case(name, (check,), measure, dt=dt)


CASES = (case("16-gon", 1e-3), case("16-gon-1ms", 1e-3, 1e-3))
