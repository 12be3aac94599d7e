"""What is not simulated again has the outcome that simulating it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace

import cases
import msgspec
import pytest

import rigdda
from rigdda import Ditch, Embankment, Fence, Forest, GravityWall, Layout, Outcome, Site
from rigdda.envs import outcome_cache
from rigdda.envs.outcome_cache import Memory, Sample, release_key
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.surface import Interface, Surface
from rigdda.model.existing import Existing
from rigdda.model.partial_factors import PartialFactors
from rigdda.model.site_tables import Origin, Rebound, Road
from rigdda.model.traffic import Traffic

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
            assert outcome_cache.misses(site, release_key(site), layout, first[seed])


def test_equal_releases_are_simulated_once_and_other_sites_anew(site: Site) -> None:
    job = (site, (), 3, "small")
    found = outcome_cache.outcomes([job, job, (site, (), 4, "small")])
    assert found.ran == (True, False, True)
    assert found[0] == found[1] == rigdda.release(*job)[1]
    short = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, duration=7.0))
    assert outcome_cache.outcomes([(short, (), 3, "small")]).simulated == 1


def repriced(site: Site) -> Site:
    """Return a site that differs in everything that does not affect its releases."""
    events = tuple(
        msgspec.structs.replace(event, rate=3.0 * event.rate, design=not event.design)
        for event in site.events
    )
    same_tables = {
        "name": "another",
        "description": "Other prices.",
        "family": "verge",
        "origin": Origin(100.0, 7.0),
        "prices": msgspec.structs.replace(site.prices, concrete=900.0, interest=0.07),
        "consequences": msgspec.structs.replace(site.consequences, closure=90000.0),
        "existing": (
            Existing(
                kind="fence", x=12.0, height=2.0, energy_class=100, removable=True, removal=10.0
            ),
        ),
        "traffic": Traffic(vehicles_per_day=5000, speed=80.0, section_length=100.0),
        "meshes": (),
        "rule": PartialFactors(quantile=0.9),
        "lumped": {"rock": Rebound(0.3)},
    }
    assert set(same_tables) == set(outcome_cache.NO_MOTION)
    return msgspec.structs.replace(site, events=events, **same_tables)


def test_releases_do_not_depend_on_prices_and_rates(site: Site) -> None:
    other = repriced(site)
    assert all(getattr(other, name) != getattr(site, name) for name in outcome_cache.NO_MOTION)
    assert release_key(other) == release_key(site)
    fence = Fence(15.0, 2.0, energy_class=250)
    stands = other.standing((fence, rigdda.Removal(12.0)))
    assert stands == (fence,)
    for seed in range(4):
        for event in site.event_names:
            _, one = rigdda.release(site, (fence,), seed, event)
            _, two = rigdda.release(other, (fence, rigdda.Removal(12.0)), seed, event)
            assert one == two


MOTION: dict[str, Callable[[Site], object]] = {
    "slope": lambda s: msgspec.structs.replace(s.slope, toe=10.5),
    "sources": lambda s: s.sources[::-1],
    "events": lambda s: s.events[::-1],
    "road": lambda s: Road(18.0, 27.0),
    "barrier_zone": lambda s: BarrierZone(4.0, 17.0),
    "surfaces": lambda s: s.surfaces | {"soil": Surface(31.0)},
    "interfaces": lambda s: (Interface("rock", "soil", 31.0),),
    "motion": lambda s: msgspec.structs.replace(s.motion, duration=7.0),
    "forest": lambda s: (Forest(1.0, 9.0, stems=100.0, dbh=0.3),),
    "scatter": lambda s: msgspec.structs.replace(s.scatter, friction_deg=1.0),
}


def test_every_other_table_of_a_site_is_part_of_the_key(site: Site) -> None:
    assert {*MOTION, *outcome_cache.NO_MOTION} == {*site.__struct_fields__}
    found = {
        release_key(msgspec.structs.replace(site, **{name: change(site)}))
        for name, change in MOTION.items()
    }
    assert len(found | {release_key(site)}) == len(MOTION) + 1


@pytest.mark.parametrize(
    "change", [{"area": (0.1, 0.3)}, {"number": (1, 2), "width": 3.0}, {"exponent": 0.7}]
)
def test_what_an_event_releases_is_part_of_the_key(site: Site, change: dict[str, object]) -> None:
    event = msgspec.structs.replace(site.events[0], **change)
    other = msgspec.structs.replace(site, events=(event, *site.events[1:]))
    assert release_key(other) != release_key(site)


def test_a_duration_that_is_too_short_is_told_for_every_site(site: Site) -> None:
    motion = msgspec.structs.replace(site.motion, duration=1.0)
    for name in ("first", "second"):
        hasty = msgspec.structs.replace(site, name=name, motion=motion)
        with pytest.warns(rigdda.DoubtfulInput, match=f"of site '{name}'"):
            found = outcome_cache.outcomes(jobs(hasty, (), "block"))
    assert found.simulated == 0


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
    key = outcome_cache.Key(release_key(site), layout, 1, "small")
    for outcome, kept in ((struck, 0), (hit, 1)):
        outcome_cache._remember({key: outcome}, {key: (site, layout, 1, "small")})
        assert len(outcome_cache.bare_outcomes.recall([key._replace(layout=())])) == kept


def test_blocks_that_stop_short_by_less_than_a_step_may_have_touched(site: Site) -> None:
    layout = (Fence(15.0, 2.0, energy_class=250),)
    near, far = (replace(cases.outcome("small"), reach=(0.0, 15.0 - d)) for d in (0.25, 0.5))
    assert not outcome_cache.misses(site, release_key(site), layout, near)
    assert outcome_cache.misses(site, release_key(site), layout, far)


def test_outcomes_without_barriers_have_nothing_held(site: Site) -> None:
    held = replace(cases.outcome("small", 0.0, False, held=0.5), reach=(0.0, 5.0))
    key = outcome_cache.Key(release_key(site), (Fence(15.0, 2.0, energy_class=100),), 1, "small")
    outcome_cache._remember({key: held}, {key: (site, key.layout, 1, "small")})
    (kept,) = outcome_cache.bare_outcomes.recall([key._replace(layout=())]).values()
    assert (kept.held_fraction, kept.slope_fraction) == (0.0, 1.0)
