"""Forecasts from releases without barriers, the surrogate of a search, and the value network."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from valley import SITE

from rigdda import BadInput
from rigdda.agents import value_training
from rigdda.agents.designers import value
from rigdda.agents.designers.catalogue import CrossingEnsemble, ensemble
from rigdda.agents.designers.forecast import LAYOUT_FEATURES, Forecast, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.surrogate import Surrogate
from rigdda.agents.network import Network
from rigdda.envs import DesignProblem


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return DesignProblem(SITE)


@pytest.fixture(scope="module")
def crossings(problem: DesignProblem) -> CrossingEnsemble:
    seeds = dict.fromkeys(problem.site.event_names, range(7, 27))
    return ensemble(problem.site, seeds, Menu(problem).stations)


def test_two_barriers_stop_what_either_stops(
    problem: DesignProblem, crossings: CrossingEnsemble
) -> None:
    forecast, menu = Forecast(problem, crossings), Menu(problem)
    fences = [(b,) for b in menu.singles("fence")[::9]]
    pairs = [(a[0], b[0]) for a in fences for b in fences if problem.fits((a[0], b[0]))]
    assert pairs
    for a, b in pairs[:20]:
        both, least = forecast.analytic((a, b))[0], np.minimum(
            forecast.analytic((a,))[0], forecast.analytic((b,))[0]
        )  # fmt: skip
        assert (both <= least + 1e-12).all()
    assert np.allclose(forecast.analytic(())[0], 1.0)


def test_features_are_finite_and_forecasts_are_shares(
    problem: DesignProblem, crossings: CrossingEnsemble
) -> None:
    forecast, menu = Forecast(problem, crossings, value_network()), Menu(problem)
    layouts = [(), *((b,) for kind in problem.kinds for b in menu.singles(kind)[::25])]
    features = np.array([forecast.features(layout) for layout in layouts])
    assert features.shape == (len(layouts), len(problem.site.events), LAYOUT_FEATURES)
    assert np.isfinite(features).all()
    shares = forecast.remaining(layouts)
    assert ((shares >= 0.0) & (shares <= 1.2)).all()


def test_a_barrier_is_not_credited_for_events_that_were_not_seen(
    problem: DesignProblem,
) -> None:
    """All of the risk of an event without releases remains."""
    first, *others = problem.site.event_names
    some = ensemble(problem.site, {first: range(7, 27)}, Menu(problem).stations)
    assert others
    forecast, menu = Forecast(problem, some), Menu(problem)
    for barrier in menu.singles("fence")[::20]:
        assert (forecast.analytic((barrier,))[0][1:] == 1.0).all()
    assert (forecast.analytic(())[0] == 1.0).all()
    assert any(forecast.analytic((b,))[0][0] < 1.0 for b in menu.singles("fence"))


def test_arrivals_follow_the_remaining_risk(
    problem: DesignProblem, crossings: CrossingEnsemble
) -> None:
    """As many arrive as the stopped blocks leave, and fewer if less of the risk remains."""
    forecast, menu = Forecast(problem, crossings), Menu(problem)
    ones, none = np.ones(len(problem.site.events)), np.zeros(len(problem.site.events))
    base = np.bincount(forecast._release, minlength=len(crossings.event))
    assert (forecast.arrivals((), ones) == (base > 0)).all()
    for barrier in menu.singles("ditch")[::25]:
        share = forecast.analytic((barrier,))[0]
        all_of_them = forecast.arrivals((barrier,), share)
        left = base - np.bincount(
            forecast._release[forecast.effect(barrier).stops], minlength=len(base)
        )
        assert (all_of_them == (left > 0)).all()
        halved = forecast.arrivals((barrier,), 0.5 * share)
        assert np.allclose(halved, np.where(left > 0, 1.0 - 0.5**left, 0.0))
        assert (forecast.arrivals((barrier,), none) == 0.0).all()


def test_the_surrogate_believes_what_it_has_seen(
    problem: DesignProblem, crossings: CrossingEnsemble
) -> None:
    """Layouts near a simulated one follow it; its own deviation falls the most."""
    surrogate = Surrogate(problem, Forecast(problem, crossings, value_network()))
    layouts = [(b,) for b in Menu(problem).singles("ditch")]
    surrogate.add(layouts)
    before, spread = surrogate.mean.copy(), surrogate.deviation.copy()
    chosen = surrogate.promising(4, 1.0)
    assert len(set(chosen)) == 4
    row = surrogate.place[chosen[0]]
    surrogate._seen.append((row, before[row] + 0.3, 1e-5, 0))
    surrogate._missed.append(0.0)
    surrogate._update()
    assert surrogate.mean[row] == pytest.approx(before[row] + 0.3, abs=0.03)
    assert surrogate.deviation[row] < 0.2 * spread[row]
    assert (surrogate.deviation <= spread + 1e-9).all()


def test_a_design_without_a_search_simulates_one_layout(problem: DesignProblem) -> None:
    found = value.design(problem, 400, 1)
    assert found.simulations <= 400 and value.design(problem, 400, 1) == found
    assert [entry.stage for entry in found.history.entries] == ["report"]
    assert problem.fits(found.layout)


def test_a_training_of_the_value_network_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    for name, number in dict(RANDOM=2, SINGLES=1, PAIRS=2, EPOCHS=2, LAYOUT_RELEASES=10).items():
        monkeypatch.setattr(value_training, name, number)
    for name, number in dict(LEAST_PER_EVENT=3, LEAST_PER_GROUP=3, MASS=9).items():
        monkeypatch.setattr(value_training, name, number)
    monkeypatch.setattr("rigdda.agents.designers.forecast.ENSEMBLE", 4)
    monkeypatch.setattr(value_training, "DesignProblem", lambda name: DesignProblem(SITE))
    terms = value_training.ValueTerms(2, 3)
    first = value_training.train(terms, tmp_path, lambda *_: None)
    assert first.sizes == [LAYOUT_FEATURES, 128, 128, 4] and first.finite
    (tmp_path / "wide-1.npz").unlink()
    again = value_training.train(terms, tmp_path, lambda *_: None)
    saved = Network.load(tmp_path / "value.safetensors")
    for (one, _), (two, _) in zip(first.layers, again.layers, strict=True):
        assert np.array_equal(one, two)
    assert saved.notes["command"] == "rigdda train --model value --sites 2 --seed 3"
    with pytest.raises(BadInput, match="another folder"):
        value_training.train(value_training.ValueTerms(3, 3), tmp_path, lambda *_: None)
