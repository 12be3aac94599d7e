"""A lone block bounces in long steps as it does in short ones."""

from __future__ import annotations

import math

import numpy as np

from physics.helpers import FLAT, polygon, rock, rough
from rigdda import Block, Scene, Settings, Simulation
from rigdda.geometry import polygon_properties
from rigdda.model.scene import Terrain
from rigdda.validation.case import Lab
from rigdda.validation.impacts import rebound

AREA, RESTITUTION, TIME = 0.1, 0.4, 0.2
"""Area [m2] and restitution of the blocks, time in which they bounce once or twice [s]."""


def thrown(seed: int) -> Scene:
    """Return a small block that comes down obliquely and rolling, as on a slope."""
    rng = np.random.default_rng(seed)
    corners = rough(rng, int(rng.integers(5, 9)))
    corners *= math.sqrt(AREA / polygon_properties(corners)[0])
    corners = polygon(corners, angle=rng.uniform(0.0, 2.0 * math.pi))
    speed = rng.uniform(2.0, 12.0)
    turning = -speed / math.sqrt(AREA / math.pi) * rng.uniform(0.6, 1.05)
    corners += (0.0, rng.uniform(0.05, 0.2) - corners[:, 1].min())
    block = Block(corners, velocity=(speed, rng.uniform(-5.0, -0.3), turning))
    return Scene(Terrain(FLAT), (block,), rock(35.0, RESTITUTION))


def energy_kept(dt: float, blocks: int = 300) -> tuple[float, float]:
    """Return the mean energy of the blocks per mass in the end, and what they lost [m2/s2]."""
    first, last = np.empty(blocks), np.empty(blocks)
    for seed in range(blocks):
        sim = Simulation(thrown(seed), Settings(dt=dt, sleeping=False))
        mass = AREA * sim.scene.blocks[0].density
        start = sim.energy()
        sim.step(round(TIME / dt))
        end = sim.energy()
        first[seed] = (start.kinetic + start.potential) / mass
        last[seed] = (end.kinetic + end.potential) / mass
    return float(last.mean()), float((first - last).mean())


def test_a_flat_landing_rebounds_wherever_in_the_step_it_falls():
    """Both corners rebound at once; one did alone where a part of the step ended at the blow."""
    lab = Lab(5e-3)
    for dt in (3e-4, 3e-3, 5e-3):
        for phase in np.linspace(0.0, 1.0, 41):
            assert abs(rebound(lab, 0.7, dt, float(phase), 1e4) - 0.7) < 1e-3


def test_a_bounce_takes_the_same_energy_at_every_step():
    """Within 2 %; when impacts of one step acted at once it took 4.5 % more in steps of 10 ms."""
    kept, lost = energy_kept(0.5e-3)
    for dt in (1e-2, 5e-3, 2.5e-3):
        assert abs(energy_kept(dt)[0] - kept) < 0.02 * lost


def test_a_flight_without_detection_ends_before_the_block_can_touch_anything():
    """A second block that falls far away prevents flights, but does not change the motion."""
    ground = Terrain([(-10.0, 12.0), (-4.0, 5.0), (3.0, 4.0), (9.0, -3.0), (900.0, -3.0)])
    for seed in range(12):
        (block,) = thrown(seed).blocks
        block = Block(block.vertices + np.array([-6.0, 14.0]), velocity=block.velocity)
        far = Block(block.vertices + np.array([800.0, 900.0]))
        alone, both = (
            Simulation(Scene(ground, blocks, rock(35.0, RESTITUTION)), Settings(dt=0.005))
            for blocks in ((block,), (block, far))
        )
        for _ in range(6):
            alone.step(100)
            both.step(100)
            np.testing.assert_array_equal(alone.poses[0], both.poses[0])
        assert both.poses[1, 1] > 100.0  # it is still falling
