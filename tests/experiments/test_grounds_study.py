"""The field cases of the grounds: how a contact is measured, and what is recorded."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from experiments.grounds import contacts, reach
from experiments.tschamut.study import BAR
from rigdda import Scene, Surface, Terrain
from rigdda.ground.grounds import GROUNDS
from rigdda.validation.scenes import FLAT, GRAVITY, box

RESULTS = Path(__file__).parents[2] / "experiments" / "results"


def table(name: str) -> list[dict[str, str]]:
    """Return the rows of a recorded table."""
    with (RESULTS / name).open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("restitution", [0.3, 0.6])
def test_a_flat_bounce_keeps_the_square_of_restitution(restitution):
    surface = Surface(0.0, restitution=restitution, rolling=0.5)
    block = box(0.0, 2.5, velocity=(0.0, -2.0, 0.0))
    scene = Scene(Terrain(FLAT), (block,), {"rock": surface})
    found = contacts.contacts(scene, 3.0, 1)
    speed = np.sqrt(4.0 + 2.0 * GRAVITY * 2.0)
    assert found[0].speed == pytest.approx(speed, abs=0.06)
    assert found[0].kept == pytest.approx(restitution**2, abs=0.006)


def test_the_observed_contacts_are_those_of_the_data():
    seen = contacts.observed()
    assert seen.shape == (11, 3)
    assert seen[:, 2].mean() == pytest.approx(0.31, abs=0.006)
    assert np.median(seen[:, 2]) == pytest.approx(0.27, abs=0.006)


def test_a_point_without_loss_keeps_its_energy():
    assert contacts.lumped_share(1.0, 1.0) == pytest.approx(np.ones(11))
    assert (contacts.lumped_share(0.0, 0.0) == 0.0).all()


def test_a_block_weighs_what_it_did():
    rng = np.random.default_rng(0)
    for name, (mass, flatness) in contacts.MASSES.items():
        _, size = contacts.section(name, rng)
        assert contacts.DENSITY * contacts.FILL * flatness * size**3 == pytest.approx(mass)


def test_the_recorded_prediction_of_contacts_is_near_those_that_were_observed():
    rows = table("chant_sura/predicted_contacts.csv")
    assert {row["block"] for row in rows} == set(contacts.MASSES)
    kept = np.array([float(row["share_kept"]) for row in rows])
    speed = np.array([float(row["speed_m_s"]) for row in rows])
    assert len(rows) >= 3000
    assert (speed >= 4.0).all() and (speed <= 10.0).all()
    real = contacts.observed()[:, 2]
    assert abs(kept.mean() - real.mean()) < 0.15
    assert abs(np.median(kept) - np.median(real)) < 0.12


WORSE = pytest.mark.xfail(reason="a later fit predicts it better than the ground of the library")


@pytest.mark.parametrize(
    ("column", "bar"),
    [  # two fits of 192 sets, to slightly different outcomes, differed by 3.0, 2.5 and 5.6 m
        ("run_out_mean_m", 3.0),
        ("run_out_50_m", 3.0),
        ("run_out_95_m", 3.0),
        pytest.param("block_4_m", 3.0, marks=WORSE),
        ("contacts_mean", 0.02),
        ("mid_slope_mean", 0.05),
        ("stops_on_slope", 0.02),
    ],
)
def test_the_ground_of_the_library_predicts_as_well_as_a_fit(column, bar):
    by = {row["fitted_on"]: row for row in table("grounds.csv") if row["model"] == "blocks"}
    real = next(row for row in table("grounds.csv") if row["model"] == "observed")
    fitted, meadow = by["tschamut and chant sura"], by["the library: meadow"]
    off, best = (abs(float(row[column]) - float(real[column])) for row in (meadow, fitted))
    assert off < best + bar


def test_a_fit_is_in_the_ranges_of_the_ground_of_the_library():
    """The alpine cases do not determine single parameters, so its values need not be the fit's."""
    by = {row["fitted_on"]: row for row in table("grounds.csv") if row["model"] == "blocks"}
    fitted = by["tschamut and chant sura"]
    ranges = GROUNDS["meadow"]
    for name in ("friction_deg", "restitution", "rolling"):
        span = getattr(ranges, name)
        assert span.low <= float(fitted[name]) <= span.high


def test_a_fit_to_run_outs_predicts_the_contacts_and_a_point_does_not():
    by = {(row["model"], row["fitted_on"]): row for row in table("grounds.csv")}
    real = by["observed", ""]
    for column in ("contacts_mean", "mid_slope_mean"):
        off = float(by["blocks", "tschamut"][column]) - float(real[column])
        assert abs(off) < 0.15
    off = float(by["lumped", "tschamut"]["contacts_mean"]) - float(real["contacts_mean"])
    assert off > 0.4


@pytest.mark.xfail(reason="the median is 12 m short and the far tail 17 m long, as after every fit")
def test_the_recorded_prediction_of_tschamut_is_near_the_runs():
    """All but the short end, of which 33 runs say little: see `experiments/README.md`."""
    by = {row["fitted_on"]: row for row in table("grounds.csv")}
    real, found = by[""], by["the library: meadow"]
    bars = {"run_out_mean_m": BAR, "run_out_50_m": 8.0, "run_out_95_m": 8.0, "block_4_m": 8.0}
    for column, bar in bars.items():
        assert abs(float(found[column]) - float(real[column])) < bar, column
    assert abs(float(found["stops_on_slope"]) - float(real["stops_on_slope"])) < 0.1
    blocks = [float(found[f"block_{number}_m"]) for number in (1, 2, 4)]
    assert min(blocks) == blocks[2]


def test_the_table_of_the_talus_has_all_variants():
    rows: list[dict] = [row | {"reach": float(row["reach"])} for row in table("grounds_reach.csv")]
    assert reach.moved(rows, "talus: rolling") > 0.0
    assert [row["variant"] for row in rows] == list(reach.variants())
