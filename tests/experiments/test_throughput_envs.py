"""The table of episodes a second has a row for every batch."""

from __future__ import annotations

import csv
import sys

import pytest

from envs.registration import ENVIRONMENTS


def test_every_batch_is_measured(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    from experiments import throughput_envs

    monkeypatch.setattr(throughput_envs, "COPIES", (1, 2))
    out = tmp_path / "table.csv"
    monkeypatch.setattr(sys, "argv", ["throughput_envs", "--quick", "--out", str(out)])
    throughput_envs.main()
    with out.open() as file:
        rows = list(csv.DictReader(file))
    batches = [(row["environment"], row["copies"]) for row in rows]
    assert batches == [(name, copies) for name in ENVIRONMENTS for copies in ("1", "2")]
    assert all(int(row["episodes"]) >= 8 for row in rows)
    assert all(float(row["episodes_per_second"]) > 0.0 for row in rows)
