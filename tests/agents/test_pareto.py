"""The front of barriers' cost against what is left: what dominates what."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from valley import SITE, Valley

from rigdda import BadInput, Fence
from rigdda.agents.designers import pareto
from rigdda.agents.designers.pareto import front, residual
from rigdda.envs import Evaluation

VALLEY = Valley(SITE)


def point(capital: float, left: float) -> Evaluation:
    fence = (Fence(12.0 + capital, 2.0, energy_class=100),)
    return replace(
        VALLEY.nothing,
        layout=fence,
        capital=capital,
        harm=left,
        repair=0.0,
        objective=capital + left,
    )


def test_the_front_is_what_nothing_dominates() -> None:
    good = [point(0.0, 5.0), point(2.0, 3.0), point(7.0, 0.0)]
    bad = [point(0.0, 6.0), point(2.0, 4.0), point(3.0, 3.0), point(8.0, 0.0), point(2.0, 3.0)]
    for order in itertools.islice(itertools.permutations(good + bad), 0, 40320, 997):
        assert front(order) == tuple(good)


def test_the_finalists_spread_over_the_front_and_hold_its_best() -> None:
    tried = [point(0.3 * i, 10.0 * 0.9**i) for i in range(30)]
    chosen = pareto.finalists(VALLEY, tried, 6)
    assert 5 <= len(chosen) <= 6
    capital = [e.capital for e in chosen]
    assert capital == sorted(capital) and {tried[0].capital, tried[-1].capital} <= set(capital)
    assert min(tried, key=lambda e: e.objective) in chosen


def test_known_layouts_are_finalists_though_dominated() -> None:
    tried = [point(9.0, 9.0), point(8.0, 8.0), *(point(float(c), 5.0 - 0.2 * c) for c in range(8))]
    assert not [e for e in pareto.finalists(VALLEY, tried, 6) if e in tried[:2]]
    chosen = pareto.finalists(VALLEY, tried, 6, known=2)
    assert chosen[:2] == tried[:2] and all(e in tried[2:] for e in chosen[2:]) and len(chosen) <= 6
    assert pareto.finalists(VALLEY, tried, 1, known=2) == tried[:1]


def test_layouts_that_others_found_are_in_the_finals(valley: Valley) -> None:
    others = [(Fence(x, 2.0, energy_class=100),) for x in (16.2, 20.0, 16.2)]
    result = pareto.warm_started(valley, others, 400)
    searched = [entry.evaluation.layout for entry in result.history.stage("search")]
    finals = [entry.evaluation.layout for entry in result.history.stage("final")]
    assert finals[:2] == searched[:2]
    for found, other in zip(searched[:2], others[:2], strict=True):
        assert found[0].x == pytest.approx(other[0].x, abs=1e-6)
    for layouts in ([], [(Fence(16.0 + i, 2.0, energy_class=100),) for i in range(6)]):
        with pytest.raises(BadInput, match="number of different layouts"):
            pareto.warm_started(valley, layouts, 160)


@pytest.mark.parametrize("simulations", [8, 400])
def test_the_result_carries_its_front(simulations: int, valley: Valley) -> None:
    result = pareto.design(valley, simulations)
    capital = [e.capital for e in result.front]
    left = [residual(e) for e in result.front]
    assert capital == sorted(capital) and left == sorted(left, reverse=True)
    if simulations > 100:
        finals = [entry.evaluation for entry in result.history.stage("final")]
        assert set(map(id, result.front)) <= set(map(id, finals)) and result.front
        for e in finals:
            assert any(f.capital <= e.capital and residual(f) <= residual(e) for f in result.front)
