"""The study of Tschamut runs, and its record is what the text says."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

from experiments.tschamut import platrock, study
from rigdda import Site

RECORDED = Path(__file__).parents[2] / "experiments" / "results" / "tschamut"


def test_it_fits_predicts_and_draws(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "QUICK_BUDGET", 8)
    monkeypatch.setattr(study, "QUICK_RELEASES", 10)
    monkeypatch.setattr(study, "QUICK_PREDICTED", 10)
    monkeypatch.setattr(study, "DRAWN", 1)
    number = study.run(True, tmp_path)
    assert 0.0 <= number.value < 60.0
    rows = list(csv.DictReader((tmp_path / "tschamut" / "prediction.csv").read_text().splitlines()))
    assert len(rows) == 30 and {row["block"] for row in rows} == {"1", "2", "4"}
    assert (tmp_path / "tschamut" / "tschamut.png").stat().st_size > 20_000


FAKE = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    if asked["R_n"] > 0.5:
        sys.exit("no")
    out = [[100.0 * v] * asked["releases"] for v in asked["volumes"]]
    print(json.dumps({"run_outs": out, "cpu": 0.25}), flush=True)
"""


def test_platrock_is_asked_in_its_own_process_and_its_end_is_told(tmp_path, monkeypatch):
    (tmp_path / "platrock_server.py").write_text(FAKE)
    monkeypatch.setattr(platrock, "__file__", str(tmp_path / "platrock.py"))
    site = Site.load(study.HERE / "site.toml")
    with platrock.PlatRock(sys.executable, site) as peer:
        found = peer.run_outs(np.array([0.2, 0.8, 0.1, 0.4]), range(3, 7))
        assert list(found) == list(platrock.MASSES) and peer.cpu == 0.25
        assert found["block 4"] == pytest.approx([100.0 * 40.0 / 2650.0] * 4)
        with pytest.raises(RuntimeError, match="PlatRock stopped: no"):
            peer.run_outs(np.array([0.6, 0.8, 0.1, 0.4]), range(3))
        with pytest.raises(RuntimeError, match="PlatRock stopped"):
            peer.run_outs(np.array([0.2, 0.8, 0.1, 0.4]), range(3))


def test_blocks_predict_runs_that_were_left_out_and_points_do_not():
    rows = list(csv.DictReader((RECORDED / "tschamut.csv").read_text().splitlines()))
    left = {(r["model"], r["what"]): float(r["left_out"]) for r in rows if r["left_out"]}
    seen = {r["what"]: float(r["observed"]) for r in rows if r["observed"]}
    for what, bar in (("mean run-out", 5.0), ("mean run-out, block 1", 8.0),
                      ("mean run-out, block 2", 8.0), ("mean run-out, block 4", 8.0),
                      ("stops on the slope", 0.1)):  # fmt: skip
        assert left["blocks", what] == pytest.approx(seen[what], abs=bar)
    assert left["blocks", "score"] < left["lumped", "score"]
    means = {name: left["blocks", f"mean run-out, block {name}"] for name in (1, 2, 4)}
    assert min(means, key=means.__getitem__) == 4


@pytest.mark.xfail(reason="the median is 10 m short and the 95 % quantile 15 m long")
def test_the_quantiles_of_runs_that_were_left_out_are_near_the_observed_ones():
    rows = list(csv.DictReader((RECORDED / "tschamut.csv").read_text().splitlines()))
    own = {r["what"]: r for r in rows if r["model"] == "blocks"}
    for what in ("50% of run-outs", "95% of run-outs"):
        observed, left_out = float(own[what]["observed"]), float(own[what]["left_out"])
        assert left_out == pytest.approx(observed, abs=8.0)
