"""The cost of a year and its parts, the spread of releases over events, targets, the reward."""

from __future__ import annotations

import itertools
import math
import multiprocessing
import os
import pickle
import subprocess
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cases
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigdda import BadInput, Ditch, Fence, Outcome, Site, Wall
from rigdda.barriers import Removal
from rigdda.envs import compare, design_envelope, ensemble, site_store
from rigdda.envs import cost as costs
from rigdda.envs.cost import judge
from rigdda.envs.outcome_cache import Memory
from rigdda.envs.problem import DesignProblem, Targets, events_of_seeds
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.model.existing import Existing
from rigdda.model.traffic import Traffic

EVENTS = ("small", "block", "low", "group")
FENCE = (Fence(12.0, 2.0, energy_class=250),)


@pytest.fixture(scope="module")
def site() -> Site:
    return cases.cut()


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Nothing is read from, or left in, the user's cache; few releases tell of the site."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("nothing")
        patch.setattr(site_store, "path_of", lambda name, key: folder / f"{name}-{key.hex()}")
        patch.setattr(ensemble, "memory", Memory(64))
        patch.setattr(ensemble, "FIRST_ROUND", 6)
        patch.setattr(ensemble, "BOTH_ROUNDS", 60)
        yield


@pytest.fixture(scope="module")
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site)


def hand_made(reached: dict[str, int], failed: dict[str, int] | None = None) -> list[Outcome]:
    """Return ten outcomes of each event, of which so many reached the road with half a m3."""
    out = []
    for name in EVENTS:
        broke = (failed or {}).get(name, 0)
        for i in range(10):
            volume = 0.5 if i < reached.get(name, 0) else 0.0
            out.append(cases.outcome(name, volume, i < broke))
    return out


def test_z_is_capital_harm_and_repair_by_rate(problem: DesignProblem, site: Site) -> None:
    outcomes = hand_made({"small": 3, "group": 10}, {"group": 2})
    found = problem.judge(FENCE, outcomes)
    harm = site.consequences.harm(0.5, True)
    mend = site.capital(FENCE) * 10.0
    assert found.capital == site.annual(FENCE)
    assert found.cost == site.capital(FENCE)
    assert found.harm == pytest.approx((1.0 * 0.3 + 0.05) / 100.0 * harm)
    assert found.repair == pytest.approx(0.05 / 100.0 * 0.2 * mend)
    assert found.objective == pytest.approx(found.capital + found.harm + found.repair)
    assert found.by_event["low"] == 0.0
    assert found.by_event["group"] == pytest.approx(0.0005 * (harm + 0.2 * mend))
    assert sum(found.by_event.values()) == pytest.approx(found.harm + found.repair)
    assert found.debris == pytest.approx((1.0 * 0.3 + 0.05) / 100.0 * 0.5)
    assert found.releases == 40
    for value, (low, high) in (
        (found.objective, found.ci),
        (found.harm, found.harm_ci),
        (found.repair, found.repair_ci),
        (found.debris, found.debris_ci),
    ):
        assert 0.0 <= low < value < high
    assert found.ci[0] >= found.capital


def test_probabilities_are_those_of_each_event(problem: DesignProblem) -> None:
    found = problem.judge(FENCE, hand_made({"small": 3}, {"group": 2}))
    assert (found.reach["small"].count, found.reach["small"].releases) == (3, 10)
    assert found.failure["group"].probability == 0.2
    assert found.reach["block"].probability == 0.0
    assert found.reach["block"].bound == pytest.approx(1.0 - 0.05**0.1)


def test_mesh_makes_events_rarer_and_is_paid_for(problem: DesignProblem, site: Site) -> None:
    outcomes = [replace(o, barriers=()) for o in hand_made({"small": 3, "block": 5})]
    mesh = (problem.place.mesh(1),)
    bare, meshed = problem.judge((), outcomes), problem.judge(mesh, outcomes)
    assert meshed.by_event["small"] == pytest.approx(0.1 * bare.by_event["small"])
    assert meshed.by_event["block"] == pytest.approx(0.5 * bare.by_event["block"])
    assert meshed.capital == site.annual(mesh) > 0.0


def test_outcomes_of_every_event_are_needed(problem: DesignProblem) -> None:
    with pytest.raises(BadInput, match="outcomes = 'none of block': include releases of every"):
        problem.judge((), [cases.outcome("small")] * 40)
    with pytest.raises(BadInput, match=r"outcomes = .*: give at least one"):
        problem.judge((), [])


def test_a_few_releases_are_unbiased_and_even() -> None:
    shares = {"a": 0.55, "b": 0.3, "c": 0.15}
    rng = np.random.default_rng(3)
    for releases in (1, 3, 5):
        count: Counter[str] = Counter()
        for _ in range(3000):
            drawn = events_of_seeds(shares, rng.integers(2**31, size=releases).tolist())
            count.update(drawn)
            if releases == 5:
                assert 1 <= drawn.count("a") <= 4
        for name, share in shares.items():
            assert count[name] / (3000 * releases) == pytest.approx(share, abs=0.03)


def test_a_few_releases_cost_what_many_do_on_the_average(
    problem: DesignProblem, site: Site
) -> None:
    volume = {"small": 0.2, "block": 0.8, "low": 0.1, "group": 3.0}
    values = []
    for seed in range(3000):
        names = problem.plan([seed, seed + 1, seed + 2])
        found = problem.judge((), [cases.outcome(n, volume[n], released=4.0) for n in names])
        values.append(found.objective)
        assert found.ci[0] <= found.objective <= found.ci[1]
    true = sum(site.rate(n, ()) * site.consequences.harm(v, True) for n, v in volume.items())
    assert np.mean(values) == pytest.approx(true, abs=4.0 * np.std(values) / math.sqrt(3000))


def test_a_release_tells_only_what_barriers_change(problem: DesignProblem) -> None:
    """Whatever event is drawn: as usual, Z is that of nothing; stopped, it falls by its share."""
    free, known = problem.nothing, problem._known
    for name, fact in known.facts.items():
        chance = fact.reached / fact.releases
        usual = cases.outcome(name, 1.0)
        harm = problem.site.bill((), usual).harm
        one = problem.judge((), [usual])
        rest = (harm - chance * fact.harm.mean) * problem.site.rate(name, ()) / problem.shares[name]
        assert one.objective == pytest.approx(free.objective + rest)
        stopped = problem.judge((), [cases.outcome(name, 0.0)])
        assert problem.reward(stopped) == pytest.approx(
            free.by_event[name] / problem.shares[name] / free.objective, rel=1e-6
        )


def test_releases_spread_over_events_and_a_part_of_them_too(problem: DesignProblem) -> None:
    shares = problem.shares
    assert sum(shares.values()) == pytest.approx(1.0)
    whole = problem.plan(range(400))
    facts = problem._known.facts
    for name, share in shares.items():
        time = facts[name].blocks ** ensemble.BLOCK_COST  # less of what takes longer
        assert share >= 0.9 * ensemble.LEAST_EVENT_SHARE / 4 * 2.0 / (1.0 + time)
        assert whole.count(name) == pytest.approx(400 * share, abs=2.5)
    assert problem.plan(range(20)) == whole[:20]
    assert min(Counter(problem.plan(range(8))).values()) == 2
    assert problem.allocation(400) == dict(Counter(whole))
    assert sum(problem.allocation(3).values()) == 3


def test_a_design_event_that_takes_long_has_enough_releases() -> None:
    site = Site.load("verge")
    own = {"slab": True}
    events = tuple(
        msgspec.structs.replace(e, design=own.get(e.name, e.design)) for e in site.events
    )
    before = DesignProblem(site).allocation(3000)["slab"]
    after = DesignProblem(msgspec.structs.replace(site, events=events)).allocation(3000)["slab"]
    assert before < 90 and after == pytest.approx(100, abs=1)


@given(st.lists(st.floats(1e-6, 1.0), min_size=1, max_size=60), st.data())
def test_planned_shares(weights: list[float], data: st.DataObject) -> None:
    """They add up to 1, design events have the floor, and the others keep their proportions."""
    site = Site.load("quick")
    names = [f"{i}" for i in range(len(weights))]
    design = [data.draw(st.booleans()) for _ in names]
    events = tuple(
        msgspec.structs.replace(site.events[0], name=name, design=own)
        for name, own in zip(names, design, strict=True)
    )
    shares = {n: w / sum(weights) for n, w in zip(names, weights, strict=True)}
    known = ensemble.Ensemble(DesignProblem("quick").nothing, {}, shares)
    planned = known.planned_shares(SimpleNamespace(events=events))
    assert sum(planned.values()) == pytest.approx(1.0)
    floor = min(ensemble.DESIGN_FLOOR, 1.0 / len(names))
    assert all(planned[n] >= 0.999999 * floor for n, own in zip(names, design, strict=True) if own)
    free = [n for n, own in zip(names, design, strict=True) if not own]
    for one, two in itertools.pairwise(free):
        assert planned[one] * shares[two] == pytest.approx(planned[two] * shares[one])
    again = ensemble.Ensemble(known.nothing, {}, planned).planned_shares(
        SimpleNamespace(events=events)
    )
    assert again == pytest.approx(planned)


def test_small_verifications_hold_the_true_cost(problem: DesignProblem, site: Site) -> None:
    """Z of hand-made distributions, 200 times: 90 to 99 % of the intervals hold it."""
    chance = {"small": 0.005, "block": 0.05, "low": 0.0, "group": 0.5}
    fails = {"small": 0.0, "block": 0.02, "low": 0.0, "group": 0.3}
    volume = {"small": (0.1, 0.4), "block": (0.2, 1.0), "low": (0.1, 0.1), "group": (0.5, 6.0)}
    rng = np.random.default_rng(11)
    events = problem.plan(range(300))

    def draw(name: str) -> Outcome:
        low, high = volume[name]
        size = low * (high / low) ** rng.random()
        reached, failed = rng.random() < chance[name], rng.random() < fails[name]
        return cases.outcome(name, size * reached, bool(failed), released=8.0)

    true = site.annual(FENCE)
    for name in EVENTS:
        low, high = volume[name]
        sizes = low * (high / low) ** ((np.arange(2000) + 0.5) / 2000)
        harm = float(np.mean([site.consequences.harm(v, True) for v in sizes.tolist()]))
        cost = chance[name] * harm + fails[name] * site.capital(FENCE) * 10.0
        true += site.rate(name, FENCE) * cost
    held = 0
    for _ in range(200):
        found = problem.judge(FENCE, [draw(name) for name in events])
        held += found.ci[0] <= true <= found.ci[1]
    assert 180 <= held <= 199


def test_a_target_of_failure_asks_for_the_failures_of_design_events(site: Site) -> None:
    problem = DesignProblem(site, targets=Targets(failure=0.2))
    counts = {"small": 10, "low": 10, "block": 0}
    assert problem.judge(FENCE, hand_made(counts, {"block": 10})).targets == "missed"
    assert problem.judge(FENCE, hand_made(counts, {"small": 10})).targets != "missed"


def test_what_cannot_fail_meets_a_target_of_failure(site: Site) -> None:
    """Ten releases leave the failure of a fence undecided, but that of a ditch is impossible."""
    problem, outcomes = DesignProblem(site, targets=Targets(failure=0.01)), hand_made({})
    ditch, wall = (Ditch(12.0, 1.0, 2.0),), (Wall(12.0, 2.0),)
    for layout in ((), ditch, wall):
        found = problem.judge(layout, outcomes)
        assert found.targets == "met"
        assert [problem.excess(found, end) for end in ("upper", "value", "lower")] == [0.0] * 3
    assert problem.nothing.targets == "met"
    found = problem.judge(FENCE, outcomes)
    assert found.targets == "undecided" and problem.excess(found) > 0.2
    both = DesignProblem(site, targets=Targets(reach=0.2, failure=0.01))
    missed = both.judge(ditch, hand_made({"block": 10}))
    assert missed.targets == "missed"
    assert both.reward(missed) == -1.0 - (1.0 - 0.2)


def test_an_existing_barrier_can_fail_until_it_is_removed(site: Site) -> None:
    old = Existing("fence", 12.0, 2.0, energy_class=250, removable=True, removal=10.0)
    stands = msgspec.structs.replace(site, existing=(old,))
    problem = DesignProblem(stands, targets=Targets(failure=0.01))
    assert problem.judge((), hand_made({})).targets == "undecided"
    assert problem.judge((Removal(12.0),), hand_made({})).targets == "met"


def test_missed_targets_are_rewarded_behind_all_that_is_not_ruinous(site: Site) -> None:
    """By the excess of the probability over the target, whatever the layout costs."""
    problem = DesignProblem(site, targets={"reach": 0.2})
    assert problem.targets == Targets(reach=0.2)
    met, poor, worse = (
        problem.judge(FENCE, 3 * hand_made({"block": n, "group": 0})) for n in (0, 6, 9)
    )
    assert [found.targets for found in (met, poor, worse)] == ["met", "missed", "missed"]
    assert problem.reward(met) == DesignProblem(site).reward(met)
    for missed in (poor, worse):
        assert problem.reward(missed) == -1.0 - (missed.reach["block"].probability - 0.2)
    assert problem.reward(met) > -1.0 > problem.reward(poor) > problem.reward(worse)


def test_a_design_event_without_releases_does_not_count_for_a_missed_target() -> None:
    """Few releases may hold none of a design event, whose probability is then not a number."""
    problem = DesignProblem("talus", targets={"reach": 1e-3})
    found = problem.evaluate((Fence(77.25, 0.875, energy_class=100),), seeds=range(40, 44))
    chances = [found.reach[event.name] for event in problem.site.events if event.design]
    assert [math.isnan(chance.probability) for chance in chances].count(True) == 1
    assert found.targets == "missed"
    greatest = max(chance.probability for chance in chances if chance.releases)
    assert problem.reward(found) == -1.0 - (greatest - 1e-3)


@pytest.mark.parametrize(
    ("targets", "reached", "state"),
    [
        (None, 0, None),
        (Targets(reach=0.3), 0, "met"),
        (Targets(reach=0.2), 0, "undecided"),
        (Targets(reach=0.2), 10, "missed"),
        (Targets(reach=0.3, failure=0.01), 0, "undecided"),
        (Targets(failure=1.0), 10, "met"),
    ],
)
def test_targets_ask_one_sided_bounds_of_design_events(
    targets: Targets | None, reached: int, state: str | None, site: Site
) -> None:
    problem = DesignProblem(site, targets=targets)
    outcomes = hand_made({"small": 10, "low": 10, "block": reached})  # small, low: no design event
    assert problem.judge(FENCE, outcomes).targets == state


def test_the_reward_is_the_fall_of_z(problem: DesignProblem) -> None:
    nothing = problem.nothing
    assert nothing.objective > 0.0
    assert nothing.outcomes == ()
    assert (nothing.capital, nothing.layout, nothing.debris_share) == (0.0, (), 1.0)
    assert problem.reward(nothing) == 0.0
    found = problem.judge(FENCE, hand_made({"small": 3}))
    expected = (nothing.objective - found.objective) / nothing.objective
    assert problem.reward(found) == pytest.approx(expected)


def test_without_prices_the_reward_is_the_share_of_debris_kept_off() -> None:
    problem = DesignProblem(cases.cut(cases.FREE, cases.HARMLESS))
    assert problem.nothing.objective == 0.0
    found = problem.judge(FENCE, hand_made({"small": 3, "group": 10}))
    assert found.objective == 0.0
    assert problem.reward(found) == pytest.approx(1.0 - found.debris / problem.nothing.debris)
    clean = problem.judge(FENCE, hand_made({}))
    assert problem.reward(clean) == 1.0


@pytest.mark.slow
def test_the_cost_of_nothing_is_found_again_by_another_process(tmp_path: Path) -> None:
    program = (  # on a site that is not in the store of the package
        "import warnings; from rigdda.envs import DesignProblem, ensemble, site_store\n"
        "warnings.simplefilter('ignore'); ensemble.FIRST_ROUND, ensemble.BOTH_ROUNDS = 2, 8\n"
        "where = site_store.path_of('ensemble', b'').parent\n"
        "print(DesignProblem('random-5').nothing.simulated, where.exists())\n"
        "ensemble._simulate = None\n"
        "ensemble.memory = type(ensemble.memory)(4)\n"
        "print(DesignProblem('random-5', 2).nothing.objective)\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                         env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)})  # fmt: skip
    assert run.returncode == 0, run.stderr
    simulated, kept = run.stdout.split()[:2]
    assert int(simulated) >= 8 and kept == "True"
    assert len(list(tmp_path.rglob("sites-*/ensemble-*.msgpack"))) == 1


def test_nothing_is_kept_on_disk(problem: DesignProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    first = problem._known
    monkeypatch.setattr(ensemble, "memory", Memory(4))
    monkeypatch.setattr(ensemble, "_simulate", lambda *_: pytest.fail("simulated again"))
    assert ensemble.of(problem.site, problem.key) == first
    path = site_store.path_of("ensemble", problem.key)
    whole = path.read_bytes()
    path.write_bytes(whole[:-20])  # cut off: known to be unsound
    assert site_store.read("ensemble", problem.key, ensemble.Ensemble) is None
    path.write_bytes(whole)


def test_processes_give_what_threads_give(problem: DesignProblem) -> None:
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn) as pool:
        there = problem.evaluate(FENCE, range(9), pool)
    here = problem.evaluate(FENCE, range(9))
    assert there.outcomes == here.outcomes
    assert replace(there, seconds=0.0, simulated=0) == replace(here, seconds=0.0, simulated=0)
    assert (there.simulated, there.releases) == (9, 9)
    assert math.isnan(there.seconds)


def test_vectors_and_layouts_are_evaluated_alike(problem: DesignProblem) -> None:
    vector = problem.encode(FENCE)
    one, two = problem.evaluate(FENCE, [4]), problem.evaluate(vector.tolist(), [4])
    assert one.outcomes == two.outcomes
    assert one.typical == (4, problem.plan([4])[0])
    assert one.ci[0] <= one.objective <= one.ci[1] and one.ci[0] < one.ci[1]


def test_samples_of_chosen_events_are_judged(problem: DesignProblem) -> None:
    seeds = {"small": range(3), "block": [7], "low": [8, 9], "group": [1, 2]}
    sample = problem.sample(FENCE, seeds)
    assert [o.event for o in sample] == ["small"] * 3 + ["block"] + ["low"] * 2 + ["group"] * 2
    both, none = problem.sample_many([(FENCE, seeds), ((), {"small": [3]})])
    assert both == sample
    assert len(none) == 1
    assert problem.judge(FENCE, sample + both).releases == 16
    with pytest.raises(BadInput, match="event = 'flood'"):
        problem.sample(FENCE, {"flood": [1]})


def test_sites_by_name_file_and_object(site: Site, tmp_path: Path) -> None:
    site.save(tmp_path / "cut.toml")
    assert DesignProblem(tmp_path / "cut.toml") == DesignProblem(site)
    assert DesignProblem("quick").site == Site.load("quick")
    problem = DesignProblem(site, zone=(10, 16))
    assert (problem.zone.start, problem.zone.end) == (10.0, 16.0)
    assert pickle.loads(pickle.dumps(problem)) == problem != DesignProblem(site)
    assert DesignProblem(site, fidelity="fast").site.motion.dt > site.motion.dt


def test_kinds_are_all_but_the_rigid_wall(site: Site) -> None:
    usual = ("fence", "ditch", "embankment", "gravity_wall")
    assert DesignProblem(site).kinds == (*usual, "mesh")
    bare = msgspec.structs.replace(site, meshes=())
    assert DesignProblem(bare).kinds == usual
    with pytest.raises(BadInput, match=r"kinds = .*: leave mesh out: cut has no options"):
        DesignProblem(bare, kinds=["mesh"])
    assert DesignProblem(site, kinds=["wall"]).fits([Wall(14.0, 1.0)])


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"site": "nowhere"}, "site = 'nowhere': choose one of"),
        ({"site": "nowhere.toml"}, "site = 'nowhere.toml': name an existing"),
        ({"site": 5}, "site = 5: give a name"),
        ({"max_barriers": 0}, "max_barriers = 0: give a whole number"),
        ({"max_barriers": 10**6}, "max_barriers = 1000000"),
        ({"kinds": ("moat",)}, "kinds = 'moat': choose one of ditch, .*, wall"),
        ({"kinds": ()}, "kinds = .*: name each kind once"),
        ({"kinds": ("wall", "wall")}, "kinds = .*: name each kind once"),
        ({"fidelity": "slow"}, "fidelity = 'slow'"),
        ({"zone": (0, 10)}, "zone = 0"),
        ({"zone": 5}, r"zone = 5: give two numbers \[low, high\]"),
        ({"zone": (6.2, 6.8)}, r"zone = \(6\.2, 6\.8\): overlap one of"),
        ({"targets": 0.1}, "targets = 0.1: give rigdda.envs.Targets"),
        ({"targets": {"reech": 0.1}}, "targets = .*reech.*: give rigdda.envs.Targets"),
        ({"targets": {"reach": 2}}, r"targets\.reach = 2"),
    ],
)
def test_bad_keywords_are_refused(keywords: dict, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        DesignProblem(**{"site": cases.cut(), **keywords})
    assert "\n" not in str(caught.value)


def test_targets_between_0_and_1_of_sites_with_design_events(site: Site) -> None:
    with pytest.raises(BadInput, match=r"targets\.reach = 2"):
        Targets(reach=2)
    plain = tuple(
        type(e)(e.name, e.rate, e.source, e.area, number=e.number, width=e.width)
        for e in site.events
    )
    with pytest.raises(BadInput, match="mark an event of cut with design = true"):
        DesignProblem(msgspec.structs.replace(site, events=plain), targets=Targets(reach=0.1))


@pytest.mark.parametrize(
    ("layout", "seeds", "message"),
    [
        ((), [], "seeds = .*: give at least one"),
        ((), 5, "seeds = 5: give a sequence"),
        ((), [1, -1], r"seeds\[1\] = -1: give a whole number of at least 0"),
        ((), [1.5], r"seeds\[0\] = 1.5"),
        ((), [1, 2, 1], r"seeds = \(1, 2, 1\): give each once"),
        ((Wall(14.0, 1.0),), [1], r"layout\[0\]\.kind = 'wall'"),
        ((Ditch(3.0, 1.0, 2.0),), [1], r"layout\[0\]"),
        (FENCE * 4, [1], "layout = '4 barriers': give at most 3"),
        (5, [1], "layout = 5: give a sequence of barriers"),
    ],
)
def test_bad_layouts_and_seeds_are_refused(
    problem: DesignProblem, layout: tuple, seeds: list, message: str
) -> None:
    with pytest.raises(BadInput, match=message):
        problem.evaluate(layout, seeds)


def test_layouts_are_compared_in_the_same_releases(problem: DesignProblem, site: Site) -> None:
    """Sums by hand; what both let past does not widen the interval."""
    strong, weak = ((Fence(12.0, height, energy_class=100),) for height in (1.2, 1.0))
    seeds = range(400)
    found = compare(problem, strong, weak, seeds)
    one, two = (problem.evaluate(layout, seeds) for layout in (strong, weak))
    by_hand = site.annual(strong) - site.annual(weak)
    for event in site.events:
        for sign, e in ((1.0, one), (-1.0, two)):
            own = [site.bill(e.layout, o) for o in e.outcomes if o.event == event.name]
            mean = np.mean([bill.harm + bill.repair for bill in own])
            by_hand += sign * site.rate(event.name, e.layout) * mean
    assert found.value == pytest.approx(by_hand)
    assert found.value == pytest.approx(one.objective - two.objective, abs=1e-6)
    assert found.ci[0] < found.value < found.ci[1]
    assert np.ptp(found.ci) < np.hypot(np.ptp(one.ci), np.ptp(two.ci))
    assert 0 < found.differ < found.releases == 400
    same = compare(problem, strong, strong, seeds)
    assert (same.value, same.ci, same.differ) == (0.0, (0.0, 0.0), 0)
    other = compare(problem, weak, strong, seeds)
    assert (other.value, other.ci[0]) == pytest.approx((-found.value, -found.ci[1]))
    with pytest.raises(BadInput, match=r"seeds = .*: give 2 or more per event"):
        compare(problem, strong, weak, range(2))


@pytest.mark.slow
def test_paired_intervals_hold_the_difference(problem: DesignProblem) -> None:
    """In 95 % of 40 repetitions; a binomial of 40 is below 33 once in 3,000 times."""
    weak = (Fence(12.0, 2.0, energy_class=100),)
    true = compare(problem, FENCE, weak, range(10_000, 14_000)).value
    parts = [compare(problem, FENCE, weak, range(k * 100, k * 100 + 100)).ci for k in range(40)]
    assert sum(low <= true <= high for low, high in parts) >= 33


def test_other_arguments_are_checked(problem: DesignProblem) -> None:
    with pytest.raises(BadInput, match=r"seeds = .*: give at least one"):
        problem.plan([])
    with pytest.raises(BadInput, match="seed = -1"):
        problem.allocation(10, seed=-1)
    with pytest.raises(BadInput, match="seeds = -1: give a mapping"):
        problem.sample((), -1)  # type: ignore[arg-type]
    with pytest.raises(BadInput, match=r"vector = .*numbers from -1 to 1"):
        problem.decode(np.full(problem.size, 1.0 + 2.0j))


def test_problems_and_evaluations_compare_by_what_they_say(
    problem: DesignProblem, site: Site
) -> None:
    same = DesignProblem(site, problem.max_barriers, problem.kinds)
    assert same == problem and hash(same) == hash(problem)
    assert hash(same) != hash(DesignProblem(site, 1))
    first = problem.evaluate(FENCE, range(10))
    assert problem.evaluate(FENCE, range(10)) == first  # recalled, in less time


def test_a_zone_of_no_length_is_refused() -> None:
    with pytest.raises(BadInput, match="the first less than the second"):
        DesignProblem("quick", zone=(25.0, 25.0))


def test_without_barriers_rare_harm_has_an_interval(site: Site) -> None:
    """An event of which no release reaches the road may still do harm."""
    nothing = DesignProblem(site).nothing
    harmless = [name for name, chance in nothing.reach.items() if chance.count == 0]
    outcomes = [cases.outcome(name) for name in site.event_names for _ in range(50)]
    facts = ensemble.statistics(site, outcomes, dict.fromkeys(site.event_names, 1.0))
    found = judge(site, (), outcomes, facts, {})
    assert found.harm == 0.0 and found.harm_ci[1] > 0.0
    alone = judge(site, (), outcomes, {}, {})
    assert alone.harm_ci == (0.0, 0.0) and math.isnan(alone.debris_share)
    assert not harmless or nothing.harm_ci[1] > nothing.harm


def test_rare_repair_is_as_wide_as_the_event(site: Site) -> None:
    wide = msgspec.structs.replace(
        site,
        events=tuple(
            msgspec.structs.replace(e, width=40.0 if e.name == "group" else e.width)
            for e in site.events
        ),
    )
    facts = DesignProblem(wide)._known.facts
    price = wide.values(FENCE)[FENCE[0]]
    largest = costs._largest_repairs(wide, FENCE, facts)
    assert facts["group"].width == 40.0
    assert largest["group"] == pytest.approx(40.0 * price)
    assert largest["small"] == pytest.approx(10.0 * price)


def test_demands_exist_up_to_the_ends_of_the_zone() -> None:
    zone = BarrierZone(4.00049, 17.79951)
    ends = design_envelope.stations(zone)
    assert (ends[0], ends[-1]) == (zone.start, zone.end)
    assert all(b > a for a, b in itertools.pairwise(ends))


def test_an_event_without_releases_has_the_risk_without_barriers() -> None:
    site = msgspec.structs.replace(Site.load("quick"), traffic=Traffic(5000.0, 60.0, 100.0))
    problem = DesignProblem(site)
    found = problem.individual_risk((), {})
    assert problem.nothing.risk is not None
    assert found == pytest.approx(problem.nothing.risk.individual, rel=1e-9)
    with pytest.raises(BadInput, match="fatalities = 'avalanche'"):
        problem.individual_risk((), {"avalanche": [1.0]})


def test_a_list_of_numbers_of_numpy_is_a_vector() -> None:
    problem = DesignProblem(Site.load("quick"))
    vector = np.full(problem.size, 0.4, np.float32)
    assert problem.decode(list(vector)) == problem.decode(vector)
    one, two = problem.evaluate(list(vector), [1]), problem.evaluate(vector, [1])
    assert one.layout == two.layout and one.objective == two.objective
