"""The band of a design over the plausible range of the ground."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from processes import png_size, refused, rig, rows, run

import rigdda
from rigdda import Site, load_layout
from rigdda.app.reports import design_report
from rigdda.app.reports.wording import span
from rigdda.app.uncertainty.ground_band import Band, BandLayout, GroundSample, inputs
from rigdda.app.uncertainty.parameters import Posterior, set_numbers
from rigdda.app.uncertainty.varied_sites import Priced
from rigdda.envs import DesignProblem
from rigdda.envs.cost import judge
from rigdda.envs.intervals import lower_bound
from rigdda.files import UNFINISHED

COMMAND = ("design", "narrow", "--budget", 300, "--verify", 40, "--seed", 2)
NAMES = ["nothing", "rule", "constant", "optimised (race)"]


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("band")
    words = run(*COMMAND, "--target", 0.2, "--ground-samples", 3, "--out", "whole", folder=folder)
    return folder, words


def test_every_layout_is_on_every_ground(designed: tuple[Path, str]) -> None:
    folder, words = designed
    table, site = rows(folder / "whole/band.csv"), Site.load("narrow")
    assert [row["layout"] for row in table] == 3 * NAMES
    paths = [key for key in table[0] if key.startswith("surfaces.")]
    limits = {one.path: one for one in inputs(site, None)}
    assert set(paths) == set(limits)
    for row in table:
        for path in paths:
            assert limits[path].low <= float(row[path]) <= limits[path].high
    for path in paths:  # a Latin hypercube
        step = (limits[path].high - limits[path].low) / 3
        cells = {int((float(row[path]) - limits[path].low) / step) for row in table}
        assert cells == {0, 1, 2}
    assert png_size(folder / "whole/band.png")[0] >= 1000
    assert "on 3 other grounds" in words and "of 3 grounds" in words and "targets are" in words
    for i, name in enumerate(NAMES):
        z = [float(row["Z"]) for row in table[i::4]]
        line = [line for line in words.splitlines() if line.startswith(f" {name} ")][-1]
        assert f" {span((min(z), max(z)))} " in line


def test_a_row_equals_an_evaluation_from_scratch(designed: tuple[Path, str]) -> None:
    folder, _ = designed
    row = rows(folder / "whole/band.csv")[-1]
    paths = [key for key in row if key.startswith("surfaces.")]
    site = set_numbers(Site.load("narrow"), paths, [float(row[path]) for path in paths])
    layout = load_layout(folder / "whole/layout.toml")
    from rigdda.seeds import release_seeds

    drawn = release_seeds("verification", 2, int(row["releases"]))
    events = DesignProblem("narrow").plan(drawn)
    jobs = [(site, layout, seed, event) for seed, event in zip(drawn, events, strict=True)]
    afresh = judge(site, layout, rigdda.release_many(jobs), {}, {})
    assert float(row["Z"]) == pytest.approx(afresh.objective, rel=1e-12)


@pytest.mark.slow
def test_the_band_changes_nothing_else_and_can_be_left_out(designed: tuple[Path, str]) -> None:
    folder, _ = designed
    words = run(*COMMAND, "--target", 0.2, "--ground-samples", 0, "--out", "none", folder=folder)
    assert "other grounds" not in words and not (folder / "none/band.csv").exists()
    for name in ("layout.toml", "evaluations.jsonl"):
        assert (folder / "none" / name).read_bytes() == (folder / "whole" / name).read_bytes()


@pytest.mark.slow
def test_a_killed_band_goes_on(designed: tuple[Path, str]) -> None:
    folder, _ = designed
    options = (*COMMAND, "--target", 0.2, "--ground-samples", 3, "--out", "killed")
    killed = rig(*options, folder=folder)
    while not list((folder / "killed" / UNFINISHED).glob("[!.]*.z")):
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.communicate()
    run(*options, folder=folder)
    one, other = (folder / name / "band.csv" for name in ("killed", "whole"))
    assert one.read_bytes() == other.read_bytes()
    assert not (folder / "killed" / UNFINISHED).exists()


def test_a_posterior_replaces_its_numbers() -> None:
    site = Site.load("narrow")
    joint = Posterior.of(("surfaces.rock.rolling",), np.array([[0.4], [0.6]]), np.ones(2))
    asked = inputs(site, joint)
    assert asked[0] is joint
    assert "surfaces.rock.rolling" not in [one.path for one in asked[1:]]
    assert len(asked) == len(inputs(site, None))


def sample(
    chosen: float,
    rival: float,
    spread: float,
    targets: tuple[str | None, str | None] = (None, None),
) -> GroundSample:
    """A ground on which the layouts cost as much as given, with paired differences that vary.

    `targets` are the states of the targets of the chosen layout and of its rival.
    """
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(100)
    base = rng.exponential(1.0, 100) / 100.0
    cases = []
    whole = (("rival", rival, 0.0, targets[1]), ("chosen", chosen, spread, targets[0]))
    for name, z, own, state in whole:
        terms = base + own * (noise - noise.mean()) / 100.0
        none = np.zeros(100, dtype=bool)
        priced = Priced(z - float(terms.sum()), terms, none, none)
        cases.append(BandLayout(name, None, priced, targets=state))  # type: ignore[arg-type]
    return GroundSample({}, tuple(cases), np.zeros(100, dtype=np.int64))


@pytest.mark.parametrize(
    "chosen, rival, spread, state",
    [
        (10.0, 12.0, 0.0, "cheapest"),
        (12.0, 12.0, 0.0, "cheapest"),
        (12.0, 11.0, 10.0, "undecided"),  # the standard error is 1
        (15.0, 11.0, 10.0, "dearer"),
        (12.0, 11.9, 0.0, "dearer"),  # the same releases: no noise
    ],
)
def test_a_choice_survives_or_not(chosen: float, rival: float, spread: float, state: str) -> None:
    assert sample(chosen, rival, spread).state == state


@pytest.mark.parametrize(
    "chosen, rival, state",
    [
        ("met", "missed", "cheapest"),
        ("undecided", "missed", "cheapest"),
        ("met", "met", "dearer"),
        ("met", "undecided", "dearer"),
        ("missed", "missed", "missed"),
        ("missed", "met", "missed"),
    ],
)
def test_only_layouts_that_do_not_miss_the_targets_compete(
    chosen: str, rival: str, state: str
) -> None:
    ground = sample(15.0, 11.0, 10.0, (chosen, rival))
    assert (ground.state, ground.targets) == (state, chosen)


def test_the_verdict_says_what_is_shown_with_targets() -> None:
    held, missing = (
        sample(15, 11, 10, states) for states in (("met", "missed"), ("missed", "missed"))
    )
    assert design_report.band_verdict(Band((held,), 100, "", ())) == (
        "on 1 of 1 grounds, the chosen layout is the cheapest of those that do not miss the "
        "targets: the choice survives"
    )
    assert design_report.band_verdict(Band((held, missing), 100, "", ())) == (
        "on 1 of 2 grounds, the chosen layout is the cheapest of those that do not miss the "
        "targets; on 1, it misses the targets: the choice depends on the ground"
    )
    assert design_report.band_verdict(Band((missing, missing), 100, "", ())) == (
        "on 2 of 2 grounds, the chosen layout misses the targets: costs are not compared"
    )


def test_differences_within_the_noise_show_nothing() -> None:
    assert design_report.band_verdict(Band((sample(12, 11, 10),), 100, "", ())) == (
        "on 0 of 1 grounds, the chosen layout is the cheapest of these; on 1, another one is "
        "cheaper by no more than the noise: these releases show neither that the choice survives "
        "nor that it depends on the ground"
    )


def test_the_targets_of_every_layout_are_judged_on_every_ground(
    designed: tuple[Path, str],
) -> None:
    """A rival that misses the target on a ground is not the cheapest there."""
    table = rows(designed[0] / "whole/band.csv")
    events = [key.removeprefix("P(reach) of ") for key in table[0] if key.startswith("P(reach)")]
    problem = DesignProblem("narrow", targets={"reach": 0.2})
    counts = problem.allocation(int(table[0]["releases"]))
    for i in range(3):
        own, layouts = table[4 * i : 4 * i + 4], [row["layout"] for row in table[4 * i : 4 * i + 4]]
        assert layouts == NAMES
        missed = {
            row["layout"]
            for row in own
            for name in events
            if lower_bound(round(float(row[f"P(reach) of {name}"]) * counts[name]), counts[name])
            > 0.2
        }
        state = own[-1]["state"]
        assert (state == "missed") == (NAMES[-1] in missed)
        rivals = [float(row["Z"]) for row in own[:-1] if row["layout"] not in missed]
        if state == "cheapest":
            assert all(float(own[-1]["Z"]) <= z for z in rivals)


def test_a_failure_of_what_cannot_fail_is_not_estimated(designed: tuple[Path, str]) -> None:
    for row in rows(designed[0] / "whole/band.csv"):
        failures = [row[key] for key in row if key.startswith("P(failure)")]
        assert failures and (set(failures) == {""}) == (row["layout"] == "nothing")


def test_the_verdict_names_the_rival() -> None:
    band = Band((sample(10, 12, 0), sample(15, 11, 10), sample(12, 11, 10)), 100, "", ())
    words = design_report.band_verdict(band)
    assert "on 1 of 3 grounds, the chosen layout is the cheapest" in words
    assert "on 1, another one is cheaper by no more than the noise" in words
    assert "on 1, 'rival' is cheaper by up to 4 EUR" in words
    assert "depends on the ground" in words
    assert "survives" in design_report.band_verdict(Band((sample(10, 12, 0),), 100, "", ()))


def test_the_number_of_grounds_is_checked(tmp_path: Path) -> None:
    line = refused("design", "narrow", "--ground-samples", -1, folder=tmp_path)
    assert "--ground-samples" in line and "-1" in line
