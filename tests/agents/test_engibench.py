"""The problem of EngiBench; its tests are those that EngiBench has for problems of its own.

The extra `engibench` needs an older pyarrow than `constraints.txt` has, so that these tests are
skipped in the usual environment.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("engibench")

from engibench.constraint import Criticality
from engibench.core import Problem
from gymnasium import spaces
from matplotlib.figure import Figure

from rigdda import BadInput
from rigdda.agents import designers
from rigdda.agents.engibench_problem import RockfallBarriers
from rigdda.envs import DesignProblem


@pytest.fixture(scope="module")
def problem() -> RockfallBarriers:
    return RockfallBarriers(1, {"site": "quick", "releases": 20, "budget": 60})


def test_interface(problem: RockfallBarriers) -> None:
    assert isinstance(problem, Problem) and isinstance(problem.design_space, spaces.Box)
    assert problem.objectives_keys == ["annual_cost"]
    assert problem.conditions_keys == ["site", "max_cost"]
    assert problem.container_id is None and problem.dataset_id
    with pytest.raises(NotImplementedError, match="rigdda dataset"):
        problem.dataset  # noqa: B018


def test_simulation_is_that_of_the_design_problem(problem: RockfallBarriers) -> None:
    problem.reset(seed=1)
    design, index = problem.random_design()
    assert index == -1 and problem.design_space.contains(design)
    cost = problem.simulate(design)
    assert cost.shape == (1,) and np.array_equal(cost, problem.simulate(design))
    own = DesignProblem("quick")
    assert problem.problem.decode(design) == own.decode(design)
    other = problem.simulate(design, {"max_cost": 0.0})
    nothing = problem.simulate(np.full(own.size, -1.0))
    assert other[0] == nothing[0]
    problem.reset(seed=2)
    assert problem.random_design()[0].tolist() != design.tolist()


@pytest.mark.parametrize("designer", ["random", "cma"])
def test_optimisation_returns_a_design_and_its_history(
    problem: RockfallBarriers, designer: str
) -> None:
    problem.reset(seed=1)
    start, _ = problem.random_design()
    best, history = problem.optimize(start, {"designer": designer})
    assert problem.design_space.contains(best)
    assert len(history) > 1 and all(len(step.obj_values) == 1 for step in history)
    found = designers.module(designer).design(problem.problem, 60, 1)
    assert problem.problem.decode(best) == found.layout


def test_constraints(problem: RockfallBarriers) -> None:
    design, _ = problem.random_design()
    assert not problem.check_constraints(design, {})
    wrong = problem.check_constraints(2.0 + design, {"max_cost": -1.0})
    assert len(wrong.by_criticality(Criticality.Error)) == 2
    with pytest.raises(BadInput):
        RockfallBarriers(0, {"site": "nowhere"})


def test_picture(problem: RockfallBarriers) -> None:
    assert isinstance(problem.render(problem.random_design()[0]), Figure)
