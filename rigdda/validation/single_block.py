"""One block on the ground: sliding, rolling and rocking.

- A block on a plane with Coulomb friction slides or stays at rest.
- A regular polygon rolls down a slope with plastic impacts: the rimless wheel.
- A tall block rocks on its base after release from a tilt, or tips over (Housner 1963).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.integrate import quad, solve_ivp

from rigdda.model.loads import PointLoad
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import (
    FLAT,
    GRAVITY,
    Floats,
    box,
    incline,
    masses,
    ngon,
    polygon,
    rock,
    shifts,
)

LOW_HEIGHT = 0.4
"""Height of a block 1 m wide that slides at 45 degrees without toppling [m]."""

SLIDE_DAMPING = 1.0
"""Mass-proportional damping [1/s]."""

SLIDE_STEPS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
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
    lab: Lab, kink_deg: float = 0.0, rolling: float = 0.3, steps: Sequence[float] = SLIDE_STEPS
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
    sim = lab.simulate(Scene(plain.terrain, plain.blocks, plain.surfaces, damping=SLIDE_DAMPING))
    start = sim.poses
    sim.step(lab.steps(2.0))
    way = shifts(start, sim.poses, down)
    return (Measured(way, damped_slide(30.0, 20.0, SLIDE_DAMPING, 2.0)),)


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

SLIDING = (
    Case("slab", SLABS, measure_slab),
    Case("slab-kinks", SLABS, lambda lab: measure_slab(lab, 1.0)),
    slide_case("slide-30-20", 30.0, 20.0, 1.0, 2.0, 1e-4),
    slide_case("slide-45-30", 45.0, 30.0, LOW_HEIGHT, 2.0, 1e-4),
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


WHEEL_SIDES, WHEEL_RADIUS = 16, 1.0
"""Number of corners and circumradius [m] of the polygon."""

ROLLING_SLOPE, ROLLING_RATE, ROLLING_DURATION = math.radians(8.0), 2.2, 3.0
"""Slope [rad], initial rate of rotation [rad/s] and time [s]."""


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


def start_rolling(
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
    sim, down = start_rolling(lab, sides, radius, slope, rate, resistance)
    first = sim.poses
    sim.step(lab.steps(time))
    return shifts(first, sim.poses, down)


def measure_rolling(lab: Lab) -> tuple[Measured]:
    """Simulate the rolling polygon."""
    wanted = (WHEEL_SIDES, WHEEL_RADIUS, ROLLING_SLOPE, ROLLING_RATE, ROLLING_DURATION)
    return (Measured(roll(lab, *wanted), wheel(*wanted)),)


def measure_resisted(
    lab: Lab, sides: int, slope_deg: float, rate: float, resistance: float
) -> tuple[Measured]:
    """Simulate a polygon that rolls against a moment."""
    wanted = (sides, WHEEL_RADIUS, math.radians(slope_deg), rate, ROLLING_DURATION, resistance)
    return (Measured(roll(lab, *wanted), wheel(*wanted)),)


def measure_roll_out(lab: Lab) -> tuple[Measured, Measured]:
    """Simulate a polygon of 60 sides that rolls out on level ground, and what it moves then."""
    sim, down = start_rolling(lab, 60, WHEEL_RADIUS, 0.0, 2.0, 0.1)
    first = sim.poses
    sim.step(lab.steps(10.0))
    out = sim.poses
    sim.step(lab.steps(20.0))
    exact = wheel(60, WHEEL_RADIUS, 0.0, 2.0, 10.0, 0.1)
    return Measured(shifts(first, out, down), exact), Measured(abs(shifts(out, sim.poses, down)))


def measure_wheel_at_rest(lab: Lab) -> tuple[Measured]:
    """Leave a polygon of 60 sides on a slope of half the limit tan(th) = c R/r.

    Without the moment it would roll: the slope is steeper than pi/60.
    """
    resistance = 0.2
    sim, down = start_rolling(lab, 60, WHEEL_RADIUS, math.atan(0.5 * resistance), 0.0, resistance)
    first = sim.poses
    sim.step(lab.steps(20.0))
    return (Measured(abs(shifts(first, sim.poses, down))),)


def rolling_case(name: str, bar: float, dt: float | None = None) -> Case:
    """Return the case with the default step or with `dt` [s]."""
    check = Check("way in 3 s", "rimless wheel (McGeer 1990)", "m", bar, "relative")
    return Case(name, (check,), measure_rolling, dt=dt)


def resisted_case(sides: int, slope_deg: float, rate: float, resistance: float) -> Case:
    """Return the case of a polygon that rolls against a moment of at most c N R."""
    check = Check("way in 3 s", "rimless wheel with the moment c N R", "m", 2e-3, "relative")
    return Case(
        f"{sides}-gon-c{resistance:g}",
        (check,),
        lambda lab: measure_resisted(lab, sides, slope_deg, rate, resistance),
    )


ROLLING = (
    rolling_case("16-gon", 1e-3),
    rolling_case("16-gon-1ms", 1e-3, 1e-3),
    resisted_case(8, 12.0, 2.2, 0.05),
    resisted_case(8, 16.0, 2.2, 0.1),
    resisted_case(16, 8.0, 2.2, 0.05),
    resisted_case(16, 12.0, 2.2, 0.1),
    Case(
        "60-gon-stops",
        (
            Check("way", "rimless wheel with the moment c N R, to its stop", "m", 0.01, "relative"),
            Check("creep, 10-30 s", "none", "m", 1e-8, "bound"),
        ),
        measure_roll_out,
    ),
    Case(
        "60-gon-stays",
        (Check("creep, 20 s", "none: tan th < c R/r", "m", 1e-4, "bound"),),
        measure_wheel_at_rest,
    ),
)


ROCKING_WIDTH, ROCKING_HEIGHT = 1.0, 4.0
"""Sides of the block [m]."""

DIAGONAL_ANGLE = math.atan2(ROCKING_WIDTH, ROCKING_HEIGHT)
"""Angle between diagonal and side [rad], the tilt beyond which the block topples."""

INITIAL_TILTS = tuple(0.5 * DIAGONAL_ANGLE * (1.0 + 1.6e-3 * k) for k in range(5))
"""Initial tilts [rad]; each delays the impact by 1 ms, which shifts it within a step."""

BEYOND, FALLEN = 1e-3, 0.5
"""Initial and final angle beyond balance of the tipping block [rad]."""

ROCKING_STEPS = (1e-3, 5e-3, 2e-2)
"""Steps for the tipping block [s]."""

PULL = 0.75 * GRAVITY / (0.5 * math.hypot(ROCKING_WIDTH, ROCKING_HEIGHT))
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
    return math.sqrt(2.0 * PULL * (math.cos(DIAGONAL_ANGLE - tilt) - math.cos(DIAGONAL_ANGLE)))


def time_to_zero(angle: float, rate: float, before: float, dt: float) -> float:
    """Return the time [s] until a tilt [rad] decreases to 0 at the acceleration of the last step.

    `rate` and `before` are the rates of decrease [rad/s] now and one step before.
    """
    gain = (rate - before) / dt
    return 2.0 * angle / (rate + math.sqrt(rate * rate + 2.0 * gain * angle))


def tilted(tilt: float) -> Scene:
    """Return the block standing on a corner."""
    corners = [
        (0.0, 0.0),
        (ROCKING_WIDTH, 0.0),
        (ROCKING_WIDTH, ROCKING_HEIGHT),
        (0.0, ROCKING_HEIGHT),
    ]
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


def measure_rocking(lab: Lab) -> tuple[Measured, Measured]:
    """Compare times and rates for all initial tilts."""
    times, kept = zip(*(rock_over(lab, tilt) for tilt in INITIAL_TILTS), strict=True)
    exact = np.array(
        [time_to_turn(DIAGONAL_ANGLE - tilt, DIAGONAL_ANGLE) for tilt in INITIAL_TILTS]
    )
    return Measured(times, exact), Measured(kept, 1.0 - 1.5 * math.sin(DIAGONAL_ANGLE) ** 2)


def measure_tip(lab: Lab) -> tuple[Measured]:
    """Release a block slightly beyond its balance, with several steps."""
    times, exact = [], time_to_turn(BEYOND, FALLEN)
    for dt in ROCKING_STEPS:
        sim, angle, before = lab.simulate(tilted(DIAGONAL_ANGLE + BEYOND), dt), BEYOND, BEYOND
        while angle < FALLEN and sim.time < 2.0 * exact:
            sim.step()
            angle, before = BEYOND + float(sim.poses[0, 2]), angle
        left = (angle - FALLEN) / (angle - before) if angle > before else 0.0
        times.append(sim.time - dt * left)
    return (Measured(times, exact),)


ROCKING = (
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
        measure_rocking,
        smooth=True,
    ),
)
