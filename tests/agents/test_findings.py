"""What a design says beyond its numbers."""

from __future__ import annotations

from dataclasses import replace

from agents import findings
from envs import DesignProblem, Evaluation


def test_what_costs_as_little_a_year_and_less_to_build_is_named(problem: DesignProblem) -> None:
    nothing = problem.evaluate((), seeds=range(4))
    chosen = replace(nothing, ci=(680.0, 705.0), cost=2_575.0)
    alike = replace(nothing, ci=(683.0, 708.0), cost=487.0)

    def told(name: str, other: Evaluation) -> list[str]:
        return findings.cheaper([("nothing", nothing), (name, other), ("optimised", chosen)])

    (line,) = told("constant", alike)
    assert line.startswith("constant may cost as little a year (683 to 708 against 680 to 705)")
    assert line.endswith("487 instead of 2,575 EUR per metre to build")
    assert not told("constant", replace(alike, ci=(706.0, 730.0)))
    assert not told("constant", replace(alike, cost=3_000.0))
    assert not told("constant", replace(alike, ci=(640.0, 660.0)))
    assert not told("constant", replace(alike, targets="missed"))
