"""Input that is sound but not of the usual type gives what the usual one gives."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

from rigdda import (
    BadInput,
    Block,
    Bolt,
    Fence,
    FixedPoint,
    PointLoad,
    Run,
    Scene,
    Settings,
    Simulation,
    Site,
    Surface,
    Terrain,
    Wall,
    load_layout,
    release,
    save_layout,
    simulate_many,
)

QUICK = Site.load("quick")
BARRIERS = (Wall(20.0, 0.6, 0.5),)


def walk(items):
    """Return what can be walked through once."""
    return (item for item in items)


def test_what_can_be_walked_through_once_is_kept():
    assert QUICK.capital(walk(BARRIERS)) == QUICK.capital(BARRIERS) > 0.0
    assert release(QUICK, walk(BARRIERS), 1)[1] == release(QUICK, BARRIERS, 1)[1]
    scene = Scene(Terrain(FLAT), [box(0.0, 0.5, velocity=(9.0, 0.0, 0.0))], rock())
    runs = simulate_many(walk([scene, scene]), None, 0.5, stations=walk([1.0]))
    assert [len(run.crossings(0)) for run in runs] == [1, 1]


WHOLE = {
    "gravity": lambda: Scene(Terrain(FLAT), [box(0.0, 0.5)], rock(), gravity=10),
    "gravity of an array": lambda: Scene(
        Terrain(FLAT), [box(0.0, 0.5)], rock(), gravity=np.array([0, -9])
    ),
    "damping": lambda: Scene(Terrain(FLAT), [box(0.0, 0.5)], rock(), damping=np.float32(1)),
    "strength": lambda: Scene(
        Terrain(FLAT), [box(0.0, 0.5)], {"rock": Surface(np.float32(30), 1000, 500, 1)}
    ),
}
SWITCHES = {
    "dt": np.float32(5e-3), "penetration": 1, "sweep_tolerance": 1, "relaxation": 1,
    "open_close_iterations": np.int32(12), "islands": np.bool_(True),
}  # fmt: skip


def test_numbers_of_any_type_leave_the_kernels_types_as_they_are():
    usual = numba.typeof(Simulation(Scene(Terrain(FLAT), [box(0.0, 0.5)], rock())).loop.arrays)
    for name, build in WHOLE.items():
        assert numba.typeof(Simulation(build()).loop.arrays) == usual, name
    scene = Scene(Terrain(FLAT), [box(0.0, 0.5)], rock())
    for name, value in SWITCHES.items():
        found = Simulation(scene, Settings(**{name: value})).loop.arrays
        assert numba.typeof(found) == usual, name


def test_numbers_of_numpy_can_be_saved(tmp_path):
    one, zero = np.float64(1.0), np.int64(0)
    scene = Scene(
        Terrain(FLAT),
        [box(0.0, 0.5), Block([(3, 0), (4, 0), (4, 1)], surface=np.str_("rock"))],
        {"rock": Surface(np.float64(30.0))},
        barriers=[Wall(np.float64(9.0), one), Fence(12, np.float32(2.0), np.float64(1e6))],
        loads=[PointLoad(zero, (0.0, 0.5), (one, 0.0))],
        supports=[FixedPoint(zero, (0.0, 0.5)), Bolt(1, (3.5, 0.2), None, (5, 5), np.float32(1e6))],
        gravity=np.float64(9.81),
        damping=np.float64(0.1),
    )
    run = Simulation(scene).run(0.05)
    run.save(tmp_path / "run.npz")
    np.testing.assert_array_equal(Run.load(tmp_path / "run.npz").poses, run.poses)
    save_layout(scene.barriers, tmp_path / "layout.toml")
    assert load_layout(tmp_path / "layout.toml") == scene.barriers


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"poses": np.zeros((2, 2, 3))}, "poses"),
        ({"poses": np.full((2, 1, 3), np.nan)}, "poses"),
        ({"times": np.array([1.0, 0.0])}, "times"),
        ({"times": np.zeros(0)}, "poses"),
        ({"events": np.zeros(3)}, "events"),
    ],
)
def test_a_run_whose_arrays_do_not_fit_is_refused(change, field, tmp_path):
    run = Simulation(Scene(Terrain(FLAT), [box(0.0, 0.5)], rock())).run(0.05)
    replace(run, **change).save(tmp_path / "run.npz")
    with pytest.raises(BadInput, match=field):
        Run.load(tmp_path / "run.npz")


@pytest.mark.parametrize(
    ("chain", "inside", "outside"),
    [
        ([(-9, 0), (9, 0)], (0, -1), (0, 1)),
        ([(9, 0), (-9, 0)], (0, 1), (0, -1)),
        ([(-9, 5), (-1, 5), (-1, 0), (1, 0), (1, 5), (9, 5)], (-3, 3), (0, 3)),
        ([(-9, 5), (0, 5), (0, 3), (-3, 3), (-3, 0), (9, 0)], (-1, 4), (-1, 2)),
        ([(0, 0), (9, 0), (9, 9), (0, 9), (0, 0)], None, (4, 4)),
        ([(0, 0), (0, 9), (9, 9), (9, 0), (0, 0)], (4, 4), (-1, 4)),
    ],
)
def test_the_ground_is_on_the_right_of_its_chain(chain, inside, outside):
    square = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
    ground = Terrain(chain)
    Scene(ground, [Block(square + outside)])
    if inside is not None:
        with pytest.raises(BadInput, match="overlaps the ground"):
            Scene(ground, [Block(square + inside)])
