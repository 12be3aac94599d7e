"""A box slides off the crest of a bench, tips over it and falls: rotation and landing point."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, box, rock

WIDTH, HEIGHT, DROP = 1.0, 0.6, 14.0
"""Sides of the box and height of the crest above the landing level [m]."""

NEAR = 0.2
"""Height of the lowest corner above that level at which the flight is evaluated [m]."""


class CrestSlide(NamedTuple):
    """Dip of a bench, its friction angle, and the speed of the box with its front at the crest."""

    bench_deg: float
    friction_deg: float
    speed: float


SLIDES = (
    CrestSlide(10.0, 5.0, 2.0),
    CrestSlide(10.0, 5.0, 4.0),
    CrestSlide(25.0, 20.0, 4.0),
    CrestSlide(0.0, 0.0, 3.0),
)


def over_the_crest(slide: CrestSlide) -> tuple[float, float]:
    """Return the rate of rotation in flight [rad/s] and the centroid's x at landing [m].

    The crest is at (0, 0). The box slides flat until the resultant of its base pressure, which
    friction shifts forward by h tan(phi)/2, reaches the crest. Then its base slides over the crest
    with Coulomb friction. With e and n along and normal to the base, s the position of the crest
    along the base from the centroid, and k the radius of gyration,

        N = (-g n + v_e w - w s') / (1 + s (s - mu h/2) / k^2),   F = -mu N,
        a = g + N n + F e,   w' = (s N + h F/2) / k^2,   s' = -v_e - w h/2,

    until the rear corner reaches the crest. From there the box flies until a corner reaches the
    level.
    """
    w, h, mu = WIDTH, HEIGHT, math.tan(math.radians(slide.friction_deg))
    bench, k2 = math.radians(slide.bench_deg), (WIDTH**2 + HEIGHT**2) / 12.0
    down = np.array([math.cos(bench), -math.sin(bench)])
    out = np.array([math.sin(bench), math.cos(bench)])
    gain = GRAVITY * (math.sin(bench) - mu * math.cos(bench))
    speed = math.sqrt(slide.speed**2 + 2.0 * gain * 0.5 * (w - mu * h))
    pull = np.array([0.0, -GRAVITY])

    def tip(_: float, state: np.ndarray) -> np.ndarray:
        position, velocity = state[:2], state[3:5]
        along = np.array([math.cos(state[2]), math.sin(state[2])])
        normal, rate = np.array([-along[1], along[0]]), state[5]
        s, slip = -position @ along, velocity @ along + 0.5 * h * rate
        push = -pull @ normal + velocity @ along * rate + rate * slip
        push /= 1.0 + s * (s - 0.5 * mu * h) / k2
        drag = -mu * push
        spin = (s * push + 0.5 * h * drag) / k2
        return np.array([*velocity, rate, *(pull + push * normal + drag * along), spin])

    def leaves(_: float, state: np.ndarray) -> float:
        along = np.array([math.cos(state[2]), math.sin(state[2])])
        return 0.5 * w - float(np.dot(state[:2], along))

    def lands(_: float, state: np.ndarray) -> float:
        return lowest(state[1], state[2]) + DROP

    leaves.terminal = lands.terminal = True  # type: ignore[attr-defined]
    start = (*(0.5 * h * out - 0.5 * mu * h * down), -bench, *(speed * down), 0.0)
    exact = {"rtol": 1e-10, "atol": 1e-12}
    off = solve_ivp(tip, (0.0, 10.0), start, events=leaves, **exact).y[:, -1]
    end = solve_ivp(lambda _, y: (*y[3:], *pull, 0.0), (0.0, 20.0), off, events=lands, **exact)
    return float(off[5]), float(end.y[0, -1])


def lowest(y: float, angle: float) -> float:
    """Return the elevation of the lowest corner of the box at a position and an angle [m, rad]."""
    reach = 0.5 * (WIDTH * abs(math.sin(angle)) + HEIGHT * abs(math.cos(angle)))
    return y - reach


def ground(bench_deg: float, pieces: int) -> tuple[Terrain, list[Block]]:
    """Return the bench above level ground, made of terrain or of `pieces` fixed blocks if not 0."""
    bench = math.radians(bench_deg)
    down = np.array([math.cos(bench), -math.sin(bench)])
    top = -12.0 * down
    if pieces == 0:
        chain = np.array([(top[0], top[1]), (0.0, 0.0), (1e-6, -DROP), (80.0, -DROP)])
        return Terrain(chain), []
    ends = [top + way * down for way in np.linspace(0.0, 12.0, pieces + 1)]
    blocks = [Block([a, (a[0], -40.0), (b[0], -40.0), b], fixed=True) for a, b in pairwise(ends)]
    return Terrain([(1e-3, -DROP), (80.0, -DROP)]), blocks


def fall(lab: Lab, slide: CrestSlide, pieces: int) -> tuple[float, float]:
    """Return the results of `over_the_crest` from a simulation with a bench of `pieces` blocks."""
    terrain, fixed = ground(slide.bench_deg, pieces)
    bench = math.radians(slide.bench_deg)
    down = np.array([math.cos(bench), -math.sin(bench)])
    centre = 0.5 * HEIGHT * np.array([math.sin(bench), math.cos(bench)]) - 0.5 * WIDTH * down
    velocity = (slide.speed * down[0], slide.speed * down[1], 0.0)
    rock_block = box(centre[0], centre[1], WIDTH, HEIGHT, -bench, velocity=velocity)
    sim = lab.simulate(Scene(terrain, (rock_block, *fixed), rock(slide.friction_deg)))
    while True:
        sim.step()
        (x, y, turned), (vx, vy, spin) = sim.poses[0], sim.velocities[0]
        height = lowest(y, turned - bench) + DROP
        if height < NEAR - vy * lab.dt:
            break
    time = (vy + math.sqrt(vy**2 + 2.0 * GRAVITY * height)) / GRAVITY
    return float(spin), float(x + vx * time)


def measure(lab: Lab, pieces: int) -> tuple[Measured, Measured]:
    """Simulate the slides over each crest."""
    computed = np.array([fall(lab, slide, pieces) for slide in SLIDES]).T
    exact = np.array([over_the_crest(slide) for slide in SLIDES]).T
    return Measured(computed[0], exact[0]), Measured(computed[1], exact[1])


def case(name: str, pieces: int, bar: float, dt: float | None = None) -> Case:
    """Return the case of a bench of `pieces` fixed blocks, or of terrain if 0, at a step [s]."""
    checks = (
        Check("rate of rotation", "a base that slides over a corner with friction", "rad/s", bar,
              "relative"),
        Check("landing", "the same, then free flight", "m", 5e-3, "relative"),
    )  # fmt: skip
    return Case(name, checks, lambda lab: measure(lab, pieces), dt=dt)


CASES = (
    case("crest", 0, 1.5e-2),
    case("crest-1ms", 0, 5e-3, 1e-3),
    case("crest-block", 1, 1.5e-2),
    case("crest-blocks", 5, 1.5e-2),
)
"""All cases with a crest."""
