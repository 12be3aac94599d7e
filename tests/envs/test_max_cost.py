"""A cap on the capital cost of layouts, in the problem, the environments and every designer."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from light_site import LIGHT

import rigdda
import rigdda.envs
from rigdda import BadInput, Fence
from rigdda.agents import DESIGNERS
from rigdda.agents.designers import module
from rigdda.agents.designers.menu import Menu
from rigdda.envs import DesignProblem
from rigdda.envs.repetition import repeat
from rigdda.envs.replay_record import load

CAP = 600.0


@pytest.fixture(scope="module")
def capped() -> DesignProblem:
    return DesignProblem("quick", max_cost=CAP)


def test_a_layout_that_costs_more_is_not_feasible(capped: DesignProblem) -> None:
    dear = (Fence(17.0, 3.0, energy_class=1000),)
    assert capped.site.capital(dear) > CAP and DesignProblem("quick").fits(dear)
    assert not capped.fits(dear)
    with pytest.raises(BadInput, match=r"layout = '2,\d+ EUR/m': spend at most max_cost = 600"):
        capped.check(dear)
    assert DesignProblem("quick", max_cost=capped.site.capital(dear)).fits(dear)


@pytest.mark.parametrize("bad", [-1.0, float("nan"), "much", True])
def test_a_bad_cap_is_refused(bad: object) -> None:
    with pytest.raises(BadInput, match="max_cost"):
        DesignProblem("quick", max_cost=bad)


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_vector_decodes_to_a_layout_within_the_cap(capped: DesignProblem, seed: int) -> None:
    vector = np.random.default_rng(seed).uniform(-1.0, 1.0, capped.size)
    layout, free = capped.decode(vector), DesignProblem("quick").decode(vector)
    assert capped.site.capital(layout) <= CAP and capped.check(layout) == layout
    lost = [words for words in capped.dropped(vector) if "max_cost" in words]
    assert bool(lost) == (capped.site.capital(free) > CAP) or len(free) > len(layout)
    if capped.site.capital(free) <= CAP:
        assert layout == free and not lost


def test_what_exceeds_the_money_is_not_built_and_told() -> None:
    env = gymnasium.make("rigdda/BarrierDesign-v0", site="quick", max_cost=0.0, releases=12)
    env.reset(seed=1)
    action = np.ones(env.action_space.shape, dtype=np.float32)
    *_, info = env.step(action)
    assert info["layout"] == () and info["cost"] == 0.0
    assert len(info["dropped"]) == 3
    assert all("spend at most max_cost = 0 EUR/m" in words for words in info["dropped"][:1])


def test_a_placement_keeps_to_what_is_left_of_the_money() -> None:
    keywords = {"site": "quick", "max_cost": CAP, "releases": 4, "targets": {"reach": 0.5}}
    env = gymnasium.make("rigdda/BarrierPlacement-v0", **keywords)
    rng, done, told = np.random.default_rng(3), False, ()
    env.reset(seed=3)
    while not done:
        action = rng.uniform(0.2, 1.0, env.action_space.shape).astype(np.float32)
        *_, done, _, info = env.step(action)
        assert info["cost"] <= CAP
        told = info["dropped"]
    assert any("max_cost" in words for words in told)


def test_a_recorded_episode_repeats_with_its_cap(tmp_path) -> None:
    env = gymnasium.make(
        "rigdda/BarrierDesign-v0", site="quick", max_cost=CAP, releases=4, record=tmp_path
    )
    env.reset(seed=5)
    env.step(np.full(env.action_space.shape, 0.6, dtype=np.float32))
    env.close()
    record = load(next(tmp_path.rglob("*.rrd")))
    assert record.max_cost == CAP and repeat(record).same


@pytest.mark.parametrize("name", DESIGNERS)
@pytest.mark.parametrize("cap", [0.0, 400.0])
def test_every_designer_keeps_to_the_cap(name: str, cap: float) -> None:
    if name == "ppo":
        pytest.importorskip("stable_baselines3")
    problem = DesignProblem(LIGHT, max_cost=cap)
    result = module(name).design(problem, 120, seed=2)
    assert problem.site.capital(result.layout) <= cap
    assert all(e.evaluation.cost <= cap for e in result.history.entries)
    if cap == 0.0:
        assert result.layout == ()


def test_the_race_spends_what_it_may() -> None:
    problem = DesignProblem(LIGHT, max_cost=400.0)
    result = module("race").design(problem, 400, seed=0)
    costs = [e.evaluation.cost for e in result.history.entries]
    assert len({e.evaluation.layout for e in result.history.entries}) >= 8
    assert 0.0 < max(costs) <= 400.0
    assert result.evaluation.objective < problem.nothing.objective


def test_the_menu_offers_only_what_can_be_paid() -> None:
    whole, few = Menu(DesignProblem("cliff")), Menu(DesignProblem("cliff", max_cost=900.0))
    for kind in ("fence", "ditch", "mesh"):
        paid = [b for b in whole.singles(kind) if whole.problem.site.capital((b,)) <= 900.0]
        assert few.singles(kind) == paid
    assert rigdda.Mesh in {type(b) for b in whole.singles("mesh")}
