"""Fences absorb up to their capacity and fail beyond it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, box, masses, polygon, rock, rough
from rigdda import Block, Fence, Scene, Settings, Simulation, Surface, Terrain
from rigdda.gauges import FAILED
from rigdda.validation.fences import FENCE, volley

CAPACITY = FENCE.capacity
GROUND = Terrain(FLAT)


@pytest.mark.parametrize("dt", [5e-3, 1e-3])
@pytest.mark.parametrize(
    ("shares", "failed", "kept"),
    [
        ((0.99,), False, (0.0,)),
        ((1.01,), True, (0.01,)),
        ((3.0,), True, (2.0,)),
        ((0.6, 0.6), True, (0.0, 0.2)),
        ((1.1, 0.5), True, (0.1, 0.5)),
    ],
)
def test_centred_hits(shares, failed, kept, dt):
    scene = volley(shares)
    run = Simulation(scene, Settings(dt=dt)).run(4.0)
    left = 0.5 * masses(scene)[0] * run.velocities[-1, :, 0] ** 2 / CAPACITY
    np.testing.assert_allclose(left, kept, atol=2e-4)
    assert math.isfinite(run.failure(0)) == failed
    assert run.absorbed[0] / CAPACITY == pytest.approx(sum(shares) - sum(kept), abs=2e-4)
    through = run.poses[-1, :, 0] > 0.2
    assert through.tolist() == [k > 0.0 for k in kept]


def test_an_impact_on_a_fence_is_plastic_whatever_the_surfaces():
    scene = volley((0.8,))
    springy = Scene(
        scene.terrain,
        scene.blocks,
        {"rock": Surface(30.0, 0.9), "concrete": Surface(30.0, 0.9)},
        barriers=scene.barriers,
        interfaces={("rock", "concrete"): Surface(30.0, 0.9)},
        gravity=0.0,
    )
    run = Simulation(springy).run(1.0)
    assert run.velocities[-1, 0, 0] == pytest.approx(0.0, abs=1e-3)


def test_the_failure_is_an_event_with_the_block_that_broke_the_fence():
    run = Simulation(volley((0.45, 0.45, 0.45))).run(4.0)
    (event,) = run.events[run.events["kind"] == FAILED]
    assert (event["block"], event["target"]) == (2, 0)
    assert event["energy"] == pytest.approx(0.45 * CAPACITY, rel=1e-3)
    assert event["time"] == run.failure(0)
    assert len(run.hits(0)) == 3


def test_what_slept_against_a_fence_falls_when_it_fails():
    """A block on a steep frictionless ramp leans on a fence at rest until another breaks it."""
    ramp = Terrain([(-40.0, 20.0), (40.0, -20.0)], ["ice"])
    tilt = -math.atan(0.5)
    leaning = box(-0.62, 1.0, 1.0, 1.0, tilt, surface="ice")
    shot = box(-27.0, 19.4, 1.0, 1.0, velocity=(15.0, 0.0, 0.0))  # at the fence after 1.8 s
    surfaces = rock() | {"ice": Surface(0.0)}
    fence = Fence(0.0, 6.0, 5e4)
    sim = Simulation(Scene(ramp, (leaning, shot), surfaces, barriers=(fence,)))
    before = sim.run(1.5)
    assert math.isinf(before.failure(0))
    assert before.velocities[-1, 0, 0] == 0.0  # asleep
    after = sim.run(4.0)
    assert math.isfinite(after.failure(0))
    assert after.poses[-1, 0, 0] > 2.0


@pytest.mark.parametrize(("share", "left"), [(1.5, 0.0), (3.0, 0.5), (10.0, 4.0)])
def test_a_block_at_rest_against_the_fence_passes_blows_on(share, left):
    """Two equal blocks go on together with half the energy of the blow, which the fence takes."""
    speed = math.sqrt(2.0 * share * CAPACITY / 2600.0)
    blocks = (box(-0.5, 0.5), box(-4.0, 0.5, velocity=(speed, 0.0, 0.0)))
    scene = Scene(GROUND, blocks, rock(0.0), barriers=(Fence(0.0, 5.0, CAPACITY),))
    run = Simulation(scene).run(1.0)
    kept = 0.5 * 2600.0 * (run.velocities[-1, :, 0] ** 2).sum() / CAPACITY
    assert kept == pytest.approx(left, abs=0.02 * share)
    assert run.absorbed[0] / CAPACITY == pytest.approx(min(share / 2.0, 1.0), rel=0.07)


def test_the_weight_of_a_pile_does_not_break_a_fence():
    ramp = Terrain([(-40.0, 40.0), (40.0, -40.0)])
    up = np.array([-1.0, 1.0]) / math.sqrt(2.0)
    blocks = tuple(
        box(*(up * (1.4 + 1.01 * i) + 0.5 / math.sqrt(2.0)), angle=-math.pi / 4) for i in range(6)
    )
    scene = Scene(ramp, blocks, rock(10.0), barriers=(Fence(0.0, 4.0, 2e3),))
    run = Simulation(scene, Settings(sleeping=False)).run(20.0)
    assert math.isinf(run.failure(0))


def test_a_fence_can_be_overtopped():
    high = box(-3.0, 5.0, velocity=(20.0, 0.0, 0.0))
    scene = Scene(GROUND, (high,), rock(), barriers=(Fence(0.0, 2.0, CAPACITY),))
    run = Simulation(scene).run(0.4)
    assert run.poses[-1, 0, 0] > 2.0
    assert run.absorbed[0] == 0.0


def test_eccentric_hits_never_take_more_than_the_capacity():
    for seed in range(60):
        rng = np.random.default_rng(seed)
        corners = rough(rng, int(rng.integers(3, 9)), rng.uniform(0.4, 1.5))
        turn, climb = rng.uniform(0.0, 6.28), math.radians(rng.uniform(-40.0, 40.0))
        speed = rng.uniform(3.0, 50.0)
        velocity = (speed * math.cos(climb), speed * math.sin(climb), rng.uniform(-10.0, 10.0))
        block = Block(polygon(corners, (-3.0, 10.0), turn), velocity=velocity)
        surfaces = rock(rng.uniform(0.0, 50.0), rng.uniform(0.0, 0.9))
        kinetic = Simulation(Scene(None, (block,), surfaces)).energy().kinetic
        fence = Fence(0.0, 30.0, kinetic * rng.uniform(0.05, 1.0))
        run = Simulation(Scene(GROUND, (block,), surfaces, barriers=(fence,))).run(1.5)
        share = run.absorbed[0] / fence.capacity
        assert share < 1.001, seed
        if math.isfinite(run.failure(0)):
            assert share > 0.99, seed


def test_a_crowd_never_takes_more_than_the_capacity():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        blocks = [
            Block(
                polygon(
                    rough(rng, int(rng.integers(4, 8)), rng.uniform(0.4, 0.8)),
                    (-2.0 - 1.7 * (i // 3), 1.5 + 1.7 * (i % 3)),
                ),
                velocity=(rng.uniform(5.0, 20.0), rng.uniform(-3.0, 0.0), rng.uniform(-5.0, 5.0)),
            )
            for i in range(int(rng.integers(3, 12)))
        ]
        kinetic = Simulation(Scene(None, blocks, rock())).energy().kinetic
        fence = Fence(0.0, 8.0, kinetic * rng.uniform(0.02, 0.4))
        sim = Simulation(Scene(GROUND, blocks, rock(30.0, 0.3), barriers=(fence,)))
        run = sim.run(2.0)
        assert run.absorbed[0] / fence.capacity < 1.001, seed
        assert (run.events["kind"] == FAILED).sum() <= 1
