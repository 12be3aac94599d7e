"""Observations of a project, how well a site matches them, and the arguments of the fit."""

import msgspec
import numpy as np
import pytest

from rigdda import BadInput, Site
from rigdda.app.cli import main
from rigdda.app.page import ground
from rigdda.app.uncertainty import fit
from rigdda.app.uncertainty.parameters import ground as grounds_of

RUN_OUTS = "event,run_out_m\nblock,9.8\nblock,12.3\nblock,14.1\nblock,17.2\nblock,20.5\n"
MARKS = "impact_m\n3.5\n7\n"


@pytest.fixture(scope="module")
def verge():
    return Site.load("verge")


def test_files_are_kept_if_they_can_be_read(tmp_path, verge):
    ground.keep(tmp_path, "run outs.csv", RUN_OUTS.encode(), verge)
    ground.keep(tmp_path, "marks.csv", MARKS.encode(), verge)
    seen = ground.observed(ground.files(tmp_path), verge)
    assert list(seen.sets) == ["block"]
    assert seen.sets["block"].values == pytest.approx([9.8, 12.3, 14.1, 17.2, 20.5])
    assert seen.marks == pytest.approx([3.5, 7.0])
    assert [path.name for path in seen.files] == ["run outs.csv"]
    for name, content, words in (
        ("../x.csv", RUN_OUTS, "letters, digits"),
        ("x.txt", RUN_OUTS, "NAME.csv"),
        ("other.csv", RUN_OUTS, "in one file only"),
        ("other.csv", "event,what\nblock,3\n", "name its columns"),
        ("marks.csv", "impact_m\n1e9\n", "impact_m"),
    ):
        with pytest.raises(BadInput, match=words):
            ground.keep(tmp_path, name, content.encode(), verge)
    assert [path.name for path in ground.files(tmp_path)] == ["marks.csv", "run outs.csv"]
    assert (tmp_path / "observed" / "marks.csv").read_text() == MARKS


def test_chainages_of_the_survey_are_refused_with_those_of_the_page(tmp_path, verge):
    origin = msgspec.structs.replace(verge.origin, chainage=1200.0)
    site = msgspec.structs.replace(verge, origin=origin)
    runs = "event,run_out_m\nblock,1209.8\n"
    with pytest.raises(BadInput, match="Chainage in the survey: 1,200 metres plus the chainage"):
        ground.keep(tmp_path, "runs.csv", runs.encode(), site)


def test_the_score_is_that_of_the_fit(tmp_path, verge):
    ground.keep(tmp_path, "runs.csv", RUN_OUTS.encode(), verge)
    sets = ground.observed(ground.files(tmp_path), verge).sets
    found = ground.compared(verge, sets, 25)
    parameters = [next(p for p in grounds_of(verge) if p.path == "surfaces.soil.rolling")]
    trials = fit.Trials(
        {"block": sets["block"].values}, parameters,
        lambda values, seeds: fit.computed(verge, sets, "blocks", seeds), {},
    )  # fmt: skip
    _, each = trials.compute(np.array([0.0]), range(25))
    assert found.score == each.mean()
    assert len(found.computed["block"]) == found.releases == 25


def test_the_page_compares_again_when_the_ground_changes(verge, tmp_path):
    ground.keep(tmp_path, "runs.csv", RUN_OUTS.encode(), verge)
    sets = ground.observed(ground.files(tmp_path), verge).sets
    match = ground.Match()
    match.ask(verge, sets)
    match.join()
    assert match.found.releases == ground.ROUNDS[-1]
    parameters = [next(p for p in grounds_of(verge) if p.path == "surfaces.soil.rolling")]
    before = match.found
    match.ask(fit.with_values(verge, parameters, [0.3]), sets)
    match.join()
    assert match.found.computed["block"].mean() < before.computed["block"].mean()
    match.ask(verge, {})
    assert match.found is None


def test_the_arguments_are_those_of_a_fit_that_runs(tmp_path, verge, capsys):
    verge.save(tmp_path / "site.toml")
    text = (tmp_path / "site.toml").read_text()
    ground.keep(tmp_path, "runs.csv", RUN_OUTS.encode(), verge)
    seen = ground.observed(ground.files(tmp_path), verge)
    chosen = [p for p in grounds_of(verge) if p.path == "surfaces.soil.rolling"]
    site = tmp_path / "site.toml"
    arguments = ground.fit_arguments(site, seen, chosen, 8, 10, tmp_path, text)
    assert main(arguments) == 0
    folder = tmp_path / arguments[arguments.index("--out") + 1]
    (row,) = ground.fit_rows(folder)
    assert row.path == ("surfaces", "soil", "rolling")
    assert chosen[0].low <= row.low <= row.fitted <= row.high <= chosen[0].high
    assert Site.load(folder / "site.toml").surfaces["soil"].rolling == row.fitted
    with pytest.raises(BadInput, match="at least one number"):
        ground.fit_arguments(site, seen, [], 8, 10, tmp_path, text)
    none = ground.observed([], verge)
    with pytest.raises(BadInput, match="add a file"):
        ground.fit_arguments(site, none, chosen, 8, 10, tmp_path, text)
