"""A regular polygon that rolls down a slope with plastic impacts: the rimless wheel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import GRAVITY, ngon, shifts

SIDES, RADIUS, SLOPE, RATE, DURATION = 16, 1.0, math.radians(8.0), 2.2, 3.0
"""Number of corners, circumradius [m], slope [rad], initial rate of rotation [rad/s], time [s]."""


def wheel(
    sides: int, radius: float, slope: float, rate: float, time: float, resistance: float = 0.0
) -> float:
    """Return the distance of the centre along the slope when it stops or after `time` [m].

    This is the rimless wheel of McGeer (1990) with the radius of gyration k of a solid polygon and
    a resisting moment c N R at its corner, R = sqrt(2) k. The wheel rotates about one corner at a
    time, with ph from -pi/n to pi/n. The normal force holds its centre at the height r cos(ph),

        N/m = g cos(th) - r (ph'' sin(ph) + w^2 cos(ph)),
        (k^2 + r^2) ph'' = g r sin(ph + th) - c R N/m.

    Then the next corner hits the ground. The centre sinks with r w- sin(pi/n) before and rises with
    r w+ sin(pi/n) after the impact, which needs the normal impulse P/m = r sin(pi/n) (w- + w+). The
    moment of momentum about the new corner changes by c R P, and the old corner lifts off:

        w+/w- = (k^2 + r^2 cos(2 pi/n) - c R r sin(pi/n)) / (k^2 + r^2 + c R r sin(pi/n)),

    with k^2 = r^2/6 (1 + 2 cos^2(pi/n)). The normal force must not vanish.
    """
    half, r2 = math.pi / sides, radius**2
    k2 = r2 / 6.0 * (1.0 + 2.0 * math.cos(half) ** 2)
    lever = resistance * math.sqrt(2.0 * k2)
    jolt = lever * radius * math.sin(half)
    kept = (k2 + r2 * math.cos(2.0 * half) - jolt) / (k2 + r2 + jolt)

    def growth(angle: Any, speed: Any) -> Any:
        push = GRAVITY * math.cos(slope) - radius * speed**2 * np.cos(angle)
        pull = GRAVITY * radius * np.sin(angle + slope) - lever * push
        return pull / (k2 + r2 - lever * radius * np.sin(angle))

    def turn(_: float, state: np.ndarray) -> tuple[float, float]:
        return state[1], growth(state[0], state[1])

    def strike(_: float, state: np.ndarray) -> float:
        return float(state[0]) - half

    def stop(_: float, state: np.ndarray) -> float:
        return float(state[1])

    strike.terminal = stop.terminal = True  # type: ignore[attr-defined]
    angle, now, way = -half, 0.0, 0.0
    while True:
        part = solve_ivp(
            turn,
            (now, time),
            (angle, rate),
            "DOP853",
            events=(strike, stop),
            rtol=1e-12,
            atol=1e-12,
        )
        angle, rate = part.y[:, -1]
        gain = growth(*part.y) * np.sin(part.y[0]) + part.y[1] ** 2 * np.cos(part.y[0])
        if (radius * gain > GRAVITY * math.cos(slope)).any():
            raise ValueError("the wheel lifts off: choose a smaller rate or slope")
        if part.status == 0 or len(part.t_events[1]):
            return way + radius * (math.sin(angle) + math.sin(half))
        way += 2.0 * radius * math.sin(half)
        now, angle, rate = part.t[-1], -half, kept * rate


def start(
    lab: Lab,
    sides: int,
    radius: float,
    slope: float,
    rate: float,
    resistance: float = 0.0,
    friction_deg: float = 60.0,
) -> tuple[Metered, np.ndarray]:
    """Return the simulation of a polygon that starts flat and rotates about its lower corner.

    The arguments are those of `wheel`. The unit vector down the slope is returned as well.
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
    surfaces = {"rock": Surface(friction_deg=friction_deg, restitution=0.0, rolling=resistance)}
    return lab.simulate(Scene(terrain, (block,), surfaces), sleeping=False), down


def roll(
    lab: Lab,
    sides: int,
    radius: float,
    slope: float,
    rate: float,
    time: float,
    resistance: float = 0.0,
) -> float:
    """Return the distance [m] of a polygon that starts flat and rotates about its lower corner.

    The arguments are those of `wheel`.
    """
    sim, down = start(lab, sides, radius, slope, rate, resistance)
    first = sim.poses
    sim.step(lab.steps(time))
    return shifts(first, sim.poses, down)


def measure(lab: Lab) -> tuple[Measured]:
    """Simulate the rolling polygon."""
    wanted = (SIDES, RADIUS, SLOPE, RATE, DURATION)
    return (Measured(roll(lab, *wanted), wheel(*wanted)),)


def measure_resisted(
    lab: Lab, sides: int, slope_deg: float, rate: float, resistance: float
) -> tuple[Measured]:
    """Simulate a polygon that rolls against a moment."""
    wanted = (sides, RADIUS, math.radians(slope_deg), rate, DURATION, resistance)
    return (Measured(roll(lab, *wanted), wheel(*wanted)),)


def measure_stop(lab: Lab) -> tuple[Measured, Measured]:
    """Simulate a polygon of 60 sides that rolls out on level ground, and what it moves then."""
    sim, down = start(lab, 60, RADIUS, 0.0, 2.0, 0.1)
    first = sim.poses
    sim.step(lab.steps(10.0))
    out = sim.poses
    sim.step(lab.steps(20.0))
    exact = wheel(60, RADIUS, 0.0, 2.0, 10.0, 0.1)
    return Measured(shifts(first, out, down), exact), Measured(abs(shifts(out, sim.poses, down)))


def measure_hold(lab: Lab) -> tuple[Measured]:
    """Leave a polygon of 60 sides on a slope of half the limit tan(th) = c R/r.

    Without the moment it would roll: the slope is steeper than pi/60.
    """
    resistance = 0.2
    sim, down = start(lab, 60, RADIUS, math.atan(0.5 * resistance), 0.0, resistance)
    first = sim.poses
    sim.step(lab.steps(20.0))
    return (Measured(abs(shifts(first, sim.poses, down))),)


def case(name: str, bar: float, dt: float | None = None) -> Case:
    """Return the case with the default step or with `dt` [s]."""
    check = Check("way in 3 s", "rimless wheel (McGeer 1990)", "m", bar, "relative")
    return Case(name, (check,), measure, dt=dt)


def resisted(sides: int, slope_deg: float, rate: float, resistance: float) -> Case:
    """Return the case of a polygon that rolls against a moment of at most c N R."""
    check = Check("way in 3 s", "rimless wheel with the moment c N R", "m", 2e-3, "relative")
    return Case(
        f"{sides}-gon-c{resistance:g}",
        (check,),
        lambda lab: measure_resisted(lab, sides, slope_deg, rate, resistance),
    )


CASES = (
    case("16-gon", 1e-3),
    case("16-gon-1ms", 1e-3, 1e-3),
    resisted(8, 12.0, 2.2, 0.05),
    resisted(8, 16.0, 2.2, 0.1),
    resisted(16, 8.0, 2.2, 0.05),
    resisted(16, 12.0, 2.2, 0.1),
    Case(
        "60-gon-stops",
        (
            Check("way", "rimless wheel with the moment c N R, to its stop", "m", 0.01, "relative"),
            Check("creep, 10-30 s", "none", "m", 1e-8, "bound"),
        ),
        measure_stop,
    ),
    Case(
        "60-gon-stays",
        (Check("creep, 20 s", "none: tan th < c R/r", "m", 1e-4, "bound"),),
        measure_hold,
    ),
)
