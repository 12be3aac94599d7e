"""A fence brakes with a constant force, by closed forms of energy and momentum, at any step."""

from __future__ import annotations

import math
from contextlib import nullcontext
from functools import cache

import numpy as np
import pytest

from physics.helpers import FLAT, GRAVITY, box, masses, ngon, polygon, rock, rough
from physics.steps import each
from rigdda import (
    BadInput,
    Block,
    DoubtfulInput,
    Fence,
    Run,
    Scene,
    Settings,
    Simulation,
    Surface,
    Terrain,
)
from rigdda.barriers import FENCE_CLASSES
from rigdda.dynamics.constants import ASLEEP, RETIRED, SUBSTEPS
from rigdda.dynamics.monitors import FAILED
from rigdda.model.settings import site_step
from rigdda.validation.barriers import (
    CAPACITY,
    ELONGATION,
    FENCE,
    STRONG,
    Bar,
    Lean,
    blow,
    braking_path,
    outcome,
    plate_mass,
    square_mass,
    strike,
    together,
    volley,
)
from rigdda.validation.case import Lab

GROUND = Terrain(FLAT)

STEPS = (1.25e-3, 2.5e-3, 5e-3, 1e-2, 2e-2)
"""Steps in which everything is tested [s]."""

at_all_steps = pytest.mark.parametrize("dt", each(STEPS))


def margin(exact: float, speed: float, dt: float) -> float:
    """Return by how much a path may miss its closed form [m]: 1.6 substeps at a speed, and 0.3 %.

    Velocities change at the start of a substep, which makes the path shorter by up to the way of a
    substep and a half; sweeps end at a tolerance, which does not become less in shorter steps.
    """
    return 1.6 * speed * dt / SUBSTEPS + 3e-3 * abs(exact)


def speed_of(share: float) -> float:
    """Return the speed of a square of a volley with this share of the capacity [m/s]."""
    return math.sqrt(2.0 * share * CAPACITY / square_mass())


def in_motion(scene: Scene, dt: float, **settings: bool) -> Simulation:
    """Return a scene in motion at a step [s]."""
    return Simulation(scene, Settings(dt=dt, **settings))


def open_ledger(sim: Simulation, start: float) -> float:
    """Return the energy that is not accounted for [J], `start` being kinetic + potential then."""
    e = sim.energy()
    return e.kinetic + e.potential - e.friction - e.damping - e.impact - e.external - start


def start_energy(sim: Simulation) -> float:
    """Return kinetic and potential energy now [J]."""
    e = sim.energy()
    return e.kinetic + e.potential


# blows of single blocks


@at_all_steps
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_central_blow_moves_it_by_its_energy_over_the_force(share, dt):
    """The plate takes part in the plastic blow."""
    sim = in_motion(volley((share,)), dt)
    run = sim.run(2.0)
    exact = outcome((share,))
    assert braking_path(run) == pytest.approx(
        exact.path, abs=margin(exact.path, speed_of(share), dt)
    )
    assert run.absorbed[0] == pytest.approx(share * CAPACITY, rel=1e-3)
    assert math.isinf(run.failure(0))
    assert np.abs(run.velocities[-1]).max() < 0.01
    assert open_ledger(sim, share * CAPACITY) == pytest.approx(0.0, abs=1e-4 * CAPACITY)


def test_a_blow_from_the_downhill_side_does_not_move_it():
    sim = in_motion(volley((0.5,), uphill=True), 5e-3)
    run = sim.run(2.0)
    assert braking_path(run) == 0.0 and math.isinf(run.failure(0))
    assert np.abs(run.velocities[-1]).max() < 0.01
    assert open_ledger(sim, 0.5 * CAPACITY) == pytest.approx(0.0, abs=1e-4 * CAPACITY)


@at_all_steps
def test_it_holds_a_block_of_its_class_and_not_one_of_a_tenth_more(dt):
    """Some of the energy goes into the plate, so that of its class is within the capacity."""
    held = in_motion(volley((1.0,)), dt).run(2.0)
    assert math.isinf(held.failure(0)) and abs(held.velocities[-1, 0, 0]) < 0.01
    assert braking_path(held) < ELONGATION
    passed = in_motion(volley((1.1,)), dt).run(2.0)
    assert math.isfinite(passed.failure(0)) and passed.poses[-1, 0, 0] > ELONGATION


@at_all_steps
@pytest.mark.parametrize(
    "shares", [(0.2, 0.2), (0.3, 0.2, 0.3), (0.6, 0.6), (0.45, 0.45, 0.45), (1.3, 0.5), (3.0,)]
)
def test_hits_add_up_until_the_capacity_is_spent(shares, dt):
    scene = volley(shares)
    sim = in_motion(scene, dt)
    run = sim.run(5.0)
    exact = outcome(shares)
    fastest = max(speed_of(share) for share in shares)
    late = margin(exact.path, fastest, dt) * len(shares)
    failed = run.events[run.events["kind"] == FAILED]
    if exact.breaking:
        (event,) = failed
        assert (event["block"] + 1, event["target"]) == (exact.breaking, 0)
        assert event["time"] == run.failure(0)
        assert braking_path(run) == pytest.approx(ELONGATION, rel=1e-12)
        assert sim.loop.arrays.bodies["status"][-1] == RETIRED
    else:
        assert len(failed) == 0
        assert braking_path(run) == pytest.approx(exact.path, abs=late)
    assert len(run.hits(0)) == (exact.breaking or len(shares))
    spent = FENCE.braking_force * late  # what the brake may miss
    kept = 0.5 * square_mass() * (run.velocities[-1, :, 0] ** 2).sum()
    assert kept == pytest.approx(exact.kept, abs=spent)
    assert run.absorbed[0] == pytest.approx(exact.taken, abs=spent)
    assert run.absorbed[0] == pytest.approx(sum(shares) * CAPACITY - kept, rel=1e-6)


@at_all_steps
def test_the_speed_left_is_the_root_of_the_energy_left(dt):
    for share in (1.2, 2.0, 5.0):
        mass, plate, speed = square_mass(), plate_mass(FENCE), speed_of(share)
        run = in_motion(volley((share,)), dt).run(1.0)
        braked = blow(mass, speed, FENCE).braked
        left = math.sqrt(2.0 * (braked - CAPACITY) / (mass + plate))
        missed = FENCE.braking_force * margin(ELONGATION, speed, dt) / (mass * left)
        assert run.velocities[-1, 0, 0] == pytest.approx(left, abs=missed)


@at_all_steps
def test_no_block_gets_through_between_two_steps(dt):
    """Small ones at up to 50 m/s, at all phases of the step: a step takes them 1 m on."""
    for side, speed in ((0.62, 20.0), (0.62, 50.0), (1.0, 50.0)):
        mass = 2600.0 * side**2
        fence = Fence(0.0, 4.0, 0.75 * mass * speed**2, elongation=3.0)
        exact = blow(mass, speed, fence).braked / fence.braking_force
        for phase in (0.05, 0.3, 0.55, 0.8):
            x = -3.0 - 0.5 * side - speed * dt * phase
            block = box(x, 2.0, side, side, velocity=(speed, 0.0, 0.0))
            scene = Scene(GROUND, (block,), rock(), barriers=(fence,), gravity=0.0)
            run = in_motion(scene, dt).run(1.0)
            assert braking_path(run) == pytest.approx(exact, abs=margin(exact, speed, dt))


@at_all_steps
def test_its_net_is_smooth_and_its_blows_are_plastic(dt):
    """Whatever the surfaces are: a block that comes aslant keeps its speed along the face."""
    surface = Surface(50.0, 0.9)
    block = box(-3.0, 4.0, velocity=(8.0, 3.0, 0.0))
    scene = Scene(
        GROUND,
        (block,),
        {"rock": surface, "concrete": surface},
        barriers=(FENCE,),
        interfaces={("rock", "concrete"): surface},
        gravity=0.0,
    )
    sim = in_motion(scene, dt)
    run = sim.run(1.5)
    vx, vy, omega = run.velocities[-1, 0]
    assert vy == pytest.approx(3.0, abs=1e-3) and omega == pytest.approx(0.0, abs=1e-2)
    assert abs(vx) < 0.01
    assert run.absorbed[0] == pytest.approx(0.5 * 2600.0 * 8.0**2, rel=1e-3)


@at_all_steps
@pytest.mark.parametrize("tilt_deg", [20.0, -35.0, 50.0])
def test_an_eccentric_blow_takes_what_stops_the_corner(tilt_deg, dt):
    """A fence that hardly gives way stops the corner of a bar, which turns on."""
    for measured in strike(Lab(dt), [Bar(tilt_deg)]):
        assert measured.computed[0] == pytest.approx(measured.exact[0], rel=0.02, abs=1e-6)


def thrown(seed: int) -> tuple[Scene, float]:
    """Return a scene of a block of random shape and way at a fence, and its energy [J]."""
    rng = np.random.default_rng(seed)
    corners = rough(rng, int(rng.integers(3, 9)), rng.uniform(0.6, 1.5))
    turn, climb = rng.uniform(0.0, 6.28), math.radians(rng.uniform(-40.0, 40.0))
    speed = rng.uniform(5.0, 50.0)
    velocity = (speed * math.cos(climb), speed * math.sin(climb), rng.uniform(-10.0, 10.0))
    block = Block(polygon(corners, (-3.0, 10.0), turn), velocity=velocity)
    surfaces = rock(rng.uniform(0.0, 50.0), rng.uniform(0.0, 0.9))
    energy = Simulation(Scene(None, (block,), surfaces)).energy().kinetic
    fence = Fence(0.0, 20.0, max(energy * rng.uniform(0.05, 1.5), 1e4), elongation=3.0)
    return Scene(GROUND, (block,), surfaces, barriers=(fence,), gravity=0.0), energy


@at_all_steps
def test_the_work_taken_is_the_energy_lost_step_by_step(dt):
    """Of blocks of any shape that hit it anyhow: the work is F times the path, and blows.

    Every blow of the plate takes at most half m_p v^2, v being the greatest speed of a corner.
    """
    for seed in range(20):
        scene, energy = thrown(seed)
        (fence,) = scene.barriers
        (mass,), (inertia,) = masses(scene)
        sim = in_motion(scene, dt)
        target, before, had = sim.loop.arrays.monitors.target, energy, 0.0
        start = sim.barrier_poses[0, 0]
        while sim.time < 1.0 and 1.0 < sim.vertices(0)[:, 1].min() < 17.0:  # not on the ground
            sim.step()
            vx, vy, omega = sim.velocities[0]
            now = 0.5 * mass * (vx**2 + vy**2) + 0.5 * inertia * omega**2
            has = float(target["absorbed"][0])
            assert before - now == pytest.approx(has - had, abs=1e-2 * energy), seed
            before, had = now, has
        braked = fence.braking_force * (sim.barrier_poses[0, 0] - start)
        speed = float(np.hypot(*scene.blocks[0].velocity[:2])) + 15.0
        blows = had - braked
        missed = fence.braking_force * margin(fence.elongation, speed, dt)
        assert -missed < blows < 5.0 * 0.5 * plate_mass(fence) * speed**2 + missed, seed
        assert open_ledger(sim, energy) == pytest.approx(0.0, abs=1e-4 * energy), seed


# several blocks


def shove(row: int, shots: tuple[tuple[float, float], ...], dt: float) -> tuple[Run, float, float]:
    """Return a run of unit squares pushed at `STRONG`, the path by closed form, and their speed.

    A `row` rests against it; `shots` are the others: chainage [m] and speed [m/s].
    """
    blocks = [box(-0.5 - 1.0 * i, 0.5) for i in range(row)]
    blocks += [box(x, 0.5, velocity=(v, 0.0, 0.0)) for x, v in shots]
    sim = in_motion(Scene(GROUND, blocks, rock(0.0), barriers=(STRONG,)), dt)
    start = start_energy(sim)
    run = sim.run(3.0)
    assert open_ledger(sim, start) == pytest.approx(0.0, abs=1e-4 * start)
    exact = together(STRONG, blocks, 2600.0 * sum(v for _, v in shots))
    return run, exact, max(v for _, v in shots)


@at_all_steps
@pytest.mark.parametrize("row", [1, 3, 6])
def test_a_row_that_is_struck_at_its_end_goes_on_together(row, dt):
    run, exact, speed = shove(row, ((-4.0 - row, 10.0),), dt)
    assert braking_path(run) == pytest.approx(exact, abs=margin(exact, speed / (row + 1), dt))
    assert run.absorbed[0] == pytest.approx(1.3e5 / (row + 1), rel=0.03)


@at_all_steps
@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_train_of_blocks_gives_a_fence_all_it_has(gap, dt):
    run, exact, speed = shove(0, tuple((-3.0 - (1.0 + gap) * i, 10.0) for i in range(3)), dt)
    assert braking_path(run) == pytest.approx(exact, abs=margin(exact, speed, dt))
    assert run.absorbed[0] == pytest.approx(3.9e5, rel=2e-3)


@at_all_steps
@pytest.mark.parametrize("ahead", [0.1, 0.5, 3.0, 9.9])
def test_a_fast_block_strikes_one_that_hits_the_fence_in_the_same_step(ahead, dt):
    fast = 20.0
    shots = ((-0.5 - 0.3 * ahead * dt, ahead), (-1.5 - 0.3 * fast * dt, fast))
    run, exact, speed = shove(0, shots, dt)
    assert braking_path(run) == pytest.approx(exact, abs=margin(exact, speed, dt))


@at_all_steps
def test_blocks_side_by_side_are_stopped_as_one(dt):
    blocks = [box(-3.0, 0.5 + 1.01 * i, velocity=(10.0, 0.0, 0.0)) for i in range(3)]
    scene = Scene(GROUND, blocks, rock(0.0), barriers=(STRONG,), gravity=0.0)
    run = in_motion(scene, dt).run(3.0)
    exact = together(STRONG, blocks, 3 * 26e3)
    assert braking_path(run) == pytest.approx(exact, abs=margin(exact, 10.0, dt))


SLOPE = Terrain([(-60.0, 45.0), (0.0, 0.0), (60.0, 0.0)])


def group(seed: int) -> Scene:
    """Return eight polygons that come down a slope of 37 degrees onto a fence at its foot."""
    rng = np.random.default_rng(seed)
    up, out = np.array([-0.8, 0.6]), np.array([0.6, 0.8])
    blocks = []
    for i in range(8):
        corners = rough(rng, int(rng.integers(5, 8)), rng.uniform(0.5, 0.8))
        place = up * (18.0 + 2.0 * (i // 2)) + out * (1.0 + 2.0 * (i % 2))
        outline = polygon(corners, place, rng.uniform(0.0, 6.28))
        blocks.append(Block(outline, velocity=(4.0, -3.0, 0.0)))
    return Scene(SLOPE, blocks, rock(25.0, 0.3), barriers=(Fence(3.0, 4.0, 6e4),))


@cache
def groups(dt: float) -> np.ndarray:
    """Return mean and half of the 95 % interval of what comes of groups, (3, 2).

    Share of blocks that end beyond the fence, path over elongation, and failures; of these the
    half interval is at least 3 / n, by the rule of three.
    """
    found, number = [], 32
    for seed in range(number):
        scene = group(seed)
        run = in_motion(scene, dt).run(8.0)
        (fence,) = scene.barriers
        beyond = (run.poses[-1, :, 0] > fence.end + fence.elongation).mean()
        found.append((beyond, braking_path(run) / fence.elongation, math.isfinite(run.failure(0))))
    values = np.array(found, dtype=float)
    half = 1.96 * values.std(axis=0, ddof=1) / math.sqrt(number)
    half[2] = max(half[2], 3.0 / number)
    return np.stack([values.mean(axis=0), half], axis=1)


@pytest.mark.parametrize("dt", STEPS[1:])
def test_what_comes_of_a_group_does_not_depend_on_the_step(dt):
    (mean, half), (least, half_least) = groups(dt).T, groups(STEPS[0]).T
    assert (np.abs(mean - least) <= 1.6 * np.hypot(half, half_least)).all(), (mean, least)
    assert 0.0 < mean[0] < 0.5 and 0.2 < mean[2] < 0.8


@at_all_steps
def test_the_work_taken_from_a_group_is_the_energy_it_lost(dt):
    """The ledger closes. The fence takes F times its path and what the blows on its plate take.

    A blow takes at most half m_p v^2, with v the speed to which the group could fall; each block
    has two of them at most on average.
    """
    for seed in range(6):
        scene = group(seed)
        (fence,) = scene.barriers
        sim = in_motion(scene, dt)
        had, place = start_energy(sim), sim.barrier_poses[0, 0]
        sim.step(round(6.0 / dt))
        assert open_ledger(sim, had) == pytest.approx(0.0, abs=1e-9 * had), seed
        absorbed = float(sim.loop.arrays.monitors.target["absorbed"][0])
        braked = fence.braking_force * (sim.barrier_poses[0, 0] - place)
        blow = plate_mass(fence) * had / sum(masses(scene)[0])
        assert -1e-9 * braked <= absorbed - braked < 2 * len(scene.blocks) * blow, seed


# what lies against it


@at_all_steps
@pytest.mark.parametrize("slope_deg", [20.0, 40.0])
@pytest.mark.parametrize("share", [0.8, 0.95, 1.05, 2.0, 50.0])
def test_a_row_on_a_slope_moves_it_by_what_its_thrust_exceeds_the_force(share, slope_deg, dt):
    """Less than F moves it not at all; more accelerates it by the difference."""
    lean = Lean(slope_deg, share)
    run = in_motion(lean.scene, dt).run(1.0)
    assert braking_path(run) == pytest.approx(lean.path(1.0), abs=3e-3 + 1.4 * dt)
    assert math.isinf(run.failure(0))


@at_all_steps
@pytest.mark.parametrize("share", [0.8, 1.25, 5.0])
@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_it_fails_under_more_than_its_force_and_holds_less_for_good(share, gap, dt):
    """Nothing creeps: what came to rest spends nothing, and falls asleep."""
    scene = Lean(40.0, share).scene
    if gap:  # each block strikes the one below it first
        up = np.array([-math.cos(math.radians(40.0)), math.sin(math.radians(40.0))])
        spread = [
            Block(block.vertices + up * gap * (i + 1), surface="ice")
            for i, block in enumerate(scene.blocks)
        ]
        scene = Scene(scene.terrain, spread, scene.surfaces, barriers=scene.barriers)
    sim = in_motion(scene, dt)
    (fence,) = scene.barriers
    early = sim.run(3.0)
    if share < 1.0:
        assert math.isfinite(early.failure(0)) and early.poses[-1, :, 0].max() > 2.0
        assert early.absorbed[0] == pytest.approx(fence.capacity, rel=0.05)
        return
    assert early.absorbed[0] < 0.02 * fence.capacity
    late = sim.run(7.0)
    assert math.isinf(late.failure(0))
    assert braking_path(late) == pytest.approx(0.0, abs=1e-4)
    assert (sim.loop.arrays.bodies["status"] == ASLEEP).all()
    thrust = 4 * 2600.0 * GRAVITY * math.tan(math.radians(40.0))
    assert late.thrust[0] == pytest.approx(thrust, rel=0.1)


@at_all_steps
def test_what_slept_against_a_fence_falls_when_it_fails(dt):
    """A block on a steep frictionless ramp leans on a fence at rest until another breaks it."""
    ramp = Terrain([(-40.0, 20.0), (40.0, -20.0)], ["ice"])
    tilt = -math.atan(0.5)
    leaning = box(-0.62, 1.0, 1.0, 1.0, tilt, surface="ice")
    shot = box(-27.0, 19.4, 1.0, 1.0, velocity=(15.0, 0.0, 0.0))  # at the fence after 1.8 s
    surfaces = rock() | {"ice": Surface(0.0)}
    fence = Fence(0.0, 6.0, 5e4, elongation=2.0)
    sim = in_motion(Scene(ramp, (leaning, shot), surfaces, barriers=(fence,)), dt)
    before = sim.run(1.5)
    assert math.isinf(before.failure(0))
    assert before.velocities[-1, 0, 0] == 0.0  # asleep
    after = sim.run(3.0)
    assert math.isfinite(after.failure(0))
    assert after.poses[-1, 0, 0] > 2.0


@at_all_steps
def test_everything_comes_to_rest_and_sleeps(dt):
    """A block that a fence stopped lies on rough ground, and neither moves any more."""
    block = box(-4.0, 0.5, velocity=(10.0, 0.0, 0.0))
    scene = Scene(GROUND, (block,), rock(20.0), barriers=(Fence(0.0, 3.0, 2e5, elongation=3.0),))
    sim = in_motion(scene, dt)
    sim.run(4.0)
    assert (sim.loop.arrays.bodies["status"] == ASLEEP).all()
    assert braking_path(sim.run(2.0)) == 0.0


# over the top


@at_all_steps
def test_what_comes_over_the_top_is_not_braked(dt):
    high = box(-3.0, 5.0, velocity=(20.0, 0.0, 0.0))
    scene = Scene(GROUND, (high,), rock(), barriers=(Fence(0.0, 2.0, CAPACITY),))
    run = in_motion(scene, dt).run(0.4)
    assert run.poses[-1, 0, 0] > 2.0
    assert run.absorbed[0] == 0.0 and braking_path(run) == 0.0


@at_all_steps
def test_it_is_lower_by_what_it_gave_way(dt):
    """So that a second block passes over where a first one moved it, and only there."""
    fence = Fence(0.0, 10.0, CAPACITY, elongation=ELONGATION)
    mass = square_mass()
    for share, passes in ((0.1, False), (0.8, True)):
        first = box(-3.0, 2.0, 1.4, 1.4, velocity=(speed_of(share), 0.0, 0.0))
        second = box(-30.0, 8.0, 1.4, 1.4, velocity=(10.0, 0.0, 0.0))
        scene = Scene(GROUND, (first, second), rock(), barriers=(fence,), gravity=0.0)
        sim = in_motion(scene, dt)
        early = sim.run(2.0)
        top = fence.height * (1.0 - 0.5 * braking_path(early) / fence.elongation)
        computed = sim.loop.arrays.outlines.corner["y"][2, :4].max()
        assert computed == pytest.approx(top, abs=1e-6)
        assert early.outline(0)[:, 1].max() == pytest.approx(top, abs=1e-6)
        assert fence.left_height(braking_path(early)) == pytest.approx(top, abs=1e-6)
        exact = blow(mass, speed_of(share), fence).braked / fence.braking_force
        assert braking_path(early) == pytest.approx(exact, abs=margin(exact, speed_of(share), dt))
        late = sim.run(2.5)
        assert (late.velocities[-1, 1, 0] == pytest.approx(10.0)) == passes


@at_all_steps
def test_its_top_does_not_bear_what_comes_down_on_it(dt):
    """A net is no wall: it takes no more than its capacity and some blows of the plate."""
    fence = Fence(0.0, 3.0, 3e4, elongation=3.0)
    block = Block(ngon(4, 1.0, (0.1, 4.5)), velocity=(0.0, -10.0, 0.0))
    run = in_motion(Scene(GROUND, (block,), rock(), barriers=(fence,)), dt).run(0.4)
    assert run.absorbed[0] <= fence.capacity + 5.0 * 0.5 * plate_mass(fence) * 12.0**2


# what a fence is


@at_all_steps
def test_a_fence_that_moves_on_by_itself_fails_like_any_other(dt):
    """A corner throws a light plate ahead, whose elongation is spent with nothing against it."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        corners = rough(rng, int(rng.integers(3, 7)), 1.0)
        speed = (rng.uniform(5.0, 20.0), rng.uniform(0.0, 10.0), rng.uniform(-10.0, 10.0))
        block = Block(polygon(corners, (-3.0, 3.0), rng.uniform(0.0, 6.28)), velocity=speed)
        fence = Fence(0.0, 4.0, 1e4, elongation=2.0)
        sim = in_motion(Scene(GROUND, (block,), rock(), barriers=(fence,), gravity=0.0), dt)
        run = sim.run(1.0)
        spent = sim.loop.arrays.bodies["status"][-1] == RETIRED
        assert spent == math.isfinite(run.failure(0)), seed
        assert spent == (braking_path(run) == pytest.approx(fence.elongation, rel=1e-12)), seed


def test_without_an_elongation_it_has_that_of_the_next_class():
    for capacity, elongation in ((5e3, 2.0), (1e4, 2.0), (1.1e4, 2.5), (1e5, 4.5), (1e9, 9.0)):
        with pytest.warns(DoubtfulInput) if capacity < 1e4 else nullcontext():
            fence = Fence(0.0, 3.0, capacity)
        assert fence.elongation == elongation
        assert fence.braking_force == capacity / elongation
    assert Fence(0.0, 3.0, 1e5, elongation=2.0).braking_force == 5e4


def test_classes():
    fence = Fence(5.0, 4.0, energy_class=1000)
    assert fence.elongation == 4.5 and fence.capacity is None and math.isinf(fence.braking_force)
    assert fence.for_width(2.0) == Fence(5.0, 4.0, 5e5, elongation=4.5)
    assert fence.for_width(25.0).capacity == 1e5
    given = Fence(5.0, 4.0, 2e5)
    assert given.for_width(3.0) is given
    lowest, heights, elongations = np.array(list(FENCE_CLASSES.values())).T
    assert (np.diff(lowest) >= 0.0).all() and (lowest < heights).all()
    assert (np.diff(heights) >= 0.0).all() and (np.diff(elongations) > 0.0).all()
    forces = np.array([1e2 * energy / c.elongation for energy, c in FENCE_CLASSES.items()])
    assert (np.diff(forces) > 0.0).all()


@pytest.mark.parametrize(
    ("fields", "mend"),
    [
        ({}, "give exactly one of them"),
        ({"capacity": 1e5, "energy_class": 500}, "give exactly one of them"),
        ({"energy_class": 700}, "give one of 100, 250"),
        ({"energy_class": 100}, "at most 2.5 m, or a higher class"),
        ({"energy_class": 500, "elongation": 1.0}, "leave it out"),
        ({"capacity": 500.0}, "at least 1000"),
        ({"capacity": math.nan}, "capacity"),
        ({"capacity": 1e5, "elongation": 0.0}, "at least 0.05"),
        ({"capacity": 1e5, "elongation": math.inf}, "elongation"),
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


@at_all_steps
@pytest.mark.parametrize(("radius", "speed"), [(0.15, 20.0), (0.3, 30.0), (0.5, 30.0)])
def test_no_turning_block_gets_through(radius, speed, dt):
    """A corner of a block that rolls may turn by half a radian in a step, deep into the net."""
    passed = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        corners = rough(rng, int(rng.integers(4, 9)), radius)
        turning = -speed / radius * rng.uniform(0.7, 1.1)
        start = -radius - 0.1 - rng.uniform(0.0, 0.03 * speed), rng.uniform(1.0, 2.5)
        velocity = speed, rng.uniform(-0.1, 0.1) * speed, turning
        block = Block(polygon(corners, start, rng.uniform(0.0, 6.3)), velocity=velocity)
        fence = Fence(0.0, 5.0, 6.5e6, elongation=7.5)
        scene = Scene(GROUND, (block,), rock(35.0, 0.3), barriers=(fence,))
        step = site_step(dt, np.array([masses(scene)[0][0] / 2600.0]), GRAVITY)
        sim = Simulation(scene, Settings(dt=step))
        run = sim.run(1.0, every=0.02)
        passed += sim.poses[0, 0] > run.barrier_poses[-1, 0, 0]
    assert passed <= 1
