"""Mass-proportional damping: in flight never with "contact", and alike at every step."""

import math

import numpy as np
import pytest

from rigdda import Block, Bolt, FixedPoint, Scene, Settings, Simulation, Surface, Terrain
from tests.physics.helpers import FLAT, GRAVITY, box, rock

ALPHA, SPEED = 0.5, 3.0


def launched(lift: float, restitution: float, dt: float) -> Simulation:
    """Return a block that is thrown along smooth level ground from a height [m]."""
    scene = Scene(
        Terrain(FLAT),
        (box(0.0, 0.5 + lift, velocity=(SPEED, 0.0, 0.0)),),
        rock(0.0, restitution),
        damping=ALPHA,
        damping_when="contact",
    )
    return Simulation(scene, Settings(dt=dt))


def test_flight_is_undamped():
    sim = launched(100.0, 0.0, 0.01)
    sim.run(1.0)
    assert sim.velocities[0] == pytest.approx((SPEED, -GRAVITY, 0.0), rel=1e-9)


@pytest.mark.parametrize("dt", [0.02, 0.01, 0.0025, 0.00125])
def test_a_bounce_is_damped_for_a_tenth_of_a_second(dt):
    """It falls 1 m, rebounds with 0.7 of its speed, and is looked at before it lands again."""
    sim = launched(1.0, 0.7, dt)
    landing = math.sqrt(2.0 / GRAVITY)
    sim.run(0.9)
    assert 0.9 < landing * (1.0 + 2.0 * 0.7)
    assert sim.velocities[0, 0] == pytest.approx(SPEED * math.exp(-ALPHA * 0.1), rel=1e-5)


def test_run_outs_of_damped_bounces_do_not_depend_on_the_step():
    """Octagons bounce down 32 degrees.

    With one step of damping less at each touch, they go 7 m too far at 20 ms.
    """
    drop = 60.0 * math.tan(math.radians(32.0))
    ground = Terrain([(-20.0, 0.0), (0.0, 0.0), (60.0, -drop), (200.0, -drop)])
    surfaces = {"rock": Surface(38.0, restitution=0.6, damping=1.7)}
    rng = np.random.default_rng(0)
    eighths = np.pi / 4.0 * (np.arange(8) + rng.uniform(-0.4, 0.4, (80, 8)))
    means = []
    for dt in (0.02, 0.0025):
        ends = []
        for angles in eighths:
            corners = 0.8 * np.column_stack([np.cos(angles), np.sin(angles)]) + (5.0, -1.0)
            block = Block(corners, velocity=(6.0, 0.0, 0.0))
            scene = Scene(ground, (block,), surfaces, damping_when="contact")
            sim = Simulation(scene, Settings(dt=dt))
            sim.step(round(30.0 / dt))
            ends.append(sim.poses[0, 0])
        means.append((np.mean(ends), np.var(ends, ddof=1) / len(ends)))
    (one, spread), (other, more) = means
    assert abs(one - other) < 1.96 * math.sqrt(spread + more)


@pytest.mark.parametrize("dt", [0.02, 0.005, 0.00125])
def test_a_slide_is_damped_all_along(dt):
    sim = launched(0.0, 0.0, dt)
    sim.run(2.0)
    # the step in which it first touches the ground is not damped
    assert sim.velocities[0, 0] == pytest.approx(SPEED * math.exp(-ALPHA * (2.0 - dt)), rel=1e-4)


def test_the_greatest_damping_of_what_is_touched_counts():
    """A block that slides from one ground onto another loses what each takes in its time."""
    surfaces = rock(0.0) | {"soft": Surface(0.0, damping=2.0), "hard": Surface(0.0, damping=0.2)}
    ground = Terrain([(-50.0, 0.0), (0.0, 0.0), (50.0, 0.0)], ["hard", "soft"])
    block = box(0.0, 0.5, velocity=(1e-3, 0.0, 0.0))  # over the seam: it touches both
    sim = Simulation(Scene(ground, (block,), surfaces, damping_when="contact"))
    sim.run(0.2)
    assert sim.velocities[0, 0] == pytest.approx(1e-3 * math.exp(-0.4), rel=0.03)


@pytest.mark.parametrize("names", [("soft", "rock"), ("rock", "soft")])
@pytest.mark.parametrize(
    "support", [FixedPoint(0, (0.5, 5.5)), Bolt(0, (0.0, 5.0), None, (0.0, 9.0), 1e5)]
)
def test_supports_damp_as_the_scene_does_whatever_the_order_of_surfaces(names, support):
    every = {"soft": Surface(damping=5.0), "rock": Surface()}
    block = box(0.0, 5.0, velocity=(0.0, 0.0, 1.0))
    surfaces = {name: every[name] for name in names}
    sim = Simulation(Scene(None, (block,), surfaces, supports=(support,), damping=0.0))
    sim.run(0.3)
    free = Simulation(Scene(None, (block,), rock(), supports=(support,), damping=0.0))
    free.run(0.3)
    assert sim.velocities == pytest.approx(free.velocities, rel=1e-9)
