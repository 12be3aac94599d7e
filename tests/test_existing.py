"""Barriers that stand already: part of every layout, worn, sunk, kept, removed or replaced."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from light_site import LIGHT

import rigdda
from rigdda import BadInput, Ditch, Fence, Mesh, Site, release, release_many
from rigdda.agents import designers
from rigdda.agents.designers.menu import Menu
from rigdda.app.reports import findings
from rigdda.app.reports.wording import before, order, unchanged
from rigdda.app.site_check import facts
from rigdda.app.site_oddities import oddities
from rigdda.app.uncertainty.parameters import plausible
from rigdda.barriers import Removal
from rigdda.barriers.fence import WornFence
from rigdda.envs import DesignProblem
from rigdda.envs.comparison import difference_of_accounts, same_structures
from rigdda.envs.cost import Account, Facts
from rigdda.envs.intervals import Known
from rigdda.envs.rendering import picture
from rigdda.envs.repetition import repeat
from rigdda.envs.replay_record import ReleaseRecord, release_record
from rigdda.envs.site_sampling import EpisodeSites
from rigdda.model.existing import Existing

OLD = Existing("fence", 20.0, 2.0, energy_class=250, condition=0.5, removable=True, removal=60.0)
FIXED = msgspec.structs.replace(OLD, removable=False, removal=None)
NEW = Fence(30.0, 2.0, energy_class=250)
REPLACING = Fence(20.2, 3.0, energy_class=1000)


def having(*existing: Existing) -> Site:
    return msgspec.structs.replace(LIGHT, existing=existing)


@pytest.fixture(scope="module")
def site() -> Site:
    return having(OLD)


def test_it_is_part_of_every_layout(site: Site) -> None:
    (old,) = site.existing_barriers
    assert old == WornFence(20.0, 2.0, energy_class=250, condition=0.5)
    assert having(msgspec.structs.replace(OLD, condition=1.0)).existing_barriers == (
        Fence(20.0, 2.0, energy_class=250),
    )
    assert site.standing() == (old,)
    assert site.standing((NEW, Mesh(4.0, "face"))) == (NEW, old)
    assert site.standing(site.as_built((NEW,))) == (NEW, old)  # adding it again changes nothing
    assert site.labels((NEW,)) == (NEW.label, "existing fence 250 kJ at 50 %, 2.0 m high")


def test_condition_reduces_the_energy_not_the_height(site: Site) -> None:
    (old,) = site.existing_barriers
    for width in (1.5, 30.0):
        new = Fence(20.0, 2.0, energy_class=250).for_width(width)
        worn = old.for_width(width)
        assert new.capacity is not None
        assert worn.capacity == pytest.approx(0.5 * new.capacity, rel=1e-15)
        assert worn.left_height(0.0) == 2.0


def test_a_worn_fence_acts_as_one_of_its_remaining_capacity() -> None:
    """125 kJ over the width of the mass, 10 m."""
    bare = rigdda.sites.load("quick")
    site = msgspec.structs.replace(bare, existing=(OLD,))
    same = (Fence(20.0, 2.0, capacity=12.5e3, elongation=2.5),)
    for seed in range(3):
        found, expected = release(site, (), seed, "mass")[1], release(bare, same, seed, "mass")[1]
        assert found == expected
        assert found.barriers[0].resistance == 12.5e3 / 2.5


def test_a_run_with_a_worn_fence_reads_back(tmp_path: Path) -> None:
    run, _ = release(having(OLD), (NEW,), 0, "block")
    run.save(tmp_path / "run.npz")
    assert rigdda.Run.load(tmp_path / "run.npz").scene.barriers == run.scene.barriers


def straight(band: tuple[float, float], road: float) -> Site:
    """Return a site on a slope of 1:2 down to x = 80, with single blocks from a band."""
    source = msgspec.structs.replace(LIGHT.sources[0], band=band)
    slope = msgspec.structs.replace(
        LIGHT.slope, points=((0.0, 40.0), (80.0, 0.0), (140.0, 0.0)), toe=20.0, surfaces=()
    )
    return msgspec.structs.replace(
        LIGHT,
        slope=slope,
        sources=(source,),
        events=tuple(e for e in LIGHT.events if e.source == source.name),
        road=msgspec.structs.replace(LIGHT.road, start=road, end=road + 8.0),
        barrier_zone=msgspec.structs.replace(LIGHT.barrier_zone, start=12.0, end=road - 0.5),
    )


LONG_SIDE = Existing("embankment", 20.0, 2.0, width=1.0, side_slope=1.0)
"""Its downhill side begins at x = 23, 3.5 m above the slope of 1:2, and meets it at x = 30.

On level ground, it would end at x = 25.
"""


def test_the_foot_of_an_old_embankment_stays_off_the_road() -> None:
    assert LONG_SIDE.barrier.works(straight((2.0, 4.0), 90.0).profile) == (20.0, 30.0)
    near = msgspec.structs.replace(straight((2.0, 4.0), 30.0), existing=(LONG_SIDE,))
    assert near.existing_barriers == (LONG_SIDE.barrier,)
    with pytest.raises(BadInput, match=r"existing\[0\]\.x = 20\.0: put all of it, up to 30"):
        msgspec.structs.replace(straight((2.0, 4.0), 29.5), existing=(LONG_SIDE,))


def test_the_foot_of_an_embankment_stays_off_loose_rock() -> None:
    site = straight((34.0, 36.0), 90.0)
    assert site.built((LONG_SIDE.barrier,), 10.0)
    hint = "put it outside the loose rock"
    with pytest.raises(BadInput, match=rf"barriers\[0\]\.x = 24\.0: {hint}"):
        site.built((msgspec.structs.replace(LONG_SIDE.barrier, x=24.0),), 10.0)
    with pytest.raises(BadInput, match=rf"existing\[0\]\.x = 24\.0: {hint}"):
        msgspec.structs.replace(site, existing=(msgspec.structs.replace(LONG_SIDE, x=24.0),))


def test_the_section_of_a_site_with_rates_of_arrivals_is_drawn() -> None:
    events = tuple(msgspec.structs.replace(e, rate_of="arrival") for e in LIGHT.events)
    arriving = msgspec.structs.replace(LIGHT, events=events)
    assert len(arriving.section((NEW,)).barriers) == 1


def test_a_release_equals_that_of_the_same_barrier_in_a_layout(site: Site) -> None:
    """The outcome is that of a site without it and a layout with it, alone and in batches."""
    bare, (old,) = LIGHT, site.existing_barriers
    for seed in range(6):
        expected = release(bare, (NEW, old), seed, "group")[1]
        assert release(site, (NEW,), seed, "group")[1] == expected
        assert release_many([(site, (NEW,), seed, "group")]) == [expected]
    drawn = {"block": range(12), "group": range(12)}
    found = DesignProblem(site, max_barriers=2).sample((NEW,), drawn)
    jobs = [(bare, (NEW, old), seed, name) for name in drawn for seed in drawn[name]]
    assert list(found) == release_many(jobs)


@pytest.mark.slow
def test_its_capital_is_sunk_and_its_upkeep_counts(site: Site) -> None:
    """1.5 % a year of the price of a new fence of 250 kJ: (200 * 2 + 300) EUR times access."""
    bare = LIGHT
    worth = (200.0 * 2.0 + 300.0) * bare.access(20.0)
    assert site.capital(()) == 0.0
    assert site.annual(()) == pytest.approx(0.015 * worth, rel=1e-14)
    assert site.capital((NEW,)) == bare.capital((NEW,))
    assert site.annual((NEW,)) == pytest.approx(bare.annual((NEW,)) + 0.015 * worth, rel=1e-14)
    nothing = DesignProblem(site).nothing
    assert nothing.capital == site.annual(())
    assert nothing.cost == 0.0


def test_removing_it_costs_once_and_saves_the_upkeep(site: Site) -> None:
    gone = (Removal(20.0),)
    assert site.standing(gone) == ()
    assert site.capital(gone) == 60.0
    assert site.annual(gone) == pytest.approx(60.0 * site.prices.annuity("removal"), rel=1e-14)
    for seed in range(4):
        assert release(site, gone, seed)[1] == release(LIGHT, (), seed)[1]


def test_a_barrier_in_its_place_replaces_it(site: Site) -> None:
    bare = LIGHT
    assert site.standing((REPLACING,)) == (REPLACING,)
    assert site.capital((REPLACING,)) == pytest.approx(bare.capital((REPLACING,)) + 60.0)
    expected = bare.annual((REPLACING,)) + 60.0 * site.prices.annuity("removal")
    assert site.annual((REPLACING,)) == pytest.approx(expected, rel=1e-14)
    both = (Removal(20.0), REPLACING)
    assert site.capital(both) == pytest.approx(site.capital((REPLACING,)), rel=1e-14)
    assert site.annual(both) == pytest.approx(expected, rel=1e-14)


def test_its_repair_costs_the_price_of_a_new_one() -> None:
    weak = having(msgspec.structs.replace(OLD, condition=0.05))
    bare = LIGHT
    seed = next(s for s in range(50) if release(weak, (), s, "group")[1].barriers[0].failed)
    outcome = release(weak, (), seed, "group")[1]
    worth = (200.0 * 2.0 + 300.0) * bare.access(20.0)
    held = weak.prices.removal * outcome.held_fraction * outcome.released_volume
    assert weak.bill((), outcome).repair == pytest.approx(10.0 * worth + held, rel=1e-12)


def test_designers_keep_clear_of_what_stays() -> None:
    problem = DesignProblem(having(FIXED), max_barriers=2)
    assert "removal" not in problem.kinds
    mend = "clear of the existing fence at 20 to 22.7"
    with pytest.raises(BadInput, match=mend):
        problem.check((REPLACING,))
    with pytest.raises(BadInput, match=mend):
        problem.check((Fence(16.0, 3.0, energy_class=500),))  # its elongation ends at 19.7
    assert problem.fits((NEW,))
    menu = Menu(problem)
    old = 20.0, 22.7
    for kind in problem.kinds:
        for barrier in menu.singles(kind):
            if kind != "mesh":
                start, end = problem.place.works(barrier)
                assert start >= old[1] or end + barrier.deflection <= old[0]


@given(st.integers(0, 2**32 - 1))
def test_every_vector_decodes_to_a_layout_clear_of_what_stays(seed: int) -> None:
    problem = VECTORS
    layout = problem.decode(np.random.default_rng(seed).uniform(-1.0, 1.0, problem.size))
    assert problem.check(layout) == layout
    assert problem.site.existing_barriers[1] in problem.site.standing(layout)


VECTORS = DesignProblem(having(OLD, Existing("ditch", 30.5, depth=1.0, width=2.0)), max_barriers=3)


def test_layouts_with_removals_are_encoded() -> None:
    assert VECTORS.kinds[-1] == "removal"
    for layout in ((Removal(20.0),), (REPLACING,), (Fence(12.0, 2.0, energy_class=250),), ()):
        assert VECTORS.decode(VECTORS.encode(layout)) == layout
    twice = VECTORS.encode((Removal(20.0),))
    width = len(twice) // 3
    twice[width : 2 * width] = twice[:width]
    assert VECTORS.decode(twice) == (Removal(20.0),)
    assert VECTORS.dropped(twice) == ("slot 1: removal: an earlier slot already removes it",)


def test_what_a_layout_removes_is_named(site: Site) -> None:
    old = "removed with this layout: existing fence 250 kJ at 50 %, 2.0 m high at x = 20.0 m"
    assert findings.removed(site, (Removal(20.0),)) == old
    assert old in findings.of_layout(site, (REPLACING,), None)
    assert findings.removed(site, (NEW,)) == findings.removed(site, ()) == ""


@pytest.mark.parametrize(
    ("barrier", "words"),
    [
        (Removal(20.0), "removal of the existing barrier at x = 20.0 m"),
        (Ditch(12.0, 1.0, 2.0), "ditch 1.0 m deep, 2.0 m wide at x = 12.0 m"),
        (Mesh(5.0, "spot"), "mesh: spot"),
    ],
)
def test_a_barrier_and_its_place_are_named_once(barrier: rigdda.Barrier, words: str) -> None:
    assert barrier.label_and_place == words


@pytest.mark.parametrize(
    "name",
    [*(pytest.param(n, marks=pytest.mark.slow) for n in ("race", "rule")), "random", "constant"],
)
def test_designers_choose(name: str, site: Site) -> None:
    problem = DesignProblem(site, max_barriers=2)
    found = designers.module(name).design(problem, 400, seed=1)
    assert problem.check(found.layout) == found.layout
    assert found.evaluation.capital == problem.site.annual(found.layout)


def test_a_layout_of_a_user_may_not_overlap_what_stays() -> None:
    site = having(FIXED)
    with pytest.raises(BadInput, match=r"barriers\[0\].x = 20.1: .*existing fence"):
        release(site, (Fence(20.1, 2.0, energy_class=250),), 0)
    with pytest.raises(BadInput, match=r"barriers\[0\].x = 20.0: leave it out: the site has no"):
        release(site, (Removal(20.0),), 0)
    with pytest.raises(BadInput, match=r"barriers\[0\].x = 20.0: leave it out"):
        release(LIGHT, (Removal(20.0),), 0)
    with pytest.raises(BadInput, match=r"barriers\[0\].x = 5.0: give 20"):
        release(having(OLD), (Removal(5.0),), 0)
    with pytest.raises(BadInput, match="use the block model"):
        rigdda.lumped(site, (), range(2), "block")


def test_it_is_named_and_drawn(site: Site) -> None:
    (line,) = [line for line in facts(site) if line.startswith("existing")]
    assert "fence 250 kJ at 50 %, 2.0 m high at x = 20 m" in line
    assert "may be removed or replaced for 60 EUR per metre" in line
    near = having(Existing("fence", 33.0, 2.0, energy_class=250))
    assert any("existing[0].x = 33: the fence gives way" in line for line in oddities(near))
    outlines = site.section((NEW,)).barriers
    assert [outline.old for outline in outlines] == [False, True]
    run, _ = release(site, (NEW,), 0, "block")
    plain, _ = release(LIGHT, (NEW, *site.existing_barriers), 0, "block")
    images = [picture(run, site, (NEW,), ""), picture(plain, having(), site.standing((NEW,)), "")]
    assert images[0].shape == images[1].shape
    assert (images[0] != images[1]).any()


def test_round_trip(site: Site, tmp_path: Path) -> None:
    for one in (site, having(OLD, Existing("ditch", 30.5, depth=1.0, width=2.0))):
        one.save(tmp_path / "site.toml")
        assert Site.load(tmp_path / "site.toml") == one


def test_an_earthwork_that_stands_changes_the_ground() -> None:
    site = having(Existing("ditch", 30.5, depth=1.0, width=2.0))
    bare = LIGHT
    ditch = Ditch(30.5, 1.0, 2.0)
    for seed in range(4):
        assert release(site, (), seed, "block")[1] == release(bare, (ditch,), seed, "block")[1]


def test_reports_say_what_happens_to_it(site: Site) -> None:
    assert findings.existing_barriers(site, (NEW,)) == [
        "existing fence 250 kJ at 50 %, 2.0 m high, at x = 20.0 m: kept"
    ]
    assert findings.existing_barriers(site, (REPLACING,))[0].endswith(": removed")
    assert order(Removal(20.0), site) == (
        "remove the existing barrier at x = 20.0 m: 60 EUR per metre"
    )
    bare = LIGHT
    assert (unchanged(site), before(site)) == ("as it stands", "as it stands")
    assert (unchanged(bare), before(bare)) == ("no barrier", "without barriers")
    assert findings.existing_barriers(bare, (NEW,)) == []


def test_a_record_of_a_release_is_repeated(site: Site) -> None:
    for layout in ((NEW,), (Removal(20.0),)):
        _, outcome = release(site, layout, 3, "group")
        text = release_record(site, layout, 3, "group", outcome)
        again = repeat(msgspec.json.decode(text, type=ReleaseRecord))
        assert again.same


def test_an_environment_takes_sites_with_and_without_it(site: Site) -> None:
    slots = EpisodeSites(site, 2, None, "full").slots
    assert slots.kinds[-1] == "removal"
    assert "removal" not in slots.shared(LIGHT)
    assert slots.shared(site) == slots.kinds


def test_a_removal_and_a_replacement_in_its_place_are_the_same_structures() -> None:
    site = Site.load("old-fence")
    old = site.existing_barriers[0]
    assert site.existing[0].removable
    new = Fence(old.x, 4.0, energy_class=1000)
    one, two = (new,), (Removal(old.x), new)
    assert same_structures(site, one, one) and not same_structures(site, one, ())
    assert same_structures(site, one, two)
    assert not same_structures(site, one, (Removal(old.x),))
    names = site.event_names
    count = 5 * len(names)
    parts = Account(
        np.repeat(names, 5),
        np.arange(count, dtype=float),
        *np.zeros((2, count)),
        *np.zeros((2, count), dtype=bool),
    )
    facts = {name: Facts(9, 0, Known(1e6, 1.0), Known(1.0, 1.0), 1.0, 1.0) for name in names}
    found = difference_of_accounts(site, (one, two), (parts, parts), facts)
    assert found.value == pytest.approx(0.0, abs=1e-9) and found.differ == 0
    assert np.ptp(found.ci) == 0.0


def test_the_sensitivity_counts_the_money_of_what_stands() -> None:
    site = Site.load("old-fence")
    assert "prices.level" in {one.path for one in plausible(site, ())["prices"]}
    assert "prices.interest" not in {one.path for one in plausible(site, ())["prices"]}
    bare = {one.path for one in plausible(msgspec.structs.replace(site, existing=()), ())["prices"]}
    assert "prices.level" not in bare
