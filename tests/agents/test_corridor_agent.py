"""The agent that builds the sections of a corridor without a search."""

from __future__ import annotations

from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from rigdda import BadInput, Layout
from rigdda.agents.corridor.agent import CorridorAgent, Offer, Prospect, offer, prospect, shipped
from rigdda.agents.network import Network
from rigdda.barriers import describe
from rigdda.envs import DesignProblem
from rigdda.envs.corridor_environment import CorridorDesign

NUMBERS = st.lists(st.floats(0.1, 100.0), min_size=0, max_size=6)


def offered(costs: list[float], gains: list[float]) -> Offer:
    """Return an offer of as many layouts as there are numbers in the shorter list."""
    n = min(len(costs), len(gains))
    cost = np.cumsum([0.0, *costs[:n]])
    return Offer(((),) * (n + 1), cost, np.cumsum([0.0, *gains[:n]]))


def words(layout: Layout) -> list[str]:
    """Return the description of a layout, whose numbers the action rounds."""
    return [describe(barrier, 2) for barrier in layout]


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=5))
def test_prospect_is_concave_and_ends_with_all_gains(sections: list[tuple[list, list]]) -> None:
    offers = [offered(*own) for own in sections]
    found = prospect(offers, [100.0] * len(offers))
    slopes = np.diff(found.gain) / np.diff(found.money)
    assert found.money[0] == found.gain[0] == 0.0
    assert (np.diff(slopes) <= 1e-9 * slopes[:-1]).all() and (slopes >= 0.0).all()
    whole = sum(own.gain[-1] for own in offers) / (100.0 * len(offers))
    assert found(np.array(1e9)) == pytest.approx(whole)


def test_prospect_spends_money_where_it_gains_most() -> None:
    good, poor = offered([10.0], [5.0]), offered([10.0], [1.0])
    found = prospect([good, poor], [20.0, 20.0])
    assert found(np.array([5.0, 10.0, 7.5])) == pytest.approx([5.0 / 40, 6.0 / 40, 5.5 / 40])


def test_prospect_of_many_steps_is_shortened() -> None:
    steps = offered([1.0] * 300, list(np.linspace(2.0, 1.0, 300)))
    found = prospect([steps], [1000.0])
    assert len(found.money) <= 64
    assert found(steps.cost) == pytest.approx(steps.gain / 1000.0, abs=2e-3)


def test_prospect_is_read_again_and_other_files_are_refused(tmp_path: Path) -> None:
    own = Prospect(np.array([0.0, 10.0, 50.0]), np.array([0.0, 0.25, 0.5]))
    own.save(tmp_path / "own.safetensors", "rigdda train")
    again = Prospect.load(tmp_path / "own.safetensors")
    assert (again.money == own.money).all() and (again.gain == own.gain).all()
    layer = np.ones((2, 3), dtype=np.float32), np.zeros(2, dtype=np.float32)
    zeros = np.zeros(3, dtype=np.float32)
    Network(zeros, zeros + 1, [layer], {}).save(tmp_path / "other.safetensors")
    with pytest.raises(BadInput, match="rigdda train --model corridor"):
        Prospect.load(tmp_path / "other.safetensors")


def test_shipped_prospect_names_its_command() -> None:
    from rigdda.agents.corridor.agent import PROSPECT_FILE

    assert shipped().gain[-1] < 1.0
    assert Network.load(PROSPECT_FILE).notes["command"].startswith("rigdda train --model corridor")


@pytest.mark.slow
def test_layouts_on_offer_are_feasible_and_none_is_dominated() -> None:
    problem = DesignProblem("quick")
    found = offer(problem)
    assert found.layouts[0] == () and found.cost[0] == found.gain[0] == 0.0
    assert (np.diff(found.cost) >= 0.0).all() and (np.diff(found.gain) > 0.0).all()
    assert all(problem.fits(layout) for layout in found.layouts)
    costs = [problem.site.capital(layout) for layout in found.layouts]
    assert found.cost == pytest.approx(costs)


@pytest.fixture(scope="module")
def agent() -> CorridorAgent:
    """Return the agent, which keeps the layouts of the sites that it has seen."""
    return CorridorAgent()


@pytest.mark.parametrize("budget", [0.0, 60.0, 1e5])
def test_agent_plays_within_its_money(budget: float, agent: CorridorAgent) -> None:
    env = CorridorDesign(["quick", "verge"], budget=budget, releases=2)
    env.reset(seed=1)
    ended = False
    while not ended:
        asked = agent.layout(env)
        _, _, ended, _, info = env.step(agent.act(env))
        assert words(info["layout"]) == words(asked) and not info["dropped"]
    assert env.spent <= env.budget
    if budget == 0.0:
        assert env.spent == 0.0
    if budget == 1e5:  # money is no limit
        best = [words(agent.offer(s.problem).layouts[-1]) for s in env.placed]
        assert [words(e.layout) for e in env.evaluations] == best


def test_agent_keeps_money_for_the_sections_to_come(agent: CorridorAgent) -> None:
    env = CorridorDesign(["quick", "verge"], budget=60.0, releases=2)
    env.reset(seed=0)
    usual = agent.prospect
    agent.prospect = Prospect(np.array([0.0, 1.0]), np.array([0.0, 0.0]))
    spends = agent.layout(env)
    agent.prospect = Prospect(np.array([0.0, 1e3]), np.array([0.0, 1e3]))
    saves = agent.layout(env)
    agent.prospect = usual
    assert spends != () and saves == ()
