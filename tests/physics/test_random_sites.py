"""Generated sites: always the same, sound whatever their number, each like its family."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import rigdda
from rigdda import BadInput, Site, sites
from rigdda.model.outcome import Outcome
from rigdda.model.site_generator import fallen

SPLITS = ("train", "validation", "test")


def test_splits_have_no_site_in_common():
    of = {name: set(sites.split(name)) for name in SPLITS}
    assert all(of.values())
    for one, other in itertools.combinations(SPLITS, 2):
        assert of[one].isdisjoint(of[other])
    assert sites.split("test", "bench")[0].startswith("bench-")


def test_splits_have_as_many_of_each_family():
    found = [sites.load(name).family for name in sites.split("test")]
    assert {found.count(family) for family in sites.FAMILIES} == {len(found) / 6}


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
    "name", ["random-x", "random--1", "random-007", "bench-1.5", "quick-3", "random"]
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
