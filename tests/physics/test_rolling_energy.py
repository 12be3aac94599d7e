"""Rolling resistance and restitution of any size never add energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import rough
from rigdda import Block, Scene, Settings, Simulation, Surface, Terrain


def ground(rng):
    """Return rough ground that falls by 20 degrees for 40 m and then is level."""
    x = np.arange(-10.0, 120.0, 1.5)
    fall = math.tan(math.radians(20.0)) * np.minimum(x, 40.0)
    return Terrain(np.stack([x, -fall + rng.uniform(-0.2, 0.2, len(x))], axis=1))


@pytest.mark.parametrize("dt", [2e-3, 5e-3, 1e-2, 2e-2])
def test_energy_of_polygons_on_rough_ground_never_grows(dt):
    """Thirty polygons are thrown; the scale is the kinetic energy at the start and 2 m of fall."""
    gains = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        velocity = (rng.uniform(2.0, 10.0), rng.uniform(-8.0, 2.0), rng.uniform(-6.0, 6.0))
        corners = rough(rng, int(rng.integers(3, 10)), 0.8) + np.array([0.0, 2.0])
        block = Block(corners, velocity=velocity)
        surface = Surface(
            friction_deg=rng.uniform(10.0, 50.0),
            restitution=rng.uniform(0.0, 1.0),
            rolling=rng.uniform(0.0, 1.0),
        )
        sim = Simulation(Scene(ground(rng), (block,), {"rock": surface}), Settings(dt=dt))
        energy = sim.energy()
        least, scale = sum(energy[:3]), energy.kinetic
        scale += 2.0 * 9.81 * sim.loop.arrays.bodies["mass"][0]
        worst = 0.0
        for _ in range(round(4.0 / dt)):
            sim.step()
            now = sum(sim.energy()[:3])
            worst, least = max(worst, (now - least) / scale), min(least, now)
        gains.append(worst)
    assert max(gains) < 1e-4, (int(np.argmax(gains)), max(gains))
