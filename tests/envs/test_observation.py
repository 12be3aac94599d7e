"""What a designer sees is what the site says and what falls without barriers."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

import rigdda
from envs import DesignProblem
from envs.base import SCORED_SEEDS
from envs.envelope import SEEDS, envelope, stations
from envs.observation import FIELDS, observe, space
from rigdda import Site, Surface, Wall
from rigdda.site import Motion, Scatter


def test_the_site_is_told(ramp: Site) -> None:
    site = msgspec.structs.replace(
        ramp,
        surfaces={
            "rock": Surface(25.0, restitution=0.1),
            "concrete": Surface(45.0, restitution=0.3),
        },
        motion=Motion(0.3, "contact", 1.0, 0.01),
        scatter=Scatter(2.0),
    )
    seen = observe(DesignProblem(site, 2, risk_weight=3.0, cost_limit=10.0), ())
    profile = [(25.0 - 1.25 * min(max(x, 0.0), 20.0)) / 100 for x in np.linspace(-10, 32, 33)]
    expected = {
        "profile": profile,
        "span": [0.42],
        "surfaces": [25 / 90, 0.1, 25 / 90, 0.1, 0.5, 0.3, 0.2],
        "source": [-0.23, -0.15, 0.1625, 0.245, 0.25125],
        "block": [math.sqrt(2.5) / 10],
        "damping": [0.3, 1.0],
        "zone": [-0.14, -0.02],
        "road": [0.08],
        "limits": [0.4, 0.05, 0.2, 0.2, 0.2, 0.6, 0.5, math.log10(5e6) / 10],
        "prices": [0.1, 0.1, 1.5, -0.04, 0.15, 0.035, 0.05, 0.03],
        "weights": [3.0, 0.2],
        "layout": [0.0, -1.0, 0.0] * 2,
        "cost_left": [1.0],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(seen[name], values, rtol=1e-6, atol=1e-7, err_msg=name)
    assert seen.keys() == FIELDS.keys() == expected.keys() | {"energy", "bounce", "deposit"}


def test_what_falls_without_barriers_is_told(ramp: Site) -> None:
    lines = stations(ramp)
    energies, heights = [[] for _ in lines], [[] for _ in lines]
    deposit = np.zeros(17)
    for seed in SEEDS:
        scene = ramp.realise((), seed)
        run = rigdda.Simulation(scene, ramp.settings(), lines.tolist()).run(ramp.motion.duration)
        for event in run.events:
            energies[event["target"]].append(event["energy"])
            ground = ramp.profile.height(lines[event["target"]])
            heights[event["target"]].append(event["y"] - ground)
        end = np.minimum((run.poses[-1, :, 0] + 10.0) // (42.0 / 16), 16).astype(int)
        areas = np.array([_area(block.vertices) for block in scene.blocks])
        np.add.at(deposit, end, areas / areas.sum() / len(SEEDS))
    seen = observe(DesignProblem(ramp), ())
    energy = [np.log10(1 + np.quantile(e, 0.95)) / 10 if e else 0.0 for e in energies]
    bounce = [np.quantile(h, 0.95) / 100 if h else 0.0 for h in heights]
    assert max(energy) > 0.3
    np.testing.assert_allclose(seen["energy"], energy, rtol=1e-6)
    np.testing.assert_allclose(seen["bounce"], bounce, rtol=1e-6)
    np.testing.assert_allclose(seen["deposit"], deposit, rtol=1e-6, atol=1e-9)
    assert seen["deposit"].sum() == pytest.approx(1.0)


def _area(corners: np.ndarray) -> float:
    x, y = corners.T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_no_block_passes_means_zero(ramp: Site) -> None:
    short = msgspec.structs.replace(ramp, motion=Motion(duration=0.1))
    found = envelope(short)
    assert not found.energy.any()
    assert not found.bounce.any()


def test_envelopes_are_simulated_once_and_on_seeds_that_are_not_scored(
    ramp: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert min(SEEDS) >= SCORED_SEEDS
    first = envelope(ramp)
    monkeypatch.setattr(rigdda, "simulate_many", None)
    assert envelope(msgspec.structs.replace(ramp)) is first
    with pytest.raises(ValueError, match="read-only"):
        first.energy[0] = 0.0


def test_the_layout_and_what_is_left_are_told(ramp: Site) -> None:
    problem = DesignProblem(ramp, kinds=("wall",), cost_limit=50.0)
    layout = (Wall(12.0, 2.0), Wall(17.0, 3.0))
    seen = observe(problem, layout)
    np.testing.assert_allclose(seen["layout"], problem.encode(layout), rtol=1e-6)
    assert seen["cost_left"] == pytest.approx([1.0 - ramp.cost(layout) / 50.0])


def test_extremes_stay_in_bounds(ramp: Site) -> None:
    problem = DesignProblem(ramp, kinds=("wall",), risk_weight=1e9, cost_limit=1e-3)
    seen = observe(problem, (Wall(12.0, 4.0),))
    assert seen in space(problem)
    assert seen["weights"][0] == 10.0
    assert seen["cost_left"] == -10.0
    assert {array.dtype for array in seen.values()} == {np.dtype(np.float32)}


def test_observations_are_copies(ramp: Site) -> None:
    problem = DesignProblem(ramp)
    first = observe(problem, ())
    for array in first.values():
        array[:] = 0.0
    assert observe(problem, ())["energy"].any()
