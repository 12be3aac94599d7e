"""The forces of islands in motion: how closely they are settled, and that they obey their law."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from rigdda import Block, Scene, Settings, Simulation, Site, Surface, Terrain
from rigdda.dynamics.constants import MOST_SWEEPS, OPEN, REST
from rigdda.dynamics.records import CONTACTS
from rigdda.validation.scenes import box, incline
from rigdda.validation.single_block import slide

FALL = 3.0
"""Simulated time in which the rock of `quick` falls [s]."""


def falling(dt: float, tolerance: float) -> Simulation:
    """Return the rock of `quick` in its fall."""
    scene = Site.load("quick").realise((), 3, "mass")
    sim = Simulation(scene, Settings(dt=dt, sweep_tolerance=tolerance))
    sim.step(round(FALL / dt))
    return sim


@pytest.mark.parametrize(("dt", "substeps"), [(5e-3, 3), (0.02, 6)])
def test_a_closer_tolerance_takes_more_sweeps(dt: float, substeps: int) -> None:
    loose, close = falling(dt, 1e6).diagnostics, falling(dt, 1e-5).diagnostics
    assert loose.relaxed > 50
    assert loose.sweeps >= substeps * loose.relaxed
    assert close.sweeps > 1.5 * loose.sweeps


@pytest.mark.parametrize("friction_deg", [32.0, 55.0, 65.0])
@pytest.mark.parametrize("dt", [5e-3, 0.02])
def test_forces_of_an_avalanche_press_and_stay_within_friction(
    dt: float, friction_deg: float
) -> None:
    """Contacts whose friction may open them by more than they close obey the law, too."""
    scene = Site.load("quick").realise((), 3, "mass")
    surfaces = {
        name: msgspec.structs.replace(surface, friction_deg=friction_deg)
        for name, surface in scene.surfaces.items()
    }
    sim = Simulation(replace(scene, surfaces=surfaces), Settings(dt=dt))
    tried = 0
    for _ in range(round(FALL / dt)):
        sim.step()
        c = sim.loop.now[: sim.loop.counters[CONTACTS]]
        c = c[(c["kind"] == REST) & (c["state"] != OPEN)]
        limit = c["friction"] * c["normal"] + c["cohesion"]
        assert (c["normal"] >= 0.0).all()
        assert (np.abs(c["shear"]) <= limit * (1.0 + 1e-12) + 1e-6).all()  # sums of 1e5 N
        tried += len(c)
    assert tried > 100


@pytest.mark.parametrize("dt", [1e-3, 5e-3, 0.02])
def test_a_train_slides_as_one_block_does(dt: float) -> None:
    single, down = incline(30.0, 20.0)
    angle = np.arctan2(down[1], down[0])
    x, y = single.blocks[0].vertices.mean(axis=0)
    blocks = [box(x + i * down[0], y + i * down[1], angle=angle) for i in range(4)]
    sim = Simulation(Scene(single.terrain, blocks, single.surfaces), Settings(dt=dt))
    before = sim.poses
    sim.step(round(2.0 / dt))
    assert sim.diagnostics.relaxed > 0.9 * sim.diagnostics.steps
    way = (sim.poses[:, :2] - before[:, :2]) @ down
    # in substeps h a block gets h v / 2 too far, which does not grow with time but with v
    np.testing.assert_allclose(way, slide(30.0, 20.0, 2.0), atol=0.01)
    np.testing.assert_allclose(way, way[0], atol=1e-3)
    gain = sim.energy()
    assert gain.friction < 0.0 and gain.impact < 1e-3 * abs(gain.friction)


def test_a_thin_block_on_rough_ground_takes_few_substeps() -> None:
    """Without partial changes of the impulses, some steps take 10,000 substeps."""
    plate = [
        [-0.252, 0.77], [-0.329, 0.783], [-0.533, 0.715], [-0.669, 0.576],
        [-0.635, 0.513], [-0.558, 0.507], [-0.407, 0.554], [-0.267, 0.653],
    ]  # fmt: skip
    surfaces = {"rock": Surface(friction_deg=52.5, restitution=0.21, rolling=0.3)}
    block = Block(np.array(plate), velocity=(0.5, 0.0, 0.0))
    scene = Scene(Terrain([(-5.0, 2.5), (5.0, -2.5), (9.0, -4.5)]), (block,), surfaces)
    sim = Simulation(scene, Settings(dt=5e-3))
    most = 0
    for _ in range(200):
        before = sim.diagnostics.sweeps
        sim.step(1)
        most = max(most, sim.diagnostics.sweeps - before)
    assert 0 < most <= 10 * MOST_SWEEPS


def impact(flexibility: np.ndarray, closing: np.ndarray, friction: float) -> np.ndarray:
    """Return the shear and normal impulse that stop a contact, or at which it slides [m/s].

    `closing` holds the velocity of the contact along shear and normal before the impact.
    """
    sticking = -np.linalg.solve(flexibility, closing)
    if abs(sticking[0]) <= friction * sticking[1]:
        return sticking
    for ratio in (-friction, friction):
        normal = -closing[1] / (flexibility[1, 1] + ratio * flexibility[0, 1])
        impulses = np.array([ratio * normal, normal])
        slip = closing[0] + flexibility[0] @ impulses
        if normal > 0.0 and ratio * slip < 0.0:
            return impulses
    raise AssertionError("no impulse fulfils the law of friction")


@pytest.mark.parametrize("sideways", [-30.0, -15.0, -3.0, 3.0, 15.0, 30.0])
@pytest.mark.parametrize("friction_deg", [30.0, 55.0, 60.0, 70.0])
def test_impact_of_a_falling_rod_on_its_corner(friction_deg: float, sideways: float) -> None:
    """The impulses fulfil the law of friction however strongly friction opens the contact.

    From 53 degrees on, the friction of a sliding corner opens the contact by more than the normal
    impulse that causes it closed it, and full changes of the impulses alternate.
    """
    rod = box(0.0, 0.0, width=0.1, height=2.0, angle=-np.arctan(0.5))
    x, y = rod.vertices[np.argmin(rod.vertices[:, 1])]
    rows = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])  # shear and normal
    inverse = np.diag([1.0, 1.0, 12.0 / (0.1**2 + 2.0**2)])  # mass and inertia, per mass
    before = np.array([sideways, -3.0, 0.0])
    friction = np.tan(np.radians(friction_deg))
    impulses = impact(rows @ inverse @ rows.T, rows @ before, friction)
    corner = np.array([0.0, 1e-4 - y])
    block = Block(rod.vertices + corner, velocity=tuple(before))
    scene = Scene(Terrain([(-9.0, 0.0), (9.0, 0.0)]), (block,), {"rock": Surface(friction_deg)})
    sim = Simulation(scene, Settings(dt=1e-4))
    sim.step(2)
    after = before + inverse @ rows.T @ impulses
    np.testing.assert_allclose(sim.velocities[0], after, atol=0.01)
    assert sim.diagnostics.sweeps < MOST_SWEEPS * sim.diagnostics.relaxed
