"""The front of cost against debris: what dominates what, and that nothing on it is dominated."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from concurrent.futures import Executor

import pytest

from agents import pareto
from agents.pareto import front
from agents.protocol import Ledger
from envs import DesignProblem, Evaluation
from rigdda import BadInput, Barrier, Site, Wall


def point(cost: float, debris: float) -> Evaluation:
    wall = (Wall(16.0, 1.0 + cost),)
    return Evaluation(wall, (1,), cost / 10.0 + debris, debris, (0.0, 1.0), (0.0, 1.0), cost, ())


def test_the_front_is_what_nothing_dominates() -> None:
    good = [point(0.0, 0.5), point(2.0, 0.3), point(7.0, 0.0)]
    bad = [point(0.0, 0.6), point(2.0, 0.4), point(3.0, 0.3), point(8.0, 0.0), point(2.0, 0.3)]
    for order in itertools.islice(itertools.permutations(good + bad), 0, 40320, 997):
        assert front(order) == tuple(good)


class Priced(DesignProblem):
    """A wall h metres high costs h - 1 and lets 0.9^(h - 1) pass; not simulated."""

    def evaluate(
        self, layout: Sequence[Barrier], seeds: Sequence[int], executor: Executor | None = None
    ) -> Evaluation:
        return point(layout[0].height - 1.0, 0.9 ** (layout[0].height - 1.0))


def test_the_finalists_spread_over_the_front_and_hold_its_best(site: Site) -> None:
    ledger = Ledger(Priced(site), 100, 0, None, None)
    tried = [ledger.evaluate((Wall(16.0, 1.0 + cost),), "search", 1) for cost in range(30)]
    chosen = pareto.finalists(tried, 6)
    assert 5 <= len(chosen) <= 6
    assert [e.cost for e in chosen] == sorted(e.cost for e in chosen)
    assert {0.0, 29.0} <= {e.cost for e in chosen}
    assert min(tried, key=lambda e: e.objective) in chosen


def test_known_layouts_are_finalists_though_dominated() -> None:
    tried = [point(9.0, 0.9), point(8.0, 0.8), *(point(float(c), 0.5 - 0.02 * c) for c in range(8))]
    assert not {tried[0], tried[1]} & set(pareto.finalists(tried, 6))
    chosen = pareto.finalists(tried, 6, known=2)
    assert chosen[:2] == tried[:2] and set(chosen[2:]) < set(tried[2:]) and len(chosen) <= 6
    assert pareto.finalists(tried, 1, known=2) == tried[:1]


def test_layouts_that_others_found_are_in_the_finals(site: Site) -> None:
    problem = DesignProblem(site, kinds=("wall",))
    others = [(Wall(16.0, 2.0),), (Wall(17.0, 3.0),), (Wall(16.0, 2.0),)]
    result = pareto.warm_started(problem, others, 160)
    searched = [entry.evaluation.layout for entry in result.history.stage("search")]
    finals = [entry.evaluation.layout for entry in result.history.stage("final")]
    assert finals[:2] == searched[:2]
    for found, other in zip(searched[:2], others[:2], strict=True):
        assert found[0].x == pytest.approx(other[0].x, abs=1e-6)
        assert found[0].height == pytest.approx(other[0].height, abs=1e-6)
    for layouts in ([], [(Wall(16.0, 2.0 + i),) for i in range(6)]):
        with pytest.raises(BadInput, match="number of different layouts"):
            pareto.warm_started(problem, layouts, 160)


@pytest.mark.parametrize("simulations", [8, 160])
def test_the_result_carries_its_front(simulations: int, site: Site) -> None:
    result = pareto.design(DesignProblem(site, kinds=("fence",)), simulations)
    costs, debris = [e.cost for e in result.front], [e.debris for e in result.front]
    assert costs == sorted(costs) and debris == sorted(debris, reverse=True)
    assert result.evaluation in [entry.evaluation for entry in result.history.entries]
    if simulations > 100:
        finals = [entry.evaluation for entry in result.history.stage("final")]
        assert set(result.front) <= set(finals) and len(result.front) > 1
        for e in finals:
            dominating = [f for f in result.front if f.cost <= e.cost and f.debris <= e.debris]
            assert dominating
