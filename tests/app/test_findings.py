"""What a design says beyond its numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from valley import SITE, Barren, Valley

from rigdda import Layout, Outcome
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import DesignResult, History
from rigdda.app.remaining_risk import failed_trials, trial_layouts
from rigdda.app.reports import findings
from rigdda.app.reports.wording import figure
from rigdda.envs import DesignProblem, Evaluation
from rigdda.seeds import release_seeds


def test_what_costs_as_little_a_year_and_less_to_build_is_named(problem: DesignProblem) -> None:
    nothing = problem.evaluate((), seeds=range(4))
    chosen = replace(nothing, ci=(680.0, 705.0), cost=2_575.0)
    alike = replace(nothing, ci=(683.0, 708.0), cost=487.0)

    def told(name: str, other: Evaluation) -> list[str]:
        return findings.cheaper([("nothing", nothing), (name, other), ("optimised", chosen)])

    (line,) = told("constant", alike)
    assert line.startswith(
        "the layout 'constant' may cost as little per year (683 to 708, optimised 680 to 705)"
    )
    assert line.endswith("cheaper to build: 487 instead of 2,575 EUR per metre")
    assert not told("constant", replace(alike, ci=(706.0, 730.0)))
    assert not told("constant", replace(alike, cost=3_000.0))
    assert not told("constant", replace(alike, ci=(640.0, 660.0)))
    assert not told("constant", replace(alike, targets="missed"))


def test_nothing_pays_only_if_nothing_that_was_verified_does(problem: DesignProblem) -> None:
    nothing = problem.evaluate((), seeds=range(4))
    dear, bare = replace(nothing, ci=(900.0, 920.0)), replace(nothing, ci=(900.0, 920.0))
    result = DesignResult(problem.site, (), bare, History(()), 10, "start", (), 0.0, ())

    def told(other: Evaluation) -> str:
        return findings.limits(result, [("nothing", bare), ("rule", other), ("found", bare)], "")

    assert told(dear).startswith("none of the verified layouts costs less per year")
    assert told(replace(dear, objective=90.0, ci=(700.0, 720.0))).startswith(
        "the layout 'rule' costs less per year"
    )


@pytest.mark.parametrize(("name", "kind"), [("verge", "ditch"), ("narrow", "gravity_wall")])
def test_what_a_single_barrier_holds_is_not_said_to_be_held_by_none(name: str, kind: str) -> None:
    problem = DesignProblem(name, kinds=(kind,))
    event = next(event.name for event in problem.site.events if event.design)
    assert {barrier.kind for (barrier,) in trial_layouts(problem)} == {kind}
    assert failed_trials(problem, event, 0) == ""


def test_what_nothing_holds_is_said() -> None:
    assert failed_trials(Valley(SITE), "block", 0) == ""
    assert "large single barriers that were tried stops the event 'block'" in failed_trials(
        Barren(SITE), "block", 0
    )


class Uneven(Barren):
    """Nothing keeps anything off, and the volume of a release is the last digit of its seed."""

    def outcome(self, layout: Layout, seed: int, event: str) -> Outcome:
        volume = 2.0 * (1 + seed % 10)
        return replace(super().outcome(layout, seed, event), released_volume=volume, width=2.0)


def test_the_volume_of_what_nothing_holds_is_that_of_all_releases() -> None:
    volumes = [1 + seed % 10 for seed in release_seeds("ensemble", 3, 4)]
    assert len(set(volumes)) > 1
    line = failed_trials(Uneven(SITE), "block", 3)
    size = f"of {min(volumes)} to {max(volumes)} m3 per metre"
    assert line.endswith(f"in at least half of 4 releases {size}")


def test_one_volume_of_all_releases_is_given_once() -> None:
    width = Barren(SITE).outcome((), 1, "block").width
    line = failed_trials(Barren(SITE), "block", 0)
    assert line.endswith(f"releases of {figure(1.0 / width)} m3 per metre")


def test_every_kind_that_may_be_built_is_tried() -> None:
    for name in ("verge", "cliff", "talus"):
        problem = DesignProblem(name)
        found = {barrier.kind for (barrier,) in trial_layouts(problem)}
        menu = Menu(problem)
        assert found == {kind for kind in problem.kinds if kind != "mesh" and menu.singles(kind)}
        assert all(problem.fits(layout) for layout in trial_layouts(problem))
