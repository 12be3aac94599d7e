"""The race finds a known optimum, tells what it is worth, and says where its answer comes from."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from msgspec.structs import replace
from valley import SITE, Barren, Valley

from rigdda import Ditch, Fence, GravityWall, Layout, Site
from rigdda.agents.designers import policy, race, random, value
from rigdda.agents.designers.menu import Menu, on_bound, spread
from rigdda.agents.designers.protocol import Entry
from rigdda.agents.designers.racing import Arm, allocation, behind
from rigdda.agents.designers.store import Release, Store
from rigdda.agents.designers.surrogate import Surrogate
from rigdda.barriers import KINDS
from rigdda.barriers.base import MIN_HEIGHT
from rigdda.envs import DesignProblem
from rigdda.envs.problem import Targets

BUDGETS = (*range(10, 110), *range(110, 400, 10))
"""Numbers of releases: all of the few of which a share is rounded most, and some larger ones."""


def least(valley: Valley) -> float:
    """Return the least Z of all single barriers of the menu."""
    menu = Menu(valley)
    return min(valley.truth((b,)) for kind in valley.kinds for b in menu.singles(kind))


def test_the_race_finds_a_known_optimum(valley: Valley) -> None:
    nothing, best = valley.truth(()), least(valley)
    lost = [valley.truth(race.design(valley, 3000, seed).layout) - best for seed in range(3)]
    assert np.median(lost) < 0.2 * (nothing - best)


def test_the_race_beats_random_search(valley: Valley) -> None:
    seeds = range(3)
    raced = [valley.truth(race.design(valley, 1500, seed).layout) for seed in seeds]
    drawn = [valley.truth(random.design(valley, 1500, seed).layout) for seed in seeds]
    assert np.mean(raced) < np.mean(drawn)


def test_without_releases_for_a_final_the_policy_decides() -> None:
    problem, few = DesignProblem(SITE), race.LEAST_FINAL_BUDGET - 1
    assert race.design(problem, few).layout == policy.design(problem, few).layout


@pytest.mark.parametrize("name", [pytest.param("race", marks=pytest.mark.slow), "random"])
def test_what_is_reported_does_not_flatter(name: str, valley: Valley) -> None:
    apart = []
    for seed in range(16):
        found = {"race": race, "random": random}[name].design(valley, 300, seed)
        low, high = found.evaluation.ci
        if found.layout:
            error = (high - low) / (2.0 * 1.96)
            apart.append((found.evaluation.objective - valley.truth(found.layout)) / error)
    assert len(apart) >= 8
    assert abs(np.mean(apart)) < 3.0 / np.sqrt(len(apart))
    assert np.mean(np.abs(apart) < 1.96) >= 0.75


@pytest.mark.slow
def test_every_race_has_its_final(valley: Valley) -> None:
    """A budget that does not pay for one would give nothing as the answer, whatever was found."""

    class Single(Valley):
        """What is known of a valley is kept by its class."""

    single = Single(replace(valley.site, events=valley.site.events[:1]))
    for budget in (160, 180, 200):
        assert race.design(single, budget, 0).history.stage("final"), budget


def test_where_nothing_helps_nothing_is_built(site: Site) -> None:
    found = race.design(Barren(site), 1000)
    assert found.layout == () and found.origin == "start" and found.on_bound == ()
    finals = [e.evaluation.layout for e in found.history.stage("final")]
    assert () in finals


@pytest.mark.parametrize(
    "simulations",
    [17, 300, 1000, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 64, 2345))],
)
def test_the_budget_is_kept_and_progress_told(simulations: int, valley: Valley) -> None:
    told: list[Entry] = []
    found = race.design(valley, simulations, progress=told.append)
    assert tuple(told) == found.history.entries
    used = [entry.simulations for entry in told]
    assert used == sorted(used) and used[-1] == found.simulations <= simulations
    assert told[-1].stage == "report" and told[-1].evaluation == found.evaluation
    searched = {(s, n) for e in told[:-1] for s, n in [(e.evaluation.layout, e.stage)]}
    assert (found.layout, "report") not in searched


def test_the_race_repeats_and_resumes(valley: Valley, tmp_path: Path) -> None:
    file = tmp_path / "store.jsonl"
    whole = race.design(valley, 700, 3, store=Store(file))
    assert race.design(valley, 700, 3) == whole
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[: len(lines) // 2]) + b'{"key": "12')
    store = Store(file)
    assert race.design(valley, 700, 3, store=store) == whole
    assert store.resumed > 0 and store.simulated > 0
    assert file.read_bytes() == b"".join(lines)
    assert file.stat().st_size < 200 * whole.simulations


@pytest.mark.slow
def test_a_target_is_met_where_it_can_be(site: Site) -> None:
    """On a road that hardly anybody needs nothing pays, so that only the target asks for one."""
    lonely = replace(site, consequences=replace(site.consequences, closure=500.0))
    free = race.design(Valley(lonely), 3000)
    strict = Valley(lonely, targets=Targets(reach=0.1))
    assert strict.chance(free.layout) > 0.1
    found = [race.design(strict, 6000, seed) for seed in range(4)]
    met = [one for one in found if one.evaluation.targets == "met"]
    assert len(met) >= 2 and all(strict.chance(one.layout) < 0.1 for one in met)


def test_a_search_says_where_its_layout_comes_from(valley: Valley) -> None:
    found = race.design(valley, 1000)
    first = {
        e.evaluation.layout for e in found.history.stage("search") if len(e.evaluation.layout) == 1
    }
    assert (found.origin == "search") or found.layout in first


@pytest.mark.parametrize("designer", [policy, value, race])
def test_a_layout_without_a_search_is_no_result_of_one(
    designer: ModuleType, valley: Valley, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below 160 releases, the designer `race` leaves the choice to the policy."""
    pair = Fence(18.0, 2.0, energy_class=500), Fence(26.0, 2.0, energy_class=500)
    monkeypatch.setattr(policy, "decide", lambda *_: pair)
    usual = Surrogate.best

    def best_pairs(self: Surrogate, n: int) -> list[Layout]:
        ranked = usual(self, len(self.layouts))
        return ([x for x in ranked if len(x) == 2] or ranked)[:n]

    monkeypatch.setattr(Surrogate, "best", best_pairs)
    found = designer.design(valley, 100)
    assert found.origin == "start" and not found.history.stage("search")
    assert len(found.layout) == 2 and found.layout == valley.check(found.layout)


def test_what_lies_on_a_bound_is_named(site: Site) -> None:
    problem = DesignProblem(site)
    zone = problem.zone
    inside = problem.place.put(Ditch(30.0, 1.5, 3.0), 30.0)
    assert inside is not None and on_bound(problem, (inside,)) == ()
    fence = Fence(zone.start, 2.5, energy_class=100)  # higher ones are of the next class
    assert on_bound(problem, (fence,)) == ("fence: start of the zone", "fence: lowest class")
    tall = Fence(12.0, zone.max_height, energy_class=1000)
    assert on_bound(problem, (tall,)) == ("fence: greatest height",)
    wall = GravityWall(zone.end - zone.min_thickness, 2.0, zone.min_thickness)
    found = on_bound(problem, (wall,))
    assert found == ("gravity wall: end of the zone", "gravity wall: least thickness")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("mesh", "removal")])
def test_all_on_the_menu_may_be_built(kind: str) -> None:
    problem = DesignProblem(SITE, kinds=(kind,))
    menu = Menu(problem)
    found = menu.singles(kind)
    assert found and all(problem.fits((b,)) for b in found[::7])
    some = spread(found, 5)
    assert len(set(some)) == len(some) <= 5
    near = list(menu.neighbours((some[0],), 1.0, 1))
    assert near and all(problem.fits(layout) and layout != (some[0],) for layout in near)


@pytest.mark.parametrize("kind", ["embankment", "gravity_wall"])
def test_the_smallest_barriers_cost_less_than_those_on_the_menu(kind: str) -> None:
    problem = DesignProblem(SITE, kinds=(kind,))
    menu = Menu(problem)
    found = menu.smallest()
    assert found and all(problem.fits((b,)) for b in found)
    assert {b.height for b in found} == {MIN_HEIGHT}
    most = max(problem.site.capital((b,)) for b in found)
    assert most < min(problem.site.capital((b,)) for b in menu.singles(kind))


def test_mesh_has_no_smallest_size() -> None:
    assert Menu(DesignProblem("quick", kinds=("mesh",))).smallest() == []


def test_an_arm_is_behind_by_its_paired_difference(valley: Valley) -> None:
    nothing, other = Arm(valley, ()), Arm(valley, ())
    reached, stopped = Release(100.0, 1.0, True, False), Release(0.0, 0.0, False, False)
    names = valley.site.event_names
    nothing.add({name: [reached, stopped] * 50 for name in names})
    other.add({name: [stopped, stopped] * 50 for name in names})
    assert behind(other, nothing, nothing) < -5.0 < 5.0 < behind(nothing, other, nothing)
    rates = sum(valley.site.rate(name, ()) for name in names)
    assert nothing.objective() == pytest.approx(50.0 * rates)


def test_an_allocation_never_asks_for_more_than_it_may() -> None:
    """A race that cannot be paid by one release ends without an answer."""
    problem = DesignProblem("verge")
    nothing = Arm(problem, ())
    for n in BUDGETS:
        assert 0.6 * n * (n >= 100) <= sum(allocation(problem, n, [], nothing).values()) <= n


def test_a_design_event_with_a_target_is_released() -> None:
    """Without releases nothing is known of it, and it must not count as met."""
    problem = DesignProblem("verge", targets=Targets(reach=0.4))
    design = [event.name for event in problem.site.events if event.design]
    nothing = Arm(problem, ())
    for n in BUDGETS:
        assert sum(allocation(problem, n, [], nothing).values()) <= n
    counts = allocation(problem, 71, [], nothing)
    assert all(counts[name] >= 6 for name in design)  # 0 of 6: 0.39 at most
    assert Arm(problem, (), strict=True).shortfall() == pytest.approx(0.6)
    assert Arm(problem, ()).shortfall() == 0.0


def test_a_layout_that_cannot_fail_is_not_behind_a_target_of_failure() -> None:
    """Otherwise, a ditch would need as many releases as a fence to show that it meets it."""
    problem = DesignProblem("quick", targets=Targets(failure=0.1))
    fence = Arm(problem, (Fence(17.0, 3.0, energy_class=1000),), strict=True)
    assert fence.shortfall() == pytest.approx(0.9)
    for layout in ((), (Ditch(30.3, 1.0, 3.0),)):
        assert Arm(problem, layout, strict=True).shortfall() == 0.0
