"""What `rigdda simulate` says of passing blocks: a real process, tables computed again by hand."""

from __future__ import annotations

import csv
import re
import time
from fractions import Fraction
from pathlib import Path

import msgspec
import numpy as np
import pyarrow.parquet as pq
import pytest
from processes import png_size, refused, rig, rows, run
from scipy.stats import binom

from rigdda import Fence, Site
from rigdda.app.reports import stations
from rigdda.app.reports.simulation_report import TABLES
from rigdda.app.reports.stations import QUANTILE_LEVELS, QUANTITIES, Passing
from rigdda.app.reports.wording import figure
from rigdda.envs.intervals import mid_p
from rigdda.envs.quantiles import quantiles
from rigdda.envs.siting import FeasiblePlaces
from rigdda.files import UNFINISHED
from rigdda.passages import PASSAGE, STATES, STOP, Passages, passages

RELEASES = 120
NUMBERS = ("mean", *(f"q{100 * level:g}" for level in QUANTILE_LEVELS))


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Releases of `verge` watched at two stations: their folder, and what was printed."""
    folder = tmp_path_factory.mktemp("verge")
    at = ("--station", 8, "--station", 3.5)
    words = run("simulate", "verge", "--releases", RELEASES, *at, "--out", "o", folder=folder)
    return folder / "o", words


def values(passage: dict[str, str]) -> dict[str, float]:
    """Return the quantities of a row of the table of passages."""
    number = {k: float(v) for k, v in passage.items() if k != "event"}
    translation, rotation = number["energy_translation_kJ"], number["energy_rotation_kJ"]
    return {
        "energy": translation + rotation,
        "energy_translation": translation,
        "energy_rotation": rotation,
        "velocity": float(np.hypot(number["velocity_x_m_s"], number["velocity_y_m_s"])),
        "height": number["height_m"],
        "height_normal": number["height_normal_m"],
        "height_top": number["height_top_m"],
    }


Table = list[dict[str, str]]


def weighted(site: Site, table: Table, releases: Table) -> list[Fraction]:
    """Return the rate of each passage's event over the number of its releases."""
    count = {name: sum(r["event"] == name for r in releases) for name in site.event_names}
    return [Fraction(str(site.event(p["event"]).rate)) / count[p["event"]] for p in table]


def quantile(sample: list[float], weights: list[Fraction], level: float) -> float:
    """Return the smallest value that at least a share `level` of the weight does not exceed."""
    below, bound = Fraction(0), Fraction(str(level)) * sum(weights)
    for value, weight in sorted(zip(sample, weights, strict=True)):
        below += weight
        if below >= bound:
            return value
    raise AssertionError


def test_the_tables_equal_a_computation_by_hand(simulated: tuple[Path, str]) -> None:
    folder, _ = simulated
    site, raw = Site.load("verge"), rows(folder / "passages.csv")
    releases = rows(folder / "outcomes.csv")
    checked = 0
    for row in rows(folder / "stations.csv"):
        if row["quantity"] == stations.PASSING_RATE:
            continue
        here = [p for p in raw if p["x_m"] == row["x_m"]]
        own = [p for p in here if row["event"] in (p["event"], stations.ALL_EVENTS)]
        assert int(row["n"]) == len(own)
        if not own:
            assert row["note"] == "no block passes" and row["mean"] == ""
            continue
        sample, weights = [values(p)[row["quantity"]] for p in own], weighted(site, own, releases)
        mean = sum(float(w) * v for w, v in zip(weights, sample, strict=True)) / float(sum(weights))
        assert float(row["mean"]) == pytest.approx(mean, rel=1e-12)
        for level in QUANTILE_LEVELS:
            hand = quantile(sample, weights, level)
            assert float(row[f"q{100 * level:g}"]) == hand
        checked += 1
    assert checked >= 2 * 4 * len(QUANTITIES)


def test_intervals_of_single_blocks_are_order_statistics(simulated: tuple[Path, str]) -> None:
    folder, _ = simulated
    raw = rows(folder / "passages.csv")
    own = [p for p in raw if p["x_m"] == "3.5" and p["event"] == "small, crest"]
    ordered = sorted(values(p)["velocity"] for p in own)
    n = len(ordered)
    assert n > 20
    (row,) = (
        row
        for row in rows(folder / "stations.csv")
        if (row["x_m"], row["event"], row["quantity"]) == ("3.5", "small, crest", "velocity")
    )
    for level, name in zip(QUANTILE_LEVELS, NUMBERS[1:], strict=True):
        low, high = int(binom.ppf(0.025, n, level)), int(binom.ppf(0.975, n, level)) + 1
        assert row[f"{name}_low"] == (str(ordered[low - 1]) if low >= 1 else "")
        assert row[f"{name}_high"] == (str(ordered[high - 1]) if high <= n else "")
        assert (name in row["note"]) == (high > n or low < 1)


def test_passing_rates_are_rates_times_the_share_of_releases(simulated: tuple[Path, str]) -> None:
    folder, _ = simulated
    site, raw, total = Site.load("verge"), rows(folder / "passages.csv"), 0.0
    releases = rows(folder / "outcomes.csv")
    table = {
        row["event"]: row
        for row in rows(folder / "stations.csv")
        if (row["quantity"], row["x_m"]) == (stations.PASSING_RATE, "8.0")
    }
    for event in site.events:
        n = sum(r["event"] == event.name for r in releases)
        passing = {p["seed"] for p in raw if (p["x_m"], p["event"]) == ("8.0", event.name)}
        assert int(table[event.name]["releases"]) == n
        if n == 0:
            assert table[event.name]["note"] == "no release of this event"
            continue
        often = event.rate * len(passing) / n
        low, high = (event.rate * end for end in mid_p(len(passing), n))
        found = [float(table[event.name][name]) for name in ("mean", "mean_low", "mean_high")]
        assert found == pytest.approx([often, low, high])
        assert table[event.name]["unit"] == "1/year per 100 m"
        total += often
    assert float(table[stations.ALL_EVENTS]["mean"]) == pytest.approx(total)


def test_parquet_equals_csv(simulated: tuple[Path, str]) -> None:
    folder, _ = simulated
    for name in TABLES:
        table = pq.read_table(folder / f"{name}.parquet").to_pylist()
        with (folder / f"{name}.csv").open(newline="") as file:
            text = list(csv.DictReader(file))
        written = [{k: "" if v is None else str(v) for k, v in row.items()} for row in table]
        assert text and written == text, name


def test_pictures_are_there_and_the_printed_figures_are_those_of_the_table(
    simulated: tuple[Path, str],
) -> None:
    folder, words = simulated
    for name in ("section", "along_slope", "run_out", "station_8m", "station_3.5m"):
        assert png_size(folder / f"{name}.png")[0] >= 1200
    (row,) = (
        row
        for row in rows(folder / "stations.csv")
        if (row["x_m"], row["event"], row["quantity"]) == ("8.0", stations.ALL_EVENTS, "velocity")
    )
    assert f"at 8 m {row['n']} blocks pass" in words
    (line,) = re_lines(words.split("at 8 m ")[1], "velocity [m/s]")
    assert f"{float(row['q50']):.3g}" in line and f"{float(row['q95']):.3g}" in line
    assert not (folder / UNFINISHED).exists()


def re_lines(text: str, word: str) -> list[str]:
    return [line for line in text.splitlines() if word in line]


def test_design_events_are_told_apart_from_the_many_small_blocks(
    simulated: tuple[Path, str],
) -> None:
    folder, words = simulated
    site, table = Site.load("verge"), rows(folder / "stations.csv")
    told = stations.of_design_events(site, table)
    assert [line for line in words.splitlines() if line.startswith("design event")] == told
    design = [event.name for event in site.events if event.design]
    assert len(told) == 2 * len(design)  # at each station
    for line in told:
        name, x = re.match(r"design event '(.*)' at (\S+) m", line).groups()
        row = next(r for r in table if r["event"] == name and float(r["x_m"]) == float(x)
                   and r["quantity"] == "energy")  # fmt: skip
        if int(row["n"]) < stations.FEW_PASSAGES:
            assert f"{row['n']} block" in line or "no block passes" in line
            assert (f"--event {name}" in line) == (int(row["releases"]) < stations.FEW_RELEASES)
        else:
            assert f"less than {figure(float(row['q95']))} kJ" in line


def test_where_blocks_stop_is_told_beyond_the_road(simulated: tuple[Path, str]) -> None:
    folder, _ = simulated
    site, stops = Site.load("verge"), rows(folder / "stops.csv")
    assert {row["state"] for row in stops} <= set(STATES)
    assert max(float(row["x_m"]) for row in stops) > site.road.end
    table = [row for row in rows(folder / "run_out.csv") if row["event"] == "small, crest"]
    own = [row for row in stops if row["event"] == "small, crest"]
    n = len({row["seed"] for row in own})
    shares = [float(row["share_of_blocks"]) for row in table]
    assert shares[0] == 1.0 and shares == sorted(shares, reverse=True)
    for row in table[::10]:
        beyond = [s for s in own if float(s["x_m"]) > float(row["x_m"])]
        assert float(row["share_of_blocks"]) == pytest.approx(len(beyond) / len(own))
        assert float(row["probability"]) == pytest.approx(len({s["seed"] for s in beyond}) / n)


def test_the_run_out_of_the_rock_is_what_the_stops_give(simulated: tuple[Path, str]) -> None:
    """95 % of the rock by mass, each event weighted by its rate, also beyond the road."""
    folder, words = simulated
    site, stops = Site.load("verge"), rows(folder / "stops.csv")
    releases = rows(folder / "outcomes.csv")
    assert {row["event"] for row in rows(folder / "stopping.csv")} > {"block", stations.ALL_EVENTS}
    for row in rows(folder / "stopping.csv"):
        own = [s for s in stops if row["event"] in (s["event"], stations.ALL_EVENTS)]
        if not own:
            continue
        each = weighted(site, own, releases)
        mass = [w * Fraction(s["mass_kg"]) for w, s in zip(each, own, strict=True)]
        hand = quantile([float(s["x_m"]) for s in own], mass, float(row["share"]))
        assert float(row["x_m"]) == hand
        assert row["x_m_low"] == "" or float(row["x_m_low"]) <= hand
        assert int(row["n"]) == len(own)
        assert row["x_m_high"] == "" or float(row["x_m_high"]) >= hand
        assert row["bound"] == "" and {s["state"] for s in own} == {"at rest"}
    assert (row["event"], row["share"]) == (stations.ALL_EVENTS, "0.95")
    assert row["x_m_low"] != ""
    (line,) = re_lines(words, "run-out of 95 % of the rock [m]")
    assert f" {hand:.1f} " in line and "lower bound" not in words


@pytest.mark.parametrize(
    "states, bound, words",
    [
        ((0, 0, 0), "", ("196.5", "196.5 to 210.0")),
        ((0, 0, 1), "", ("196.5", "196.5 to ?")),
        ((0, 2, 0), "lower bound", (">= 196.5", "196.5 to ?")),
        ((1, 0, 0), "lower bound", (">= 196.5", "196.5 to ?")),
    ],
)
def test_the_run_out_is_not_cut_at_the_road(
    states: tuple[int, ...], bound: str, words: tuple[str, str]
) -> None:
    """100 releases of three blocks with 10, 86 and 4 % of the rock, two of them beyond the road."""
    site = Site.load("quick")
    stops = np.zeros(300, dtype=STOP)
    stops["release"], stops["block"] = np.repeat(np.arange(100), 3), np.tile(np.arange(3), 100)
    stops["x"], stops["mass"] = np.tile([20.0, 196.5, 210.0], 100), np.tile([10.0, 86.0, 4.0], 100)
    stops["state"] = np.tile(states, 100)
    none = np.zeros(100, dtype=np.int64)
    found = Passages(np.zeros(0), tuple(range(100)), none, np.zeros(0, dtype=PASSAGE), stops)
    table = stations.stopping(Passing.of(site, (), site.event_names[0], found))
    assert site.road.end < 196.5 and table[-1]["bound"] == bound
    assert stations.stopped(table) == words
    assert bool(stations.lower_bound(table)) == bool(bound)


def test_events_without_a_release_have_empty_rows_of_the_run_out(tmp_path: Path) -> None:
    site = Site.load("quick")
    site = msgspec.structs.replace(site, origin=msgspec.structs.replace(site.origin, chainage=9.0))
    found = passages(site, (), [(0, "block")], [])
    table = stations.stopping(Passing.of(site, (), None, found))
    stations.write(tmp_path / "stopping", table)
    written = rows(tmp_path / "stopping.csv")
    assert {row["event"] for row in written} == {*site.event_names, stations.ALL_EVENTS}
    for row in written:
        drawn = row["event"] in ("block", stations.ALL_EVENTS)
        assert bool(row["x_m"]) == bool(row["chainage_m"]) == drawn
    assert stations.stopped(table[2:4]) == ("-", "-") and not stations.lower_bound(table[2:4])


@pytest.mark.slow
def test_the_interval_of_the_run_out_holds_that_of_many_releases() -> None:
    site, held = Site.load("verge"), 0
    whole = passages(site, (), [(seed, "group") for seed in range(4_000)], [])
    everything = Passing.of(site, (), "group", whole)
    true = float(stations.stopping(everything)[-1]["x_m"])
    for start in range(0, 4_000, 200):
        found = passages(site, (), [(seed, "group") for seed in range(start, start + 200)], [])
        row = stations.stopping(Passing.of(site, (), "group", found))[-1]
        held += row["x_m_low"] <= true and not row["x_m_high"] < true
    assert held >= 17  # of 20


def test_a_block_that_leaves_the_profile_is_told(tmp_path: Path) -> None:
    words = run("simulate", "shu-hwa", "--event", "block, top", "--releases", 30, "--out", "o",
                folder=tmp_path)  # fmt: skip
    left = [row for row in rows(tmp_path / "o/stops.csv") if row["state"] == "left the profile"]
    assert f"{len(left)} left the profile at its end (148.6 m)" in words
    table = rows(tmp_path / "o/run_out.csv")
    assert {row["event"] for row in table} == {"block, top"}
    assert float(table[-1]["share_of_blocks"]) == pytest.approx(len(left) / 30)
    assert left and all(float(row["x_m"]) == 148.6 for row in left)
    last = rows(tmp_path / "o/stopping.csv")[-1]
    mass = {row["block"] + row["seed"]: float(row["mass_kg"]) for row in left}
    whole = sum(float(row["mass_kg"]) for row in rows(tmp_path / "o/stops.csv"))
    assert float(last["left"]) == pytest.approx(sum(mass.values()) / whole)
    assert float(last["left"]) > 0.05  # so that the end of the ground is a lower bound only
    assert last["bound"] == "lower bound" and float(last["x_m"]) == 148.6
    assert last["x_m_high"] == ""
    assert ">= 148.6" in words and "of the rock left the surveyed ground" in words
    assert "the run-out of 95 % of the rock is a lower bound" in words
    (row, *_) = rows(tmp_path / "o/stations.csv")
    assert float(row["x_m"]) == Site.load("shu-hwa").road.start  # by default


@pytest.mark.slow
def test_all_releases_count(tmp_path: Path) -> None:
    """Not only those of which trajectories are drawn."""
    options = ("--event", "small, crest", "--releases", 300, "--out", "o")
    run("simulate", "verge", *options, folder=tmp_path)
    along = rows(tmp_path / "o/along_slope.csv")
    assert {row["releases"] for row in along} == {"300"}
    most = max(int(row["n"]) for row in along)
    assert most > 200
    top = next(row for row in along if row["n"] == str(most) and row["quantity"] == "energy")
    assert top["q95_high"] != ""  # the third-highest of 60 would have none


@pytest.mark.slow
def test_a_killed_simulation_goes_on_and_ends_the_same(tmp_path: Path) -> None:
    options, out = ("--releases", 400, "--station", 8, "--out"), tmp_path / "killed"
    run("simulate", "verge", *options, "whole", folder=tmp_path)
    for least in (1, 4, 9):
        killed = rig("simulate", "verge", *options, "killed", folder=tmp_path)
        while len(list((out / UNFINISHED).glob("[!.]*.npz"))) < least:
            assert killed.poll() is None
            time.sleep(0.01)
        killed.kill()
        killed.communicate()
    words = run("simulate", "verge", *options, "killed", folder=tmp_path)
    assert "from an interrupted run" in words
    for file in (f"{name}.csv" for name in (*TABLES, "outcomes")):
        assert (out / file).read_bytes() == (tmp_path / "whole" / file).read_bytes()


@pytest.mark.parametrize(
    "options, named",
    [
        (("--station", 400), ("station", "400", "between -15 and 61")),
        (("--station", 61), ("station", "61", "between -15 and 61")),
        (("--station", "nan"), ("--station", "nan", "give a finite number")),
        (("--station", "near"), ("--station", "near")),
        (("--releases", 0), ("--releases", "0", "1")),
        (("--model", "lumped", "--station", 3), ("--station", "blocks")),
    ],
)
def test_malformed_options_are_one_line(
    options: tuple[object, ...], named: tuple[str, ...], tmp_path: Path
) -> None:
    line = refused("simulate", "verge", *options, folder=tmp_path)
    assert all(word in line for word in named), line
    assert list(tmp_path.iterdir()) == []


def test_passages_do_not_hang_on_other_stations_or_threads() -> None:
    site, fence = Site.load("verge"), (Fence(9.0, 2.0, energy_class=100),)
    releases = [(seed, name) for name in ("block", "group", "slab") for seed in range(6)]
    few = passages(site, fence, releases, [4.0, 10.0], threads=1)
    many = passages(site, fence, releases, [1.0, 4.0, 7.0, 10.0, 30.0], threads=2)
    for k, station in enumerate((1, 3)):
        own, other = few.at(k).copy(), many.at(station).copy()
        own["station"] = other["station"] = 0
        assert len(own) and (own == other).all()
    assert (few.stops == many.stops).all()


def test_passages_equal_those_of_a_run(site: Site) -> None:
    """Of groups of blocks, with the velocity of the step at which a block passes."""
    from rigdda import Simulation
    from rigdda.passages import ends

    scene = site.realise((), 3, "group")
    settings = site.settings(scene)
    run = Simulation(scene, settings, (20.0,), leave=ends(site)[1]).run(site.motion.duration)
    found = passages(site, (), [(3, "group")], [20.0]).table
    crossed = run.crossings(0)
    assert len(found) == len(scene.blocks)
    assert found["time"].tolist() == crossed["time"].tolist()
    assert found["height"].tolist() == crossed["height"].tolist()
    assert np.hypot(found["vx"], found["vy"]) == pytest.approx(crossed["speed"], rel=1e-12)
    whole = found["translation"] + found["rotation"]
    assert whole == pytest.approx(crossed["energy"] * found["width"])
    assert (found["rotation"] > 0.0).all() and (found["omega"] != 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("event", ["block", "group"])
def test_intervals_hold_the_quantiles_of_many_releases(event: str) -> None:
    """100 runs of 200 releases against 10,000; `experiments.envelope_coverage` takes 50,000."""
    site, held, widths = Site.load("verge"), 0, []
    truth = passages(site, (), [(seed, event) for seed in range(10**6, 10**6 + 10_000)], [6.0])
    of = QUANTITIES["energy"].of
    true = np.quantile(of(truth.table), 0.9, method="inverted_cdf")
    for start in range(0, 20_000, 200):
        found = passages(site, (), [(seed, event) for seed in range(start, start + 200)], [6.0])
        passing = Passing.of(site, (), event, found)
        (one,) = quantiles(passing.sample(event, found.table, of(found.table)), [0.9])
        held += one.low <= true <= one.high
        widths.append((one.high - one.low) / true)
    assert held >= 90
    assert np.median(widths) < 1.5  # intervals are not wider than this number of releases requires


def test_the_run_out_of_an_event_that_is_switched_off_is_told() -> None:
    site = Site.load("quick")
    off = tuple(
        msgspec.structs.replace(e, rate=0.0) if e.name == "block" else e for e in site.events
    )
    found = passages(site, (), [(seed, "block") for seed in range(20)], [])
    table, without = (
        stations.run_out(Passing.of(one, (), "block", found))
        for one in (site, msgspec.structs.replace(site, events=off))
    )
    assert [row["probability"] for row in without] == [row["probability"] for row in table]
    assert {row["rate"] for row in without} == {0.0} and table[0]["probability"] == 1.0


def test_it_is_said_which_figures_are_of_the_rates_with_mesh() -> None:
    site = Site.load("cliff")
    none = passages(site, (), [], [])
    mesh = FeasiblePlaces(site, site.barrier_zone).mesh(0)
    assert "rates with mesh" in Passing.of(site, (mesh,), None, none).of_mesh()
    for layout, event in (((), None), ((mesh,), site.event_names[0])):
        assert Passing.of(site, layout, event, none).of_mesh() == ""
