"""The engineering rule on crossings that can be counted by hand."""

from __future__ import annotations

import numpy as np
import pytest
from valley import SITE

from rigdda import Ditch, Embankment, Fence, Site
from rigdda.agents.designers.catalogue import CROSSING, CrossingEnsemble
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.rule import demands, ritchie, rule
from rigdda.barriers import FENCE_CLASSES
from rigdda.envs import DesignProblem

STATIONS = np.array([14.0, 20.0, 27.0])
SPEED, MASS, ENERGY, FREEBOARD = 1.122, 1.02, 1.2, 0.5
"""Partial factors of UNI 11211-4, of trajectories by 1.10 x 1.02, and the free height [m]."""


def crossings(
    speeds: dict[int, float], height: float = 1.0, mass: float = 1000.0
) -> CrossingEnsemble:
    """Return 20 blocks of the first event that cross some stations and the road."""
    places = [*speeds, len(STATIONS)]
    table = np.zeros(20 * len(places), dtype=CROSSING)
    table["station"] = np.repeat(places, 20)
    table["release"] = np.tile(np.arange(20), len(places))
    table["speed"] = np.repeat([*speeds.values(), 1.0], 20)
    table["height"], table["radius"], table["mass"] = height, 0.4, mass
    return CrossingEnsemble(STATIONS, table, np.zeros(20, dtype=int), np.ones(20))


def build(
    ensemble: CrossingEnsemble, kinds: tuple[str, ...] = ("fence",), site: Site = SITE
) -> tuple:
    problem = DesignProblem(site, kinds=kinds)
    return rule(problem, ensemble, Menu(problem))


def test_what_is_asked_is_worked_out_by_hand() -> None:
    (asked,) = demands(crossings({1: 10.0}), [0])
    assert asked[0] == 20.0
    assert asked[1] == pytest.approx(0.5 * (1000.0 * MASS) * (10.0 * SPEED) ** 2)
    assert asked[2] == pytest.approx(1.0 * SPEED + FREEBOARD)


def test_the_quantile_leaves_out_the_rarest_block() -> None:
    looked = crossings({1: 10.0})
    looked.crossings["speed"][0] = 40.0
    (asked,) = demands(looked, [0])
    fast = np.quantile([40.0] + 19 * [10.0], 0.95)
    assert asked[1] == pytest.approx(0.5 * (1000.0 * MASS) * (fast * SPEED) ** 2)


def test_the_class_takes_the_energy_with_its_factor() -> None:
    for energy in (80e3, 90e3, 200e3, 210e3, 1600e3):
        speed = np.sqrt(2.0 * energy / (1000.0 * MASS)) / SPEED
        (fence,) = build(crossings({1: speed}))
        assert isinstance(fence, Fence) and fence.x == 20.0
        # 1.62 m, in steps of half a metre, and no lower than its class is made
        assert fence.height == max(2.0, FENCE_CLASSES[fence.energy_class].lowest)
        least = [c for c in (100, 250, 500, 1000, 1500, 2000, 3000) if 1e3 * c / ENERGY > energy]
        assert fence.energy_class == least[0]


def test_a_low_class_is_passed_over_where_it_is_too_low() -> None:
    (fence,) = build(crossings({1: 5.0}, height=2.6))
    assert fence.height == 3.5 and fence.energy_class == 500


def test_of_all_stations_the_cheapest_fence_is_built() -> None:
    (fence,) = build(crossings({0: 10.0, 1: 40.0, 2: 30.0}))
    assert fence.x == 14.0
    (fence,) = build(crossings({0: 10.0, 1: 10.0, 2: 10.0}))
    assert fence.x == 27.0  # access is cheaper


def test_a_station_below_which_blocks_start_is_passed_over() -> None:
    looked = crossings({0: 5.0, 1: 10.0})
    looked.crossings["release"][:10] += 100  # half of what crosses there does not reach the road
    looked = CrossingEnsemble(STATIONS, looked.crossings, np.zeros(200, dtype=int), np.ones(200))
    (fence,) = build(looked)
    assert fence.x == 20.0


def test_where_nothing_comes_nothing_is_built() -> None:
    looked = crossings({1: 5.0})
    empty = CrossingEnsemble(STATIONS, looked.crossings[:0], looked.event, looked.width)
    assert build(empty) == ()


def test_where_no_fence_takes_it_a_ditch_or_an_embankment_is_built(site: Site) -> None:
    huge = crossings({1: 90.0, 2: 90.0}, mass=1e6)
    assert build(huge) == ()
    (ditch,) = build(huge, ("fence", "ditch", "embankment"))
    width, depth = ritchie(site)
    assert isinstance(ditch, Ditch) and ditch.width == width and ditch.depth <= depth
    assert abs(ditch.x - site.slope.toe) < 1.0
    (dam,) = build(huge, ("fence", "embankment"))
    assert isinstance(dam, Embankment) and dam.height == pytest.approx(SPEED + FREEBOARD)


def test_ritchie_widens_with_the_height(site: Site) -> None:
    width, depth = ritchie(site)
    assert (width, depth) in ((4.6, 1.8), (6.1, 1.8))


def test_the_inclination_is_that_of_the_cut_not_of_the_plateau_above_it() -> None:
    """`bench` falls at 59 degrees from its crest, 48 from the far end of its plateau."""
    assert ritchie(Site.load("bench")) == (7.6, 2.7)
