"""What a designer sees: scaled to about unit spread over sites, every entry of some use."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from cases import FREE, HARMLESS, cut

import rigdda
from rigdda import Site, sites
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import FIRST, STATIONS, barrier_free, envelope, largest, stations
from rigdda.envs.environments import SCORED_SEEDS
from rigdda.envs.observation import BOUND, FIELDS, observe, space

CUT = cut()
SEEN_AT_SITES = 30


def raw(seen: dict[str, np.ndarray], name: str) -> np.ndarray:
    """Return what an array says, in its own units."""
    return FIELDS[name].centre + FIELDS[name].spread * seen[name].astype(float)


def nothing(problem: DesignProblem) -> dict[str, np.ndarray]:
    return observe(problem, problem.nothing, np.full(problem.size, -1.0))


def test_the_site_is_told() -> None:
    problem = DesignProblem(CUT, 2)
    seen, worth = nothing(problem), problem.nothing.objective
    x = np.linspace(-10.0, 18.0, 17)[:-1]
    height = np.interp(x, *np.transpose(CUT.slope.points)) + 0.1
    rates = np.log10([1e-3 + 1.7, 1e-3 + 0.05])
    upkeep = CUT.prices.annual
    bought = [1350 * upkeep("fence"), 800 * upkeep("embankment"), 170 * upkeep("ditch")]
    expected = {
        "profile": np.arcsinh(height / 10.0),
        "span": [math.log10(28.0)],
        "zone": np.log10([14.0, 0.2]),
        "ground": [math.tan(math.radians(32)), 0.4, math.tan(math.radians(30)), 0.2],
        "road": [math.log10(8.0)],
        "closure": [math.log10(50_001.0)],
        "nothing": [math.log10(1e-3 + worth)],
        "groups": [problem.nothing.by_event["group"] / worth],
        "rates": rates,
        "prices": np.log10(1e-6 + np.array(bought) / worth),
        "spent": [0.0],
        "layout": np.full(problem.size, -1.0),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(raw(seen, name), values, rtol=1e-5, atol=1e-5, err_msg=name)
    assert raw(seen, "incline")[4] == pytest.approx(math.atan(2.0), abs=1e-3)
    by_event = problem.nothing.by_event
    heavy = (0.9 * by_event["small"] + 0.5 * by_event["block"]) / worth
    assert raw(seen, "mesh") == pytest.approx([heavy, 1200 * upkeep("mesh") / worth], rel=1e-5)
    assert seen.keys() == FIELDS.keys()


def test_what_falls_without_barriers_is_told() -> None:
    """By its definition, from the runs themselves."""
    lines, seen = stations(CUT), envelope(CUT)
    often, energies = np.zeros((2, STATIONS)), [[[] for _ in lines] for _ in range(2)]
    for event in CUT.events:
        group = int(largest(CUT, event.name) > 1)
        count = max(2, 16 // largest(CUT, event.name))
        for seed in range(FIRST, FIRST + count):
            scene = CUT.realise((), seed, event.name)
            run = rigdda.Simulation(scene, CUT.settings(scene), lines.tolist()).run(8.0)
            for k in range(STATIONS):
                passed = [e["energy"] for e in run.events if e["target"] == k and e["kind"] == 1]
                often[group, k] += (len(passed) > 0) * event.rate / count
                energies[group][k] += passed
    np.testing.assert_allclose(seen.often, often, rtol=1e-9, atol=1e-12)
    for group in range(2):
        for k in range(STATIONS):
            assert seen.energy[group, k] in (energies[group][k] or [0.0])
    assert seen.deposit.sum() == pytest.approx(1.0)
    told = nothing(DesignProblem(CUT))
    np.testing.assert_allclose(raw(told, "often"), np.log10(1e-3 + often).ravel(), atol=1e-5)


def test_envelopes_are_simulated_once_and_on_seeds_that_are_not_scored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert FIRST >= SCORED_SEEDS
    first = envelope(CUT)
    monkeypatch.setattr(Site, "realise", None)
    assert envelope(msgspec.structs.replace(CUT)) is first
    with pytest.raises(ValueError, match="read-only"):
        first.energy[0] = 0.0


def test_no_block_passes_means_zero() -> None:
    short = msgspec.structs.replace(
        CUT, name="short", motion=msgspec.structs.replace(CUT.motion, duration=1.0)
    )
    found = envelope(short)
    assert found.often[1][0] > 0.0  # in a second only the first station is passed
    assert not found.often[1][1:].any() and not found.energy[1][1:].any()


def test_what_stands_and_what_it_costs_is_told() -> None:
    problem = DesignProblem(CUT, 1, ("gravity_wall",))
    layout = problem.decode([1.0, 0.8, 0.0, 0.0])
    found = problem.evaluate(layout, range(10))
    seen = observe(problem, found, problem.encode(layout))
    np.testing.assert_allclose(seen["layout"], [1.0, 0.8, 0.0, 0.0], atol=1e-6)
    share = CUT.annual(layout) / problem.nothing.objective
    assert raw(seen, "spent")[0] == pytest.approx(share)


def test_extremes_stay_in_bounds() -> None:
    problem = DesignProblem(cut(FREE, HARMLESS))
    seen = nothing(problem)
    assert seen in space(problem.size, 3, False)
    assert {array.dtype for array in seen.values()} == {np.dtype(np.float32)}
    assert max(abs(array).max() for array in seen.values()) <= BOUND


def test_observations_are_copies() -> None:
    problem = DesignProblem(CUT)
    for array in nothing(problem).values():
        array[:] = 0.0
    assert nothing(problem)["energy"].any()


@pytest.mark.slow
def test_every_entry_moves_over_sites_by_about_its_spread() -> None:
    """Over 30 sites of the splits; of what stands, that is decided and not of the site."""
    third = SEEN_AT_SITES // 3
    names = [n for split in ("train", "validation", "test") for n in sites.split(split)[:third]]
    problems = [DesignProblem(name, fidelity="fast") for name in names]
    barrier_free([problem.site for problem in problems])
    seen = [nothing(problem) for problem in problems]
    for name in FIELDS.keys() - {"layout", "spent"}:
        values = np.array([one[name] for one in seen], dtype=float)
        assert (values.std(axis=0) > 0.02).all(), name
        assert 0.4 < values.std() < 2.5, name
        assert abs(values.mean()) < 1.0, name
