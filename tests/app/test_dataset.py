"""Data sets of outcomes, and the sample in the repository."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from rigdda import BadInput, Site
from rigdda.app import cli, dataset
from rigdda.app.dataset import Recipe
from rigdda.barriers import from_table
from rigdda.envs import DesignProblem
from rigdda.envs.forecast_table import NAMES, WIDTH
from rigdda.envs.observation import FIELDS

SAMPLE = Path(__file__).parents[2] / "experiments" / "results" / "dataset_sample"

RECIPE = Recipe("validation", 6, 8)
SITE = "random-1000000"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a data set of one site, written by the command."""
    out = tmp_path_factory.mktemp("data")
    sizes = ["--sites", "1", "--layouts", "6", "--releases", "8"]
    assert cli.main(["dataset", "--split", "validation", *sizes, "--out", str(out)]) == 0
    return out


def test_rows_are_the_outcomes_of_the_releases(folder: Path) -> None:
    outcomes, places = dataset.read(folder)
    assert outcomes.num_rows == 48 and outcomes.schema == dataset.OUTCOMES
    problem = DesignProblem(SITE)
    rows = [row for row in outcomes.to_pylist() if row["layout_id"] == 3]
    layout = tuple(from_table("layout", table) for table in json.loads(rows[0]["layout"]))
    again = problem.evaluate(layout, [row["seed"] for row in rows])
    assert [o.event for o in again.outcomes] == [row["event"] for row in rows]
    assert [o.road_volume for o in again.outcomes] == [row["road_volume"] for row in rows]
    assert rows[0]["capital"] == again.cost and rows[0]["annual"] == again.capital
    (place,) = places.to_pylist()
    assert place["site"] == SITE and place["nothing"] == problem.nothing.objective
    flat, _ = gymnasium.make("rigdda/BarrierDesign-v0", site=SITE, flat=True).reset()
    assert place["observation"] == flat.tolist()


def test_layouts_differ_and_may_be_built() -> None:
    problem = DesignProblem("narrow-1000003")
    found = dataset.layouts(problem, 20, 3)
    assert found == dataset.layouts(problem, 20, 3)
    assert found[0] == ("nothing", ())
    assert {origin for origin, _ in found} == {
        "nothing", "constant", "single", "random", "neighbour"
    }  # fmt: skip
    assert len({layout for _, layout in found}) == 20
    assert all(problem.fits(layout) for _, layout in found)


def test_a_run_continues_and_other_terms_are_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def record(recipe: Recipe, name: str) -> tuple[bytes, bytes]:
        made.append(name)
        return b"", b""

    monkeypatch.setattr(dataset, "part", record)
    assert dataset.write(RECIPE, 1, folder) == 48
    assert made == []
    with pytest.raises(BadInput, match="name another folder"):
        dataset.write(Recipe("validation", 7, 8), 1, folder)
    with pytest.raises(BadInput, match="sites"):
        RECIPE.names(61)


def test_a_refused_command_leaves_the_record_of_the_results(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "run.json").read_bytes()
    assert cli.main(["dataset", "--split", "validation", "--sites", "1", "--layouts", "7",
                     "--releases", "8", "--out", str(folder)]) == 2  # fmt: skip
    assert "layouts = 7: the data set in" in capsys.readouterr().err
    assert (folder / "run.json").read_bytes() == before


@pytest.mark.parametrize("file", ["dataset.json", f"outcomes/{SITE}.parquet"])
def test_a_damaged_file_is_named(file: str, folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "data"
    shutil.copytree(folder, copy)
    (copy / file).write_bytes(b"junk")
    with pytest.raises(BadInput, match=f"{file}.*damaged"):
        dataset.write(RECIPE, 1, copy)


def test_a_missing_part_is_named(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "data"
    shutil.copytree(folder, copy)
    (copy / "sites" / f"{SITE}.parquet").unlink()
    with pytest.raises(BadInput, match=rf"sites/{SITE}.parquet.*missing"):
        dataset.read(copy)


def features(row: dict, place: dict) -> list[float]:
    """Return features of a layout: its relative cost, and the sizes of its kinds."""
    cost = row["annual"] / place["nothing"]
    out = [1.0, cost, np.exp(-2.0 * cost)]
    barriers = json.loads(row["layout"])
    for kind in ("fence", "ditch", "embankment", "gravity_wall", "mesh"):
        own = [b for b in barriers if b["kind"] == kind]
        out += [float(bool(own)), sum(b.get("height", b.get("depth", 0.0)) for b in own) / 5.0]
    return out


def test_a_model_of_the_sample_predicts_sites_that_it_has_not_seen() -> None:
    outcomes, places = dataset.read(SAMPLE)
    assert sum(f.stat().st_size for f in SAMPLE.rglob("*")) < 10e6
    known = {row["site"]: row for row in places.to_pylist()}
    rows = dataset.costs(outcomes).to_pylist()
    x = np.array([features(row, known[row["site"]]) for row in rows])
    y = np.array([row["z"] / known[row["site"]]["nothing"] for row in rows])
    sites = np.array([row["site"] for row in rows])
    assert len(known) == 12 and len(rows) == 192
    wrong = usual = 0.0
    for name in known:  # ridge regression without the site
        out = sites == name
        gram = x[~out].T @ x[~out] + 0.3 * np.eye(x.shape[1])
        weights = np.linalg.solve(gram, x[~out].T @ y[~out])
        wrong += float(np.square(x[out] @ weights - y[out]).sum())
        usual += float(np.square(y[~out].mean() - y[out]).sum())
    assert wrong < 0.85 * usual


def test_the_observations_of_the_sample_are_in_the_order_of_flat_observations() -> None:
    _, places = dataset.read(SAMPLE)
    start = sum(FIELDS[name].size for name in NAMES[: NAMES.index("closure")])
    for place in places.to_pylist():
        assert len(place["observation"]) == WIDTH
        cost = Site.load(place["site"]).consequences.closure
        closure = (np.log10(1.0 + cost) - FIELDS["closure"].centre) / FIELDS["closure"].spread
        assert place["observation"][start] == pytest.approx(closure, abs=1e-4)


def test_costs_are_those_of_an_evaluation(folder: Path) -> None:
    outcomes, _ = dataset.read(folder)
    rows = dataset.costs(outcomes).to_pylist()
    assert [row["layout_id"] for row in rows] == list(range(6))
    seen = [row for row in outcomes.to_pylist() if row["layout_id"] == 0]
    events = {row["event"] for row in seen}
    risk = sum(
        np.mean([r["harm"] + r["repair"] for r in seen if r["event"] == e])
        * next(r["rate"] for r in seen if r["event"] == e)
        for e in events
    )
    assert rows[0]["z"] == pytest.approx(risk + rows[0]["annual"])
    with pytest.raises(BadInput, match="rigdda dataset"):
        dataset.read(folder / "outcomes")
