"""Fits to deposits, to blocks that pass a station, and to several files; posteriors."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from processes import refused, rig, rows, run

from rigdda import BadInput, Site
from rigdda.app.uncertainty import fit
from rigdda.app.uncertainty.observations import DEPOSIT, OBSERVED_RUN_OUT, DataSet, read
from rigdda.app.uncertainty.parameters import parse, read_posterior, with_values
from rigdda.app.uncertainty.score_surface import best_places
from rigdda.files import UNFINISHED
from rigdda.passages import passages

SITE = Site.load("quick")
EDGES = np.array([0.0, 16, 20, 24, 28, 32, 36, 40, 44, 48, 52, 56, 60, 64, 68, 72, 80])
PATHS = ("surfaces.rock.rolling", "surfaces.rock.restitution")
TRUE = ((0.1, 0.2), (0.25, 0.3), (0.4, 0.15), (0.3, 0.4), (0.15, 0.45))


def deposit(site: Site, first: int, releases: int) -> DataSet:
    """Return the deposit of single blocks of a site, by mass."""
    found = passages(site, (), [(s, "block") for s in range(first, first + releases)], ()).stops
    mass = np.histogram(found["x"], EDGES, weights=found["mass"])[0]
    return DataSet(DEPOSIT, "block", EDGES, np.nan, mass / mass.sum(), releases)


def fitted(i: int, paths: tuple[str, ...], releases: int, budget: int, each: int) -> fit.Fit:
    """Return the fit to a synthetic deposit."""
    parameters = [parse(path) for path in paths]
    real = with_values(SITE, parameters, TRUE[i][: len(paths)])
    one = deposit(real, 10**6 + 1000 * i, releases)
    return fit.fit(SITE, {one.name: one}, parameters, budget, each, i, lambda done, words: None)


def holds(found: fit.Fit, i: int) -> bool:
    """Return whether the 90 % intervals of all parameters hold the true values."""
    low, high = found.posterior.interval(0.9)
    true = np.array(TRUE[i][: len(low)])
    return bool(((low <= true) & (true <= high)).all())


@pytest.mark.slow
def test_a_synthetic_deposit_gives_back_its_rolling_resistance() -> None:
    found = fitted(1, PATHS[:1], 40, 16, 40)
    assert holds(found, 1)
    low, high = found.posterior.interval(0.9)
    assert fit.identified(found) == [True]
    assert found.low <= low < high <= found.high
    assert found.posterior.weights.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_fits_find_the_values_of_five_synthetic_deposits() -> None:
    held = [holds(fitted(i, PATHS[:1], 60, 32, 100), i) for i in range(len(TRUE))]
    assert sum(held) >= 4


def test_blocks_of_a_deposit_count_as_many_as_are_independent() -> None:
    one = deposit(SITE, 5000, 30)
    alone = fit.independent_blocks(SITE, one, range(100))
    assert 8 <= alone <= 30  # unequal blocks tell less by mass than equal ones
    twice = fit.independent_blocks(SITE, one._replace(releases=60), range(100))
    assert twice == pytest.approx(2 * alone, abs=1)
    group = fit.independent_blocks(SITE, one._replace(event="group", releases=30), range(40))
    assert 0.9 * alone < group < 6 * 30
    with pytest.raises(BadInput, match="in the column releases"):
        fit.independent_blocks(SITE, one._replace(releases=1), range(100))


def test_the_least_place_of_noisy_scores_is_found_with_its_error() -> None:
    rng = np.random.default_rng(1)
    places = rng.random((60, 2))
    surface = 2.0 + 4.0 * (places[:, 0] - 0.3) ** 2 + (places[:, 1] - 0.6) ** 2
    scores = surface[:, None] + 0.01 * rng.standard_normal(60)[:, None] * np.ones((1, 200))
    found = best_places(places, scores, rng)
    assert found.shape == (200, 2)
    assert found.mean(axis=0) == pytest.approx([0.3, 0.6], abs=0.06)
    assert (found.std(axis=0) < 0.15).all() and (found.std(axis=0) > 1e-3).all()
    low, high = np.quantile(found, (0.025, 0.975), axis=0)
    assert (low <= [0.3, 0.6]).all() and (high >= [0.3, 0.6]).all()


@pytest.mark.slow
def test_passages_and_run_outs_are_fitted_together(tmp_path: Path) -> None:
    parameters, rolling = [parse("surfaces.rock.rolling")], 0.25
    real = with_values(SITE, parameters, (rolling,))
    found = passages(real, (), [(s, "block") for s in range(7000, 7040)], [20.0]).table
    lines = ["event,station_m,quantity,value"]
    lines += [f"block,20,velocity,{np.hypot(v, w)}" for v, w in found[["vx", "vy"]].tolist()]
    lines += [f"block,20,height,{h}" for h in found["height"].tolist()]
    (tmp_path / "passages.csv").write_text("\n".join(lines) + "\n")
    one = deposit(real, 7000, 40)
    lines = ["event,start_m,end_m,mass_t,releases"]
    lines += [
        f"block,{a},{b},{m},40"
        for a, b, m in zip(EDGES[:-1], EDGES[1:], 7.0 * one.shares, strict=True)
    ]
    (tmp_path / "deposit.csv").write_text("\n".join(lines) + "\n")
    sets = read([tmp_path / "passages.csv", tmp_path / "deposit.csv"], SITE)
    names = ["block, velocity at 20 m", "block, height at 20 m", "block, deposit"]
    assert list(sets) == names
    assert sets["block, deposit"].shares == pytest.approx(one.shares)
    got = fit.fit(SITE, sets, parameters, 16, 40, 0, lambda done, words: None)
    low, high = got.posterior.interval(0.99)
    assert low[0] <= rolling <= high[0] and high[0] - low[0] < 0.3
    table = {row["what"]: row for row in fit.rows(got, got.observed)}
    for name in names:
        row = table[f"mean, {name}"]
        assert row["fitted"] == pytest.approx(row["observed"], rel=0.35)
    assert table["mean, block, velocity at 20 m"]["unit"] == "m/s"
    fit.draw(tmp_path / "fit.png", got)
    assert (tmp_path / "fit.png").stat().st_size > 5000


def test_a_deposit_is_spread_evenly_within_its_intervals() -> None:
    one = DataSet(DEPOSIT, "block", np.array([0.0, 10.0, 30.0]), np.nan, np.array([0.25, 0.75]), 8)
    assert one.sample(4).tolist() == pytest.approx([5.0, 10 + 20 / 6, 20.0, 10 + 20 * 5 / 6])
    assert DataSet(OBSERVED_RUN_OUT, "block", np.zeros(3)).name == "block"


@pytest.mark.parametrize(
    "text, named",
    [
        ("event,start_m,end_m\nblock,0,9\n", "name its columns"),
        ("event,start_m,end_m,share,mass_t\nblock,0,9,1,1\n", "name its columns"),
        ("event,run_out_m,station_m,quantity,value\nblock,1,2,height,3\n", "name its columns"),
        ("event,start_m,end_m,share\nblock,0,9,1\n", "two intervals or more"),
        ("event,start_m,end_m,share\nblock,0,9,0\nblock,9,12,0\n", "rock in at least one"),
        ("event,start_m,end_m,share\nblock,0,9,1\nblock,10,12,1\n", "let it begin at 9"),
        ("event,start_m,end_m,share\nblock,0,9,1\nblock,8,12,1\n", "let it begin at 9"),
        ("event,start_m,end_m,share\nblock,9,0,1\nblock,9,12,1\n", "row 1 end_m = 0"),
        ("event,start_m,end_m,share\nblock,0,9,-1\nblock,9,12,1\n", "row 1 share = -1"),
        ("event,start_m,end_m,share\nblock,0,9,1\nblock,9,99,1\n", "row 2 end_m = 99"),
        ("event,start_m,end_m,share,releases\nblock,0,9,1,2\nblock,9,12,1,3\n", "same number"),
        ("event,start_m,end_m,share,releases\nblock,0,9,1,x\nblock,9,12,1,x\n", "releases = 'x'"),
        ("event,start_m,end_m,share\nrain,0,9,1\nrain,9,12,1\n", "row 1 event = 'rain'"),
        ("event,station_m,quantity,value\nblock,20,speed,3\n", "velocity"),
        ("event,station_m,quantity,value\nblock,500,height,3\n", "row 1 station_m = 500"),
        ("event,station_m,quantity,value\nblock,-9,velocity,3\n", "row 1 station_m = -9"),
        (
            "event,station_m,quantity,value\nblock,1,velocity,3\n",
            "beyond 1 m, where the source face",
        ),
        (
            "event,station_m,quantity,value\nmass,0.4,height,3\n",
            "beyond 0.5 m, where the source mass",
        ),
        ("event,station_m,quantity,value\nblock,20,velocity,-3\n", "row 1 value = -3"),
        ("event,station_m,quantity,value\nblock,20,velocity,fast\n", "give a number"),
    ],
)
def test_a_table_of_observations_is_checked(text: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "seen.csv").write_text(text)
    options = ("--parameters", "surfaces.rock.rolling")
    line = refused("fit", "quick", "seen.csv", *options, folder=tmp_path)
    assert named in line


def test_an_error_names_the_file_of_several(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("event,run_out_m\nblock,30\nblock,31\n")
    (tmp_path / "b.csv").write_text("event,run_out_m\nblock,30\ngrup,31\n")
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    with pytest.raises(BadInput, match=r"observed .*b\.csv row 2 event = 'grup'"):
        read(files, SITE)
    (tmp_path / "b.csv").write_text("event,start_m,end_m,share\nblock,0,9,0\nblock,9,12,0\n")
    with pytest.raises(BadInput, match=r"observed .*b\.csv share of block"):
        read(files, SITE)
    (tmp_path / "b.csv").write_text("event,run_out\nblock,30\n")
    with pytest.raises(BadInput, match=r"observed .*b\.csv = 'event, run_out'"):
        read(files, SITE)


def test_a_station_within_the_source_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("event,station_m,quantity,value\n" + 3 * "block,2,velocity,1\n")
    (one,) = read([tmp_path / "a.csv"], SITE).values()
    assert one.station == 2.0 and one.values.tolist() == [1.0, 1.0, 1.0]


def test_observations_that_tell_nothing_identify_nothing() -> None:
    parameters = [parse("surfaces.rock.restitution"), parse("surfaces.rock.rolling=0.2:0.6")]
    observed = {"block": np.array([1.0, 2.0, 4.0])}
    found = fit.search(
        SITE, observed, parameters, lambda values, seeds: {"block": np.zeros(1)}, 8, 10, 0,
        lambda done, words: None,
    )  # fmt: skip
    assert fit.identified(found) == [False, False]
    low, high = found.posterior.interval(0.95)
    assert low == pytest.approx([0.02, 0.21], abs=0.002)  # the middle 95 % of the ranges
    assert high == pytest.approx([0.78, 0.59], abs=0.002)


def test_points_are_fitted_to_run_outs_only(tmp_path: Path) -> None:
    (tmp_path / "seen.csv").write_text(
        "event,station_m,quantity,value\n" + 3 * "block,20,height,1\n"
    )
    line = refused("fit", "quick", "seen.csv", "--model", "lumped", "--parameters",
                   "lumped.rock.normal", folder=tmp_path)  # fmt: skip
    assert "--model" in line and "use blocks" in line


def test_the_same_observations_in_two_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "seen.csv").write_text("event,run_out_m\n" + 3 * "block,20\n")
    line = refused("fit", "quick", "seen.csv", "seen.csv", "--parameters",
                   "surfaces.rock.rolling", folder=tmp_path)  # fmt: skip
    assert "in one file only" in line


def test_stations_that_tables_cannot_tell_apart_are_refused(tmp_path: Path) -> None:
    """In one file and in two; the reason is not that a file repeats the other."""
    head = "event,station_m,quantity,value\n"
    near = ["block,30.00001,velocity,9\n", 2 * "block,30.00002,velocity,8\n"]
    words = r"station_m = 30\.00002: give 30\.00001 for both, or .*: in tables, both .* 30 m$"
    (tmp_path / "a.csv").write_text(head + "".join(near))
    with pytest.raises(BadInput, match=r"observed .*a\.csv " + words):
        read([tmp_path / "a.csv"], SITE)
    for name, lines in zip("bc", near, strict=True):
        (tmp_path / f"{name}.csv").write_text(head + lines)
    with pytest.raises(BadInput, match=r"observed .*c\.csv " + words):
        read([tmp_path / "b.csv", tmp_path / "c.csv"], SITE)
    apart = near[1].replace("30.00002", "30.001")
    (tmp_path / "c.csv").write_text(head + apart)
    names = ["block, velocity at 30 m", "block, velocity at 30.001 m"]
    assert list(read([tmp_path / "b.csv", tmp_path / "c.csv"], SITE)) == names


def test_an_event_with_the_name_of_other_observations_is_refused(tmp_path: Path) -> None:
    events = (*SITE.events[:1], msgspec.structs.replace(SITE.events[0], name="block, deposit"))
    site = msgspec.structs.replace(SITE, events=events, meshes=())
    (tmp_path / "a.csv").write_text("event,start_m,end_m,share\nblock,20,30,1\nblock,30,40,2\n")
    (tmp_path / "b.csv").write_text("event,run_out_m\n" + 3 * '"block, deposit",30\n')
    with pytest.raises(BadInput, match=r"b\.csv event = 'block, deposit': rename this event"):
        read([tmp_path / "a.csv", tmp_path / "b.csv"], site)


@pytest.mark.parametrize("text, count", [("10", 10), ("1e1", 10), ("10.0", 10), (" 7", 7)])
def test_numbers_of_releases_are_read_as_other_numbers(
    text: str, count: int, tmp_path: Path
) -> None:
    rows = f"block,20,30,1,{text}\nblock,30,40,2,{count}\n"
    (tmp_path / "a.csv").write_text("event,start_m,end_m,share,releases\n" + rows)
    (one,) = read([tmp_path / "a.csv"], SITE).values()
    assert one.releases == count and isinstance(one.releases, int)


@pytest.mark.parametrize("text", [5000 * "1", "1000001", "1e300", "2.5", "0", "-3", "", "\u0663"])
def test_an_unsound_number_of_releases_is_named(text: str, tmp_path: Path) -> None:
    rows = f"block,20,30,1,{text}\nblock,30,40,2,{text}\n"
    (tmp_path / "a.csv").write_text("event,start_m,end_m,share,releases\n" + rows, "utf-8")
    words = r"a\.csv row 1 releases = .*: give a whole number of at least 1 and at most 1000000$"
    with pytest.raises(BadInput, match=words):
        read([tmp_path / "a.csv"], SITE)


ROLLING = ("--parameters", "surfaces.rock.rolling")
DEPOSIT_COLUMNS = "event,start_m,end_m,share,releases\n"


@pytest.mark.parametrize(
    "text, options, named",
    [
        (
            "event,run_out_m\n" + 3 * "block,30\n",
            ("--parameters", "surfaces.rock.friction_deg=-5:20"),
            "surfaces.rock.friction_deg = -5",
        ),
        (
            "event,run_out_m\n" + 3 * "block,30\n",
            ("--parameters", "surfaces.clay.rolling"),
            "name a number of the site file",
        ),
        (
            "event,run_out_m\n" + 3 * "block,30\n",
            ("--parameters", "prices.concrete=1:2"),
            "do not depend on it",
        ),
        (
            "event,station_m,quantity,value\n" + 3 * "block,20,height,1\n",
            ("--model", "lumped", "--parameters", "lumped.rock.normal"),
            "use blocks: points give run-outs only",
        ),
        (
            DEPOSIT_COLUMNS + "block,0,30,1,1\nblock,30,33,1,1\nblock,33,60,1,1\n",
            ROLLING,
            "give a deposit of more releases",
        ),
        (
            DEPOSIT_COLUMNS + "block,-9,-8,1,1\nblock,-8,-7,1,1\n",
            ROLLING,
            "-9 to -7 m': no rock of 10 computed releases stops there",
        ),
    ],
)
def test_a_refused_fit_leaves_no_folder(
    text: str, options: tuple[str, ...], named: str, tmp_path: Path
) -> None:
    (tmp_path / "seen.csv").write_text(text)
    line = refused("fit", "quick", "seen.csv", *options, "--releases", 10, "--out", "out",
                   folder=tmp_path)  # fmt: skip
    assert named in line
    assert not (tmp_path / "out").exists()


def stopped(*each: Sequence[float]) -> Callable[..., SimpleNamespace]:
    """Return a function in place of `passages`: blocks of 1 t stop at given chainages [m]."""
    stops = np.zeros(sum(map(len, each)), dtype=[("release", int), ("x", float), ("mass", float)])
    stops["release"] = np.repeat(np.arange(len(each)), [len(own) for own in each])
    stops["x"] = [x for own in each for x in own]
    stops["mass"] = 1000.0
    return lambda *_: SimpleNamespace(stops=stops, seed=range(len(each)))


@pytest.mark.parametrize(
    "each, value, mend",
    [
        (((5.0,), (70.0,)), "10 to 40 m", "correct the event or the chainages, or change the gro"),
        (((22.0,), (24.0, 70.0)), "20 to 40 m", "divide it, or change the ground .*LOW:HIGH"),
        (((12.0, 20.0), (13.0, 22.0)), "block, deposit", "alike.*let releases differ"),
    ],
)
def test_a_deposit_that_the_computed_releases_cannot_judge(
    each: tuple[tuple[float, ...], ...], value: str, mend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More releases of the deposit would not help, which was the advice for fewer than three."""
    ends = np.array([10.0, 20.0, 40.0]) if value != "block, deposit" else np.array([10.0, 15, 40])
    one = DataSet(DEPOSIT, "block", ends, np.nan, np.array([0.5, 0.5]), 9)
    monkeypatch.setattr(fit, "passages", stopped(*each))
    with pytest.raises(BadInput, match=f"of block = '{value}'.*{mend}") as bad:
        fit.independent_blocks(SITE, one, range(len(each)))
    assert "more releases" not in str(bad.value)


def test_a_single_block_a_release_counts_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The variance between releases of one block each is that of independent blocks."""
    one = DataSet(DEPOSIT, "block", np.array([10.0, 20, 40]), np.nan, np.array([0.5, 0.5]), 9)
    monkeypatch.setattr(fit, "passages", stopped((12.0,), (25.0,), (13.0,), (39.0,)))
    assert fit.independent_blocks(SITE, one, range(4)) == 9


@pytest.mark.slow
def test_a_killed_fit_goes_on_and_its_posterior_is_sampled(tmp_path: Path) -> None:
    lines = ["event,start_m,end_m,volume_m3,releases"]
    one = deposit(SITE, 5000, 30)
    lines += [
        f"block,{a},{b},{m},30" for a, b, m in zip(EDGES[:-1], EDGES[1:], one.shares, strict=True)
    ]
    (tmp_path / "deposit.csv").write_text("\n".join(lines) + "\n")
    command = ("fit", "quick", "deposit.csv", "--parameters", PATHS[0], "--budget", 12)
    command = (*command, "--releases", 20, "--seed", 4, "--out")
    run(*command, "whole", folder=tmp_path)
    killed = rig(*command, "killed", folder=tmp_path)
    least = random.Random(3).randint(1, 9)
    while len(list((tmp_path / "killed" / UNFINISHED).glob("[!.]*.npz"))) < least:
        assert killed.poll() is None
        time.sleep(0.002)
    killed.kill()
    killed.communicate()
    run(*command, "killed", folder=tmp_path)
    for name in ("fit.csv", "posterior.csv", "site.toml"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert not (tmp_path / "killed" / UNFINISHED).exists()
    file = tmp_path / "whole/posterior.csv"
    joint = read_posterior(file, SITE)
    row = rows(tmp_path / "whole/fit.csv")[0]
    low, high = joint.interval(0.95)
    assert float(row["low"]) <= low[0] and high[0] <= float(row["high"])
    run("sensitivity", "quick", "--parameters", "ground", "--posterior", file, "--samples", 2,
        "--releases", 8, "--out", "s", folder=tmp_path)  # fmt: skip
    table = rows(tmp_path / "s/sensitivity.csv")
    assert {row["input"] for row in table} == {
        f"posterior of {PATHS[0]}", PATHS[1], "surfaces.rock.friction_deg",
    }  # fmt: skip
    drawn = {float(row[PATHS[0]]) for row in rows(tmp_path / "s/samples.csv")}
    assert drawn <= set(joint.values[:, 0].tolist())


def test_values_read_back_belong_to_their_observations(tmp_path: Path) -> None:
    """A deposit before run-outs: the values are computed in another order."""
    one = deposit(SITE, 5000, 30)
    stops = passages(SITE, (), [(s, "block") for s in range(900, 930)], ()).stops["x"]
    runs = DataSet(OBSERVED_RUN_OUT, "block", np.array(stops, dtype=np.float64))
    sets = {one.name: one, runs.name: runs}
    parameters = [parse(PATHS[0])]

    def quiet(done: float, words: str) -> None:
        """Show no progress."""

    fits = [fit.fit(SITE, sets, parameters, 8, 20, 3, quiet, out=out) for out in (None, tmp_path)]
    again = fit.fit(SITE, sets, parameters, 8, 20, 3, quiet, out=tmp_path)
    for other in (fits[1], again):
        assert other.best.values == fits[0].best.values
        assert fit.rows(other, other.observed) == fit.rows(fits[0], fits[0].observed)


def test_a_deposit_is_shown_as_it_was_observed() -> None:
    """Of 4.9 t, 4.4 t lie uphill of 118 m: 95 % lie uphill of 124 m."""
    ends = np.array([40.0, 56.0, 80.0, 100.0, 118.0, 130.0, 174.0])
    mass = np.array([0.4, 0.6, 1.1, 2.3, 0.5, 0.0])
    one = DataSet(DEPOSIT, "block", ends, np.nan, mass / mass.sum(), 12)
    shown = one.sample(fit.DEPOSIT_PIECES)
    right = 118.0 + 12.0 * (0.95 - 4.4 / 4.9) / (0.5 / 4.9)
    assert np.quantile(shown, 0.95) == pytest.approx(right, abs=0.2)
    assert shown.mean() == pytest.approx(
        float((mass * 0.5 * (ends[1:] + ends[:-1])).sum() / 4.9), abs=0.2
    )
    found = SimpleNamespace(sets={one.name: one}, observed={one.name: one.sample(4)})
    assert fit._shown(found, one.name) == pytest.approx(shown)
