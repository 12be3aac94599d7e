"""Fences absorb up to their capacity and fail beyond it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, box, masses, polygon, rock, rough
from rigdda import (
    BadInput,
    Block,
    DoubtfulInput,
    Fence,
    Scene,
    Settings,
    Simulation,
    Surface,
    Terrain,
)
from rigdda.barriers import FENCE_CLASSES
from rigdda.dynamics.monitors import FAILED
from rigdda.validation.fences import CAPACITY, FENCE, volley

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
    scene = Scene(ramp, blocks, rock(10.0), barriers=(Fence(0.0, 4.0, 1e4),))
    run = Simulation(scene, Settings(sleeping=False)).run(20.0)
    assert math.isinf(run.failure(0))


def test_a_fence_can_be_overtopped():
    high = box(-3.0, 5.0, velocity=(20.0, 0.0, 0.0))
    scene = Scene(GROUND, (high,), rock(), barriers=(Fence(0.0, 2.0, CAPACITY),))
    run = Simulation(scene).run(0.4)
    assert run.poses[-1, 0, 0] > 2.0
    assert run.absorbed[0] == 0.0


def thrown(seed, share=None):
    """Return a scene of a block of random shape and way at a fence, and its energy [J].

    The fence has a random share of that as capacity, or this one.
    """
    rng = np.random.default_rng(seed)
    corners = rough(rng, int(rng.integers(3, 9)), rng.uniform(0.4, 1.5))
    turn, climb = rng.uniform(0.0, 6.28), math.radians(rng.uniform(-40.0, 40.0))
    speed = rng.uniform(5.0, 50.0)
    velocity = (speed * math.cos(climb), speed * math.sin(climb), rng.uniform(-10.0, 10.0))
    block = Block(polygon(corners, (-3.0, 10.0), turn), velocity=velocity)
    surfaces = rock(rng.uniform(0.0, 50.0), rng.uniform(0.0, 0.9))
    energy = Simulation(Scene(None, (block,), surfaces)).energy().kinetic
    fence = Fence(0.0, 60.0, max(energy * (share or rng.uniform(0.05, 1.0)), 1e4))
    return Scene(Terrain(FLAT), (block,), surfaces, barriers=(fence,), gravity=0.0), energy


def test_a_fence_takes_what_its_blocks_lose_step_by_step():
    """Of any shape, however it hits, for one that breaks as for one that does not."""
    worst = []
    for seed in range(40):
        scene, energy = thrown(seed)
        sim = Simulation(scene, Settings(dt=2e-3))
        target, before, had = sim.loop.arrays.monitors.target, energy, 0.0
        while sim.vertices(0)[:, 1].min() > 0.2 and sim.time < 1.0:  # on the ground it loses more
            sim.step()
            now, has = sim.energy().kinetic, float(target["absorbed"][0])
            worst.append(abs((before - now) - (has - had)) / energy)
            before, had = now, has
    assert np.quantile(worst, 0.995) < 1e-3 and max(worst) < 0.03


def test_eccentric_hits_never_take_more_than_the_capacity():
    for seed in range(60):
        scene = thrown(seed)[0]
        capacity = scene.barriers[0].capacity
        run = Simulation(scene).run(1.5)
        share = run.absorbed[0] / capacity
        assert share <= 1.0, seed
        assert math.isinf(run.failure(0)) or share > 0.99, seed


def test_a_weak_fence_stops_no_block_that_strikes_the_ground_in_the_same_step():
    """Of those of many shapes only few are much slower or faster than without the fence.

    These are such as the ground stops in several blows within a step, which is one with a fence.
    """
    dt, apart, kept = 5e-3, 0, 0.0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        speed = np.array([rng.uniform(8.0, 20.0), -rng.uniform(5.0, 15.0)])
        corners = polygon(rough(rng, 6, 1.0), (0.0, 0.0), rng.uniform(0.0, 6.28))
        right, bottom = corners[:, 0].max(), corners[:, 1].min()
        start = corners - [right, bottom] - speed * rng.uniform(0.1, 0.9, 2) * dt
        surfaces = rock(rng.uniform(20.0, 60.0), rng.uniform(0.5, 0.95))
        block = Block(start, velocity=(*speed, 0.0))
        found = []
        for barriers in ((), (Fence(0.0, 5.0, 1e4),)):
            scene = Scene(GROUND, (block,), surfaces, barriers=barriers)
            sim = Simulation(scene, Settings(dt=dt))
            sim.step()
            found.append((sim.velocities[0, 0], sim.energy().kinetic))
        apart += abs(found[1][0] - found[0][0]) > 2.0
        kept += found[1][1] / found[0][1] / 200
    assert apart <= 15
    assert kept > 0.9


@pytest.mark.parametrize("dt", [1e-2, 5e-3, 2.5e-3, 1.25e-3])
def test_what_a_fence_takes_of_blows_does_not_depend_on_the_step(dt):
    """A row of blocks rests against it, others strike its end, one after the other or at once."""
    row = [box(-0.5 - 1.0 * i, 0.5) for i in range(3)]
    shots = [box(-6.0 - 1.3 * i, 0.5, velocity=(10.0, 0.0, 0.0)) for i in range(3)]
    scene = Scene(GROUND, (*row, *shots), rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
    taken = Simulation(scene, Settings(dt=dt)).run(2.0).absorbed[0]
    # each has 130 kJ, of which the n-th part arrives through n - 1 blocks
    assert taken == pytest.approx(1.3e5 * (1 / 4 + 1 / 5 + 1 / 6), rel=0.08)


@pytest.mark.parametrize("dt", [1e-2, 2.5e-3, 1.25e-3])
@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_train_of_blocks_gives_a_fence_all_it_has(dt, gap):
    """What comes on behind the block that hits the fence counts, too."""
    train = [box(-3.0 - (1.0 + gap) * i, 0.5, velocity=(10.0, 0.0, 0.0)) for i in range(3)]
    scene = Scene(GROUND, train, rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
    assert Simulation(scene, Settings(dt=dt)).run(0.6).absorbed[0] == pytest.approx(3.9e5, rel=0.02)


@pytest.mark.parametrize("dt", [1e-2, 5e-3, 2.5e-3, 1.25e-3])
@pytest.mark.parametrize("ahead", [0.1, 0.5, 3.0, 9.9])
def test_a_fast_block_strikes_one_that_hits_the_fence_in_the_same_step(ahead, dt):
    """The fence takes the energy of the one that hits it, and half of that of the other."""
    fast = 20.0
    blocks = [
        box(-0.5 - 0.3 * ahead * dt, 0.5, velocity=(ahead, 0.0, 0.0)),
        box(-1.5 - 0.3 * fast * dt, 0.5, velocity=(fast, 0.0, 0.0)),
    ]
    scene = Scene(GROUND, blocks, rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
    taken = Simulation(scene, Settings(dt=dt)).run(1.0).absorbed[0]
    mass = masses(scene)[0][0]
    assert taken == pytest.approx(0.5 * mass * (ahead**2 + 0.5 * fast**2), rel=0.01)


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0])
def test_an_oblique_blow_gives_the_share_that_is_directed_at_the_fence(tilt_deg):
    """A corner strikes the face of a wedge that leans on the fence, along its normal."""
    tilt, speed = math.radians(tilt_deg), 10.0
    way = np.array([math.cos(tilt), -math.sin(tilt)])
    wedge = Block([(-1.5 - math.tan(tilt), 0.0), (0.0, 0.0), (0.0, 1.0), (-1.5, 1.0)])
    struck = np.array([-1.5 - 0.5 * math.tan(tilt), 0.5]) - 0.02 * way
    corners = [(0.0, 0.0), (-0.5, 0.5), (-1.0, 0.0), (-0.5, -0.5)]
    turn = np.array([[way[0], way[1]], [-way[1], way[0]]])
    striker = Block(np.array(corners) @ turn + struck, velocity=(*(speed * way), 0.0))
    barriers = (Fence(0.0, 5.0, 1e9),)
    scene = Scene(GROUND, (wedge, striker), rock(0.0), barriers=barriers, gravity=0.0)
    taken = Simulation(scene, Settings(dt=5e-3)).run(0.1).absorbed[0]
    m_i, m_j = masses(scene)[0]
    work = 0.5 * m_j**2 / (m_j + m_i) * speed**2 * math.cos(tilt) ** 2
    assert taken == pytest.approx(work, rel=0.02)


def test_a_blow_reaches_the_fence_through_a_row():
    """A block that strikes a row of three goes on with them: a quarter of its energy."""
    blocks = [box(-0.5 - 1.0 * i, 0.5) for i in range(3)]
    blocks.append(box(-4.0, 0.5, velocity=(10.0, 0.0, 0.0)))
    for dt in (1e-2, 2.5e-3):
        scene = Scene(GROUND, blocks, rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
        run = Simulation(scene, Settings(dt=dt)).run(1.0)
        assert run.absorbed[0] == pytest.approx(0.25 * 1.3e5, rel=0.1)


def test_it_is_lower_by_what_it_took_where_others_follow():
    for others, lost in ((1, 0.0), (2, 0.25)):
        scene = volley((0.5, 0.3)[:others])
        sim = Simulation(scene)
        sim.step(round(0.8 / sim.settings.dt))
        top = sim.loop.arrays.outlines.corner["y"][others].max()
        assert top == pytest.approx(FENCE.height * (1.0 - lost), rel=1e-3)


def leaning(slope_deg, fence, blocks=4, until=6.0):
    """Return the run of smooth cubes in a row on a slope that lean on a fence, and their weight."""
    slope = math.radians(slope_deg)
    up, out = (
        np.array([-math.cos(slope), math.sin(slope)]),
        np.array([math.sin(slope), math.cos(slope)]),
    )
    ramp = Terrain([up * 40.0, -up * 40.0], ["ice"])
    first = 0.51 + math.tan(slope)
    rocks = [
        box(*(up * (first + 1.005 * i) + out * 0.5), angle=-slope, surface="ice")
        for i in range(blocks)
    ]
    surfaces = rock(0.0) | {"ice": Surface(0.0)}
    run = Simulation(Scene(ramp, rocks, surfaces, barriers=(fence,))).run(until)
    return run, blocks * 2600.0 * 9.81


@pytest.mark.parametrize("slope_deg", [20.0, 40.0])
def test_thrust_of_what_rests_is_that_of_statics(slope_deg):
    run, weight = leaning(slope_deg, Fence(0.0, 4.0, 1e9))
    assert run.thrust[0] == pytest.approx(weight * math.tan(math.radians(slope_deg)), rel=0.1)


@pytest.mark.parametrize("share", [0.8, 1.25])
def test_it_fails_under_what_rests_against_it(share):
    resistance = 4 * 2600.0 * 9.81 * math.tan(math.radians(30.0)) / share
    fence = Fence(0.0, 4.0, 4.0 * resistance, elongation=4.0)
    assert fence.bears == pytest.approx(resistance)
    run, _ = leaning(30.0, fence)
    assert math.isfinite(run.failure(0)) == (share > 1.0)
    assert run.absorbed[0] < 0.5 * fence.capacity
    assert (run.poses[-1, :, 0].max() > 2.0) == (share > 1.0)


def test_classes():
    fence = Fence(5.0, 4.0, energy_class=1000)
    assert fence.elongation == 4.5 and fence.capacity is None
    assert fence.for_width(2.0) == Fence(5.0, 4.0, 5e5, elongation=4.5)
    assert fence.for_width(25.0).capacity == 1e5
    given = Fence(5.0, 4.0, 2e5)
    assert given.for_width(3.0) is given and math.isinf(given.bears)
    lowest, heights, elongations = np.array(list(FENCE_CLASSES.values())).T
    assert (np.diff(lowest) >= 0.0).all() and (lowest < heights).all()
    assert (np.diff(heights) >= 0.0).all() and (np.diff(elongations) > 0.0).all()


@pytest.mark.parametrize(
    ("fields", "mend"),
    [
        ({}, "give one of them"),
        ({"capacity": 1e5, "energy_class": 500}, "give one of them"),
        ({"energy_class": 700}, "give one of 100, 250"),
        ({"energy_class": 100}, "at most 2.5 m, or a higher class"),
        ({"energy_class": 500, "elongation": 1.0}, "leave it out"),
        ({"capacity": 500.0}, "at least 1000"),
        ({"capacity": 1e5, "elongation": 0.0}, "above 0"),
    ],
)
def test_fences_that_cannot_be_are_refused(fields, mend):
    with pytest.raises(BadInput, match=mend):
        Fence(0.0, 3.0, **fields)


def test_a_slip_of_the_unit_is_told():
    with pytest.warns(DoubtfulInput, match="J per metre"):
        Fence(0.0, 3.0, 1e3)


def test_a_scene_needs_what_a_fence_takes_per_metre():
    with pytest.raises(BadInput, match="for_width"):
        Scene(GROUND, (box(-3.0, 1.0),), rock(), barriers=(Fence(0.0, 3.0, energy_class=500),))


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
