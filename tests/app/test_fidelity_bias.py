"""What fidelity "fast" costs and gains, against the releases themselves."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from rigdda import BadInput, Site
from rigdda.app import fidelity_bias
from rigdda.app.cli import main
from rigdda.envs import DesignProblem, problem
from rigdda.seeds import release_seeds


def test_fast_has_fewer_larger_blocks_and_a_longer_step() -> None:
    site = Site.load("quick")
    fast = problem.site_at_fidelity(site, "fast")
    fewer, more = (len(s.realise(seed=0, event="mass").blocks) for s in (fast, site))
    assert fewer == pytest.approx(more / problem.FAST_AREA_FACTOR, rel=0.25)
    assert fast.motion.dt == max(problem.FAST_DT, site.motion.dt)
    assert problem.site_at_fidelity(site, "full") is site
    with pytest.raises(BadInput, match="fidelity = 'coarse': choose one of fast, full"):
        problem.site_at_fidelity(site, "coarse")


@pytest.mark.slow
def test_the_bias_is_that_of_the_evaluations(site: Site) -> None:
    ticks: list[int] = []
    found = fidelity_bias.compare(site, 12, 3, lambda done, _: ticks.append(done))
    assert ticks == [0, 12, 24, 36, 48, 60]
    assert [c.name for c in found] == ["nothing", "constant", "rule"]
    seeds = release_seeds("verification", 3, 12)
    full = DesignProblem(site).evaluate((), seeds)
    assert found[0].full.objective == full.objective
    for c in found:
        assert c.bias.low <= c.bias.value <= c.bias.high
        assert c.bias.value == pytest.approx(c.fast.objective - c.full.objective)
        below = math.hypot(c.fast.objective - c.fast.ci[0], c.full.ci[1] - c.full.objective)
        assert c.bias.value - c.bias.low == pytest.approx(below)


def test_the_command_writes_its_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fidelity", "narrow", "--releases", "10", "--out", str(tmp_path)]) == 0
    assert "fidelity.csv is in" in capsys.readouterr().out
    with (tmp_path / "fidelity.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["case"] for row in rows] == ["nothing", "constant", "rule"]
    for row in rows:
        numbers = [float(row[key]) for key in ("bias_low", "bias", "bias_high")]
        assert numbers == sorted(numbers)
        assert np.isfinite(float(row["z_full"]))


def test_an_unknown_site_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fidelity", "nowhere"]) == 2
    assert "site = 'nowhere'" in capsys.readouterr().err
