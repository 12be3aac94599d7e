"""What is not simulated again has the outcome that simulating it gives."""

from __future__ import annotations

from dataclasses import asdict, replace

import cases
import msgspec
import pytest

import rigdda
from rigdda import Ditch, Embankment, Fence, GravityWall, Layout, Outcome, Site
from rigdda.envs import outcome_cache
from rigdda.envs.outcome_cache import Memory, Sample, fingerprint

SEEDS = range(24)


@pytest.fixture(scope="module")
def site() -> Site:
    return cases.cut()


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcome_cache, "bare_outcomes", Memory(4096))


def same(one: Outcome, two: Outcome) -> None:
    """Check that two outcomes agree, to what bounces make of the rounding of other corners."""
    first, second = asdict(one), asdict(two)
    tables = zip(first.pop("barriers"), second.pop("barriers"), strict=True)
    for a, b in [(first, second), *tables]:
        for name, value in a.items():
            number = isinstance(value, float) or name in ("reach", "run_out")
            assert b[name] == (pytest.approx(value, rel=1e-6, abs=1e-3) if number else value), name


def jobs(site: Site, layout: Layout, event: str) -> list[outcome_cache.Job]:
    return [(site, layout, seed, event) for seed in SEEDS]


@pytest.mark.parametrize(
    "layout",
    [
        (Fence(15.0, 2.0, energy_class=250),),
        (GravityWall(15.0, 1.0, 0.8),),
        (Ditch(14.0, 1.0, 3.0, side_slope=0.67),),
        (Embankment(13.0, 1.5),),
        (Ditch(11.5, 1.0, 2.5, side_slope=0.67), Fence(15.0, 2.0, energy_class=100)),
    ],
)
@pytest.mark.parametrize("event", ["small", "low", "group"])
def test_what_no_block_comes_near_changes_nothing(site: Site, layout: Layout, event: str) -> None:
    outcome_cache.outcomes(jobs(site, (), event))
    found = outcome_cache.outcomes(jobs(site, layout, event))
    for seed, outcome, ran in zip(SEEDS, found, found.ran, strict=True):
        if not ran:
            same(outcome, rigdda.release(site, layout, seed, event)[1])


def test_much_is_reused_where_little_comes_so_far(site: Site) -> None:
    layout = (Fence(15.0, 2.0, energy_class=250),)
    outcome_cache.outcomes(jobs(site, (), "small"))
    assert outcome_cache.outcomes(jobs(site, layout, "small")).simulated < 0.85 * len(SEEDS)
    again = outcome_cache.outcomes(jobs(site, (), "small"))
    assert (again.simulated, again.seconds < 0.05) == (0, True)


def test_a_release_that_stays_clear_of_its_layout_is_one_without(site: Site) -> None:
    layout = (Fence(15.0, 2.0, energy_class=250),)
    first = outcome_cache.outcomes(jobs(site, layout, "small"))
    without = outcome_cache.outcomes(jobs(site, (), "small"))
    assert 0 < without.simulated < len(SEEDS)
    for seed, outcome, ran in zip(SEEDS, without, without.ran, strict=True):
        if not ran:
            same(outcome, rigdda.release(site, (), seed, "small")[1])
            assert outcome_cache.misses(site, fingerprint(site), layout, first[seed])


def test_equal_releases_are_simulated_once_and_other_sites_anew(site: Site) -> None:
    job = (site, (), 3, "small")
    found = outcome_cache.outcomes([job, job, (site, (), 4, "small")])
    assert found.ran == (True, False, True)
    assert found[0] == found[1] == rigdda.release(*job)[1]
    slower = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, damping=0.2))
    assert outcome_cache.outcomes([(slower, (), 3, "small")]).simulated == 1


def test_mesh_is_no_part_of_a_release(site: Site) -> None:
    outcome_cache.outcomes(jobs(site, (), "small"))
    assert outcome_cache.outcomes(jobs(site, (rigdda.Mesh(1.5, "light"),), "small")).simulated == 0


def test_samples_add_up_and_split() -> None:
    one = Sample([cases.outcome()] * 2, (True, False), 3.0)
    two = Sample([cases.outcome("block")], (True,), 1.0)
    both = one + two
    assert (len(both), both.simulated, both.seconds) == (3, 2, 4.0)
    first, second = both.split([0, 2, 3])
    assert (first, first.ran, first.seconds) == (one, one.ran, 2.0)
    assert second.seconds == 2.0
    assert Sample([cases.outcome()]).simulated == 0


def test_memory_is_bounded() -> None:
    memory: Memory[int, str] = Memory(2)
    memory.remember({1: "a", 2: "b"})
    assert memory.recall([1, 5]) == {1: "a"}  # and so it is the latest
    memory.remember({3: "c"})
    assert memory.recall(range(5)) == {1: "a", 3: "c"}


def test_a_release_that_struck_is_not_one_without(site: Site) -> None:
    """A wall that was moved uphill is struck where it did not stand."""
    layout = (GravityWall(15.0, 1.0, 0.8),)
    hit = replace(cases.outcome("small", 0.0, False), reach=(0.0, 5.0))
    assert hit.barriers[0].hits == 0
    struck = replace(hit, barriers=(replace(hit.barriers[0], hits=2),))
    key = outcome_cache.Key(fingerprint(site), layout, 1, "small")
    for outcome, kept in ((struck, 0), (hit, 1)):
        outcome_cache._remember({key: outcome}, {key: (site, layout, 1, "small")})
        assert len(outcome_cache.bare_outcomes.recall([key._replace(layout=())])) == kept


def test_blocks_that_stop_short_by_less_than_a_step_may_have_touched(site: Site) -> None:
    layout = (Fence(15.0, 2.0, energy_class=250),)
    near, far = (replace(cases.outcome("small"), reach=(0.0, 15.0 - d)) for d in (0.25, 0.5))
    assert not outcome_cache.misses(site, fingerprint(site), layout, near)
    assert outcome_cache.misses(site, fingerprint(site), layout, far)


def test_outcomes_without_barriers_have_nothing_held(site: Site) -> None:
    held = replace(cases.outcome("small", 0.0, False, held=0.5), reach=(0.0, 5.0))
    key = outcome_cache.Key(fingerprint(site), (Fence(15.0, 2.0, energy_class=100),), 1, "small")
    outcome_cache._remember({key: held}, {key: (site, key.layout, 1, "small")})
    (kept,) = outcome_cache.bare_outcomes.recall([key._replace(layout=())]).values()
    assert (kept.held_fraction, kept.slope_fraction) == (0.0, 1.0)
