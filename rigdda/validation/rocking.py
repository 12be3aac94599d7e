"""A tall block that rocks on its base after release from a tilt, or tips over (Housner 1963)."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, GRAVITY, polygon, rock

WIDTH, HEIGHT = 1.0, 4.0
"""Sides of the block [m]."""

HALF = math.atan2(WIDTH, HEIGHT)
"""Angle between diagonal and side [rad], the tilt beyond which the block topples."""

TILTS = tuple(0.5 * HALF * (1.0 + 1.6e-3 * k) for k in range(5))
"""Initial tilts [rad]; each delays the impact by 1 ms, which shifts it within a step."""

BEYOND, FALLEN = 1e-3, 0.5
"""Initial and final angle beyond balance of the tipping block [rad]."""

STEPS = (1e-3, 5e-3, 2e-2)
"""Steps for the tipping block [s]."""

PULL = 0.75 * GRAVITY / (0.5 * math.hypot(WIDTH, HEIGHT))
"""p^2 = 3 g/(4 R) in th'' = -p^2 sin(al - th), for a solid rectangle about its corner [1/s2]."""


def time_to_turn(first: float, last: float) -> float:
    """Return the time [s] from rest at one angle from balance [rad] to another angle.

    This is the integral of dph/ph', with ph'^2 = 2 p^2 (cos ph0 - cos ph). The substitution ph =
    ph0 + s^2 removes the singularity.
    """

    def slowness(s: float) -> float:
        if s == 0.0:
            return 2.0 / math.sqrt(2.0 * PULL * math.sin(first))
        gained = 2.0 * math.sin(first + 0.5 * s * s) * math.sin(0.5 * s * s)
        return 2.0 * s / math.sqrt(2.0 * PULL * gained)

    return float(quad(slowness, 0.0, math.sqrt(last - first), epsabs=1e-12, epsrel=1e-12)[0])


def rate_at_impact(tilt: float) -> float:
    """Return the rate [rad/s] at zero tilt of a block whose greatest tilt is `tilt` [rad]."""
    return math.sqrt(2.0 * PULL * (math.cos(HALF - tilt) - math.cos(HALF)))


def time_to_zero(angle: float, rate: float, before: float, dt: float) -> float:
    """Return the time [s] until a tilt [rad] decreases to 0 at the acceleration of the last step.

    `rate` and `before` are the rates of decrease [rad/s] now and one step before.
    """
    gain = (rate - before) / dt
    return 2.0 * angle / (rate + math.sqrt(rate * rate + 2.0 * gain * angle))


def tilted(tilt: float) -> Scene:
    """Return the block standing on a corner."""
    corners = [(0.0, 0.0), (WIDTH, 0.0), (WIDTH, HEIGHT), (0.0, HEIGHT)]
    return Scene(Terrain(FLAT), (Block(polygon(corners, angle=tilt)),), rock(60.0))


def rock_over(lab: Lab, tilt: float) -> tuple[float, float]:
    """Release the block, and let it hit the ground and rock over to its next greatest tilt.

    Returns the time to the impact [s] and the ratio of the rates after and before it [-].
    """
    sim = lab.simulate(tilted(tilt))
    angle, rate = [tilt], [0.0]
    while len(rate) < 3 or rate[-1] > rate[-2]:  # the rate grows until the impact
        sim.step()
        angle.append(tilt + sim.poses[0, 2])
        rate.append(-sim.velocities[0, 2])
    time = sim.time - lab.dt + time_to_zero(angle[-2], rate[-2], rate[-3], lab.dt)
    while sim.velocities[0, 2] < 0.0:
        sim.step()
        angle.append(tilt + sim.poses[0, 2])
    return time, rate_at_impact(-min(angle)) / rate_at_impact(tilt)


def measure(lab: Lab) -> tuple[Measured, Measured]:
    """Compare times and rates for all initial tilts."""
    times, kept = zip(*(rock_over(lab, tilt) for tilt in TILTS), strict=True)
    exact = np.array([time_to_turn(HALF - tilt, HALF) for tilt in TILTS])
    return Measured(times, exact), Measured(kept, 1.0 - 1.5 * math.sin(HALF) ** 2)


def measure_tip(lab: Lab) -> tuple[Measured]:
    """Release a block slightly beyond its balance, with several steps."""
    times, exact = [], time_to_turn(BEYOND, FALLEN)
    for dt in STEPS:
        sim, angle, before = lab.simulate(tilted(HALF + BEYOND), dt), BEYOND, BEYOND
        while angle < FALLEN and sim.time < 2.0 * exact:
            sim.step()
            angle, before = BEYOND + float(sim.poses[0, 2]), angle
        left = (angle - FALLEN) / (angle - before) if angle > before else 0.0
        times.append(sim.time - dt * left)
    return (Measured(times, exact),)


CASES = (
    Case(
        "tipping",
        (Check("time to 0.5 rad", "integral of dph/ph' (Housner 1963)", "s", 1e-3, "relative"),),
        measure_tip,
    ),
    Case(
        "rocking",
        (
            Check("time to impact", "integral of dph/ph' (Housner 1963)", "s", 1e-3, "relative"),
            Check("rate kept", "1 - 3/2 sin^2 al (Housner 1963)", "-", 5e-3, "relative"),
        ),
        measure,
        smooth=True,
    ),
)
