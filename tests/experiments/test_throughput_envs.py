"""The table of episodes a second has a row for every batch, that of variances one for a site."""

from __future__ import annotations

import csv

import pytest
from click.testing import CliRunner


@pytest.mark.slow
def test_every_batch_is_measured(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    from experiments import throughput_envs
    from experiments.throughput_envs import BEFORE

    monkeypatch.setattr(throughput_envs, "BATCHES", (1, 2))
    done = CliRunner().invoke(throughput_envs.main, ["--quick", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    with (tmp_path / "throughput_envs.csv").open() as file:
        rows = list(csv.DictReader(file))
    batches = [(row["environment"], row["copies"]) for row in rows]
    names = [*BEFORE, *BEFORE, throughput_envs.CORRIDOR]
    assert batches == [(name, copies) for name in names for copies in ("1", "2")]
    assert all(int(row["steps"]) >= 16 for row in rows)
    assert all(float(row["episodes_per_second"]) > 0.0 for row in rows)
    with (tmp_path / "reward_variance.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert row["site"] == "quick"
    ratio = float(row["variance"]) / float(row["variance_same_release"])
    assert float(row["ratio"]) == pytest.approx(ratio, abs=0.01)
