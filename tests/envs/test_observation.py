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
from rigdda.envs.envelope import (
    ZONE_STATIONS,
    barrier_free,
    envelope,
    largest,
    stations,
)
from rigdda.envs.environments import BarrierDesign, BarrierEnv, BarrierPlacement
from rigdda.envs.observation import BOUND, FIELDS, LAYOUT_FIELDS, observe, space
from rigdda.seeds import EPISODES, OBSERVATIONS

CUT = cut()
SEEN_AT_SITES = 30


def raw(seen: dict[str, np.ndarray], name: str) -> np.ndarray:
    """Return what an array says, in its own units."""
    field = (FIELDS | LAYOUT_FIELDS)[name]
    return field.centre + field.spread * seen[name].astype(float)


def test_the_site_is_told() -> None:
    problem = DesignProblem(CUT, 2)
    seen, worth = observe(problem), problem.nothing.objective
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
    often, energies = np.zeros((2, ZONE_STATIONS)), [[[] for _ in lines] for _ in range(2)]
    for event in CUT.events:
        group = int(largest(CUT, event.name) > 1)
        count = max(2, 16 // largest(CUT, event.name))
        for seed in range(OBSERVATIONS, OBSERVATIONS + count):
            scene = CUT.realise((), seed, event.name)
            run = rigdda.Simulation(scene, CUT.settings(scene), lines.tolist()).run(8.0)
            for k in range(ZONE_STATIONS):
                passed = [e["energy"] for e in run.events if e["target"] == k and e["kind"] == 1]
                often[group, k] += (len(passed) > 0) * event.rate / count
                energies[group][k] += passed
    np.testing.assert_allclose(seen.often, often, rtol=1e-9, atol=1e-12)
    for group in range(2):
        for k in range(ZONE_STATIONS):
            assert seen.energy[group, k] in (energies[group][k] or [0.0])
    assert seen.deposit.sum() == pytest.approx(1.0)
    told = observe(DesignProblem(CUT))
    np.testing.assert_allclose(raw(told, "often"), np.log10(1e-3 + often).ravel(), atol=1e-5)


def test_envelopes_are_simulated_once_and_on_seeds_that_are_not_scored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert OBSERVATIONS >= EPISODES
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
    env = BarrierPlacement(CUT, 2, ("gravity_wall",), releases=1)
    before, _ = env.reset(seed=0)
    assert raw(before, "spent") == pytest.approx([0.0])
    np.testing.assert_array_equal(before["layout"], np.full(8, -1.0))
    seen, *_, info = env.step(np.array([1.0, 0.8, 0.0, 0.0], np.float32))
    np.testing.assert_allclose(seen["layout"], [1.0, 0.8, 0.0, 0.0, *[-1.0] * 4], atol=1e-6)
    share = CUT.annual(info["layout"]) / env.problem.nothing.objective
    assert raw(seen, "spent")[0] == pytest.approx(share)


def test_extremes_stay_in_bounds() -> None:
    problem = DesignProblem(cut(FREE, HARMLESS))
    seen = observe(problem)
    assert seen in space(problem.size, 3, False)
    assert {array.dtype for array in seen.values()} == {np.dtype(np.float32)}
    assert max(abs(array).max() for array in seen.values()) <= BOUND


def test_observations_are_copies() -> None:
    problem = DesignProblem(CUT)
    for array in observe(problem).values():
        array[:] = 0.0
    assert observe(problem)["energy"].any()


def episodes(env: BarrierEnv, names: list[str], each: int) -> dict[str, np.ndarray]:
    """Return every observation of random episodes on some sites, (n, size) by array."""
    env.action_space.seed(0)
    seen = []
    for i, name in enumerate(each * names):
        seen.append(env.reset(seed=i, options={"site": name})[0])
        ended = False
        while not ended:
            action = env.action_space.sample()
            action[0] = abs(action[0])  # the last slots are used, too
            observation, _, ended, *_ = env.step(action)
            seen.append(observation)
    return {name: np.array([one[name] for one in seen], dtype=float) for name in seen[0]}


def most_blocks(site: Site) -> int:
    """Return the largest number of blocks of an event."""
    return max(largest(site, name) for name in site.event_names)


@pytest.mark.parametrize(
    "env_class", [BarrierDesign, pytest.param(BarrierPlacement, marks=pytest.mark.slow)]
)
def test_no_entry_is_always_the_same(env_class: type[BarrierEnv]) -> None:
    """Over a built-in and a generated site of every family but that of large, slow masses."""
    names = [*sites.FAMILIES, *sites.split("validation")[:6]]
    names = [name for name in names if most_blocks(Site.load(name)) < 100]
    env = env_class("validation", releases=1)
    for name, values in episodes(env, names, 6).items():
        assert (np.ptp(values, axis=0) > 1e-3).all(), name


@pytest.mark.slow
@pytest.mark.parametrize("split", ["train", "validation", "test"])
def test_every_entry_moves_over_sites_by_about_its_spread(split: str) -> None:
    problems = [DesignProblem(name, fidelity="fast") for name in sites.split(split)[:SEEN_AT_SITES]]
    barrier_free([problem.site for problem in problems])
    seen = [observe(problem) for problem in problems]
    for name in FIELDS:
        values = np.array([one[name] for one in seen], dtype=float)
        assert (values.std(axis=0) > 0.02).all(), name
        assert 0.4 < values.std() < 2.5, name
        assert abs(values.mean()) < 1.0, name
