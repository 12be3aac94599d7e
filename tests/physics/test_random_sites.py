"""Generated sites: always the same, sound whatever their number, each like its family."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import rigdda
from rigdda import BadInput, Site, sites
from rigdda.ground.grounds import GROUNDS
from rigdda.model.outcome import Outcome
from rigdda.model.site_generator import fallen

PARTS = ("train", "validation", "test")
FROZEN = {
    "random-1": ((-15.0, 46.429), 1.71, (1.7006, 3.4012)),
    "cliff-1000000004": ((-8.0, 16.22), 1.47, (0.012, 0.12)),
}
"""First corner of the slope, price factor of access and areas of the blocks of the first event."""


def test_splits_have_no_site_in_common():
    assert sites.SPLITS == (*PARTS, *(f"wide-{part}" for part in PARTS))
    of = {name: set(sites.split(name)) for name in sites.SPLITS}
    assert all(of.values())
    for one, other in itertools.combinations(sites.SPLITS, 2):
        assert of[one].isdisjoint(of[other])
    assert sites.split("test", "bench")[0].startswith("bench-")
    assert sites.split("wide-test", "forest")[0] == "wide-forest-1000000000"


def test_splits_have_as_many_of_each_family():
    found = [sites.load(name).family for name in sites.split("test")]
    assert {found.count(family) for family in sites.FAMILIES} == {len(found) / 6}
    first = [sites.load(name).family for name in sites.split("wide-train")[:18]]
    assert {first.count(family) for family in sites.WIDE_FAMILIES} == {2}


def test_the_name_of_a_site_tells_its_family_and_part():
    told = {"random-8": "talus", "wide-8": "old-fence", "wide-slab-cut-5": "slab-cut"}
    for name, family in told.items():
        assert sites.family_of(name) == family == sites.load(name).family
    parts = {"bench-3": "train", "wide-1000003": "validation", "random-1000000059": "test"}
    for name, part in parts.items():
        assert sites.part_of(name) == part
    assert sites.part_of("bench") is None and sites.part_of("wide-5000") is None


def test_the_sites_of_the_first_version_stay_as_they_were():
    """Two sites are what they were before there were wide ranges."""
    found = [sites.load(name) for name in FROZEN]
    assert FROZEN == {
        site.name: (site.slope.points[0], site.prices.access, site.events[0].area) for site in found
    }


@pytest.mark.parametrize("family", sites.WIDE_FAMILIES)
def test_wide_sites_are_sound(family):
    """They load, have room for barriers, and their grounds are within the ranges of the library."""
    for number in range(12):
        site = sites.load(f"wide-{family}-{number}")
        assert site.family == family and site.name == f"wide-{family}-{number}"
        assert site.barrier_zone.start >= fallen(site.slope, site.sources)
        assert sum(end - start for start, end in site.rooms) > 1.0
        for surface in site.surfaces.values():
            ground = GROUNDS[surface.ground]
            assert ground.friction_deg.low <= surface.friction_deg <= ground.friction_deg.high
            assert ground.rolling.low <= surface.rolling <= ground.rolling.high
        for event in site.event_names:
            assert len(site.realise((), number, event).blocks) >= site.event(event).number[0]


def test_forest_existing_barriers_and_traffic_vary():
    forests = [sites.load(f"wide-forest-{i}").forest[0] for i in range(8)]
    assert len({forest.stems for forest in forests}) == 8
    assert len({forest.end for forest in forests}) == 8
    fences = [sites.load(f"wide-old-fence-{i}").existing[0] for i in range(8)]
    assert len({fence.x for fence in fences}) == len({fence.height for fence in fences}) == 8
    assert {fence.energy_class for fence in fences} == {250}
    assert len({sites.load(f"wide-slab-cut-{i}").traffic for i in range(8)}) == 8


@pytest.mark.parametrize("name", ["bench-17", "random-17", "shu-hwa-3", "random-1000000000"])
def test_a_site_is_that_of_its_name(name, tmp_path):
    site = sites.load(name)
    assert site.name == name and site == Site.load(name)
    site.save(tmp_path / "site.toml")
    assert Site.load(tmp_path / "site.toml") == site


@pytest.mark.parametrize("family", sites.FAMILIES)
def test_two_hundred_sites_are_sound(family):
    """34 of each family: they load, and every event starts clear of the ground and of others."""
    for number in range(34):
        site = sites.load(f"{family}-{number}")
        assert site.family == family
        assert site.barrier_zone.start >= fallen(site.slope, site.sources)
        assert sum(end - start for start, end in site.rooms) > 1.5
        for event in site.event_names:
            assert len(site.realise((), number, event).blocks) >= site.event(event).number[0]


@pytest.mark.parametrize("family", sites.FAMILIES)
def test_instances_differ_from_one_another(family):
    found = [sites.load(f"{family}-{number}") for number in range(30)]
    heights = np.array([site.slope.points[0][1] for site in found])
    closures = {site.consequences.closure for site in found}
    assert heights.max() > 1.3 * heights.min() > 0.0 and len(closures) > 20
    assert len({site.events[0].area for site in found}) == 30


@pytest.mark.parametrize(
    "name",
    [
        "random-x",
        "random--1",
        "random-007",
        "bench-1.5",
        "quick-3",
        "random",
        "forest-1",
        "wide-shu-hwa-1",
        "wide-random-1",
        "wide",
        "widely-3",
    ],
)
def test_no_site_of_that_name(name):
    with pytest.raises(BadInput, match="random-N"):
        sites.load(name)


def test_no_split_of_that_name():
    with pytest.raises(BadInput, match="train"):
        sites.split("exam")


@pytest.mark.slow
def test_rock_reaches_the_road_of_most():
    """Of what makes up most of the cost a good part does, on all of 60 sites of the test split."""
    found: dict[str, list[Outcome]] = {}
    for name in sites.split("test"):
        site = sites.load(name)
        jobs = [(site, (), seed, event) for seed in range(8) for event in site.event_names]
        found[name] = rigdda.release_many(jobs)
    shares = [np.mean([outcome.reached for outcome in of]) for of in found.values()]
    assert min(shares) > 0.1
