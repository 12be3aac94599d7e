"""Entry of the exam of PPO: a short training that is interrupted, and the entry with its model."""

from __future__ import annotations

import math

import pytest

from experiments import exam_ppo
from rigdda import sites
from rigdda.app.exam.counter import practice

pytest.importorskip("stable_baselines3")


@pytest.fixture
def names(monkeypatch) -> list[str]:
    """Return the sites of a short training, of four copies."""
    monkeypatch.setattr(exam_ppo, "COPIES", 4)
    monkeypatch.setattr(exam_ppo, "RELEASES", 1)
    monkeypatch.setitem(exam_ppo.SETTINGS, "batch_size", 16)
    return list(sites.split("wide-validation")[:2])


def test_a_training_continues_and_its_model_designs(names, tmp_path, monkeypatch) -> None:
    _, course = exam_ppo.train(names, 1e-3, tmp_path)
    assert len(course) == 1 and course[0]["episodes"] == 4 * exam_ppo.SETTINGS["n_steps"]
    model, longer = exam_ppo.train(names, course[0]["processor_s"] + 1e-3, tmp_path)
    assert longer[0] == course[0] and longer[1]["episodes"] == 2 * course[0]["episodes"]
    assert all(exam_ppo.LEAST_REWARD <= row["reward"] <= 1.0 for row in longer)
    path = tmp_path / "ppo.pt"
    model.policy.save(str(path))
    monkeypatch.setattr(exam_ppo, "POLICY", path)
    task = practice(names[0], budget=0)
    layout = exam_ppo.design(task)
    assert task.used == 0
    assert layout == tuple(task.problem.check(layout))
    assert math.isfinite(task.site.annual(layout))
