"""Distribution of releases to threads: large events first, results in the order of the releases."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from rigdda import Ditch, Site, distribution
from rigdda.errors import BadInput
from rigdda.passages import Passages, passages
from rigdda.releases import by_size, release_many, release_outcome

QUICK = Site.load("quick")
EVENTS = ("block", "mass", "group", "block", None, "mass", "block")
DITCH = (Ditch(QUICK.barrier_zone.end - 3.0, 1.0, 3.0),)


def test_releases_of_masses_come_first_and_outcomes_keep_their_order():
    jobs = [
        (QUICK, layout, seed, event) for seed, event in enumerate(EVENTS) for layout in ((), DITCH)
    ]
    large, small = by_size(jobs)
    assert sorted(large + small) == list(range(len(jobs)))
    masses = [seed for seed, name in enumerate(EVENTS) if (name or QUICK.pick(seed)) == "mass"]
    assert [jobs[place][1:3] for place in large] == [
        (layout, seed) for layout in ((), DITCH) for seed in masses
    ]
    alone = [release_outcome(*job) for job in jobs]
    assert release_many(jobs, threads=2) == alone
    assert release_many(jobs, threads=1) == alone
    with ThreadPoolExecutor(1) as pool, distribution.using(pool):
        assert release_many(jobs) == alone


def test_the_first_wrong_release_is_reported_although_masses_come_first():
    jobs = [(QUICK, (), 0, "mass"), (QUICK, (), 1, "slide"), (QUICK, (), -1, "mass")]
    with pytest.raises(BadInput, match="slide"):
        release_many(jobs)


def test_passages_keep_the_order_of_the_releases():
    releases = list(enumerate(EVENTS))
    stations = [QUICK.slope.toe, QUICK.road.start]
    alone = Passages.join([passages(QUICK, DITCH, [one], stations) for one in releases])
    assert alone.seed == tuple(range(len(EVENTS)))
    assert len(np.unique(alone.table["release"])) > 3
    with ThreadPoolExecutor(1) as pool, distribution.using(pool):
        distributed = passages(QUICK, DITCH, releases, stations)
    threaded = [passages(QUICK, DITCH, releases, stations, threads=n) for n in (1, 2)]
    for found in (distributed, *threaded):
        assert found.seed == alone.seed
        for name in ("event", "table", "stops"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))
