"""Rolling resistance: sliding keeps to Coulomb, rolling is slowed by at most c N R in each contact.

R = sqrt(2 I/m). The reference solutions are solved for accelerations and forces as they stand, not
in closed form, so that they do not share an algebra with `rigdda.validation.single_block`.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from physics.helpers import GRAVITY, box, ngon, polygon, rough
from physics.steps import STEPS, accepted, each, mechanical
from rigdda import Block, Scene, Settings, Simulation, Surface, Terrain
from rigdda.validation.single_block import wheel


def simulate(
    ground: np.ndarray, block: Block, dt: float, friction_deg: float, rolling: float, e: float = 0.0
) -> Simulation:
    """Return the simulation of a block on a ground, which does not sleep."""
    surfaces = {"rock": Surface(friction_deg=friction_deg, restitution=e, rolling=rolling)}
    scene = Scene(Terrain(ground), (block,), surfaces)
    return Simulation(scene, Settings(dt=dt, sleeping=False))


# --- slabs that slide


def slab(slope_deg: float, speed: float, kink_deg: float) -> tuple[np.ndarray, Block]:
    """Return a ground, of which every second metre is steeper by `kink_deg`, and a slab on it.

    The slab is 3.5 m long and 1 m thick. It lies on three crests, that is on the mean slope.
    """
    slope = math.radians(slope_deg)
    x = np.arange(-6.0, 120.0)
    y = -0.5 * math.tan(math.radians(kink_deg) / 2.0) * (np.arange(len(x)) % 2)
    ground = polygon(np.column_stack([x, y]), angle=-slope)
    (centre,) = polygon([(0.0, 0.5)], angle=-slope)
    velocity = (speed * math.cos(slope), -speed * math.sin(slope), 0.0)
    return ground, box(*centre, 3.5, 1.0, -slope, velocity=velocity)


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("kink_deg", [0.0, 1.0])
@pytest.mark.parametrize("rolling", [0.0, 0.3])
def test_a_slab_that_slides_keeps_to_coulomb(rolling, kink_deg, dt):
    """On planes and kinked lines of 35 and 60 degrees, from rest and with 5 m/s, within .5 %.

    The slab is longer than three metres, so that it slides from crest to crest, without a fall.
    """
    for slope_deg in (35.0, 60.0):
        for friction_deg in (20.0, 32.0):
            for speed in (0.0, 5.0):
                ground, block = slab(slope_deg, speed, kink_deg)
                sim = simulate(ground, block, dt, friction_deg, rolling)
                sim.step(round(2.0 / dt))
                slope = math.radians(slope_deg)
                friction = math.tan(math.radians(friction_deg))
                pull = GRAVITY * (math.sin(slope) - math.cos(slope) * friction)
                along = sim.velocities[0, :2] @ (math.cos(slope), -math.sin(slope))
                case = (slope_deg, friction_deg, speed)
                assert along == pytest.approx(speed + 2.0 * pull, rel=5e-3), case


# --- the rimless wheel


def forces(angle: float, rate: float, slope: float, k2: float, lever: float) -> tuple[float, float]:
    """Return the angular acceleration and the normal force over the mass of a wheel on a corner.

    The wheel of radius 1 m rotates clockwise about a corner at rest, `angle` after it is above it.
    Unknown are the acceleration of its centre along and normal to the slope, that of its rotation,
    and shear and normal force at the corner; the moment is `lever` N.
    """
    x, y = math.sin(angle), math.cos(angle)  # from the corner to the centre, along and normal
    system = np.array(
        [
            [1.0, 0.0, 0.0, -1.0, 0.0],  # a_x = g sin th + S
            [0.0, 1.0, 0.0, 0.0, -1.0],  # a_y = -g cos th + N
            [0.0, 0.0, k2, y, lever - x],  # k2 w' = x N - y S - lever N
            [1.0, 0.0, -y, 0.0, 0.0],  # a_x = w' y - w^2 x
            [0.0, 1.0, x, 0.0, 0.0],  # a_y = -w' x - w^2 y
        ]
    )
    fall = GRAVITY * math.sin(slope), -GRAVITY * math.cos(slope)
    found = np.linalg.solve(system, [*fall, 0.0, -(rate**2) * x, -(rate**2) * y])
    return float(found[2]), float(found[4])


def after_impact(half: float, rate: float, k2: float, lever: float) -> float:
    """Return the rate of a wheel after its next corner has struck, with a moment impulse lever P.

    Unknown are the velocity of the centre, the rate, and the shear and normal impulse at the new
    corner, which then is at rest; the old one lifts off.
    """
    sin, cos = math.sin(half), math.cos(half)
    before = rate * cos, -rate * sin, k2 * rate
    x, y = -sin, cos  # from the new corner to the centre
    system = np.array(
        [
            [1.0, 0.0, 0.0, -1.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, -1.0],
            [0.0, 0.0, k2, y, lever - x],
            [1.0, 0.0, -y, 0.0, 0.0],
            [0.0, 1.0, x, 0.0, 0.0],
        ]
    )
    return float(np.linalg.solve(system, [*before, 0.0, 0.0])[2])


def resisted_wheel(
    sides: int, slope: float, rate: float, time: float, rolling: float
) -> tuple[float, float]:
    """Return the way [m] of the centre of a wheel of radius 1 m, and the time [s] that it takes.

    It starts flat and rotates about its lower corner, until it stops or for `time`.
    """
    half = math.pi / sides
    k2 = (1.0 + 2.0 * math.cos(half) ** 2) / 6.0
    lever = rolling * math.sqrt(2.0 * k2)

    def turn(_: float, state: np.ndarray) -> tuple[float, float]:
        return state[1], forces(state[0], state[1], slope, k2, lever)[0]

    def strike(_: float, state: np.ndarray) -> float:
        return state[0] - half

    def stop(_: float, state: np.ndarray) -> float:
        return state[1]

    strike.terminal = stop.terminal = True
    angle, now, way = -half, 0.0, 0.0
    while True:
        part = solve_ivp(
            turn, (now, time), (angle, rate), events=(strike, stop), rtol=1e-10, atol=1e-10
        )
        angle, rate = part.y[:, -1]
        pressed = [forces(*state, slope, k2, lever)[1] for state in part.y.T]
        assert min(pressed) > 0.0, "the wheel lifts off: choose a smaller rate or slope"
        if part.status == 0 or len(part.t_events[1]):
            return float(way + math.sin(angle) + math.sin(half)), part.t[-1]
        way += 2.0 * math.sin(half)
        now, angle, rate = part.t[-1], -half, after_impact(half, rate, k2, lever)
        if rate <= 0.0:
            return way, now


def on_a_face(sides: int, slope: float, rate: float) -> Block:
    """Return a polygon of radius 1 m on a face that starts to rotate about its lower corner."""
    half = math.pi / sides
    centre = np.array([0.0, math.cos(half)])
    corners = polygon(ngon(sides, 1.0, centre, half - math.pi / 2.0), angle=-slope)
    speed = rate * math.cos(half), rate * math.sin(half)
    (velocity,) = polygon([speed], angle=-slope)
    return Block(corners, velocity=(*velocity, -rate))


def rolled(
    sides: int, slope: float, rate: float, time: float, rolling: float, dt: float
) -> tuple[float, Simulation]:
    """Return the simulated way [m] along the slope, and the simulation at its end."""
    ground = polygon([(-20.0, 0.0), (100.0, 0.0)], angle=-slope)
    sim = simulate(ground, on_a_face(sides, slope, rate), dt, 60.0, rolling)
    start = sim.poses[0, :2]
    sim.step(round(time / dt))
    return float((sim.poses[0, :2] - start) @ (math.cos(slope), -math.sin(slope))), sim


WHEELS = [(6, 15.0, 2.0), (8, 15.0, 2.0), (16, 8.0, 2.2), (30, 5.0, 2.0)]
"""Numbers of sides, slopes [deg] and first rates [rad/s] of wheels that do not lift off in 3 s.

None of them stops close to where it would stand on a corner: there a way says nothing.
"""


@pytest.mark.parametrize(("sides", "slope_deg", "rate"), WHEELS)
def test_the_reference_without_resistance_is_that_of_mcgeer(sides, slope_deg, rate):
    slope = math.radians(slope_deg)
    mcgeer = wheel(sides, 1.0, slope, rate, 3.0)
    assert resisted_wheel(sides, slope, rate, 3.0, 0.0)[0] == pytest.approx(mcgeer, rel=1e-6)


@pytest.mark.parametrize("rolling", [0.03, 0.1, 0.3])
def test_the_reference_with_many_sides_is_a_disc(rolling):
    """Its way to a stop on level ground is w^2 (r^2 + k^2)/(2 c g R), with k^2 = r^2/2 and R = r.

    What impacts take falls with the number of sides: ways of two numbers are extrapolated.
    """
    ways = [resisted_wheel(n, 0.0, 1.0, 60.0, rolling)[0] for n in (100, 200)]
    disc = 1.5 / (2.0 * rolling * GRAVITY)
    assert 2.0 * ways[1] - ways[0] == pytest.approx(disc, rel=0.05)


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("rolling", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize(("sides", "slope_deg", "rate"), WHEELS)
def test_a_wheel_is_resisted_by_a_moment(sides, slope_deg, rate, rolling, dt):
    """In 3 s, or up to where it stops before it falls back on its face, within 1 % or 2 cm."""
    slope = math.radians(slope_deg)
    exact, time = resisted_wheel(sides, slope, rate, 3.0, rolling)
    way, _ = rolled(sides, slope, rate, time, rolling, dt)
    assert way == pytest.approx(exact, rel=1e-2, abs=0.02)


# --- the disc


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("rolling", [0.1, 0.3])
def test_a_disc_rolls_to_a_stop(rolling, dt):
    """A polygon of 60 sides on level ground; it then stays.

    A disc slows by c g R r/(r^2 + k^2). The impacts of n sides take 1 - w+/w- = 2 sin^2(pi/n)
    r^2/(r^2 + k^2) of its rate each 2 pi/n, so that w' = -(a + b w^2), b = pi/n r^2/(r^2 + k^2).
    """
    rate, sides = 2.0, 60
    k2 = (1.0 + 2.0 * math.cos(math.pi / sides) ** 2) / 6.0
    slowed = rolling * GRAVITY * math.sqrt(2.0 * k2) / (1.0 + k2)
    lost = math.pi / sides / (1.0 + k2)
    disc = math.log1p(lost * rate**2 / slowed) / (2.0 * lost)
    way, sim = rolled(sides, 0.0, rate, 3.0, rolling, dt)
    assert way == pytest.approx(disc, abs=2.0 * math.sin(math.pi / sides))
    before = sim.poses
    sim.step(round(10.0 / dt))
    assert np.abs(sim.poses - before).max() < 1e-6


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("rolling", [0.2, 0.5])
def test_a_disc_stays_on_a_slope_below_the_limit_of_rolling(rolling, dt):
    """The force on its face may be c R and half a face beside its centre: else it rolls.

    In the first step it may fall, before contacts are known to rest; it does not creep.
    """
    sides, face = 60, math.sin(math.pi / 60.0)
    k2 = (1.0 + 2.0 * math.cos(math.pi / sides) ** 2) / 6.0
    limit = math.atan((rolling * math.sqrt(2.0 * k2) + face) / math.cos(math.pi / sides))
    first, sim = rolled(sides, 0.9 * limit, 0.0, 0.5, rolling, dt)
    assert abs(first) < GRAVITY * dt**2
    before = sim.poses
    sim.step(round(10.0 / dt))
    assert np.abs(sim.poses - before).max() < 1e-9
    assert rolled(sides, 1.1 * limit, 0.0, 5.0, rolling, dt)[0] > 0.5


# --- grounds with and without resistance


@pytest.mark.parametrize("before, after", [(0.3, 0.0), (0.0, 0.3), (0.3, 0.1)])
@pytest.mark.parametrize("pair", [False, True], ids=["one block", "two blocks"])
@pytest.mark.parametrize("dt", each(accepted(1.0)))
def test_a_block_that_changes_the_ground_comes_to_rest(before, after, pair, dt):
    """A block slides v^2 / (2 g tan phi) from one ground to another, and then rests.

    The contacts take over the impulses of the first ground. A rolling impulse that the second one
    does not limit would grow without bound. Two blocks are an island of several substeps.
    """
    friction, speed, rest = 20.0, 3.0, 5.0
    surfaces = {
        "soil": Surface(friction_deg=friction, restitution=0.0, rolling=before),
        "rock": Surface(friction_deg=friction, restitution=0.0, rolling=after),
    }
    ground = Terrain([(-20.0, 0.0), (0.0, 0.0), (20.0, 0.0)], ["soil", "rock"])
    blocks = [box(-0.6, 0.5, surface="soil", velocity=(speed, 0.0, 0.0))]
    if pair:
        blocks.append(box(-1.6, 0.5, surface="soil", velocity=(speed, 0.0, 0.0)))
    scene = Scene(ground, blocks, surfaces)
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    sim.step(round(rest / dt))
    way = speed**2 / (2.0 * GRAVITY * math.tan(math.radians(friction)))
    assert sim.poses[0, 0] == pytest.approx(-0.6 + way, abs=speed * dt + 0.005)
    assert np.abs(sim.velocities).max() < 1e-6
    ends = sim.loop.contacts
    most = ends["rolling"] * ends["accumulated_normal"]
    assert (np.abs(ends["accumulated_roll"]) <= most + 1e-6).all()


# --- energy


@pytest.mark.parametrize("dt", each(accepted(0.5)))
def test_rolling_resistance_gives_no_energy(dt):
    """Thirty random polygons (fewer in short steps), thrown onto random ground; e and c in 0..1.

    Position correction may lift a block by some millimetres: 1e-3 of the energy at the start.
    """
    for seed in range(30 if dt >= 0.005 else 12):
        rng = np.random.default_rng(seed)
        corners = polygon(rough(rng, int(rng.integers(3, 9))), (0.0, 3.0), rng.uniform(0.0, 6.0))
        velocity = (*rng.uniform(-8.0, 8.0, 2), rng.uniform(-6.0, 6.0))
        x = np.linspace(-60.0, 60.0, 81)
        ground = np.column_stack([x, -0.3 * x + rng.uniform(-0.4, 0.4, len(x)) - 0.5])
        e, rolling = rng.uniform(0.0, 1.0, 2)
        block = Block(corners, velocity=velocity)
        sim = simulate(ground, block, dt, rng.uniform(10.0, 50.0), rolling, e)
        least = start = mechanical(sim)
        scale = sim.energy().kinetic + 2600.0 * GRAVITY
        for _ in range(round(3.0 / dt)):
            sim.step()
            now = mechanical(sim)
            assert now < least + 1e-3 * scale and now < start + 1e-4 * scale, (seed, e, rolling)
            least = min(least, now)
