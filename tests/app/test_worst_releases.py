"""The worst releases of a study, as a table and a picture."""

import csv
import struct

import pytest
import tomli_w
from light_site import LIGHT

import rigdda
from rigdda import Fence
from rigdda.app.cli import main
from rigdda.app.worst_releases import FAILURE, ON_ROAD, worst

WEAK = (Fence(30.0, 2.5, energy_class=100),)


def _row(layout, event, seed, energy, volume, failed):
    return {
        "layout": layout, "event": event, "seed": str(seed), "max_energy_on_road": str(energy),
        "road_volume": str(volume), "barrier_0_failed": str(failed), "barrier_1_failed": "",
    }  # fmt: skip


def test_the_most_energy_and_the_failures_of_each_layout():
    rows = [
        _row("a", "block", 0, 0.0, 0.0, True),
        _row("a", "block", 1, 5e3, 1.0, False),
        _row("a", "group", 0, 9e3, 0.2, True),
        _row("a", "group", 1, 7e3, 0.2, False),
        _row("b", "block", 0, 0.0, 0.0, False),
        _row("b", "block", 1, 1e3, 0.5, False),
    ]
    found = worst(rows, 2)
    assert [(one.layout, one.why, one.event, one.seed) for one in found] == [
        ("a", ON_ROAD, "group", 0),
        ("a", ON_ROAD, "group", 1),
        ("a", FAILURE, "group", 0),
        ("a", FAILURE, "block", 0),
        ("b", ON_ROAD, "block", 1),
    ]
    assert found[0].energy == 9.0
    assert worst(rows[4:5], 2) == []


def test_a_study_writes_them_and_the_report_shows_them(tmp_path, capsys):
    LIGHT.save(tmp_path / "site.toml")
    rigdda.save_layout(WEAK, tmp_path / "layout.toml")
    layouts = [{"name": "nothing"}, {"name": "fence", "file": "layout.toml"}]
    table = {"site": "site.toml", "releases": 12, "layouts": layouts}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    out = tmp_path / "out"
    study = ["study", str(tmp_path / "study.toml"), "--seed", "5", "--out", str(out)]
    assert main([*study, "--worst", "2"]) == 0
    with (out / "worst.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    first = rows[0]
    assert (first["layout"], first["why"]) == ("nothing", ON_ROAD)
    _, outcome = rigdda.release(LIGHT, (), int(first["seed"]), first["event"])
    assert float(first["energy_on_road"]) == pytest.approx(1e-3 * outcome.max_energy_on_road)
    failures = [row for row in rows if row["why"] == FAILURE]
    assert failures
    for row in failures:
        _, outcome = rigdda.release(LIGHT, WEAK, int(row["seed"]), row["event"])
        assert any(barrier.failed for barrier in outcome.barriers)
    with (out / "worst.png").open("rb") as picture:
        head = picture.read(24)
    assert min(struct.unpack(">II", head[16:])) > 300
    assert main(["report", str(out), "--out", str(tmp_path / "report")]) == 0
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "The worst releases of the study" in page
    assert FAILURE in page
