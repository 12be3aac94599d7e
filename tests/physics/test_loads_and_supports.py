"""Loads, supports, joints, ground motion and static mode against statics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from physics.helpers import box, rock
from rigdda import (
    BadInput,
    Block,
    BodyForce,
    Bolt,
    FixedPoint,
    LineLoad,
    PointLoad,
    Run,
    Scene,
    Settings,
    Simulation,
    Site,
    Surface,
    Terrain,
)

FLAT = Terrain([(-50.0, 0.0), (50.0, 0.0)])
WEIGHT = 2600.0 * 9.81
"""Weight of a square of 1 m2 [N]."""


def square(**how) -> Block:
    return box(0.0, 0.5, **how)


def test_a_bolt_holds_whichever_of_its_ends_comes_first():
    """On a fixed block, and between two that touch."""
    held = Block([(-0.5, 3.0), (0.5, 3.0), (0.5, 4.0), (-0.5, 4.0)], fixed=True)
    for ends in ((0, (0.0, 3.0), 1, (0.0, 1.0)), (1, (0.0, 1.0), 0, (0.0, 3.0))):
        scene = Scene(None, (held, square()), rock(), supports=(Bolt(*ends, 1e7),))
        sim = Simulation(scene)
        sim.run(1.0)
        assert abs(sim.poses[1, 1] - 0.5) < 2.1 * WEIGHT / 1e7
        up = sim.supports()[0, 1] * (1.0 if ends[0] == 1 else -1.0)
        assert 0.0 <= up < 2.1 * WEIGHT
    ways = []
    for first, second in ((0, 1), (1, 0)):
        points = ((0.3, 0.2), (-0.3, 1.8))
        bolt = Bolt(first, points[first], second, points[second], 3e8, prestress=1e5)
        blocks = (square(), box(0.0, 1.5, velocity=(1.0, 0.0, 0.0)))
        sim = Simulation(Scene(FLAT, blocks, rock(30.0), supports=(bolt,)))
        sim.step(40)
        ways.append((sim.poses.copy(), sim.supports()[0] * (1 if first == 0 else -1)))
    np.testing.assert_allclose(ways[0][0], ways[1][0], atol=1e-9)
    np.testing.assert_allclose(ways[0][1], ways[1][1], rtol=1e-6)


LOADS = {
    "point": PointLoad(0, (0.0, 0.5), (3.0e4, 1.0e4)),
    "line": LineLoad(0, (-0.5, 0.2), (0.5, 0.8), (3.0e4 / math.hypot(1, 0.6), 0.0)),
    "body": BodyForce(0, (3.0e4, 0.0)),
}


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_a_load_through_the_centroid_accelerates(load):
    sim = Simulation(Scene(None, (square(),), loads=(load,), gravity=0.0))
    sim.step(200)
    vx, vy, omega = sim.velocities[0]
    assert vx == pytest.approx(3.0e4 / 2600.0)
    assert vy == pytest.approx(1.0e4 / 2600.0 if load is LOADS["point"] else 0.0)
    assert abs(omega) < 1e-12
    energy = sim.energy()
    assert energy.external == pytest.approx(energy.kinetic, rel=1e-12)


@pytest.mark.parametrize(
    ("point", "force"), [((0.5, 0.5), (1e4, 0.0)), ((0.0, 0.0), (0.0, -1e4))], ids=["cos", "sin"]
)
def test_a_dead_load_swings_its_block_with_the_period_of_small_swings(point, force):
    """As on a thread: from the centroid towards the point is the way of the load."""
    load, start = PointLoad(0, point, force), 0.01
    sim = Simulation(Scene(None, (square(velocity=(0.0, 0.0, start)),), loads=(load,), gravity=0.0))
    rate = math.sqrt(1e4 * 0.5 / (2600.0 / 6.0))
    sim.step(round(0.5 * math.pi / rate / sim.settings.dt))
    assert sim.poses[0, 2] == pytest.approx(start / rate, rel=0.01)
    assert abs(sim.velocities[0, 2]) < 0.02 * start


def test_a_line_load_turns_its_block():
    load = LineLoad(0, (0.0, 0.0), (0.5, 0.0), (0.0, 2e4))
    sim = Simulation(Scene(None, (box(0.0, 0.0),), loads=(load,), gravity=0.0))
    sim.step()
    moment = 2e4 * 0.5 * 0.25
    assert sim.velocities[0, 2] == pytest.approx(moment / (2600.0 / 6.0) * sim.settings.dt)


def test_a_dead_load_turns_with_its_point():
    """A physical pendulum in the field of a load: energy is kept."""
    load = PointLoad(0, (0.5, 0.5), (0.0, -1e4))
    sim = Simulation(Scene(None, (square(),), loads=(load,), gravity=0.0))
    start = sum(sim.energy()[:3])
    for _ in range(400):
        sim.step()
        energy = sim.energy()
        assert sum(energy[:3]) - start == pytest.approx(energy.external, abs=1e-6)


def test_a_pin_carries_the_weight_and_lets_turn():
    sim = Simulation(Scene(None, (square(),), supports=(FixedPoint(0, (0.5, 0.5)),)))
    sim.step()
    # angular acceleration m g r / (I + m r^2), I = m / 6, r = 1/2
    assert sim.velocities[0, 2] == pytest.approx(9.81 * 0.5 / (1 / 6 + 0.25) * 5e-3, rel=1e-3)
    force = sim.supports()[0, 1]
    assert force == pytest.approx(WEIGHT * (1 - 0.25 / (1 / 6 + 0.25)), rel=1e-2)
    start = sum(sim.energy()[:3])
    for _ in range(400):
        sim.step()
        pinned = sim.poses[0, :2] + 0.5 * np.array(
            [math.cos(sim.poses[0, 2]), math.sin(sim.poses[0, 2])]
        )
        assert np.hypot(*(pinned - (0.5, 0.5))) < 1e-3
    assert sum(sim.energy()[:3]) == pytest.approx(start, abs=0.01 * WEIGHT)


def test_a_bolt_hangs_a_block():
    bolt = Bolt(0, (0.0, 1.0), None, (0.0, 3.0), 1e6)
    sim = Simulation(Scene(None, (square(),), supports=(bolt,), damping=3.0))
    sim.step(4000)
    assert sim.poses[0, 1] == pytest.approx(0.5 - WEIGHT / 1e6, abs=1e-6)
    assert sim.supports()[0] == pytest.approx([0.0, WEIGHT], abs=1.0)
    assert sim.energy().elastic == pytest.approx(0.5 * WEIGHT**2 / 1e6, rel=1e-3)


@pytest.mark.parametrize("speed", [0.01, 10.0])  # as a whole, and relaxed in substeps
def test_bolts_between_blocks_give_no_energy_and_swing_as_they_should(speed):
    """Three blocks in a row, the outer ones pulled by bolts: they swing with w^2 = k/m."""
    stiffness = 1e5
    blocks = (
        box(-3.0, 0.0, velocity=(speed - 0.1, 0.0, 0.0)),
        box(0.0, 0.0, velocity=(speed, 0.0, 0.0)),
        box(3.0, 0.0, velocity=(speed + 0.1, 0.0, 0.0)),
    )
    bolts = (
        Bolt(0, (-3.0, 0.0), 1, (0.0, 0.0), stiffness),
        Bolt(1, (0.0, 0.0), 2, (3.0, 0.0), stiffness),
    )
    sim = Simulation(Scene(None, blocks, rock(), supports=bolts, gravity=0.0))
    period, start = 2.0 * math.pi * math.sqrt(2600.0 / stiffness), sum(sim.energy()[:3])
    apart = []
    for _ in range(round(3.0 * period / sim.settings.dt)):
        sim.step()
        apart.append(sim.poses[2, 0] - sim.poses[1, 0] - 3.0)
    swing = 0.1 / math.sqrt(stiffness / 2600.0)
    assert max(apart) == pytest.approx(swing, rel=0.05)
    assert min(apart) == pytest.approx(-swing, rel=0.15)
    assert sum(sim.energy()[:3]) <= start + 1e-3 * 2600.0 * 0.1**2


def test_forces_of_supports_are_in_the_order_of_the_scene():
    blocks = (box(0.0, 0.5), box(3.0, 0.5, density=5200.0))
    bolts = (Bolt(1, (3.0, 1.0), None, (3.0, 3.0), 1e6), Bolt(0, (0.0, 1.0), None, (0.0, 3.0), 1e6))
    sim = Simulation(Scene(None, blocks, supports=bolts, damping=3.0))
    sim.step(4000)
    assert sim.supports()[:, 1] == pytest.approx([2.0 * WEIGHT, WEIGHT], rel=1e-4)


def test_a_bolt_yields():
    bolt = Bolt(0, (0.0, 1.0), None, (0.0, 3.0), 1e7, yield_force=0.5 * WEIGHT)
    sim = Simulation(Scene(None, (square(),), supports=(bolt,)))
    sim.step(10)
    before = sim.velocities[0, 1]
    sim.step(100)
    assert (sim.velocities[0, 1] - before) / 0.5 == pytest.approx(-0.5 * 9.81, rel=1e-3)


def test_a_prestressed_bolt_between_blocks_holds_them_together():
    lower, upper = box(0.0, 0.5), box(0.0, 1.5)
    pull = PointLoad(1, (0.0, 1.5), (0.0, 1.8 * WEIGHT))
    for prestress, stands in ((2.0 * WEIGHT, True), (0.0, False)):
        bolt = Bolt(0, (0.0, 0.2), 1, (0.0, 1.8), 1e4, prestress)
        scene = Scene(FLAT, (lower, upper), rock(30.0), loads=(pull,), supports=(bolt,))
        sim = Simulation(scene)
        sim.step(60)
        assert (sim.poses[1, 1] < 1.501) == stands


@pytest.mark.parametrize(
    ("load", "stands"), [(0.97, True), (1.03, False)], ids=["below strength", "above strength"]
)
@pytest.mark.parametrize("way", ["tension", "shear"])
def test_a_joint_breaks_at_its_strength(way, load, stands):
    surface = {"rock": Surface(30.0, cohesion=4e4, tension=3e4)}
    if way == "tension":
        force = (0.0, WEIGHT + load * 3e4)
    else:
        force = (load * (4e4 + WEIGHT * math.tan(math.radians(30.0))), 0.0)
    block = box(0.0, 0.5, 2.0, 1.0) if way == "shear" else square()
    if way == "shear":
        surface = {"rock": Surface(30.0, cohesion=2e4, tension=3e4)}
        force = (load * (4e4 + 2 * WEIGHT * math.tan(math.radians(30.0))), 0.0)
    # at the height of the base, so that the block is not turned
    point = (0.0, 0.0) if way == "shear" else (0.0, 0.5)
    scene = Scene(FLAT, (block,), surface, loads=(PointLoad(0, point, force),))
    sim = Simulation(scene)
    start = sim.poses[0, :2]
    sim.step(200)
    assert (np.hypot(*(sim.poses[0, :2] - start)) < 1e-4) == stands


def test_a_broken_joint_does_not_heal():
    surface = {"rock": Surface(10.0, cohesion=1e5, tension=1e5)}
    block = square(velocity=(0.0, 8.0, 0.0))
    sim = Simulation(Scene(FLAT, (block,), surface, loads=(PointLoad(0, (0, 0), (8e3, 0.0)),)))
    sim.step(600)
    assert sim.poses[0, 1] < 0.51  # back on the ground
    assert sim.velocities[0, 0] > 1.0  # and slides


def test_static_mode_settles_at_once_and_stays():
    blocks = [box(1e-4 * i, 0.5 + i) for i in range(5)]
    sim = Simulation(Scene(FLAT, blocks, rock(30.0)), Settings(mode="static"))
    sim.step(50)
    forces = sim.contacts()
    base = forces[forces["block_b"] == -1]
    assert base["normal_force"].sum() == pytest.approx(5 * WEIGHT, rel=1e-6)
    assert np.abs(sim.velocities).max() < 1e-6


@pytest.mark.parametrize("solver", ["pcg", "block-pcg", "sor", "direct"])
def test_every_solver_carries_a_stack(solver):
    blocks = [box(1e-4 * i, 0.5 + i) for i in range(6)]
    sim = Simulation(Scene(FLAT, blocks, rock(30.0)), Settings(solver=solver))
    sim.step(200)
    assert np.abs(sim.velocities).max() < 1e-4


def test_one_system_for_all_gives_what_islands_give():
    blocks = [box(3.0 * i, 0.5 + 0.2 * i) for i in range(3)]
    ends = []
    for islands in (True, False):
        settings = Settings(islands=islands, sleeping=False)
        sim = Simulation(Scene(FLAT, blocks, rock(30.0)), settings)
        sim.step(100)
        ends.append(sim.poses)
    np.testing.assert_allclose(ends[0], ends[1], atol=3e-4)  # falling blocks are relaxed


def test_plain_contact_sinks_by_its_spring():
    settings = Settings(penetration=1e-3)
    scene = Scene(FLAT, (square(),), {"rock": Surface(30.0, restitution=None)}, damping=20.0)
    sim = Simulation(scene, settings)
    sim.step(2000)
    # two corners share the weight, each of stiffness weight / penetration
    assert 0.5 - sim.poses[0, 1] == pytest.approx(0.5e-3, rel=1e-3)


def test_a_scene_with_all_of_it_survives_a_file(tmp_path):
    scene = Scene(
        FLAT,
        (square(), box(3.0, 0.5)),
        {"rock": Surface(30.0, 1e3, 2e3, None)},
        loads=(*LOADS.values(),),
        supports=(FixedPoint(1, (3.0, 0.5)), Bolt(0, (0, 0), 1, (3, 0), 1e5, 10.0, 1e4)),
        gravity=(0.1, -9.8),
        base_motion=[(0.0, 0.0, 0.0), (0.1, 1.0, 0.0), (0.2, 0.0, 0.0)],
    )
    run = Simulation(scene).run(0.1)
    run.save(tmp_path / "run.npz")
    again = Simulation(Run.load(tmp_path / "run.npz").scene).run(0.1)
    assert np.array_equal(run.poses, again.poses)


BAD = {
    "block": (lambda: Scene(FLAT, (square(),), loads=(PointLoad(1, (0, 0), (1, 0)),)), "loads[0]"),
    "support": (
        lambda: Scene(FLAT, (square(),), supports=(Bolt(0, (0, 0), 3, (1, 1), 1e5),)),
        "supports[0]",
    ),
    "stiffness": (lambda: Bolt(0, (0, 0), None, (1, 1), 0.0), "bolt: stiffness"),
    "no length": (lambda: Bolt(0, (0, 0), None, (0, 0), 1e5), "bolt: point_b"),
    "yield": (lambda: Bolt(0, (0, 0), None, (1, 0), 1e5, 10.0, 5.0), "bolt: yield_force"),
    "NaN": (lambda: PointLoad(0, (0, math.nan), (1, 0)), "point load: point"),
    "motion": (lambda: Scene(FLAT, (square(),), base_motion=[(1, 0, 0), (0, 0, 0)]), "base_motion"),
    "shape": (lambda: Scene(FLAT, (square(),), base_motion=[1.0, 2.0]), "base_motion"),
    "mode": (lambda: Settings(mode="quick"), "mode"),
    "solver": (lambda: Settings(solver="magic"), "solver"),
    "cohesion": (lambda: Surface(30.0, cohesion=-1.0), "cohesion"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case):
    wrong, field = BAD[case]
    with pytest.raises(BadInput) as caught:
        wrong()
    assert caught.value.field.startswith(field)


def test_a_bolt_that_does_nothing_costs_no_solution_of_a_moving_mass() -> None:
    """Islands with supports are relaxed while they move, like all others."""
    scene = Site.load("quick").realise((), 1, "mass")
    x, y = scene.blocks[0].vertices.mean(axis=0)
    solves = []
    for supports in ((), (Bolt(0, (x, y), None, (x, y + 200.0), 1e-3),)):
        sim = Simulation(replace(scene, supports=supports), Settings(dt=1e-2))
        sim.step(300)
        solves.append(sim.diagnostics.solves)
    assert solves[1] <= solves[0] + 50
