"""Upkeep of existing barriers in forecast costs: it is part of Z, with and without new barriers."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from valley import SITE, Valley, seen

from rigdda import Layout
from rigdda.agents.corridor import agent
from rigdda.agents.designers import convex, value
from rigdda.agents.designers.catalogue import ensemble_seeds, tabulate, whole
from rigdda.agents.designers.forecast import Forecast, forecast_seeds, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.racing import Arm
from rigdda.agents.designers.surrogate import Surrogate
from rigdda.model.existing import Existing


class FencedValley(Valley):
    """The valley with an old fence whose upkeep is dear and which stops nothing."""


@pytest.fixture
def old_fence(few_blocks: None, monkeypatch: pytest.MonkeyPatch) -> FencedValley:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    monkeypatch.setattr("rigdda.agents.corridor.agent.ensemble", seen)
    fence = Existing("fence", 14.0, 6.0, energy_class=5000)
    return FencedValley(msgspec.structs.replace(SITE, existing=(fence,)))


def forecast(problem: Valley, simulations: int = 0) -> Forecast:
    """Return the forecast of a designer with a number of simulations, or without a search."""
    site = problem.site
    seeds = ensemble_seeds(site, 0, simulations) if simulations else forecast_seeds(site)
    return Forecast(problem, seen(site, seeds, Menu(problem).stations), value_network())


def forecast_z(judge: Forecast, layout: Layout) -> float:
    """Return Z as its definition has it: annual cost and the remaining harm of every event."""
    site, nothing = judge.problem.site, judge.problem.nothing
    bare = np.array([nothing.by_event[name] for name in site.event_names])
    return site.annual(layout) + float(judge.remaining([layout])[0] @ bare)


def test_the_gain_of_an_offer_is_the_fall_of_z(old_fence: FencedValley) -> None:
    found, judge = agent.offer(old_fence), forecast(old_fence)
    assert len(found.layouts) > 2
    for layout, gain in zip(found.layouts[1:], found.gain[1:], strict=True):
        assert gain == pytest.approx(old_fence.nothing.objective - forecast_z(judge, layout))


def test_value_builds_what_lowers_z_however_dear_the_upkeep(old_fence: FencedValley) -> None:
    """A forecast Z above the risk is a loss only if it is above Z without barriers."""
    nothing, upkeep = old_fence.nothing.objective, old_fence.site.annual(())
    layout = value.design(old_fence, 60).layout
    assert nothing - upkeep < forecast_z(forecast(old_fence, 60), layout) < nothing
    assert layout


def test_z_without_barriers_is_the_risk_and_the_upkeep(old_fence: FencedValley) -> None:
    pool = Surrogate(old_fence, forecast(old_fence))
    nothing = old_fence.nothing.objective
    assert pool.bare * pool.worth == pytest.approx(nothing)
    assert pool.worth == pytest.approx(nothing - old_fence.site.annual(()))
    arm = Arm(old_fence, ())
    assert pool.joint(arm, arm) == (pool.bare, 0.0)


def test_choices_of_the_programme_have_the_upkeep(old_fence: FencedValley) -> None:
    site, menu = old_fence.site, Menu(old_fence)
    crossings = seen(site, forecast_seeds(site), menu.stations)
    table = whole(old_fence, crossings, menu)
    harm = float(table.weight @ table.base)
    assert convex.choose(table.take([]), 1).objective == pytest.approx(site.annual(()) + harm)
    ditch = next(b for b in menu.singles("ditch"))
    one = tabulate(old_fence, crossings, [ditch])
    left = harm - float(one.weight @ one.relief[:, 0])
    assert one.objective[0] == pytest.approx(site.annual((ditch,)) + left)  # without repair
    for choice in convex.best_choices(old_fence, crossings, menu):
        assert site.annual(()) < choice.bound <= choice.objective + 1e-6
        assert choice.objective <= site.annual(()) + harm + 1e-6
    j = int(np.argmin(table.objective))
    best = convex.choose(table.take([j]), 1)
    assert best.objective == pytest.approx(float(table.objective[j]))
