"""Restitution is as prescribed for slow impacts, for e = 1, and along a row of blocks."""

from __future__ import annotations

import numpy as np
import pytest

from physics.helpers import box, ngon
from physics.steps import STEPS, accepted, each, in_space, mechanical, on_floor
from rigdda import Block, BodyForce, Scene, Settings, Simulation, Surface, Terrain
from rigdda.validation.scenes import FLAT

# --- two blocks that meet slowly


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("speed", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("where", ["floor", "space", "space with gravity", "pushed apart"])
def test_slow_blocks_rebound_from_one_another(where, speed, dt):
    """By half of their speed of approach, long after they have met."""
    blocks = (
        box(0.0, 0.5, velocity=(speed / 2.0, 0.0, 0.0)),
        box(1.01, 0.5, velocity=(-speed / 2.0, 0.0, 0.0)),
    )
    if where == "floor":
        sim = on_floor(blocks, dt, 0.0, 0.5)
    elif where == "pushed apart":  # by equal forces down: gravity by another name
        loads = tuple(BodyForce(i, (0.0, -2600.0 * 9.81)) for i in range(2))
        sim = in_space(blocks, dt, restitution=0.5, loads=loads)
    else:
        sim = in_space(blocks, dt, restitution=0.5, gravity=9.81 if "gravity" in where else 0.0)
    sim.step(round(0.01 / speed / dt) + 10)
    apart = sim.velocities[1] - sim.velocities[0]
    assert apart[0] == pytest.approx(0.5 * speed, rel=0.02)
    assert np.abs(apart[1:]).max() < 0.01 * speed


# --- e = 1


def central(seed: int) -> tuple[Block, Block]:
    """Return two random polygons that meet along the line of their centroids."""
    rng = np.random.default_rng(seed)
    away = (-0.9, 0.0), (0.9, 0.0)
    density = 10.0 ** rng.uniform(2.5, 4.0, 2)
    speed = rng.uniform(0.5, 8.0), -rng.uniform(0.0, 5.0)
    side = rng.uniform(0.7, 1.5)
    first = ngon(2 * int(rng.integers(2, 5)), 0.5, away[0])  # with a corner towards the other
    second = box(*away[1], side, side).vertices if seed % 2 else ngon(4, 0.6, away[1], np.pi / 4)
    return (
        Block(first, density[0], velocity=(speed[0], 0.0, 0.0)),
        Block(second, density[1], velocity=(speed[1], 0.0, 0.0)),
    )


def kept(sim: Simulation, time: float) -> float:
    """Return the mechanical energy after a time [s] over that at the start."""
    start = mechanical(sim)
    sim.step(round(time / sim.settings.dt))
    return mechanical(sim) / start


@pytest.mark.parametrize("dt", each(accepted(0.35)))
@pytest.mark.parametrize("friction_deg", [0.0, 30.0])
def test_elastic_central_impacts_of_pairs_keep_the_energy(friction_deg, dt):
    for seed in range(200):
        sim = in_space(central(seed), dt, friction_deg, 1.0)
        before = sim.velocities[:, 0]
        assert kept(sim, 1.0) == pytest.approx(1.0, abs=1e-9), seed
        after = sim.velocities[:, 0]
        assert after[1] - after[0] == pytest.approx(before[0] - before[1], rel=1e-9), seed


def off_centre(seed: int) -> tuple[Block, Block]:
    """Return two random polygons that meet beside the line of their centroids."""
    rng = np.random.default_rng(seed)
    centres = (-0.8, 0.0), (0.8, rng.uniform(-0.5, 0.5))
    corners = [ngon(int(rng.integers(3, 9)), 0.5, c, rng.uniform(0.0, 6.0)) for c in centres]
    speed = rng.uniform(1.0, 5.0)
    return (
        Block(corners[0], velocity=(speed, 0.0, 0.0)),
        Block(corners[1], velocity=(-speed, 0.0, 0.0)),
    )


@pytest.mark.parametrize("dt", each(accepted(0.325)))
def test_smooth_elastic_impacts_off_the_centre_keep_the_energy(dt):
    """Nearly: the rebound is at the end of a substep, and arms change by v dt/8 until then."""
    lost = []
    for seed in range(100):
        ratio = kept(in_space(off_centre(seed), dt, restitution=1.0), 0.6)
        assert ratio < 1.0 + 1e-9, seed
        lost.append(1.0 - ratio)
    assert np.median(lost) < 0.5 * dt and np.percentile(lost, 95) < 2.5 * dt


@pytest.mark.parametrize("dt", each(accepted(0.49)))
def test_a_lone_block_that_lands_flat_or_on_a_corner_rebounds_elastically(dt):
    """Without gravity its speed is reversed; with it, it rises as high as it fell from."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        side, speed, angle = rng.uniform(0.7, 1.5), rng.uniform(1.0, 8.0), (seed % 2) * np.pi / 4.0
        above = rng.uniform(0.01, 0.1) + side * (0.5 if seed % 2 == 0 else np.sqrt(0.5))
        block = box(0.0, above, side, side, angle, velocity=(0.0, -speed, 0.0))
        surfaces = {"rock": Surface(30.0 * rng.integers(0, 2), restitution=1.0)}
        scene = Scene(Terrain(FLAT), (block,), surfaces, gravity=0.0)
        sim = Simulation(scene, Settings(dt=dt, sleeping=False))
        sim.step(round(0.3 / dt))
        assert sim.velocities[0] == pytest.approx((0.0, speed, 0.0), abs=1e-9 * speed), seed


@pytest.mark.parametrize("dt", each(accepted(1.0)))
@pytest.mark.parametrize("drop", [0.2, 1.93])
def test_an_elastic_block_bounces_for_ever(drop, dt):
    """A square dropped flat; 20 s. Where it bounces is raised by the depth of contacts, 0.1 mm."""
    sim = on_floor((box(0.0, 0.5 + drop),), dt, restitution=1.0)
    weight = 2600.0 * 9.81
    start = mechanical(sim)
    sim.step(round(20.0 / dt))
    assert mechanical(sim) - start == pytest.approx(0.0, abs=0.01 * weight * drop)
    assert np.abs(sim.poses[0, [0, 2]]).max() < 1e-6


# --- a row


def in_sequence(gap: float, speeds: list[float], e: float, time: float) -> np.ndarray:
    """Return the speeds [m/s] of equal blocks in a row after a time, pair by pair as they meet."""
    gaps, v = np.full(len(speeds) - 1, gap), np.array(speeds)
    while True:
        closing = v[:-1] - v[1:]
        waits = np.where(closing > 1e-12, np.maximum(gaps, 0.0) / np.maximum(closing, 1e-12), 1e9)
        k = int(waits.argmin())
        if waits[k] > time:
            return v
        time -= waits[k]
        gaps = gaps - closing * waits[k]
        gaps[k] = 0.0
        mean, half = (v[k] + v[k + 1]) / 2.0, e * (v[k] - v[k + 1]) / 2.0
        v[k], v[k + 1] = mean - half, mean + half


@pytest.mark.parametrize("dt", [1e-3, 2e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("count", [3, 5, 10])
@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
def test_blows_along_a_row_are_handed_on_in_sequence(speed, count, dt):
    """The first of a row with gaps of 1 mm moves; 0.3 m of its way later the speeds are right."""
    gap, time = 1e-3, 0.3 / speed
    blocks = [box((1.0 + gap) * i, 0.5) for i in range(count)]
    blocks[0] = box(0.0, 0.5, velocity=(speed, 0.0, 0.0))
    sim = on_floor(blocks, dt, 0.0, 0.5)
    sim.step(round(time / dt))
    wanted = in_sequence(gap, [speed] + [0.0] * (count - 1), 0.5, time)
    assert sim.velocities[:, 0].sum() == pytest.approx(speed, rel=1e-6)
    assert np.abs(sim.velocities[:, 0] - wanted).max() < 0.1 * speed
