"""Risk to life: closed forms of the established method, its part of Z, and targets."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from light_site import LIGHT

import rigdda
from rigdda import BadInput, Fence, GravityWall, Outcome, Site
from rigdda.app.reports.tables import write_outcomes
from rigdda.envs import DesignProblem
from rigdda.envs.cost import Risk, judge
from rigdda.envs.intervals import Mean
from rigdda.envs.problem import MET, MISSED, UNDECIDED, Targets, excess
from rigdda.model.traffic import Traffic

TRAFFIC = Traffic(vehicles_per_day=7200.0, speed=72.0, section_length=250.0)


@pytest.fixture(scope="module")
def site() -> Site:
    return msgspec.structs.replace(LIGHT, traffic=TRAFFIC)


def outcome(event: str, width: float, volume: float, on_road: float, energy: float) -> Outcome:
    """Return an outcome with these results on the road and no barriers."""
    return Outcome(
        event=event,
        width=width,
        released_mass=1e4,
        released_volume=5.0,
        road_volume=volume,
        reached=volume > 0.0,
        reach=(0.0, 50.0),
        debris_fraction=volume / 5.0,
        debris_on_road=on_road,
        max_energy_on_road=energy,
        run_out=(40.0, 40.0, 40.0),
        slope_fraction=0.0,
        held_fraction=0.0,
        road_fraction=1.0,
        beyond_fraction=0.0,
        barriers=(),
    )


def test_temporal_and_spatial_probability_is_that_of_bunce() -> None:
    """N_v / 24 * L_v / V of a rock without width: 7,200 vehicles of 5.4 m a day at 72 km/h."""
    by_hand = 7200.0 / 24.0 * 5.4 / 1000.0 / 72.0
    assert float(TRAFFIC.hit(0.0)) == pytest.approx(by_hand, rel=1e-14)
    assert by_hand == pytest.approx(0.0225)


def test_the_width_of_the_rock_adds_to_the_length_of_the_vehicle() -> None:
    assert float(TRAFFIC.hit(2.0)) == pytest.approx(0.0225 * (5.4 + 2.0) / 5.4, rel=1e-14)


def test_hits_are_a_poisson_mean() -> None:
    """Vehicles that pass at random: the mean number within 7.4 m equals the closed form."""
    rng, density = np.random.default_rng(1), 7200.0 / 24.0 / 72_000.0
    road, width, length = 2_000.0, 2.0, 5.4
    seen = []
    for _ in range(20_000):
        front = rng.uniform(0.0, road, rng.poisson(density * road))
        rock = 0.5 * road
        seen.append(np.count_nonzero((front > rock) & (front - length < rock + width)))
    spread = np.std(seen) / math.sqrt(len(seen))
    assert abs(np.mean(seen) - float(TRAFFIC.hit(width))) < 4.0 * spread


def test_stopping_distance_is_that_of_aashto() -> None:
    """20 m/s: 2.5 s of reaction and 3.4 m/s2."""
    assert TRAFFIC.stopping == pytest.approx(20.0 * 2.5 + 400.0 / 6.8, rel=1e-14)
    usual = msgspec.structs.replace(TRAFFIC, speed=80.0)
    assert usual.stopping == pytest.approx(129.0, abs=2.0)  # 130 m in the table of the guide


def test_vehicles_closer_than_the_decision_sight_distance_run_into_debris() -> None:
    own = msgspec.structs.replace(TRAFFIC, decision_sight_distance=120.0)
    assert own.stopped_late == pytest.approx(7200.0 / 24.0 / 72_000.0 * 120.0, rel=1e-14)
    given = msgspec.structs.replace(TRAFFIC, run_into=0.4)
    assert given.stopped_late == 0.4


def test_vulnerability_is_interpolated() -> None:
    table = msgspec.structs.replace(TRAFFIC, vulnerability=((1.0, 0.2), (3.0, 0.8)))
    volumes = np.array([0.0, 1.0, 2.0, 3.0, 50.0])
    assert table.deadly(volumes, 0.0).tolist() == pytest.approx([0.2, 0.2, 0.5, 0.8, 0.8])
    by_energy = Traffic(
        7200.0, 72.0, 250.0, vulnerability=((10.0, 0.1), (110.0, 1.0)), vulnerability_by="energy"
    )
    assert float(by_energy.deadly(0.0, 60e3)) == pytest.approx(0.55)


def test_risk_of_a_site_equals_hand_calculation(site: Site) -> None:
    """Two releases of each event: 1 of 2 blocks reaches the road and stays, nothing else does."""
    names = site.event_names
    assert names == ("block", "group")
    hit = outcome("block", 1.2, 1.0, 1.2, 0.0)
    found = [hit, replace(hit, road_volume=0.0, reached=False, debris_on_road=0.0)]
    for name in names[1:]:
        found += [outcome(name, 5.0, 0.0, 0.0, 0.0)] * 2
    risk = judge(site, (), found, {}, {}).risk
    assert risk is not None
    density, rate = 7200.0 / 24.0 / 72_000.0, 0.6 / 100.0
    hits = rate * 0.5 * density * (5.4 + 1.2)
    runs = rate * 0.5 * density * (20.0 * 2.5 + 400.0 / 6.8)
    killed = 1.5 * (hits * 0.3 + runs * 0.1)
    assert risk.hit.value == pytest.approx(250.0 * hits, rel=1e-12)
    assert risk.run_into.value == pytest.approx(250.0 * runs, rel=1e-12)
    assert risk.fatalities.value == pytest.approx(250.0 * killed, rel=1e-12)
    assert risk.per_km.value == pytest.approx(1000.0 * killed, rel=1e-12)
    person = 500.0 / (365.0 * 7200.0) * 250.0 * killed / 1.5
    assert risk.individual.value == pytest.approx(person, rel=1e-12)
    assert risk.individual.low < risk.individual.value < risk.individual.high


def test_the_risk_is_that_of_rock_only_as_the_outcome_table_gives_it(tmp_path: Path) -> None:
    """The formula of docs/risk.md by hand; a wall that was pushed onto the road does not count."""
    wall = GravityWall(25.0, 2.0, 1.0)
    site = msgspec.structs.replace(LIGHT, traffic=_with(vulnerability=((0.5, 0.1), (4.0, 0.9))))
    jobs = [(site, (wall,), seed, name) for name in site.event_names for seed in range(30)]
    simulated = rigdda.release_many(jobs)
    pushed = [
        replace(o, barriers=(replace(o.barriers[0], failed=True, state="slid", road_area=1.5),))
        for o in simulated
    ]
    write_outcomes(tmp_path / "outcomes.csv", [job[2] for job in jobs], pushed)
    with (tmp_path / "outcomes.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    density, late = 7200.0 / 24.0 / 72_000.0, 20.0 * 2.5 + 400.0 / 6.8
    hits = killed = 0.0
    for name in site.event_names:
        own, rate = [r for r in table if r["event"] == name], site.event(name).rate / 100.0
        for row in own:
            came, lies = row["reached"] == "True", float(row["debris_on_road"]) > 0.0
            n_h = density * (5.4 + float(row["width"])) * came
            v_h = float(np.interp(float(row["road_volume"]), [0.5, 4.0], [0.1, 0.9]))
            hits += rate * n_h / len(own)
            killed += rate * 1.5 * (n_h * v_h + density * late * lies * 0.1) / len(own)
    assert 0 < sum(row["reached"] == "True" for row in table) < len(table)
    risk = judge(site, (wall,), pushed, {}, {}).risk
    assert risk is not None
    assert risk.hit.value == pytest.approx(250.0 * hits, rel=1e-12)
    assert risk.fatalities.value == pytest.approx(250.0 * killed, rel=1e-12)
    person = 500.0 / (365.0 * 7200.0 * 1.5) * 250.0 * killed
    assert risk.individual.value == pytest.approx(person, rel=1e-12)
    assert judge(site, (wall,), simulated, {}, {}).risk == risk
    harm = [judge(site, (wall,), each, {}, {}).harm for each in (simulated, pushed)]
    assert harm[0] < harm[1]


def test_individual_risk_of_a_passage_is_that_of_one_vehicle() -> None:
    """One trip a year: (L_v + w) / V of the year times the falls of a year."""
    one = msgspec.structs.replace(TRAFFIC, commuter_trips=1.0, run_into=0.0)
    falls = 3.0  # per year on the section
    fatal = falls * float(one.consequences(True, False, 2.0, 1.0, 0.0).fatalities)
    by_hand = falls * (5.4 + 2.0) / 72_000.0 / (365.0 * 24.0) * 0.3
    assert fatal * one.person == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize(("vehicles", "occupancy"), [(2.0, 1.0), (2.0, 1.5), (4.0, 0.5)])
def test_the_risk_of_one_person_is_at_most_that_of_all(vehicles: float, occupancy: float) -> None:
    """Who is in every vehicle that has a person in it shares its risk with the other persons."""
    alone = _with(vehicles_per_day=vehicles, occupancy=occupancy, commuter_trips=730.0)
    assert alone.person == pytest.approx(1.0 / max(1.0, occupancy), rel=1e-12)
    with pytest.raises(BadInput, match="commuter_trips = 731"):
        msgspec.structs.replace(alone, commuter_trips=731.0)


def test_fatalities_are_priced_into_z(site: Site) -> None:
    hit = outcome("block", 1.2, 1.0, 1.2, 0.0)
    before = site.bill((), hit).harm
    priced = msgspec.structs.replace(site, traffic=_with(fatality_value=5e6))
    more = 5e6 * float(site.traffic_consequences((), hit).fatalities)
    assert priced.bill((), hit).harm == pytest.approx(before + more, rel=1e-14)
    bare = msgspec.structs.replace(site, traffic=None)
    assert bare.bill((), hit) == site.bill((), hit)


def test_risk_of_releases_does_not_change_z(site: Site) -> None:
    seeds = range(40)
    bare = DesignProblem(LIGHT).evaluate((), seeds)
    found = DesignProblem(site).evaluate((), seeds)
    assert bare.risk is None
    assert found.risk is not None
    assert found.risk.fatalities.value > 0.0
    assert found.objective == bare.objective
    assert found.ci == bare.ci


def test_reward_follows_the_value_of_a_fatality(site: Site) -> None:
    priced = msgspec.structs.replace(site, traffic=_with(fatality_value=1e9))
    fence = (Fence(30.0, 3.0, energy_class=1000),)
    problem = DesignProblem(priced)
    found, nothing = problem.evaluate(fence, range(60)), problem.nothing
    assert found.risk is not None
    assert nothing.risk is not None
    assert nothing.objective > 10.0 * DesignProblem(LIGHT).nothing.objective
    assert problem.reward(found) == (nothing.objective - found.objective) / nothing.objective


def _with(**values: float) -> Traffic:
    return msgspec.structs.replace(TRAFFIC, **values)


positive = st.floats(0.01, 100.0)


@given(st.floats(0.0, 30.0), st.floats(0.0, 200.0), st.booleans(), positive)
def test_doubling_traffic_doubles_the_toll_but_not_the_individual_risk(
    width: float, volume: float, lies: bool, trips: float
) -> None:
    one = _with(commuter_trips=trips)
    two = _with(commuter_trips=trips, vehicles_per_day=14_400.0)
    tolls = [t.consequences(True, lies, width, volume, 0.0) for t in (one, two)]
    for a, b in zip(*tolls, strict=True):
        assert float(b) == pytest.approx(2.0 * float(a), rel=1e-12)
    persons = [float(t.fatalities) * o.person for t, o in zip(tolls, (one, two), strict=True)]
    assert persons[1] == pytest.approx(persons[0], rel=1e-12)


@given(
    st.sampled_from(("vehicle_length", "occupancy", "commuter_trips", "decision_sight_distance")),
    st.floats(1.0, 50.0),
    st.floats(1.0, 3.0),
)
def test_risk_grows_with_every_exposure(name: str, value: float, factor: float) -> None:
    less, more = _with(**{name: value}), _with(**{name: value * factor})
    tolls = [t.consequences(True, True, 2.0, 3.0, 0.0).fatalities for t in (less, more)]
    assert tolls[1] >= tolls[0]
    each = [float(f) * t.person * t.occupancy for f, t in zip(tolls, (less, more), strict=True)]
    assert each[1] >= each[0] * (1.0 - 1e-12)


@given(st.lists(st.tuples(st.floats(0.0, 100.0), st.floats(0.0, 1.0)), min_size=1, max_size=5))
def test_deadly_grows_with_size_if_the_table_does(pairs: list[tuple[float, float]]) -> None:
    sizes = sorted({round(size, 3) for size, _ in pairs})
    chances = sorted(chance for _, chance in pairs)[: len(sizes)]
    table = msgspec.structs.replace(TRAFFIC, vulnerability=tuple(zip(sizes, chances, strict=True)))
    values = table.deadly(np.linspace(0.0, 120.0, 60), 0.0)
    assert (np.diff(values) >= -1e-12).all()
    assert values.min() >= 0.0
    assert values.max() <= 1.0


def test_target_of_individual_risk_has_three_states(site: Site) -> None:
    none = Mean(0.0, 0.0, 0.0)
    for value, state in (
        (Mean(5e-7, 2e-7, 9e-7), MET),
        (Mean(1e-6, 5e-7, 2e-6), UNDECIDED),
        (Mean(3e-6, 2e-6, 4e-6), MISSED),
    ):
        risk = Risk(none, none, none, none, value)
        assert Targets(individual=1e-6).state([], {}, {}, risk) == state
    assert excess(2e-6, 1e-6) == pytest.approx(0.5)
    assert excess(1e-7, 1e-6) == excess(0.0, 1e-6) == 0.0


def test_target_of_individual_risk_is_part_of_the_reward(site: Site) -> None:
    problem = DesignProblem(site, targets={"individual": 1e-12})
    nothing = problem.nothing
    assert nothing.targets == "missed"
    assert -2.0 <= problem.reward(nothing) < -1.0
    assert DesignProblem(site, targets={"individual": 1.0}).nothing.targets == "met"
    design = Targets(reach=0.5, individual=1e-12)
    assert DesignProblem(site, targets=design).nothing.targets == "missed"


def test_target_needs_traffic() -> None:
    with pytest.raises(BadInput, match=r"targets.individual = 1e-06: add the table \[traffic\]"):
        DesignProblem("quick", targets={"individual": 1e-6})


def test_round_trip(site: Site, tmp_path: Path) -> None:
    own = msgspec.structs.replace(
        site,
        traffic=_with(run_into=0.1, vulnerability=((1.0, 0.1), (2.0, 0.5)), fatality_value=5e6),
    )
    for one in (own, site, rigdda.sites.load("quick")):
        one.save(tmp_path / "site.toml")
        assert Site.load(tmp_path / "site.toml") == one
