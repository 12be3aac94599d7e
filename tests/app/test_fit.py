"""Fitting a site to observed run-outs."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from processes import png_size

from rigdda import BadInput, Site
from rigdda.app.cli import main
from rigdda.app.reports import pictures
from rigdda.app.uncertainty import fit
from rigdda.app.uncertainty.fit import check_parameters, run_outs, scores
from rigdda.app.uncertainty.observations import OBSERVED_RUN_OUT, DataSet, read
from rigdda.app.uncertainty.parameters import Parameter, Posterior, parse, with_values
from rigdda.model.site_tables import Rebound

SITE = Site.load("verge")
TRUE = {"lumped.soil.tangential": 0.7, "lumped.soil.friction_deg": 35.0}


def truth() -> tuple[tuple[Parameter, ...], Site]:
    parameters = tuple(parse(name) for name in TRUE)
    return parameters, with_values(SITE, parameters, list(TRUE.values()))


def test_scores_are_least_for_the_distribution_that_was_drawn_from():
    rng = np.random.default_rng(0)
    seen = rng.normal(10.0, 2.0, 4000)
    mean = {
        (m, s): scores(rng.normal(m, s, 4000), seen).mean()
        for m in (9.0, 10.0, 11.0)
        for s in (1.0, 2.0, 4.0)
    }
    assert min(mean, key=mean.__getitem__) == (10.0, 2.0)
    assert mean[10.0, 2.0] == pytest.approx(2.0 / np.sqrt(np.pi), rel=0.03)  # Gneiting, eq. 5


@pytest.mark.parametrize("runs", [7, 33])
def test_an_exact_prediction_has_the_statistics_of_the_observations(runs):
    observed = {"block": np.random.default_rng(runs).uniform(0.0, 120.0, runs)}
    seen = fit.seen(observed, 60.0)
    exact = fit.quality(observed, [observed["block"]] * runs, 0.0, 60.0)
    assert exact.quantiles == seen.quantiles
    assert exact.mean == pytest.approx(seen.mean)
    assert exact.stopped == pytest.approx(seen.stopped)


def test_values_are_found_again_with_what_they_predict():
    parameters, real = truth()
    events = ["block", "small, face"]
    observed = run_outs(real, "lumped", events, range(900, 1020))
    sets = {event: DataSet(OBSERVED_RUN_OUT, event, values) for event, values in observed.items()}
    found = fit.fit(SITE, sets, parameters, 96, 60, 0, lambda done, words: None, "lumped")
    exact = np.array(list(TRUE.values()))
    # a point that bounces on a short verge hardly slides: friction is left open, and said to be
    assert found.best.values[0] == pytest.approx(exact[0], abs=0.03)
    assert found.high[0] - found.low[0] < 0.1 and found.high[1] - found.low[1] > 5.0
    there = fit.seen(observed, SITE.slope.toe)
    for quality in (found.fitted, found.validated):
        assert quality.mean == pytest.approx(there.mean, abs=1.0)
        assert quality.score < 1.05 * scores(observed["block"], observed["block"]).mean() + 1.0
    assert found.site.lumped["soil"] == Rebound(
        Rebound().normal, *(float(v) for v in found.best.values)
    )


def test_blocks_are_fitted_from_the_command_line(tmp_path):
    seen = tmp_path / "seen.csv"
    seen.write_text('event,run_out_m\nblock,11.2\nblock,14.0\nblock,12.5\n"small, face",9.0\n')
    code = main(["fit", "verge", str(seen), "--parameters", "surfaces.soil.restitution",
                 "--parameters", "surfaces.soil.rolling=0:1", "--budget", "8", "--releases", "10",
                 "--out", str(tmp_path / "out")])  # fmt: skip
    assert code == 0
    fitted = Site.load(tmp_path / "out" / "site.toml")
    rows = list(csv.DictReader((tmp_path / "out" / "fit.csv").read_text().splitlines()))
    values = {row["what"]: float(row["fitted"]) for row in rows}
    assert fitted.surfaces["soil"].rolling == pytest.approx(values["surfaces.soil.rolling"])
    assert fitted.surfaces["soil"].restitution == pytest.approx(values["surfaces.soil.restitution"])
    assert 5.0 < values["mean run-out"] < 25.0
    assert (tmp_path / "out" / "fit.png").stat().st_size > 5000


@pytest.mark.parametrize("text", ["motion.damping=2:1", "motion.damping=a:b", "motion.duration"])
def test_limits_are_checked(text):
    with pytest.raises(BadInput, match="parameters"):
        parse(text)


@pytest.mark.parametrize(
    ("path", "named"),
    [
        ("surfaces.rock.damping", "surfaces.rock.rolling"),
        ("surfaces.rock.damping_sd=0:1", "surfaces.rock.rolling_sd"),
        ("motion.damping", "surfaces.NAME.rolling"),
    ],
)
def test_damping_of_grounds_is_not_fitted(path, named):
    with pytest.raises(BadInput, match=r"^--parameters = '[a-z_.]+': name .*rolling resist") as bad:
        with_values(SITE, [parse(path)], [0.4])
    assert f"name {named}:" in bad.value.hint


def test_damping_in_flight_and_the_rolling_resistance_have_limits():
    assert parse("motion.damping") == Parameter("motion.damping", 0.0, 3.0)
    assert parse("surfaces.soil.rolling") == Parameter("surfaces.soil.rolling", 0.0, 1.0)
    assert parse("surfaces.soil.rolling_sd").high == 0.3
    speed = parse("surfaces.soil.restitution_speed")
    assert (speed.low, speed.high) == (2.0, 50.0)
    assert with_values(SITE, [speed], [9.0]).surfaces["soil"].restitution_speed == 9.0
    paper = Site.load("shu-hwa-paper")
    assert with_values(paper, [parse("motion.damping")], [0.4]).motion.damping == 0.4


def test_scatter_has_limits_of_its_own():
    assert parse("scatter.friction_deg") == Parameter("scatter.friction_deg", 0.0, 10.0)
    with pytest.raises(BadInput, match=r"write motion\.damping=LOW:HIGH"):
        parse("motion.damping=")


def test_an_unsound_value_is_told_by_its_path():
    with pytest.raises(BadInput, match=r"^surfaces\.rock\.friction_deg = 95\.0: "):
        with_values(SITE, [Parameter("surfaces.rock.friction_deg", 0.0, 99.0)], [95.0])


@pytest.mark.parametrize("path", ["surfaces.sand.restitution", "name", "road", "motion.friction"])
def test_only_numbers_of_the_site_are_fitted(path):
    with pytest.raises(BadInput, match="name a number of the site file"):
        with_values(SITE, [Parameter(path, 0.0, 1.0)], [0.5])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("run_out_m\n3\n", "name its columns"),
        ("event,run_out_m\nrock,3\n", "rock"),
        ("event,run_out_m\nblock,far\n", "row 1"),
        ("event,run_out_m\nblock,10\n", "three observed runs"),
        ("event,run_out_m\nblock,45\n", "the road ends beyond all observed stops"),
        ("event,run_out_m\nblock,3,1\n", "row 1 = 'block,3,1': give 2 cells"),
        ("event,run_out_m\n,3\n", "row 1 event = '': choose small, face or "),
        ("event,run_out_m,run_out_m\nblock,3,4\n", "a different name"),
        ("event,run_out_m,event\nblock,3,block\n", "seen.csv = 'event': give each column"),
        ("event,run_out_m\nblock,4_0\n", "row 1 run_out_m = '4_0': give a number"),
        ("event,run_out_m\nblock," + 140_000 * "3" + "\n", "repair line 2"),
        ("", "name its columns"),
    ],
)
def test_a_table_of_runs_is_checked(tmp_path, text, what):
    path = tmp_path / "seen.csv"
    path.write_text(text)
    with pytest.raises(BadInput, match=what):
        read([path], SITE)


def test_every_seed_may_be_given() -> None:
    """The search of the fit takes no 0, which would be the time, and nothing above 2^32 - 1."""
    seen: list[list[float]] = []
    for _ in range(2):
        places: list[float] = []

        def score(place: np.ndarray, places: list[float] = places) -> float:
            places += place.tolist()
            return float(np.square(place - 0.3).sum())

        fit.explore(score, 2, 24, 2**32 - 1)
        seen.append(places)
    assert seen[0] == seen[1] and len(seen[0]) == 44


@pytest.mark.parametrize(
    ("paths", "model", "mend"),
    [
        (["motion.damping", "motion.damping"], "blocks", "name each number once"),
        (["prices.concrete"], "blocks", "do not depend on it"),
        (["lumped.soil.normal"], "blocks", "choose from surfaces"),
        (["surfaces.soil.restitution"], "lumped", "choose from lumped"),
    ],
)
def test_what_run_outs_cannot_tell_is_not_fitted(paths, model, mend):
    with pytest.raises(BadInput, match=mend):
        check_parameters([Parameter(path, 0.1, 0.5) for path in paths], model)


def test_a_table_that_is_not_utf_8_is_refused(tmp_path):
    path = tmp_path / "seen.csv"
    path.write_bytes("event,run_out_m\nGr\u00f6\u00dfe,5\n".encode("latin-1"))
    with pytest.raises(BadInput, match="save it as UTF-8"):
        read([path], Site.load("verge"))


def test_one_number_is_searched_whatever_its_scores() -> None:
    for seed in range(20):
        rng, count = np.random.default_rng(seed), [0]

        def score(
            place: np.ndarray, rng: np.random.Generator = rng, count: list[int] = count
        ) -> float:
            count[0] += 1
            return float(0.1 * rng.random() + 0.1 * (place[0] - 0.7) ** 2)

        fit.explore(score, 1, 60, seed)
        assert count[0] > 40


def picture(
    observed: np.ndarray, computed: np.ndarray, event: str, path: Path, monkeypatch
) -> Figure:
    """Return the picture of a fit to run-outs of an event, which `draw` also writes to a file."""
    drawn: list[Figure] = []
    save = pictures.save

    def keep(figure: Figure, where: Path) -> None:
        drawn.append(figure)
        save(figure, where)

    monkeypatch.setattr(pictures, "save", keep)
    parameters, values = (parse("surfaces.soil.rolling"),), np.array([0.3])
    quality = fit.seen({event: observed}, SITE.slope.toe)
    posterior = Posterior.of(("surfaces.soil.rolling",), values[:, None], np.ones(1))
    best = fit.Candidate(values, {event: computed})
    left, sets = np.zeros(len(observed)), {event: DataSet(OBSERVED_RUN_OUT, event, observed)}
    found = fit.Fit(SITE, parameters, best, values, values, quality, quality, left, posterior,
                    {event: observed}, sets)  # fmt: skip
    fit.draw(path, found)
    return drawn[0]


@pytest.mark.parametrize("name", ["block $\\frac$", "from $5 to $6", "a_b^c"])
def test_the_picture_of_a_fit_takes_any_name(name, tmp_path, monkeypatch):
    runs = np.array([9.8, 12.3, 14.1])
    figure = picture(runs, runs + 1.0, name, tmp_path / "fit.png", monkeypatch)
    assert figure.axes[0].get_title() == f"{name}\n3 observed"
    assert min(png_size(tmp_path / "fit.png")) > 100


@pytest.mark.parametrize(
    ("observed", "computed"),
    [
        ((-30.0, -25.0, -20.0), (-27.0, -24.0)),
        ((-30.0, -25.0, -20.0), (-50.0, 4.0)),
        ((480_010.0, 480_020.0, 480_030.0), (480_012.0, 480_040.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0)),
        ((-5.0, -5.0, -5.0), (-5.0, -5.0)),
    ],
)
def test_the_axis_of_the_picture_reaches_a_little_beyond_all_values(
    observed, computed, tmp_path, monkeypatch
):
    figure = picture(np.array(observed), np.array(computed), "block", tmp_path / "fit.png",
                     monkeypatch)  # fmt: skip
    axes = figure.axes[0]
    values = [*observed, *computed]
    low, high = axes.get_xlim()
    assert low < min(values) and high > max(values)
    reach = max(values) - min(values)
    if reach > 0.0:
        assert (high - low) == pytest.approx(1.1 * reach)
    x, share = (np.asarray(data) for data in axes.lines[0].get_data())
    assert (x[0], x[-1]) == pytest.approx((low, high))
    assert (share[0], share[-1]) == (0.0, 1.0)  # the whole computed distribution is drawn
