"""Whole releases of the scene shu-hwa-paper: nothing sinks or tunnels, and the books balance."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import shapely

from rigdda import Settings, Simulation, Site, Wall
from rigdda.geometry import polygon_properties
from rigdda.measurement import measure, stations, watch

SITE = Site.load("shu-hwa-paper")


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
    scene = SITE.realise(layout, seed)
    sim = Simulation(scene, SITE.settings(scene), stations(SITE, layout), watch(SITE))
    run = sim.run(SITE.motion.duration)
    ground = run.scene.terrain.points
    x, y = run.poses[..., 0], run.poses[..., 1]
    # beyond the ends of the terrain there is no ground
    over = (x > ground[0, 0]) & (x < ground[-1, 0])
    assert (y > np.interp(x, *ground.T))[over].all(), seed
    for wall in layout:
        outline = shapely.Polygon(wall.outline(run.scene.terrain))
        assert not shapely.contains_xy(outline, x, y).any(), (seed, wall)
    outcome = measure(SITE, run, "mass", 10.0)
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
    assert depth < 0.15, (seed, depth)  # a tenth of a block
    return depth


@pytest.mark.parametrize("layout", [(), on_benches(2.0)], ids=["bare", "two walls"])
def test_release(layout):
    check_release((layout, 0))


@pytest.mark.slow
def test_many_releases():
    jobs = [(on_benches(2.0) if seed % 2 else (), seed) for seed in range(100)]
    with ThreadPoolExecutor() as pool:
        depths = sorted(pool.map(check_release, jobs))
    assert len(depths) == 100
    assert depths[98] < 0.1 and depths[50] < 0.03


@pytest.mark.parametrize("dt", [1e-2, 5e-3])
def test_without_post_correction_a_mass_comes_down_too(dt):
    """Its blocks grow as they turn, as in the paper's Fig. 1; nothing is thrown away by that."""
    scene = Site.load("quick").realise((), 1, "mass")
    sim = Simulation(scene, Settings(dt=dt, post_correction=False))
    start = sim.poses
    sim.step(round(2.0 / dt))
    assert (sim.poses[:, 1] < start[:, 1]).mean() > 0.9
    assert np.hypot(*sim.velocities[:, :2].T).max() < 25.0  # a fall of 32 m


def test_a_mass_in_static_mode_settles():
    """Contacts that form later are softer than those of the first step, or the mass explodes.

    Without inertia, every step starts at rest: a block may settle, but it cannot gather speed.
    """
    scene = Site.load("quick").realise((), 1, "mass")
    sim = Simulation(scene, Settings(dt=1e-2, mode="static"))
    start = sim.poses
    sim.step(200)
    moved = np.hypot(*(sim.poses - start)[:, :2].T)
    assert np.median(moved) < 0.5 and moved.max() < 3.0  # a single block may slide by 2.2 m
