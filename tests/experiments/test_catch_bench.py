"""The catch bench: one number is fitted at one width, another width is predicted."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from experiments import lumped_mass
from experiments.catch_bench import study

RECORDED = Path(__file__).parents[2] / "experiments" / "results"


def test_it_fits_one_width_and_predicts_another(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "FACES", (75.0,))
    monkeypatch.setattr(study, "VARIANTS", {"rolling": study.VARIANTS["rolling"]})
    number = study.run(True, tmp_path)
    (row,) = csv.DictReader((tmp_path / "catch_bench.csv").read_text().splitlines())
    assert float(row["within_9.4_m"]) == pytest.approx(number.value, rel=1e-5)
    assert 0.6 < number.value < float(row["within_10.9_m"]) < 0.99
    assert (tmp_path / "catch_bench.png").stat().st_size > 10_000


def test_a_width_that_no_value_retains_is_told():
    variant = study.VARIANTS["rolling"]
    narrow = variant.fitted._replace(low=0.95, high=1.0)  # so much resistance retains all
    assert study.fitted(study.below(75.0), variant._replace(fitted=narrow), 40) is None


def test_the_recorded_prediction_is_within_its_bar_at_every_face():
    rows = list(csv.DictReader((RECORDED / "catch_bench.csv").read_text().splitlines()))
    shares = [float(r["within_9.4_m"]) for r in rows if r["fitted"] == "surfaces.rock.rolling"]
    assert len(shares) == len(study.FACES)
    assert all(share == pytest.approx(study.PREDICTED[1], abs=study.BAR) for share in shares)


def test_the_lumped_mass_is_computed_beside_the_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(lumped_mass, "QUICK_RELEASES", 2)
    monkeypatch.setattr(lumped_mass, "highway", lambda: lumped_mass.cut(35))
    monkeypatch.setattr(lumped_mass, "DT", 1e-2)
    lumped_mass.run(True, tmp_path)
    rows = list(csv.DictReader((tmp_path / "lumped_mass.csv").read_text().splitlines()))
    assert [row["model"] for row in rows] == ["blocks", "lumped"] * 4
    assert all(0.0 <= float(row["debris"]) <= 1.0 for row in rows)
