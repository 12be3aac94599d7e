"""Mass-proportional damping of a scene: it acts always, alike at every step, on all blocks."""

import math

import pytest

from rigdda import Block, Bolt, FixedPoint, Scene, Settings, Simulation, Surface, Terrain
from rigdda.errors import BadInput
from tests.physics.helpers import FLAT, GRAVITY, box, rock

ALPHA, SPEED = 0.5, 3.0

every_step = pytest.mark.parametrize("dt", [0.02, 0.005, 0.00125])


def launched(lift: float, dt: float) -> Simulation:
    """Return a block that is thrown along smooth level ground from a height [m]."""
    block = box(0.0, 0.5 + lift, velocity=(SPEED, 0.0, 0.0))
    scene = Scene(Terrain(FLAT), (block,), rock(0.0), damping=ALPHA)
    return Simulation(scene, Settings(dt=dt))


@every_step
def test_a_flight_is_damped(dt):
    """With v' = -g - c v: v = -g/c (1 - exp(-c t))."""
    sim = launched(100.0, dt)
    sim.run(1.0)
    kept = math.exp(-ALPHA)
    fall = -GRAVITY / ALPHA * (1.0 - kept)
    assert sim.velocities[0] == pytest.approx((SPEED * kept, fall, 0.0), rel=1e-3)


@every_step
def test_a_slide_is_damped_all_along(dt):
    sim = launched(0.0, dt)
    sim.run(2.0)
    assert sim.velocities[0, 0] == pytest.approx(SPEED * math.exp(-ALPHA * 2.0), rel=1e-3)


@every_step
@pytest.mark.parametrize("damping", [0.5, 5.0])
def test_forces_at_rest_are_not_changed(damping, dt):
    """A block on a slope is held by its weight's components."""
    slope = math.radians(20.0)
    down = (math.cos(slope), -math.sin(slope))
    block = box(0.5 * math.sin(slope), 0.5 * math.cos(slope), angle=-slope)
    terrain = Terrain([(-5.0 * down[0], -5.0 * down[1]), (5.0 * down[0], 5.0 * down[1])])
    scene = Scene(terrain, (block,), rock(35.0), damping=damping)
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    sim.run(2.0)
    found, weight = sim.contacts(), 2600.0 * GRAVITY
    normal, shear = (abs(found[f"{name}_force"].sum()) for name in ("normal", "shear"))
    assert normal == pytest.approx(weight * math.cos(slope), rel=1e-6)
    assert shear == pytest.approx(weight * math.sin(slope), rel=1e-6)


def test_damping_in_contact_is_refused():
    with pytest.raises(BadInput, match="rolling resistance"):
        Scene(Terrain(FLAT), (box(0.0, 0.5),), rock(), damping=ALPHA, damping_when="contact")


@pytest.mark.parametrize("names", [("soft", "rock"), ("rock", "soft")])
@pytest.mark.parametrize(
    "support", [FixedPoint(0, (0.5, 5.5)), Bolt(0, (0.0, 5.0), None, (0.0, 9.0), 1e5)]
)
def test_surfaces_do_not_resist_the_rotation_of_what_only_supports_hold(names, support):
    """Whatever their order."""
    every = {"soft": Surface(rolling=0.5), "rock": Surface()}
    block: Block = box(0.0, 5.0, velocity=(0.0, 0.0, 1.0))
    found = []
    for surfaces in ({name: every[name] for name in names}, rock()):
        sim = Simulation(Scene(None, (block,), surfaces, supports=(support,)))
        sim.run(0.3)
        found.append(sim.velocities)
    assert found[0] == pytest.approx(found[1], rel=1e-9)
