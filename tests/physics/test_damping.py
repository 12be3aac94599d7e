"""Mass-proportional damping: in flight never with "contact", and alike at every step."""

import math

import pytest

from rigdda import Scene, Settings, Simulation, Terrain
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
    # the step of the impact and that in which the time ends are damped whole or not at all
    assert sim.velocities[0, 0] == pytest.approx(
        SPEED * math.exp(-ALPHA * 0.1), rel=ALPHA * 1.5 * dt
    )


@pytest.mark.parametrize("dt", [0.02, 0.005, 0.00125])
def test_a_slide_is_damped_all_along(dt):
    sim = launched(0.0, 0.0, dt)
    sim.run(2.0)
    assert sim.velocities[0, 0] == pytest.approx(
        SPEED * math.exp(-ALPHA * 2.0), rel=ALPHA * 1.5 * dt
    )
