"""Results on the grid of the survey: printed lines and tables, and none without an origin."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import msgspec
import pytest
from rich.console import Console, RenderableType

import rigdda
from rigdda import Fence, Site
from rigdda.agents.designers.protocol import Entry
from rigdda.app import studies
from rigdda.app.reports import stations, study_report, tables
from rigdda.app.reports.stations import Passing
from rigdda.app.reports.tables import EvaluationsFile
from rigdda.app.reports.wording import order, surveyed
from rigdda.app.studies import Study
from rigdda.envs.cost import judge
from rigdda.model.site_tables import Origin
from rigdda.passages import passages

FENCE = Fence(20.0, 2.0, energy_class=250)


@pytest.fixture(scope="module")
def bare() -> Site:
    return rigdda.sites.load("quick")


@pytest.fixture(scope="module")
def site(bare: Site) -> Site:
    return msgspec.structs.replace(bare, origin=Origin(2683400.0, 1800.0, True))


def written(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def printed(table: RenderableType) -> str:
    console = Console(width=120, file=io.StringIO(), record=True)
    console.print(table)
    return console.export_text()


def test_a_station_has_its_chainage_and_elevation(site: Site, tmp_path: Path) -> None:
    seeds = [(s, "block") for s in range(8)]
    passing = Passing.of(site, (), "block", passages(site, (), seeds, [20.0, 34.8]))
    rows = stations.summary(passing, [0, 1])
    level = 1800.0 + site.profile.height(20.0)
    assert (rows[0]["x_m"], rows[0]["chainage_m"]) == (20.0, 2683380.0)
    assert rows[0]["elevation_m"] == level
    line, _ = next(stations.tables(rows))
    assert f"at 20 m (survey: chainage 2,683,380.0 m, elevation {level:,.1f} m) " in line
    every = {
        "stations": rows,
        "run_out": stations.run_out(passing),
        "stopping": stations.stopping(passing),
        "stops": stations.stops(passing),
        "passages": stations.raw(passing, [0]),
    }
    for name, found in every.items():
        fields = stations.raw_fields(site) if name == "passages" else None
        stations.write(tmp_path / name, found, fields)
        for row in written(tmp_path / f"{name}.csv"):
            assert float(row["chainage_m"]) == 2683400.0 - float(row["x_m"])


def test_without_an_origin_there_are_no_such_columns(bare: Site) -> None:
    passing = Passing.of(bare, (), "block", passages(bare, (), [(0, "block")], [20.0]))
    for rows in (stations.summary(passing, [0]), stations.run_out(passing)):
        assert not {"chainage_m", "elevation_m"} & set(rows[0])
    assert stations.raw_fields(bare) == list(stations.PASSAGE_COLUMNS)
    assert surveyed(bare, 20.0) == ""
    assert "survey" not in order(FENCE, bare)


def test_a_barrier_to_order_has_its_place_on_the_survey(site: Site, tmp_path: Path) -> None:
    assert "at x = 20.0 m (survey: chainage 2,683,380.0 m, elevation 1,81" in order(FENCE, site)
    outcomes = rigdda.release_many(
        [(site, (FENCE,), s, name) for name in site.event_names for s in range(2)]
    )
    assert "survey: chainage 2,683,380.0 m" in printed(tables.outcomes(site, (FENCE,), outcomes))
    evaluation = judge(site, (FENCE,), outcomes, {}, {})
    with EvaluationsFile(tmp_path / "evaluations.csv", site) as file:
        file.add(Entry(6, "search", evaluation))
    (row,) = written(tmp_path / "evaluations.csv")
    (place,) = json.loads(row["survey"])
    assert place == {
        "chainage_m": 2683380.0,
        "elevation_m": 1800.0 + site.profile.height(20.0),
    }


def test_the_order_of_a_ditch_on_a_slope_tells_its_cut() -> None:
    bench = Site.load("bench")
    ditch = rigdda.Ditch(27.5, 3.0, 8.0, 0.25)
    rise = bench.profile.height(ditch.x) - bench.profile.height(ditch.end)
    cut, floor = ditch.cut(bench.profile)
    assert cut == pytest.approx(3.0 + rise)
    assert floor == pytest.approx(8.0 - 0.25 * (2.0 * 3.0 + rise))
    words = f"with a cut of {cut:.1f} m on its uphill side and a floor {floor:.1f} m wide"
    assert rise > 1.0 and words in order(ditch, bench)
    flat = Site.load("verge")
    assert "cut of" not in order(rigdda.Ditch(6.0, 1.0, 4.0, 0.25), flat)


def test_tables_of_risk_are_only_there_with_traffic(bare: Site, tmp_path: Path) -> None:
    busy = msgspec.structs.replace(bare, traffic=rigdda.Traffic(8000.0, 80.0, 250.0))
    layouts = {"nothing": (), "fence": (FENCE,)}
    for site, name in ((bare, "bare.csv"), (busy, "busy.csv")):
        study = Study(site, 4, layouts)
        studies.run(study, 0, tmp_path / name, lambda *_: None)
        again = studies.run(study, 0, tmp_path / name, lambda *_: None)
        assert again == study.size
    plain, more = written(tmp_path / "bare.csv"), written(tmp_path / "busy.csv")
    assert list(more[0])[6:9] == ["vehicles_hit", "vehicles_run_into", "fatalities"]
    assert [{k: v for k, v in row.items() if k in plain[0] and k != "key"} for row in more] == [
        {k: v for k, v in row.items() if k != "key"} for row in plain
    ]
    found = studies.results(Study(bare, 4, layouts), tmp_path / "bare.csv")
    assert study_report.risks(found) is None
    found = studies.results(Study(busy, 4, layouts), tmp_path / "busy.csv")
    words = printed(study_report.risks(found))
    outcomes = rigdda.release_many(
        [(busy, (), s, name) for name in busy.event_names for s in range(4)]
    )
    risk = judge(busy, (), outcomes, {}, {}).risk
    assert risk is not None
    for mean in (risk.hit, risk.run_into, risk.fatalities, risk.per_km, risk.individual):
        assert f"{mean.value:.2g}" in words
