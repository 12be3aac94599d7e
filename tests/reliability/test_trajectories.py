"""Trajectories: closed forms, outcomes, thinning, crossings, order and bad input."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
import shapely

import rigdda
from rigdda import BadInput, Ditch, Embankment, Fence, GravityWall, Layout, Wall, sites
from rigdda.dynamics import history
from rigdda.model.settings import EARTH
from rigdda.passages import passages
from rigdda.trajectory import POINTS, Place, PointKind, Trajectories

BENCH = sites.load("bench")
ROUGH = msgspec.structs.replace(
    BENCH,
    surfaces={n: msgspec.structs.replace(s, roughness=0.1) for n, s in BENCH.surfaces.items()},
)
LAYOUTS: dict[str, Layout] = {
    "nothing": (),
    "ditch and wall": (Ditch(25.0, 0.8, 2.5), Wall(31.0, 0.8)),
    "fences, one fails": (Fence(25.0, 2.0, capacity=2e4), Fence(31.0, 2.0, energy_class=100)),
    "embankment that is pushed away": (Embankment(31.0, 0.6, width=0.5, density=300.0),),
    "gravity wall": (GravityWall(31.0, 1.5),),
}


@pytest.fixture(scope="module")
def steps() -> Trajectories:
    """Return trajectories with the states after all steps."""
    return rigdda.trajectories(BENCH, (), "block", range(12), tolerance=0.0)


@pytest.fixture(scope="module")
def few() -> Trajectories:
    return rigdda.trajectories(BENCH, (), "block", range(12), tolerance=0.1)


def same(one: Trajectories, other: Trajectories) -> bool:
    """Return whether trajectories are bit-identical."""
    arrays = ("event", "release", "mass", "inertia", "place", "reached", "start", *POINTS)
    equal = all(np.array_equal(getattr(one, n), getattr(other, n)) for n in arrays)
    return equal and one.outcomes == other.outcomes and one.seed == other.seed


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("site", [BENCH, ROUGH], ids=["bench", "rough"])
def test_outcomes_are_those_of_releases(site, name):
    seeds = range(10 if site is BENCH else 3)
    found = rigdda.trajectories(site, LAYOUTS[name], "block", seeds)
    wanted = [rigdda.release_outcome(site, LAYOUTS[name], seed, "block") for seed in seeds]
    assert list(found.outcomes) == wanted
    for i in range(len(LAYOUTS[name])):
        loads = found.barrier(i)
        assert loads.hits.tolist() == [o.barriers[i].hits for o in wanted]
        assert loads.max_energy.tolist() == [o.barriers[i].max_energy for o in wanted]
        assert loads.failed.tolist() == [o.barriers[i].failed for o in wanted]
        assert np.isnan(loads.max_height).tolist() == [o.barriers[i].hits == 0 for o in wanted]
    shares = {
        Place.ROAD: "road_fraction",
        Place.BEYOND: "beyond_fraction",
        Place.HELD: "held_fraction",
    }
    for place, share in shares.items():
        assert (found.place == place).tolist() == [getattr(o, share) == 1.0 for o in wanted]
    assert found.reached.tolist() == [o.reached for o in wanted]


def test_a_path_ends_where_its_outcome_does(few):
    run_out = [outcome.run_out[2] for outcome in few.outcomes]
    assert np.minimum(few.end_x, BENCH.road.end).tolist() == run_out
    run, _ = rigdda.release(BENCH, (), 3, "block")
    own = few.points(3)
    assert (few.x[own][-1], few.y[own][-1], few.theta[own][-1]) == tuple(run.poses[-1, 0])
    assert (few.x[own][0], few.y[own][0]) == tuple(run.poses[0, 0, :2])
    assert few.time[own][-1] == run.times[-1]


def test_states_are_those_of_the_run(steps):
    run, _ = rigdda.release(BENCH, (), 3, "block")
    own = steps.points(3)
    at = np.searchsorted(steps.time[own], run.times - 1e-9)
    np.testing.assert_array_equal(steps.x[own][at], run.poses[:, 0, 0])
    np.testing.assert_array_equal(steps.omega[own][at], run.velocities[:, 0, 2])


def test_energy_is_that_of_translation_and_rotation(few):
    mass, inertia = few.mass[few.path], few.inertia[few.path]
    wanted = 0.5 * mass * few.speed**2 + 0.5 * inertia * few.omega**2
    np.testing.assert_allclose(few.energy, wanted, rtol=1e-12)
    released = [outcome.released_mass for outcome in few.outcomes]
    np.testing.assert_allclose(few.mass / few.width, released, rtol=1e-12)


def test_a_flight_is_a_parabola(few):
    """Positions and velocities at the ends of a flight follow from each other by g alone."""
    after = np.flatnonzero(few.kind == PointKind.FLIGHT)
    before = after - 1
    t = few.time[after] - few.time[before]
    assert len(after) > 100
    assert t.max() > 0.2
    np.testing.assert_allclose(few.vx[after], few.vx[before], atol=1e-9)
    np.testing.assert_allclose(few.vy[after], few.vy[before] - EARTH * t, atol=1e-9)
    np.testing.assert_allclose(few.x[after], few.x[before] + few.vx[before] * t, atol=1e-9)
    rise = few.vy[before] * t - 0.5 * EARTH * t**2
    np.testing.assert_allclose(few.y[after], few.y[before] + rise, atol=1e-9)


def test_impacts_end_flights_and_take_energy(steps):
    impact = np.flatnonzero(steps.kind == PointKind.IMPACT)
    assert len(impact) > 30
    assert (steps.kind[impact - 1] == PointKind.FLIGHT).all()
    assert (steps.energy[impact] < steps.energy[impact - 1]).mean() > 0.95
    surface = shapely.LineString(steps.ground.points)
    apart = shapely.distance(surface, shapely.points(steps.x[impact], steps.y[impact]))
    assert (apart < steps.radius[steps.path[impact]] + 0.02).all()


@pytest.mark.parametrize("tolerance", [0.02, 0.1, 0.5])
def test_lines_are_within_the_tolerance(steps, tolerance):
    thin = steps.thinned(tolerance)
    assert len(thin.x) < len(steps.x) / 5
    for p in range(len(steps)):
        own, kept = steps.points(p), thin.points(p)
        weight = steps.mass[p] * EARTH
        for name, scale in (
            ("x", 1.0),
            ("y", 1.0),
            ("theta", steps.radius[p]),
            ("energy", 1.0 / weight),
        ):
            line = np.interp(steps.time[own], thin.time[kept], getattr(thin, name)[kept])
            assert np.abs(line - getattr(steps, name)[own]).max() * scale < tolerance + 1e-9
        for kind in (PointKind.START, PointKind.IMPACT, PointKind.END):
            marked = steps.time[own][steps.kind[own] == kind]
            assert np.array_equal(marked, thin.time[kept][thin.kind[kept] == kind])


def test_thinning_later_is_thinning_at_once(steps, few):
    assert same(steps.thinned(0.1), few)
    assert steps.thinned(0.0) is steps
    assert few.thinned(0.1).tolerance == pytest.approx(0.2)


def test_states_at_any_time(steps, few):
    """In flight they are exact; elsewhere they are within the tolerance."""
    for p in range(len(few)):
        own = steps.points(p)
        found = few.states(p, steps.time[own])
        wanted = np.stack(
            [getattr(steps, n)[own] for n in ("x", "y", "theta", "vx", "vy", "omega")], 1
        )
        flies = steps.kind[own] == PointKind.FLIGHT
        np.testing.assert_allclose(found[flies], wanted[flies], atol=1e-8)
        assert np.abs(found[:, :2] - wanted[:, :2]).max() < 0.1 + 1e-9
    ends = few.states(0, [-1.0, 1e3])
    own = few.points(0)
    assert ends[:, 0].tolist() == [few.x[own][0], few.x[own][-1]]


def test_crossings_are_the_passages(steps, few):
    """A passage is the first step beyond the station, at most a step after the crossing."""
    lines = [20.0, 25.0, 31.0]
    found = passages(BENCH, (), [(seed, "block") for seed in steps.seed], lines)
    own, thin = steps.crossings(lines), few.crossings(lines)
    passed = np.isfinite(own.time)
    assert passed.sum() == len(found.table) > 10
    for row in found.table:
        k, p = row["station"], row["release"]
        assert row["time"] - 0.0101 <= own.time[k, p] <= row["time"]
        speed = np.hypot(row["vx"], row["vy"])
        assert own.height[k, p] == pytest.approx(row["height"], abs=0.011 * speed + 1e-3)
        ratio = np.cos(steps.ground.inclination(lines[k], steps.width[p]))
        assert own.normal[k, p] == pytest.approx(own.height[k, p] * ratio)
        weight = row["mass"] * EARTH
        energy = row["translation"] + row["rotation"]
        assert energy == pytest.approx(own.energy[k, p], abs=0.3 * energy + 0.2 * weight)
    np.testing.assert_array_equal(np.isfinite(thin.time), passed)
    gap = (
        np.abs(thin.energy - own.energy)[passed]
        / np.broadcast_to(few.mass * EARTH, passed.shape)[passed]
    )
    assert np.median(gap) < 0.02
    steep = np.isfinite(few.crossings([BENCH.slope.points[0][0]]).time)
    assert not steep.any()  # blocks start further downhill


def test_threads_change_nothing(few):
    one = rigdda.trajectories(BENCH, (), "block", range(12), threads=1)
    assert same(one, few)
    assert same(rigdda.trajectories(BENCH, (), "block", range(12), threads=3), few)


def test_parts_follow_the_seeds(few):
    parts = list(rigdda.trajectory_parts(BENCH, (), "block", range(12), size=5))
    assert [part.seed for part in parts] == [(0, 1, 2, 3, 4), (5, 6, 7, 8, 9), (10, 11)]
    assert same(Trajectories.join(parts), few)
    stopped = rigdda.trajectory_parts(BENCH, (), "block", range(10_000), size=2)
    assert next(stopped).seed == (0, 1)
    stopped.close()


def test_groups_have_a_path_for_each_block(monkeypatch):
    found = rigdda.trajectories(BENCH, (), "group", range(3))
    assert list(found.outcomes) == [rigdda.release_outcome(BENCH, (), s, "group") for s in range(3)]
    counts = [len(BENCH.draw(seed, "group").blocks) for seed in range(3)]
    assert np.bincount(found.release).tolist() == counts
    assert len(found) == len(found.vertices) == sum(counts) == len(found.start) - 1
    released = np.bincount(found.release, found.mass / found.width)
    np.testing.assert_allclose(released, [o.released_mass for o in found.outcomes])
    reached = np.bincount(found.release, found.reached) > 0
    assert reached.tolist() == [o.reached for o in found.outcomes]
    # a release that would need more memory is recorded at longer intervals
    monkeypatch.setattr(history, "MEMORY", 48.0 * max(counts) * 300)
    coarse = rigdda.trajectories(BENCH, (), "group", range(3), tolerance=0.0)
    assert coarse.outcomes == found.outcomes
    assert np.diff(coarse.start).max() <= 302
    np.testing.assert_array_equal(coarse.end_x, found.end_x)
    assert (coarse.kind == PointKind.FLIGHT).sum() > 20


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"seeds": []}, "seeds"),
        ({"seeds": [0, -1]}, r"seeds\[1\]"),
        ({"seeds": [0.5]}, r"seeds\[0\]"),
        ({"seeds": 3}, "seeds"),
        ({"tolerance": -0.1}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
        ({"threads": 0}, "threads"),
        ({"event": "storm"}, "storm"),
        ({"layout": (3,)}, "layout"),
        ({"layout": (Wall(500.0, 1.0),)}, "500"),
    ],
)
def test_bad_input(change, named):
    with pytest.raises(BadInput, match=named):
        rigdda.trajectories(BENCH, **{"event": "block", "seeds": range(2), **change})


def test_bad_stations_and_sites(few):
    with pytest.raises(BadInput, match="stay on the terrain"):
        few.crossings([1e4])
    with pytest.raises(BadInput, match="site"):
        rigdda.trajectories("bench")  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="size"):
        rigdda.trajectory_parts(BENCH, size=0)  # before the first part
