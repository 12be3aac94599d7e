"""Random sites: always the same, never degenerate, and worth protecting."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import rigdda
from rigdda import BadInput, Site, sites
from rigdda.geometry import overlap

SEEDS = (*range(0, 1024, 64), *sites.TEST_SEEDS)


def test_training_never_sees_the_test_sites():
    assert set(sites.TRAIN_SEEDS).isdisjoint(sites.TEST_SEEDS)
    found = sites.test_sites()
    assert len(found) == 20
    assert found == [sites.random(seed) for seed in sites.TEST_SEEDS]
    assert len({site.slope for site in found}) == 20


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_site_is_one_to_design_on(seed, tmp_path):
    site = sites.random(seed)
    zone, road, toe = site.barrier_zone, site.road, site.slope.toe
    assert 5.0 <= road.start - toe <= 10.0 + 1e-3
    assert zone.end == pytest.approx(road.start - 2.0)
    assert zone.max_height <= 4.0
    assert zone.end - zone.start > 7.0
    points = np.array(site.slope.points)
    assert 20.0 < points[0, 1] < 80.0
    assert (np.diff(points[:, 0]) > 0.0).all() and (np.diff(points[1:, 1]) <= 0.0).all()
    assert site.source.outline[:, 0].max() < zone.start
    for release in range(2):
        blocks = site.realise(seed=release).blocks
        assert 20 <= len(blocks) <= 40
    chain = [*site.slope.points, (points[-1, 0], -99.0), (points[0, 0], -99.0)]
    ground = shapely.Polygon(chain)
    assert max(overlap(shapely.Polygon(b.vertices), ground) for b in blocks) < 1e-6
    site.save(tmp_path / "site.toml")
    assert Site.load(tmp_path / "site.toml") == site


def test_the_seed_is_checked():
    for seed in (-1, 0.5, "random"):
        with pytest.raises(BadInput, match=r"seed = .*: give a whole number of at least 0"):
            sites.random(seed)


def test_sites_are_of_many_shapes():
    found = [sites.random(seed) for seed in range(200)]
    heights = np.array([site.slope.points[0][1] for site in found])
    assert heights.min() < 25.0 and heights.max() > 60.0
    benches = [(len(site.slope.points) - 7) // 2 for site in found]
    assert set(benches) == {0, 1, 2}


@pytest.mark.slow
def test_much_but_not_all_of_the_rock_reaches_the_road():
    chosen = [*sites.test_sites(), *(sites.random(seed) for seed in range(0, 1024, 16))]
    jobs = [(site, (), seed) for site in chosen for seed in range(4)]
    debris = np.array([outcome.debris_fraction for outcome in rigdda.release_many(jobs)])
    means = debris.reshape(-1, 4).mean(axis=1)
    assert means.min() > 0.2 and means.max() < 0.8
