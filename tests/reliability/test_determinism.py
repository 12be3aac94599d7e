"""The same input gives the same numbers, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

from rigdda import Run, Scene, Settings, Simulation, Site, Terrain, Wall, simulate_many
from rigdda.model.scene import scene_to_json

SITE = Site.load("quick")
LAYOUT = (Wall(0.5 * (SITE.barrier_zone.start + SITE.barrier_zone.end), 1.5),)
DURATION = 3.0


def scene(seed: int = 0) -> Scene:
    return SITE.realise(LAYOUT, seed, "mass")


def play(seed: int = 0) -> Run:
    one = scene(seed)
    return Simulation(one, SITE.settings(one), (30.0,), (0.0, 1e3)).run(DURATION)


def same(one: Run, other: Run) -> bool:
    """Return whether two runs are equal to the last bit."""
    names = ("times", "poses", "velocities", "events", "absorbed", "watch_energy", "extent")
    return scene_to_json(one.scene) == scene_to_json(other.scene) and all(
        getattr(one, name).dtype == getattr(other, name).dtype
        and np.array_equal(getattr(one, name), getattr(other, name))
        for name in names
    )


@pytest.fixture(scope="module")
def run() -> Run:
    return play()


def test_twice(run):
    assert same(run, play())


def test_seeds_differ(run):
    assert not same(run, play(1))


def test_many_at_once(run):
    scenes = [scene(seed) for seed in (0, 1, 2, 0)]
    runs = simulate_many(scenes, SITE.settings(scenes[0]), DURATION, 0.05, (30.0,), (0.0, 1e3))
    for seed, many in zip((0, 1, 2, 0), runs, strict=True):
        assert same(many, run if seed == 0 else play(seed))


def test_steps_in_pieces():
    whole, pieces = (Simulation(scene(), SITE.settings(scene())) for _ in range(2))
    whole.step(400)
    for n in (1, 0, 7, 92, 299, 1):
        pieces.step(n)
    assert whole.time == pieces.time
    assert np.array_equal(whole.poses, pieces.poses)
    assert np.array_equal(whole.velocities, pieces.velocities)
    assert whole.energy() == pieces.energy()


def test_save_and_load(run, tmp_path):
    run.save(tmp_path / "run.npz")
    assert same(Run.load(tmp_path / "run.npz"), run)


def test_saved_scene_runs_the_same(run, tmp_path):
    run.save(tmp_path / "run.npz")
    loaded = Run.load(tmp_path / "run.npz").scene
    again = Simulation(loaded, SITE.settings(loaded), (30.0,), (0.0, 1e3)).run(DURATION)
    assert same(again, run)


def test_sleeping_block_wakes_when_hit():
    blocks = (box(0.0, 0.5), box(-30.0, 0.5, velocity=(15.0, 0.0, 0.0)))
    sim = Simulation(Scene(Terrain(FLAT), blocks, rock(10.0)), Settings())
    sim.step(200)
    assert (sim.velocities[0] == 0.0).all()  # asleep
    resting = sim.poses[0]
    sim.step(10)
    assert (sim.poses[0] == resting).all()
    sim.step(1000)
    assert sim.poses[0, 0] > resting[0] + 0.5
    assert sim.poses[0, 0] - sim.poses[1, 0] > 0.999
