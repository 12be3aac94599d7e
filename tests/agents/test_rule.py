"""The engineering rule on crossings that can be counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from agents.crossings import CROSSING, Ensemble
from agents.rule import rule
from rigdda import Fence, Site, Wall

STATIONS = np.array([12.0, 16.0, 20.0])


def crossings(energies: dict[int, float], height: float, radius: float = 0.5) -> Ensemble:
    """Return 20 crossings at some stations, all of the same energy there."""
    table = np.zeros(20 * len(energies), dtype=CROSSING)
    table["station"] = np.repeat(list(energies), 20)
    table["energy"] = np.repeat(list(energies.values()), 20)
    table["height"], table["radius"] = height, radius
    return Ensemble(STATIONS, table, np.array([1e5]), radius)


def test_the_wall_stands_where_energy_is_least_above_the_bounce(site: Site) -> None:
    assert rule(site, crossings({0: 5.0, 1: 2.0, 2: 3.0}, 1.5), "wall") == (Wall(16.0, 2.5, 0.5),)


def test_equal_energies_are_settled_towards_the_toe(site: Site) -> None:
    assert rule(site, crossings({0: 2.0, 1: 2.0, 2: 2.0}, 1.5), "wall")[0].x == 20.0


def test_the_freeboard_grows_with_large_blocks(site: Site) -> None:
    (wall,) = rule(site, crossings({1: 2.0}, 1.0, radius=1.6), "wall")
    assert wall.height == pytest.approx(1.0 + 1.6 + 0.8)


def test_no_wall_is_higher_than_the_site_allows(site: Site) -> None:
    assert rule(site, crossings({1: 2.0}, 9.0), "wall")[0].height == site.barrier_zone.max_height


def test_a_station_that_needs_too_high_a_wall_is_passed_over(site: Site) -> None:
    looked = crossings({0: 1.0, 1: 2.0, 2: 3.0}, 1.5)
    looked.crossings["height"][:20] = 9.0
    assert rule(site, looked, "wall")[0].x == 16.0


def test_the_quantile_leaves_out_the_rarest_bounce(site: Site) -> None:
    looked = crossings({1: 2.0}, 1.0)
    looked.crossings["height"][0] = 4.0
    (wall,) = rule(site, looked, "wall")
    assert wall.height == pytest.approx(np.quantile([4.0] + 19 * [1.0], 0.95) + 0.5 + 0.5)


def test_where_nothing_comes_nothing_is_built(site: Site) -> None:
    assert rule(site, crossings({}, 1.0), "wall") == ()


def test_a_fence_has_the_capacity_for_all_that_a_release_brings(site: Site) -> None:
    looked = crossings({0: 5e5, 1: 2e4, 2: 3e5}, 1.5)
    (fence,) = rule(site, looked, "fence")
    assert isinstance(fence, Fence) and (fence.x, fence.height) == (16.0, 2.5)
    assert fence.capacity == pytest.approx(20 * 2e4)
    looked.crossings["height"][20:30] = 2.6  # above its top
    assert rule(site, looked, "fence")[0].height > 2.6
    zone = site.barrier_zone
    for energy, capacity in ((1.0, zone.min_capacity), (1e7, zone.max_capacity)):
        assert rule(site, crossings({1: energy}, 1.5), "fence")[0].capacity == capacity
