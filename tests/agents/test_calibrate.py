"""What fidelity "fast" costs and gains, against the releases themselves."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from scipy import stats

import rigdda
from agents import calibrate
from agents.cli import main
from agents.seeds import release_seeds
from envs import fidelity
from rigdda import BadInput, Site, sites


def test_fast_has_fewer_larger_blocks_and_a_longer_step():
    for seed in range(5):
        site = sites.random(seed)
        fast = fidelity.at(site, "fast")
        fewer, more = (len(s.realise(seed=0).blocks) for s in (fast, site))
        assert fewer == pytest.approx(more / fidelity.COARSER, rel=0.25)
        assert fast.motion.dt == fidelity.FAST_DT > site.motion.dt
        assert fast.source.area == site.source.area
        assert fidelity.at(site, "full") is site
    toppling = Site.load("toppling")
    assert fidelity.at(toppling, "fast").source == toppling.source
    with pytest.raises(BadInput, match="fidelity = 'coarse': choose one of fast, full"):
        fidelity.at(site, "coarse")


def test_the_bias_is_that_of_the_releases_with_welch_s_interval():
    site = Site.load("quick")
    ticks = []
    found = calibrate.calibrate(site, 4, 3, lambda done, words: ticks.append(done))
    assert ticks == [0, 4, 8, 12, 16, 20]
    assert [len(c.layout) for c in found] == [0, 1, 2]
    seeds = release_seeds("verification", 3, 4)
    for c in found:
        for name, sample in (("full", c.full), ("fast", c.fast)):
            jobs = [(fidelity.at(site, name), c.layout, seed) for seed in seeds]
            assert sample.tolist() == [o.debris_fraction for o in rigdda.release_many(jobs)]
        test = stats.ttest_ind(c.fast, c.full, equal_var=False)
        assert c.bias == pytest.approx(c.fast.mean() - c.full.mean())
        assert c.bias_ci == pytest.approx(tuple(test.confidence_interval(0.95)), rel=1e-6)
        assert c.gain == c.seconds_full / c.seconds_fast > 0.0


def test_the_command_writes_its_table(tmp_path, capsys):
    assert main(["calibrate", "quick", "--releases", "2", "--out", str(tmp_path)]) == 0
    assert "calibrate.csv is in" in capsys.readouterr().out
    with (tmp_path / "calibrate.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["releases"] for row in rows] == ["2"] * 3
    for row in rows:
        numbers = [float(row[key]) for key in ("bias_low", "bias", "bias_high")]
        assert numbers == sorted(numbers)
        assert np.isfinite(float(row["gain"]))


def test_an_unknown_site_is_bad_input(capsys):
    assert main(["calibrate", "nowhere"]) == 2
    assert "site = 'nowhere'" in capsys.readouterr().err
