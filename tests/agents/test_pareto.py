"""The front of barriers' cost against what is left: what dominates what."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from valley import SITE, Valley

from rigdda import Fence
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
    assert capital[1:] == sorted(capital[1:]) and {tried[0].capital, tried[-1].capital} <= set(
        capital
    )
    assert min(tried, key=lambda e: e.objective) == chosen[0]  # a final may take the first only


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
