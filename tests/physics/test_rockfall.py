"""Whole releases of the site shu-hwa: nothing sinks or tunnels, and the books balance."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import shapely

from rigdda import Simulation, Site, Wall, release_many
from rigdda.geometry import polygon_properties
from rigdda.outcome import measure, stations, watch

SITE = Site.load("shu-hwa")


def benches() -> list[tuple[float, float]]:
    """Return start and end of the flat parts of the slope inside the barrier zone [m]."""
    points, zone = np.array(SITE.slope.points), SITE.barrier_zone
    dip = np.degrees(np.arctan2(-np.diff(points[:, 1]), np.diff(points[:, 0])))
    return [
        (a, b)
        for a, b, d in zip(points[:-1, 0], points[1:, 0], dip, strict=True)
        if d < 30.0 and zone.start <= a and b <= min(zone.end, SITE.slope.toe)
    ]


def on_benches(height: float, thickness: float = 1.0) -> tuple[Wall, ...]:
    """Return a wall at the outer edge of each bench."""
    return tuple(Wall(end - thickness, height, thickness) for _, end in benches())


def check_release(job: tuple[tuple[Wall, ...], int]) -> float:
    """Assert what holds in every frame of a release; return its greatest penetration [m]."""
    layout, seed = job
    sim = Simulation(
        SITE.realise(layout, seed), SITE.settings(), stations(SITE, layout), watch(SITE)
    )
    run = sim.run(SITE.motion.duration)
    ground = run.scene.terrain.points
    x, y = run.poses[..., 0], run.poses[..., 1]
    # beyond the ends of the terrain there is no ground
    over = (x > ground[0, 0]) & (x < ground[-1, 0])
    assert (y > np.interp(x, *ground.T))[over].all(), seed
    for wall in layout:
        outline = shapely.Polygon(wall.outline(run.scene.terrain))
        assert not shapely.contains_xy(outline, x, y).any(), (seed, wall)
    outcome = measure(SITE, run)
    assert (
        outcome.slope_fraction
        + outcome.held_fraction
        + outcome.road_fraction
        + outcome.beyond_fraction
        == 1.0
    )
    mass = math.fsum(b.density * polygon_properties(b.vertices)[0] for b in run.scene.blocks)
    assert outcome.released_mass == mass
    depth = sim.diagnostics.penetration
    assert depth < 0.1, (seed, depth)
    return depth


@pytest.mark.parametrize("layout", [(), on_benches(2.0)], ids=["bare", "two walls"])
def test_release(layout):
    check_release((layout, 0))


@pytest.mark.slow
def test_many_releases():
    jobs = [(on_benches(2.0) if seed % 2 else (), seed) for seed in range(100)]
    with ThreadPoolExecutor() as pool:
        assert len(list(pool.map(check_release, jobs))) == 100


def objectives(layout: tuple[Wall, ...], seeds: range) -> np.ndarray:
    """Return debris plus the weighted cost of a layout, for each release."""
    debris = [o.debris_fraction for o in release_many([(SITE, layout, s) for s in seeds])]
    return np.array(debris) + 0.2 * SITE.cost(layout) / SITE.costs.limit


def interval(values: np.ndarray) -> tuple[float, float]:
    """Return the 95 % interval of the mean."""
    half = 1.96 * values.std(ddof=1) / math.sqrt(len(values))
    return values.mean() - half, values.mean() + half


def best(layouts: list[tuple[Wall, ...]]) -> tuple[Wall, ...]:
    """Return the layout of least objective in a few releases."""
    return min(layouts, key=lambda layout: objectives(layout, range(4)).mean())


@pytest.mark.slow
def test_two_walls_beat_the_best_single_wall():
    zone = SITE.barrier_zone
    heights = (1.0, 2.0, zone.max_height)
    places = np.linspace(zone.start + 1.0, zone.end - 1.0, 6)
    single = best([(Wall(float(x), height),) for x in places for height in heights])
    double = best([on_benches(height) for height in heights])
    fresh = range(1000, 1024)
    one, two, bare = (objectives(layout, fresh) for layout in (single, double, ()))
    print(single, interval(one), double, interval(two), interval(bare))
    assert two.mean() < 0.8 * one.mean()
    assert interval(two)[1] < interval(one)[0]
    assert two.mean() < bare.mean()  # the best is not to build nothing
    assert SITE.cost(double) < 0.9 * SITE.costs.limit  # nor to spend all
