"""Releases in batches, and releases that end early, give what they give alone and in full."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import rigdda
from rigdda import (
    BadInput,
    Block,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Scene,
    Settings,
    Simulation,
    Surface,
    Terrain,
    sites,
)
from rigdda.measurement import measure, stations, watch
from rigdda.model.outcome import Outcome
from rigdda.releases import EVERY, Batch

SITE = sites.load("bench")
EVENTS = ("block", "small", "group")
LAYOUTS: dict[str, Layout] = {
    "nothing": (),
    "fences, one fails": (Fence(12.5, 3.0, capacity=3e4), Fence(31.0, 4.0, capacity=3e5)),
    "wall that moves": (GravityWall(31.0, 1.5, thickness=0.6),),
    "ditch": (Ditch(31.0, 1.2, 3.0),),
    "embankment": (Embankment(31.0, 1.5),),
}


def jobs(seeds: int) -> list[tuple[rigdda.Site, Layout, int, str]]:
    return [(SITE, lay, s, e) for s in range(seeds) for e in EVENTS for lay in LAYOUTS.values()]


@pytest.mark.parametrize("threads", [1, 3])
def test_batch_equals_single(threads):
    wanted = jobs(3)
    found = rigdda.release_many(wanted, threads)
    assert found == [rigdda.release(*job)[1] for job in wanted]
    states = [b.state for outcome in found for b in outcome.barriers]
    assert {"failed", "stands"} < set(states)


def test_friction_of_a_release():
    """Where friction scatters from release to release it is written anew each time."""
    site = rigdda.Site.parse(
        (sites.text("bench") + "\n[scatter]\nfriction_deg = 3.0\n"), "scattered"
    )
    layouts = ((), (Embankment(31.0, 2.0),))  # whose resistance depends on it
    wanted = [(site, lay, seed, e) for lay in layouts for e in EVENTS for seed in range(6)]
    for found, job in zip(rigdda.release_many(wanted, 1), wanted, strict=True):
        assert found == rigdda.release(*job)[1], job


def test_what_an_embankment_bears_is_that_of_the_friction_of_its_release():
    site = rigdda.Site.parse(
        (sites.text("bench") + "\n[scatter]\nfriction_deg = 3.0\n"), "scattered"
    )
    batch = Batch(site, (Embankment(31.0, 2.0),))
    limits = []
    for seed in range(6):
        sim = batch.simulation(batch.scene(site.draw(seed, "block")))
        limits.append(float(sim.loop.arrays.monitors.target["limit"][0]))
        assert limits[-1] == pytest.approx(sim.scene.resistance(0)), seed
    assert max(limits) > 1.1 * min(limits)


def test_what_fails_is_told():
    wanted = [(SITE, (), 0, "block"), (SITE, (), 1, "no such"), (SITE, (), 2, "nor this")]
    with pytest.raises(BadInput, match="no such"):
        rigdda.release_many(wanted)
    with pytest.raises(BadInput, match=r"jobs\[1\]"):
        rigdda.release_many([wanted[0], wanted[0][:3]])
    with pytest.raises(BadInput, match="threads = 0"):
        rigdda.release_many(wanted[:1], threads=0)


def full(layout: Layout, seed: int, event: str) -> Outcome:
    """Return the outcome of a release that lasts as long as the site says."""
    drawn = SITE.draw(seed, event)
    scene = SITE.scene(drawn, SITE.built(layout, drawn.width))
    lines, duration = stations(SITE, scene.barriers), SITE.motion.duration
    run = Simulation(scene, SITE.settings(scene), lines, watch(SITE)).run(duration, EVERY)
    return measure(SITE, run, drawn.event, drawn.width)


@pytest.mark.parametrize("name", LAYOUTS)
def test_early_end_changes_no_outcome(name):
    """Only where blocks that left the road came to in the end is not followed."""
    layout = LAYOUTS[name]
    for event in EVENTS:
        for seed in range(4):
            early, late = rigdda.release(SITE, layout, seed, event)[1], full(layout, seed, event)
            reach = late.reach[0], early.reach[1]
            assert early == dataclasses.replace(late, reach=reach)
            assert early.reach[1] == late.reach[1] or early.reach[1] > SITE.road.end


def test_a_release_ends_when_nothing_moves():
    run, _ = rigdda.release(SITE, (), 0, "block")
    assert run.times[-1] < SITE.motion.duration
    assert (np.diff(run.times) > 0.0).all()
    assert len(run.times) == len(run.poses) == len(run.barrier_poses)


@pytest.mark.parametrize("stop", [1, 7, 50])
def test_flight_may_be_interrupted(stop):
    """A block that falls, bounces and passes a wall: the same however many steps a call takes."""
    ground = Terrain([(-20.0, 10.0), (0.0, 10.0), (5.0, 2.0), (30.0, 0.0), (60.0, 0.0)])
    block = Block([(-1.0, 11.0), (0.2, 11.1), (0.0, 12.0), (-0.9, 11.8)], velocity=(4.0, 2.0, 3.0))
    surfaces = {"rock": Surface(30.0, restitution=0.4)}
    scene = Scene(ground, (block,), surfaces, (rigdda.Wall(20.0, 1.0),), damping=0.2)
    whole, parts = (Simulation(scene, Settings(dt=4e-3), (10.0,)) for _ in range(2))
    whole.step(700)
    for _ in range(700 // stop):
        parts.step(stop)
    np.testing.assert_array_equal(whole.poses, parts.poses)
    np.testing.assert_array_equal(whole.velocities, parts.velocities)
    np.testing.assert_array_equal(whole.vertices(0), parts.vertices(0))
    assert whole.energy() == parts.energy()
