"""Speed against error: what is varied, how outcomes and errors are taken, one number."""

from __future__ import annotations

import math

import numpy as np
import pytest

from experiments.bench.cases import single
from experiments.bench.penetration import centroids
from experiments.front import front
from experiments.made_by import MADE_BY
from experiments.speed_error import closed_forms, highway, knobs, study
from experiments.speed_error.highway import Budget, Sample
from experiments.speed_error.tables import bias, closed_table, total_error
from rigdda import Block, Scene, Settings, Terrain
from rigdda.validation.scenes import FLAT, box, rock
from rigdda.validation.single_block import SLIDING

SLIDE = single()[0]


def sample(mean: float, spread: float, count: int, default: bool = False) -> Sample:
    """Return releases with this mean and standard deviation of all outcomes."""
    draws = np.random.default_rng(0).standard_normal(count)
    draws = (draws - draws.mean()) / draws.std(ddof=1)
    outcomes = mean + spread * np.repeat(draws[:, None], 3, axis=1)
    return Sample("rigdda", knobs.STEP, 0.005, default, outcomes, 1.0)


def test_choices_are_sound_settings_and_the_default_is_one():
    found = list(knobs.choices(2.0))
    assert sum(c.default for c in found) == 1
    assert Settings(**next(c for c in found if c.default).settings) == Settings()
    others = [Settings(**c.settings) for c in found if not c.default]
    assert len(others) == len(set(others)) and Settings() not in others
    soft = next(c for c in found if (c.knob, c.value) == (knobs.STIFFNESS, 1e-3))
    assert soft.settings == {"penetration": 2e-3}


def test_outcome_of_blocks_that_pass_the_barrier_or_not():
    """Three of four blocks pass the toe at 10 m/s, two the road's edge: 1/2 m v^2 + 1/2 I w^2."""
    blocks = tuple(box(80.0 - 3.0 * i, 10.0) for i in range(4))
    scene = Scene(Terrain(FLAT), blocks, rock())
    times = np.arange(60) * highway.FRAME
    poses = np.zeros((60, 4, 3))
    poses[:, :, :2] = centroids(scene)
    poses[:, :, 0] += 10.0 * times[:, None]  # by 11.8 m: to 91.8, 88.8, 85.8 and 82.8 m
    poses[:, :, 2] = 2.0 * times[:, None]
    debris, run_out, energy = highway.outcome(scene, poses)
    assert debris == 0.5
    assert run_out == pytest.approx(91.8)
    assert energy == pytest.approx(1e-3 * 2600.0 * (0.5 * 100.0 + 0.5 * 4.0 / 6.0))


def test_blocks_have_the_area_asked_for():
    areas = [len(highway.scene(area, 0).blocks) * area for area in (4.0, 8.0)]
    assert areas == pytest.approx([highway.ROCK.area] * 2, rel=0.06)


def test_error_of_a_mean_is_bias_and_noise():
    reference, unknown = sample(1.0, 0.1, 400), 2.0 * 0.1**2 / 400.0
    least = math.sqrt(unknown + 0.01**2)
    assert total_error(sample(1.0, 0.1, 400), reference, 100) == pytest.approx(least, rel=1e-6)
    off, sure = bias(sample(1.3, 0.1, 400), reference)
    assert off == pytest.approx(0.3)
    assert sure == pytest.approx(1.96 * 0.1 * math.sqrt(2.0 / 400.0))
    both = math.sqrt(0.3**2 + unknown + 0.01**2)
    assert total_error(sample(1.3, 0.1, 400), reference, 100) == pytest.approx(both)


def test_the_number_is_the_bias_over_the_interval_of_100_releases():
    value, known = study.worst_bias(sample(1.3, 0.5, 50), sample(1.0, 0.5, 50))
    assert value == pytest.approx(0.3 / (1.96 * 0.05))
    assert known == pytest.approx(math.sqrt(2.0 * 100.0 / 50.0))


def test_front():
    points = [(1.0, 5.0), (2.0, 6.0), (3.0, 1.0), (4.0, math.inf)]
    assert front(points, lambda p: p) == [(1.0, 5.0), (3.0, 1.0)]


def test_a_tuned_lab_sets_what_was_chosen():
    soft = knobs.Choice(knobs.STIFFNESS, 1e-2, {"penetration": 0.01})
    lab = closed_forms.TunedLab(soft)
    scene = Scene(Terrain(FLAT), (Block(box(0.0, 0.5).vertices),), rock())
    assert lab.simulate(scene, sleeping=False).settings == Settings(
        penetration=0.01, sleeping=False
    )
    assert lab.dt == Settings().dt


def test_slides_are_exact_at_every_choice():
    points = list(closed_forms.sweep(SLIDE))
    assert max(p.error for p in points) < 1e-5  # with a single open-close iteration
    assert "| step 0.01 |" in closed_table(points)
    newmark = next(c for c in SLIDING if c.name == "newmark")
    default = next(p for p in closed_forms.sweep_alone(newmark) if p.default)
    assert default.error < 1e-3


@pytest.mark.slow
def test_a_run_writes_its_tables_and_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr(highway, "QUICK", Budget(8, 2, 2, 12.0, (), 16.0))
    monkeypatch.setattr(study, "peers", list)
    monkeypatch.setattr(closed_forms, "with_peers", lambda quick: [SLIDE])
    number = study.run(True, tmp_path)
    assert number.passed, str(number)
    names = {"speed_error.csv", "speed_error.png", "speed_error.md", "highway.csv", "highway.png"}
    assert {path.name for path in tmp_path.iterdir()} == names | {study.SAMPLES, MADE_BY}


def test_a_study_goes_on_with_the_samples_it_has(tmp_path, monkeypatch):
    choice = knobs.Choice(knobs.STEP, 0.01, {"dt": 0.01})
    first = highway.sample(choice, 2, 12.0, 4.0, tmp_path)
    assert len(list(tmp_path.glob("rigdda-step-0.01-*.npz"))) == 1
    monkeypatch.setattr(highway, "release", None)  # nothing is computed again
    again = highway.sample(choice, 2, 12.0, 4.0, tmp_path)
    assert np.array_equal(again.outcomes, first.outcomes)
    assert again.cpu == first.cpu
    with pytest.raises(TypeError):
        highway.sample(choice, 3, 12.0, 4.0, tmp_path)


@pytest.mark.slow
def test_the_quick_study_finds_no_bias(tmp_path):
    number = study.run(True, tmp_path)
    assert number.passed, str(number)
