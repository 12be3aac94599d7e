"""Training of a policy on tables made for the purpose, and from the command line."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from processes import refused, run

from rigdda import MECHANICS, BadInput, sites
from rigdda.agents import training
from rigdda.agents.designers.policy import Policy, load
from rigdda.agents.learning import forecasts, outcomes
from rigdda.agents.learning.forecasts import FEATURES, SiteForecasts
from rigdda.agents.network import Network
from rigdda.agents.training import Terms
from rigdda.envs import forecast_table
from rigdda.envs.forecast_table import WIDTH, ForecastTable

LAYOUTS = ("[]", *(f'[{{"kind": "mesh", "rank": {i}}}]' for i in range(5)))


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> ForecastTable:
    """Return a table in which Z is a function of two features, and let it be the one that ships."""
    rng = np.random.default_rng(3)
    names = (*sites.split("train")[:30], *sites.split("validation")[:10])
    features = np.zeros((40, 6, FEATURES), np.float32)
    features[..., :2] = rng.normal(size=(40, 6, 2))
    features[:, 0, :2] = 3.0  # no barrier
    features[..., forecasts.FORECAST_Z] = 0.5  # forecasts that do not distinguish layouts
    z = 0.5 + 0.2 * np.tanh(features[..., 0] + features[..., 1])
    z[:, 0] = 1.0
    z[rng.random(z.shape) < 0.2] = np.nan
    z[:, 0] = 1.0
    seen = np.zeros((40, WIDTH), np.float32)
    made = ForecastTable(names, LAYOUTS, seen, features, z, {"mechanics": MECHANICS})
    monkeypatch.setattr(forecast_table, "load", lambda: made)
    return made


def chosen_z(policy: Policy, table: ForecastTable, split: str) -> float:
    """Return the mean Z of the chosen layouts minus the least possible."""
    rows = table.rows(split)
    mask = table.mask[rows]
    best = policy.choose(table.features[rows], mask)
    assert mask[np.arange(len(rows)), best].all()
    z = table.z[rows]
    return float(np.mean(z[np.arange(len(rows)), best] - np.nanmin(z, axis=1)))


@pytest.mark.parametrize("algorithm", training.ALGORITHMS)
def test_a_policy_learns_what_makes_a_layout_good(
    algorithm: str, table: ForecastTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    from rigdda.agents.learning import exact_gradient, ppo

    monkeypatch.setattr(training, "MEMBERS", 1)
    monkeypatch.setattr(exact_gradient, "STEPS", 150)
    monkeypatch.setattr(ppo, "ITERATIONS", 30)
    policy = training.train(Terms(algorithm=algorithm), tmp_path, lambda *_: None)
    first = float(np.mean(np.nanmean(table.z, axis=1) - np.nanmin(table.z, axis=1)))
    assert chosen_z(policy, table, "train") < 0.2 * first
    assert chosen_z(policy, table, "validation") < 0.5 * first  # sites that it has not seen
    read = load(tmp_path / "policy.safetensors")
    assert (
        read.layouts == LAYOUTS
        and read.network.notes["command"] == Terms(algorithm=algorithm).command
    )
    again = tmp_path / "again"
    again.mkdir()
    training.train(Terms(algorithm=algorithm), again, lambda *_: None)
    files = [folder / "policy.safetensors" for folder in (tmp_path, again)]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_outcomes_correct_what_forecasts_say(
    table: ForecastTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forecasts reward a low sum of two features, and outcomes a high one."""
    pytest.importorskip("torch")
    done: list[str] = []

    def corrected(known: ForecastTable, row: int, count: int) -> np.ndarray:
        done.append(known.names[row])
        if len(done) == 12:
            raise KeyboardInterrupt
        return np.where(known.mask[row], 1.0 - known.z[row], np.nan)

    monkeypatch.setattr(outcomes, "corrected", corrected)
    monkeypatch.setattr(training, "MEMBERS", 1)
    terms = Terms(simulate=5)
    with pytest.raises(KeyboardInterrupt):
        training.train(terms, tmp_path, lambda *_: None)
    policy = training.train(terms, tmp_path, lambda *_: None)
    assert len(done) == 30 + 1  # only the interrupted site is repeated
    rows = table.rows("validation")
    best = policy.choose(table.features[rows], table.mask[rows])
    z = table.z[rows]
    assert np.mean(z[np.arange(10), best]) > np.nanmean(z[:, 1:]) + 0.05
    with pytest.raises(BadInput, match="another folder"):
        training.train(Terms(simulate=4), tmp_path, lambda *_: None)


def test_layouts_that_are_not_simulated_keep_their_forecast(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Otherwise a policy would not learn to avoid them."""
    from light_site import LIGHT

    from rigdda.envs import DesignProblem

    problem = DesignProblem(LIGHT)
    found = forecasts.of_site(problem, forecast_table.load().layouts)
    z = found.z.astype(np.float64)
    z[-1] = np.nan  # cannot be built
    table = ForecastTable(
        (LIGHT.name,), forecast_table.load().layouts, np.zeros((1, WIDTH), np.float32),
        found.features[None], z[None], {},
    )  # fmt: skip
    monkeypatch.setattr(outcomes, "problem", lambda name: problem)
    corrected = outcomes.corrected(table, 0, 2)
    simulated = np.argsort(np.where(np.isfinite(z[1:]), z[1:], np.inf))[:2] + 1
    others = np.setdiff1d(np.arange(len(z)), simulated)
    np.testing.assert_array_equal(corrected[others], z[others])
    assert (corrected[simulated] != z[simulated]).all() and corrected[0] == 1.0


def test_outcomes_and_forecasts_are_weighted_with_their_precision() -> None:
    from light_site import LIGHT

    from rigdda.envs import DesignProblem

    problem = DesignProblem(LIGHT)
    n = len(LIGHT.event_names)
    sure, unsure = np.full(n, 1e-9), np.full(n, 1e9)
    assert outcomes._remaining(problem, np.full(n, 0.3), sure, 0.6) == pytest.approx(0.3, abs=1e-3)
    assert outcomes._remaining(problem, np.full(n, 0.3), unsure, 0.6) == pytest.approx(0.6)
    assert outcomes._remaining(problem, np.full(n, np.nan), sure, 0.6) == pytest.approx(0.6)


def test_the_catalogue_serves_all_sites() -> None:
    z = np.full((3, 6), 0.9)
    z[:, 0] = 1.0
    z[0, 1] = z[1, 4] = z[2, 5] = 0.1
    z[:, 2] = np.nan
    listed = ["[]", "a", "b", "c", "d", "e"]
    assert forecasts.choose(z, listed, 4) == [0, 1, 4, 5]
    assert forecasts.choose(z, listed, 99) == list(range(6))


def test_forecasts_of_another_catalogue_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.npz"
    own = SiteForecasts(np.zeros(WIDTH, np.float32), np.zeros((2, FEATURES)), np.ones(2), 50.0)
    own.save(file, ["[]", "a"])
    read = SiteForecasts.load(file, ["[]", "a"])
    assert (read.z == own.z).all() and read.nothing == 50.0
    with pytest.raises(BadInput, match="another version"):
        SiteForecasts.load(file, ["[]", "b"])
    file.write_bytes(b"PK")
    with pytest.raises(BadInput, match="damaged"):
        SiteForecasts.load(file, ["[]", "a"])


def test_the_best_layout_of_a_family_is_chosen_on_its_training_sites(table: ForecastTable) -> None:
    best = training.best_of_families(table)
    assert set(best) == {"verge", "bench", "talus", "narrow", "cliff", "shu-hwa"}
    rows = [r for r in table.rows("train") if sites.family_of(table.names[r]) == "talus"]
    mean = np.where(table.mask[rows], table.z[rows], 1.0).mean(axis=0)
    assert best["talus"][0] == int(mean.argmin()) and best["talus"][-1] == int(mean.argmax())


def test_the_value_of_the_policy_is_shown_beside_simple_rules(tmp_path: Path) -> None:
    """A comparison on a site, by the command."""
    pytest.importorskip("torch")
    words = run("train", "--compare", 1, "--verify", 20, "--out", tmp_path / "o", folder=tmp_path)
    assert "95 %" in words
    methods = ("nothing", "constant", "rule", "best of the family", "least forecast", "policy")
    for method in methods:
        assert method in words
    with (tmp_path / "o/comparison.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    (bare,) = (row for row in rows if row["method"] == "nothing")
    assert float(bare["z"]) == float(bare["nothing"])
    assert len(rows) == len(methods) and {row["site"] for row in rows} == {"wide-1000000"}
    notes = load(tmp_path / "o/policy.safetensors").network.notes
    assert notes["command"] == "rigdda train --algorithm gradient --simulate 0 --seed 0"
    line = refused("train", "--seed", 1, "--out", tmp_path / "o", folder=tmp_path)
    assert "seed = 1" in line and "another folder" in line


def test_bad_terms_are_one_line(tmp_path: Path) -> None:
    line = refused("train", "--sites", 100_000, folder=tmp_path)
    assert "sites" in line and "100000" in line
    line = refused("train", "--simulate", 1_000, folder=tmp_path)
    assert "simulate = 1000" in line
    line = refused("evaluate", "--policy", "none.safetensors", folder=tmp_path)
    assert "none.safetensors" in line


def test_a_damaged_training_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "training.json").write_bytes(b"{")
    line = refused("train", "--out", ".", folder=tmp_path)
    assert "training.json" in line and "another folder" in line


def test_a_network_of_members_gives_the_scores_of_each() -> None:
    torch = pytest.importorskip("torch")
    from rigdda.agents.learning import pointer

    members = [pointer.Pointer(FEATURES, seed) for seed in range(3)]
    zeros, ones = np.zeros(FEATURES, np.float32), np.ones(FEATURES, np.float32)
    made = pointer.export(members, zeros, ones, {})
    assert isinstance(made, Network) and made.sizes[-1] == 3
    seen = np.random.default_rng(0).uniform(-1, 1, (4, FEATURES)).astype(np.float32)
    mask, prior = torch.ones(4, dtype=torch.bool), torch.zeros(4)
    for k, member in enumerate(members):
        said = member(torch.tensor(seen), prior, mask).detach().numpy()
        np.testing.assert_allclose(made(seen)[:, k], said, atol=1e-5)
    with torch.no_grad():
        for member in members:
            member.last.weight += 1.0
    made = pointer.export(members, zeros, ones, {})
    said = members[1](torch.tensor(seen), prior, mask).detach().numpy()
    np.testing.assert_allclose(made(seen)[:, 1], said, atol=1e-4)


def test_an_untrained_policy_follows_the_forecasts(table: ForecastTable) -> None:
    """The corrections are zero before the training, so that the least forecast Z is chosen."""
    pytest.importorskip("torch")
    from rigdda.agents.learning import pointer

    zeros, ones = np.zeros(FEATURES, np.float32), np.ones(FEATURES, np.float32)
    network = pointer.export([pointer.Pointer(FEATURES, 0)], zeros, ones, {})
    features = np.random.default_rng(1).uniform(-1, 1, (40, len(LAYOUTS), FEATURES))
    features[..., forecasts.FORECAST_Z] = np.nan_to_num(table.z)
    least = np.where(table.mask, table.z, np.inf).argmin(axis=1)
    assert (Policy(network, LAYOUTS).choose(features, table.mask) == least).all()


@pytest.fixture
def cheap_training(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Replace the simulations and the learning of a training; return the sites that it asks for."""
    asked: list[list[str]] = []

    def collect(
        names: list[str], catalogue: tuple[str, ...], folder: Path, tick: object
    ) -> dict[str, SiteForecasts]:
        asked.append(list(names))
        rng = np.random.default_rng(len(names))
        seen = np.zeros(WIDTH, np.float32)
        features = rng.normal(size=(len(catalogue), FEATURES))
        z = rng.uniform(0.2, 1.0, len(catalogue))
        z[0] = 1.0
        return {name: SiteForecasts(seen, features, z, 100.0) for name in names}

    def learn(
        terms: Terms, table: ForecastTable, z: object, notes: dict[str, str], tick: object
    ) -> Network:
        mean = np.zeros(FEATURES, np.float32)
        layer = np.zeros((1, FEATURES), np.float32), np.zeros(1, np.float32)
        return Network(mean, mean + 1.0, [layer], notes)

    monkeypatch.setattr(forecasts, "collect", collect)
    monkeypatch.setattr(training, "learn", learn)
    return asked


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*.*")}


def test_a_refused_training_changes_nothing(
    cheap_training: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    training.train(Terms(sites=3), tmp_path, lambda *_: None)
    before = contents(tmp_path)
    assert set(before) == {"training.json", "forecasts.safetensors", "policy.safetensors"}
    for other in (Terms(sites=2), Terms(), Terms(sites=3, seed=1), Terms(3, "ppo")):
        with pytest.raises(BadInput, match="another folder"):
            training.train(other, tmp_path, lambda *_: None)
    assert len(cheap_training) == 1 and contents(tmp_path) == before
    assert training.recorded_terms(tmp_path)["sites"] == 3  # type: ignore[index]
    training.train(Terms(sites=3), tmp_path, lambda *_: None)
    assert contents(tmp_path) == before
    usual = forecasts.collect

    def changed(names: list[str], *more: object) -> dict[str, SiteForecasts]:
        found = usual(names, *more)  # type: ignore[arg-type]
        for own in found.values():
            own.z[1] *= 0.5
        return found

    monkeypatch.setattr(forecasts, "collect", changed)
    with pytest.raises(BadInput, match=r"table = .* another folder"):
        training.train(Terms(sites=3), tmp_path, lambda *_: None)
    assert contents(tmp_path) == before


def test_a_table_is_rounded_as_in_its_file(cheap_training: list[list[str]], tmp_path: Path) -> None:
    made = training.table_of(Terms(sites=3), tmp_path, lambda *_: None)
    made.save(tmp_path / "table.safetensors")
    read = ForecastTable.load(tmp_path / "table.safetensors")
    assert (read.names, read.layouts, dict(read.notes)) == (made.names, made.layouts, made.notes)
    for name in ("observation", "features", "z"):
        own, again = getattr(made, name), getattr(read, name)
        assert own.dtype == again.dtype == np.float32
        np.testing.assert_array_equal(own, again)
