"""Motions with a known solution: falls, slides, holds, bounces, rocking, spin and stacks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from physics.helpers import FLAT, GRAVITY, box, incline, ngon, polygon, rock
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import polygon_properties


def test_free_fall():
    sim = Simulation(Scene(None, (box(),), rock()))
    sim.step(200)
    assert sim.time == pytest.approx(1.0, abs=1e-12)
    assert abs(sim.poses[0, 1] + 0.5 * GRAVITY) < 1e-12
    assert abs(sim.velocities[0, 1] + GRAVITY) < 1e-12


def test_damped_fall():
    alpha = 0.6
    sim = Simulation(Scene(None, (box(),), rock(), damping=alpha))
    sim.step(200)
    decay = 1.0 - math.exp(-alpha)
    assert sim.velocities[0, 1] == pytest.approx(-GRAVITY / alpha * decay, rel=2e-6)
    assert sim.poses[0, 1] == pytest.approx(-GRAVITY / alpha * (1.0 - decay / alpha), rel=5e-6)


@pytest.mark.parametrize(
    ("slope", "friction", "height", "duration", "bar"),
    [
        (30.0, 20.0, 1.0, 2.0, 1.5e-5),
        (45.0, 30.0, 0.4, 2.0, 1e-5),  # low: a cube would topple
        (35.0, 34.0, 1.0, 2.0, 2e-4),
        (35.0, 34.0, 1.0, 10.0, 1e-5),
    ],
)
def test_slide(slope, friction, height, duration, bar):
    scene, down = incline(slope, friction, 1.0, height)
    sim = Simulation(scene)
    start = sim.poses[0, :2]
    sim.step(round(duration / sim.settings.dt))
    dip = math.radians(slope)
    pull = GRAVITY * (math.sin(dip) - math.cos(dip) * math.tan(math.radians(friction)))
    way = (sim.poses[0, :2] - start) @ down
    assert way == pytest.approx(0.5 * pull * duration**2, rel=bar)


@pytest.mark.parametrize("friction", [30.5, 35.0])
@pytest.mark.parametrize("sleeping", [True, False])
def test_hold(friction, sleeping):
    scene, _ = incline(30.0, friction)
    sim = Simulation(scene, Settings(sleeping=sleeping))
    start = sim.poses[0, :2]
    sim.step(200)
    settled = sim.poses[0, :2]
    sim.step(1800)
    assert np.linalg.norm(sim.poses[0, :2] - start) < 1e-4
    assert np.linalg.norm(sim.poses[0, :2] - settled) < 5e-9


BOUNCE = {1e-3: 2e-3, 5e-3: 8e-3, 1e-2: 1.6e-2}
"""Bar on the restitution by time step: the impact acts on the whole step."""


def rebound(restitution: float, dt: float, phase: float, density: float = 2600.0) -> float:
    """Return the restitution that the apex after a flat drop from 5 m shows.

    `phase` shifts the drop so that the block touches elsewhere within its step.
    """
    drop = 5.0 + phase * dt * math.sqrt(10.0 * GRAVITY)
    scene = Scene(Terrain(FLAT), (box(0.0, 0.5 + drop, density=density),), rock(30.0, restitution))
    sim = Simulation(scene, Settings(dt=dt))
    sim.step(math.floor(math.sqrt(2.0 * drop / GRAVITY) / dt) + 2)
    apex = sim.poses[0, 1]
    while True:
        sim.step()
        if sim.poses[0, 1] <= apex:
            return math.sqrt(max(apex - 0.5, 0.0) / drop)
        apex = sim.poses[0, 1]


@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("dt", [1e-3, 5e-3, 1e-2])
def test_newton_bounce(restitution, dt):
    for phase in (0.0, 0.5):
        assert abs(rebound(restitution, dt, phase) - restitution) < BOUNCE[dt], phase


@pytest.mark.parametrize("density", [1.0, 1e2, 1e4, 1e6])
def test_bounce_does_not_know_density(density):
    assert abs(rebound(0.5, 5e-3, 0.0, density) - rebound(0.5, 5e-3, 0.0)) < 1e-9


def test_rocking():
    """Housner (1963): a block of 1 m by 4 m falls back from half the tilt at which it topples."""
    width, height = 1.0, 4.0
    half, radius = math.atan2(width, height), 0.5 * math.hypot(width, height)
    tilt = 0.5 * half
    corners = polygon([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)], angle=tilt)
    sim = Simulation(Scene(Terrain(FLAT), (Block(corners),), rock(60.0)))
    angle, rate = [tilt], [0.0]
    while len(rate) < 3 or rate[-1] < rate[-2]:  # the rate grows until the impact
        sim.step()
        angle.append(tilt + sim.poses[0, 2])
        rate.append(sim.velocities[0, 2])
    dt = sim.settings.dt
    arrival = sim.time - dt + angle[-2] / -rate[-2]
    pull = 0.75 * GRAVITY / radius  # of the rate: pull * sin(angle of the diagonal)

    def slowness(s: float) -> float:  # angle = tilt - s^2 takes the root out of the integral
        gained = math.cos(half - tilt) - math.cos(half - tilt + s * s)
        return 2.0 * s / math.sqrt(2.0 * pull * gained)

    exact = quad(slowness, 1e-6, math.sqrt(tilt))[0]
    assert exact == pytest.approx(0.69834, abs=1e-5)
    assert abs(arrival - exact) < 2e-4
    rate_at = -math.sqrt(2.0 * pull * (math.cos(half - tilt) - math.cos(half)))
    after = rate[-1] - pull * math.sin(half) * (sim.time - exact)  # back to the impact
    assert after / rate_at == pytest.approx(1.0 - 1.5 * math.sin(half) ** 2, rel=2e-2)


def test_spin_keeps_area():
    rate = 2.0 * math.pi * 20.0
    block = Block(ngon(7), velocity=(0.0, 0.0, rate))
    sim = Simulation(Scene(None, (block,), rock(), gravity=0.0))
    before = polygon_properties(sim.vertices(0))[0]
    sim.step(10_000)
    assert sim.poses[0, 2] == pytest.approx(1000.0 * 2.0 * math.pi, rel=1e-6)
    assert polygon_properties(sim.vertices(0))[0] == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("count", [10, 25])
def test_stack(count):
    blocks = tuple(box(0.0, 0.5 + i) for i in range(count))
    sim = Simulation(Scene(Terrain(FLAT), blocks, rock()), Settings(sleeping=False))
    sim.step(2000)
    assert np.abs(sim.velocities).max() < 1e-9
    assert sim.diagnostics.penetration < 3e-4
    assert np.abs(sim.poses[:, 0]).max() < 1e-9
