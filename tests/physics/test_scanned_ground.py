"""Ground that was surveyed in segments far shorter than a block."""

import numpy as np
import pytest

from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import polygon_properties
from rigdda.model.settings import longest_step
from rigdda.validation.scenes import rough
from tests.physics.helpers import GRAVITY, rock


def test_a_slab_does_not_jump_at_a_ledge_of_centimetres():
    points = [(-9, -0.07), (-0.1, -0.07), (-0.05, -0.04), (0, 0), (0.02, -2), (9, -2)]
    slab = Block([(-0.3, 0.01), (0.7, 0.01), (0.7, 0.41), (-0.3, 0.41)], velocity=(0, -1, 0))
    for dt in (1e-3, 5e-3, 1e-2):
        scene = Scene(Terrain(points), [slab], rock(30.0))
        run = Simulation(scene, Settings(dt=dt)).run(0.3, every=dt)
        excess, _ = beyond(run, dt)
        assert excess < 1e-3


def beyond(run, dt: float) -> tuple[float, float]:
    """Return the greatest displacement in a step beyond what velocity gives, and energies.

    The former in m; the latter as the greatest rise over all that the block lost and had [-].
    """
    pose, velocity = run.poses[:, 0], run.velocities[:, 0]
    speed = np.hypot(*velocity[:, :2].T)
    way = np.hypot(*np.diff(pose[:, :2], axis=0).T)
    excess = way - np.maximum(speed[1:], speed[:-1]) * dt - 0.5 * GRAVITY * dt**2
    area, _, second = polygon_properties(run.scene.blocks[0].vertices)
    energy = 0.5 * speed**2 + 0.5 * second / area * velocity[:, 2] ** 2 + GRAVITY * pose[:, 1]
    rise = (energy - np.minimum.accumulate(energy)).max()
    return float(excess.max()), float(rise / (energy[0] - energy.min()))


def scanned(seed: int) -> tuple[Scene, float]:
    """Return a block that is thrown onto a scanned profile, and a step [s]."""
    rng = np.random.default_rng(seed)
    length, noise = rng.choice([0.05, 0.1, 0.2, 0.5]), rng.uniform(0.01, 0.05)
    x = np.arange(0.0, 250.0, length)
    y = -np.tan(np.radians(35.0)) * np.minimum(x, 36.0) + rng.normal(0.0, noise, len(x))
    ground = Terrain(np.column_stack([x, y]))
    corners = rough(rng, int(rng.integers(4, 9)), 0.5 * rng.uniform(0.2, 2.0))
    place, speed, down = rng.uniform(3.0, 10.0), rng.uniform(5.0, 40.0), rng.uniform(-1.0, 0.2)
    reach = np.abs(corners).max()
    top = max(ground.height(at) for at in np.linspace(place - reach, place + reach, 200))
    velocity = (speed * np.cos(down), speed * np.sin(down), rng.uniform(-5.0, 5.0))
    block = Block(corners + np.array([place, top + reach + 0.1]), velocity=velocity)
    area = polygon_properties(corners)[0]
    dt = min(rng.choice([2e-3, 5e-3]), 0.99 * longest_step(np.array([area]), GRAVITY))
    return Scene(ground, [block], rock(35.0, rng.uniform(0.0, 0.5))), float(dt)


@pytest.mark.parametrize("first", range(0, 40, 20))
def test_blocks_over_scanned_profiles_neither_jump_nor_gain_energy(first):
    """200 of them by `-m slow`: none by more than a centimetre, energy not by a thousandth."""
    check(range(first, first + 20))


@pytest.mark.slow
def test_many_blocks_over_scanned_profiles():
    check(range(40, 240))


def check(seeds: range) -> None:
    """Check that no block is displaced beyond its velocity, and that none gains energy."""
    for seed in seeds:
        scene, dt = scanned(seed)
        excess, rise = beyond(Simulation(scene, Settings(dt=dt)).run(4.0, every=dt), dt)
        assert excess < 0.01, seed
        assert rise < 1e-3, seed
