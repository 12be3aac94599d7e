"""The cost of a right outcome: what is counted, and that every engine computes the same scenes."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from experiments.bench import engines
from experiments.bench.engines import PEERS
from experiments.outcome_cost import gathering, sample
from experiments.outcome_cost.cases import CASES, cut
from experiments.outcome_cost.cost import cost, needed, sampled
from experiments.outcome_cost.engines import CORE, LUMPED, REFERENCE, Setting, settings
from experiments.outcome_cost.sample import ENERGY, PAST, RUN_OUT, Core, Points, Release
from experiments.outcome_cost.study import compared
from rigdda import Block, Scene, Terrain
from rigdda.validation.scenes import rock

RECORDED = Path(__file__).parents[2] / "experiments" / "results" / "outcome_cost"
LEVEL = 0.03


def releases(share, count, seed=0):
    """Return releases of ten blocks of which a share is past the road."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        past = rng.random(10) < share
        blocks = np.stack([np.ones(10), past, 50.0 + 10.0 * rng.random(10), np.full(10, 7.0)], 1)
        found.append(Release(blocks, 0.5))
    return found


def test_outcomes_are_those_of_all_blocks_by_mass():
    blocks = np.array([[3.0, 1.0, 60.0, 9.0], [1.0, 0.0, 20.0, math.nan], [1.0, 0.0, 30.0, 5.0]])
    debris, run_out, energy = sample.outcomes([Release(blocks, 0.0), Release(blocks, 0.0)])
    assert debris == pytest.approx(0.6) and run_out == 60.0
    assert energy == pytest.approx(np.quantile([9.0, 5.0, 9.0, 5.0], 0.95))


def test_the_releases_that_an_answer_needs_are_those_of_scatter_and_bias():
    scatter, none = np.array([0.3, 0.1, 0.2]), np.zeros(3)
    assert needed(none, none, scatter, 0.03) == pytest.approx([100.0, 0.1 / 0.009, 400 / 9])
    biased = needed(np.array([0.024, 0.0, 0.04]), none, scatter, 0.03)
    assert biased[0] == pytest.approx(0.09 / (0.03**2 - 0.024**2)) and biased[2] == math.inf
    noisy = needed(np.array([0.024, 0.0, 0.0]), np.full(3, 0.024), scatter, 0.03)
    assert noisy[0] == pytest.approx(100.0)  # what is within its error counts as none


def test_a_cost_is_told_only_where_the_bias_is_known_to_the_level():
    reference, few = (sampled(releases(0.3, n, n)) for n in (1500, 40))
    unknown = cost(few, reference, 0.03)
    assert not unknown.known and 0.0 < unknown.resampled[0] < math.inf
    found = cost(sampled(releases(0.3, 1500, 1), 1), reference, 0.1)
    low, high = found.ends()
    assert low <= found.value <= high
    assert found.value == pytest.approx(0.5 * 0.7 / 3 / 0.1**2, rel=0.3)
    off = sampled(releases(0.5, 300, 2), 1)
    assert cost(off, reference, 0.1).value == math.inf and gathering.surely_biased(off, reference)


def test_a_peer_of_unknown_bias_counts_as_if_it_had_none():
    ours, peer = Setting(CORE, 1e-2), Setting("MuJoCo", 1e-2)
    samples = {REFERENCE: sampled(releases(0.3, 1500)),
               ours: sampled(releases(0.3, 1500, 1), 1),
               peer: sampled(releases(0.3, 40, 2), 2)}  # fmt: skip
    row = compared(samples, 0.05)
    assert row["told"] == "its least cost" and 0.0 < row["ratio"] < math.inf
    assert row["low"] <= row["ratio"] <= row["high"]
    samples[peer] = sampled(releases(0.5, 300, 2), 2)
    assert compared(samples, 0.05)["ratio"] == 0.0


@pytest.mark.parametrize(("adapter", "package"), PEERS.items())
def test_peers_start_as_the_scene_does_and_turn_at_its_rate(adapter, package):
    pytest.importorskip(package)
    module = engines.adapter(adapter)
    block = Block(np.array([[0.0, 30.0], [2.0, 30.0], [2.0, 31.0], [0.0, 31.0]]),
                  velocity=(3.0, 1.0, 40.0))  # fmt: skip
    scene = Scene(Terrain([(-50.0, 0.0), (50.0, 0.0)]), (block,), rock())
    run = module.Engine(scene, 1e-3, True, **module.OPTIONS[0])
    assert run.velocities()[0] == pytest.approx((3.0, 1.0, 40.0))
    run.advance(200)  # more than a turn
    vx, vy, omega = run.velocities()[0]
    assert (vx, omega) == pytest.approx((3.0, 40.0), rel=1e-3)
    assert vy == pytest.approx(1.0 - 0.2 * 9.81, abs=0.01)


@pytest.mark.parametrize("name", CASES)
def test_this_core_and_points_compute_releases(name):
    case = CASES[name]()
    core, points = Core(case, 10e-3, {}), Points(case)
    for computer in (core, points):
        found = computer.release(1)
        assert found.cpu > 0.0 and len(found.blocks) == len(case.draw(1).blocks)
        assert set(found.blocks[:, PAST]) <= {0.0, 1.0}
        came = ~np.isnan(found.blocks[:, ENERGY])
        assert (found.blocks[came, ENERGY] >= 0.0).all()
        assert np.isfinite(found.blocks[:, RUN_OUT]).all()


def test_a_study_goes_on_where_it_was(tmp_path, monkeypatch):
    monkeypatch.setattr(gathering, "settings", lambda name: settings(name)[:2])
    first = gathering.gather("tschamut", 6, tmp_path)
    monkeypatch.setattr(gathering, "compute", None)  # nothing is computed again
    again = gathering.gather("tschamut", 6, tmp_path)
    assert list(first) == list(again) and first[REFERENCE].releases == 6
    assert all(np.array_equal(first[s].means, again[s].means) for s in first)


def test_ritchies_cuts_are_cases():
    assert {cut(angle).name for angle in (35, 60, 80)} == {f"ritchie-{a}" for a in (35, 60, 80)}


def test_the_record_has_every_case_engine_and_ratio():
    rows = list(csv.DictReader((RECORDED / "outcome_cost.csv").read_text().splitlines()))
    assert {row["case"] for row in rows} == set(CASES)
    assert {row["engine"] for row in rows} == {CORE, "Box2D", "pymunk", "MuJoCo", LUMPED}
    ratios = list(csv.DictReader((RECORDED / "ratios.csv").read_text().splitlines()))
    judged = {r["case"]: float(r["ratio"]) for r in ratios if float(r["level"]) == LEVEL}
    assert set(judged) == set(CASES)
