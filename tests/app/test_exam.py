"""The exam: counting and refusal of releases, verification, scores, and entries that cheat."""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from processes import refused

from rigdda import MECHANICS, BadInput, Ditch, Site, sites
from rigdda.agents.designers import catalogue, value
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.agents.learning import forecasts
from rigdda.app.exam import counter, ranking, scorer, specification
from rigdda.app.exam.counter import practice
from rigdda.app.exam.specification import Anchor, References, tables
from rigdda.envs import DesignProblem, forecast_table
from rigdda.model.site_names import NUMBERS, instance

SITES = ("wide-narrow-2000000003", "wide-cliff-2000000004")

SPEC = f"""
version = 7
mechanics = "{MECHANICS}"
budgets = [0, 60]
verification = 40
max_barriers = 2
references = "references.json"
reference_releases = 2000
sites = ["wide-narrow-2000000003", "wide-cliff-2000000004"]

[[corridors]]
name = "road"
money = 400.0
sites = ["wide-narrow-2000000003", "wide-cliff-2000000004"]
lengths = [10.0, 30.0]
"""

ENTRIES = """
import numpy as np

import rigdda
from rigdda import Fence
from rigdda.envs import DesignProblem, forecast_table


def honest(task):
    found = []
    while task.left >= 20:
        layout = task.problem.decode(task.rng.uniform(*task.problem.bounds))
        found.append((task.evaluate(layout, 20).objective, layout))
    return min(found, key=lambda pair: pair[0])[1] if found else ()


def greedy(task):
    try:
        task.evaluate((), 10**5)
    except rigdda.BadInput as bad:
        assert "are left of" in str(bad)
    task._budget.used -= 50  # makes room in its own count only
    try:
        return honest(task)
    except rigdda.BadInput as bad:
        assert "are left of" in str(bad)
        return ()


def sneaky(task):
    try:
        DesignProblem(task.site).evaluate(task.layout([0.5] * task.problem.size), range(30))
    except rigdda.BadInput:
        pass
    return ()


def direct(task):
    try:
        rigdda.release(task.site, (), 1)
    except rigdda.BadInput:
        pass
    return ()


def wild(task):
    return (Fence(-1e4, 3.0, energy_class=500),)


def broken(task):
    raise RuntimeError("no idea")


def spender(task):
    from rigdda.app.exam.entries import constant
    return [constant(own) for own in task.sections]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a small exam and entries."""
    home = tmp_path_factory.mktemp("exam")
    (home / "spec.toml").write_text(SPEC)
    (home / "entries_of_test.py").write_text(ENTRIES)
    anchors = {}
    for name in SITES:
        problem = DesignProblem(name, 2)
        best = (problem.place.put(Ditch(0.0, 2.5, 5.0), problem.zone.end - 6.0),)
        layout = constant(problem, Menu(problem)) or best
        anchors[name] = Anchor(tables((layout,)), 50.0, (40.0, 60.0), 200.0, 300.0, 2000)
    both = [anchors[name].layouts[0] for name in SITES]
    anchors["road"] = Anchor(both, 2000.0, (1900.0, 2100.0), 9000.0, 10000.0, 2000)
    References(MECHANICS, anchors).save(home / "references.json")
    return home


def exam(folder: Path, entry: str, *more: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own, as a user does."""
    program = [sys.executable, "-m", "rigdda.app.cli", "exam", "--spec", "spec.toml"]
    root = str(Path(__file__).parents[2])
    return subprocess.run(
        [*program, "--entry", f"entries_of_test:{entry}", "--out", f"out-{entry}", *more],
        cwd=folder, env={**os.environ, "PYTHONPATH": root}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


def read(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as text:
        return list(csv.DictReader(text))


def test_no_split_contains_a_site_of_the_exam() -> None:
    asked = specification.load()
    names = [*asked.sites, *(site for road in asked.corridors for site in road.sites)]
    assert len(asked.sites) == 27 and len(asked.corridors) == 3
    assert len(set(names)) == len(names) == 39
    for name in names:
        family, number, wide = instance(name)
        assert family in sites.WIDE_FAMILIES and wide
        assert not any(number in numbers for numbers in NUMBERS.values())


def test_every_task_of_the_exam_has_a_reference_that_may_be_built() -> None:
    asked = specification.load()
    known, whole = specification.references(asked), specification.part(asked)
    assert whole.size == 4 * 30 and whole.complete is asked.current
    specification.check_references(whole, known)
    assert set(known.anchors) == {order.name for order in whole.orders(0)}
    for order in whole.orders(0):
        layouts, cost = known.anchors[order.name].built(), 0.0
        for problem, layout, length in zip(
            counter.problems_of(order), layouts, order.lengths, strict=True
        ):
            cost += length * problem.site.capital(problem.check(layout))
        assert order.money is None or 0.0 < cost <= order.money * (1.0 + 1e-9)


def test_an_honest_entry_is_scored_and_counted(folder: Path) -> None:
    done = exam(folder, "honest")
    assert done.returncode == 0, done.stderr
    rows = read(folder / "out-honest" / "results.csv")
    assert [(r["name"], r["budget"], r["used"]) for r in rows] == [
        (SITES[0], "0", "0"), (SITES[1], "0", "0"), ("road", "0", "0"),
        (SITES[0], "60", "60"), (SITES[1], "60", "60"), ("road", "60", "120"),
    ]  # fmt: skip
    assert all(r["flags"] == "" and r["refused"] == "0" for r in rows)
    for row in rows[:2]:  # nothing was built: the score follows from the recorded values
        behind = float(row["objective"]) - float(row["reference"])
        assert float(row["score"]) == pytest.approx(1.0 - behind / 150.0)
        assert float(row["distance"]) == pytest.approx(behind / 250.0)
    summary = read(folder / "out-honest" / "summary.csv")
    assert [r["track"] for r in summary] == ["sites", "sites", "corridors", "corridors"]
    assert {r["complete"] for r in summary} == {"True"}
    assert (folder / "out-honest" / "score.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        ("greedy", "asked for more releases than its budget"),
        pytest.param("sneaky", "simulated releases itself", marks=pytest.mark.slow),
        pytest.param("direct", "simulated releases itself (Simulation)", marks=pytest.mark.slow),
        pytest.param("wild", "submitted what cannot be built", marks=pytest.mark.slow),
    ],
)
def test_the_command_flags_a_cheat(folder: Path, entry: str, reason: str) -> None:
    done = exam(folder, entry, "--sites", "1")
    assert done.returncode == 1, done.stdout + done.stderr
    said = " ".join(done.stdout.split())
    assert f"flagged: the entry {reason}" in said
    assert f"entries_of_test:{entry} is disqualified" in done.stderr
    rows = read(folder / f"out-{entry}" / "results.csv")
    assert any(reason in row["flags"] for row in rows)
    assert all(int(row["used"]) <= int(row["budget"]) for row in rows)


@pytest.mark.slow
def test_an_entry_that_fails_is_one_line(folder: Path) -> None:
    done = exam(folder, "broken", "--sites", "1")
    assert done.returncode == 2
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("rigdda: ") and "RuntimeError: no idea" in last
    assert "entries_of_test.py" in done.stderr and "entrant.py" not in done.stderr


ODD = {
    "misses": "def f(task):\n    return ()\n",
    "unsound": "def f(task:\n",
    "needy": "import no_such_package\n\ndef f(task):\n    return ()\n",
    "quitter": "import os\nos._exit(3)\n",
}
"""Modules by name, of which only the first can be imported."""


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--entry", "misses:g"), "--entry = 'misses:g': name a function that can be imported"),
        (("--entry", "unsound:f"), "--entry = 'unsound:f': correct its module: SyntaxError"),
        (("--entry", "needy:f"), "--entry = 'needy:f': name a function that can be imported"),
        (("--entry", "quitter:f"), "--entry = 'quitter:f': its process ended while it was"),
        (("--entry", "misses:__name__"), "name a function that receives a task"),
        (("--entry", ""), "--entry = '': give package.module:function"),
        (
            ("--entry", "misses:f", "--corridor-entry", "misses:g"),
            "--corridor-entry = 'misses:g': name a function that can be imported",
        ),
        (
            ("--entry", "misses:f", "--corridor-entry", "nowhere:g"),
            "--corridor-entry = 'nowhere:g': name package.module:function",
        ),
    ],
)
def test_an_entry_that_cannot_be_imported_is_refused_before_anything_is_written(
    options: tuple[str, ...], named: str, tmp_path: Path
) -> None:
    for name, text in ODD.items():
        (tmp_path / f"{name}.py").write_text(text)
    assert named in refused("exam", *options, "--out", "o", folder=tmp_path)
    assert not any(path.is_file() for path in (tmp_path / "o").rglob("*"))
    assert not (tmp_path / "runs").exists()


def test_the_process_of_an_entry_imports_it_before_anything_is_computed(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compute(problem: DesignProblem) -> None:
        raise AssertionError

    monkeypatch.chdir(folder)
    monkeypatch.setattr(scorer, "prepare", compute)
    asked = specification.part(specification.load(folder / "spec.toml"))
    known = specification.references(asked.specification, folder / "spec.toml")
    job = scorer.Scorer(asked, known, "entries_of_test:nowhere", "", tmp_path)
    with pytest.raises(BadInput, match="name a function that can be imported"):
        job.play()
    assert list(tmp_path.iterdir()) == []


def test_only_a_folder_with_submissions_belongs_to_an_entry(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    asked = specification.part(specification.load(folder / "spec.toml"))
    known = specification.references(asked.specification, folder / "spec.toml")
    broken, honest = (
        scorer.Scorer(asked, known, f"entries_of_test:{name}", "", tmp_path)
        for name in ("broken", "honest")
    )
    first, second = (scorer.identity_of(asked, one.functions) for one in (broken, honest))
    broken._mark_folder(first)
    honest._read_folder(second)  # the first entry failed before it submitted anything
    honest._mark_folder(second)
    honest._keep(scorer.Submission(SITES[0], 60, [[]], 0, 0, []))
    honest._read_folder(second)
    with pytest.raises(BadInput, match="an exam of another entry, source file"):
        broken._read_folder(first)
    (tmp_path / scorer.IDENTITY).unlink()
    with pytest.raises(
        BadInput, match=r"submissions\.json of an unknown exam: name another folder"
    ):
        honest._read_folder(second)


@pytest.mark.parametrize("place", ["sites", "corridor"])
def test_an_exam_does_not_continue_on_a_site_that_changed(
    place: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    file = tmp_path / "mine.toml"
    site = Site.load("quick")
    site.save(file)
    usual = specification.load(folder / "spec.toml")
    road = msgspec.structs.replace(usual.corridors[0], sites=(SITES[0], str(file)))
    spec = msgspec.structs.replace(usual, sites=(*SITES, str(file)))
    if place == "corridor":
        spec = msgspec.structs.replace(usual, corridors=(road,))
    part = specification.part(spec, sites=1)
    job = scorer.Scorer(part, References("", {}), "entries_of_test:honest", "", tmp_path)
    before = scorer.identity_of(part, job.functions)
    assert before == scorer.identity_of(specification.part(spec), job.functions)
    job._mark_folder(before)
    job._keep(scorer.Submission(SITES[0], 60, [[]], 0, 0, []))
    job._read_folder(scorer.identity_of(part, job.functions))
    steeper = {n: msgspec.structs.replace(s, friction_deg=30.5) for n, s in site.surfaces.items()}
    msgspec.structs.replace(site, surfaces=steeper).save(file)
    after = scorer.identity_of(part, job.functions)
    with pytest.raises(BadInput, match="an exam of another entry, source file, site, seed"):
        job._read_folder(after)


@pytest.mark.slow
def test_a_corridor_must_not_cost_more_than_the_money(folder: Path) -> None:
    more = ("--corridor-entry", "entries_of_test:spender", "--budget", "0", "--corridors", "1")
    done = exam(folder, "honest", *more, "--sites", "1", "--out", "out-spender")
    rows = read(folder / "out-spender" / "results.csv")
    assert rows[1]["name"] == "road"
    assert (done.returncode == 1) == ("spend at most 16,000 EUR" in rows[1]["flags"])
    assert done.returncode == 1


@pytest.mark.slow
def test_a_part_is_marked_and_an_exam_continues(folder: Path) -> None:
    first = exam(folder, "honest", "--sites", "1", "--budget", "60", "--out", "out-part")
    assert first.returncode == 0 and "cannot enter the leaderboard" in first.stdout
    before = read(folder / "out-part" / "results.csv")
    kept = (folder / "out-part" / "submissions.json").stat().st_mtime_ns
    again = exam(folder, "honest", "--sites", "1", "--budget", "60", "--out", "out-part")
    assert again.returncode == 0
    assert read(folder / "out-part" / "results.csv") == before
    assert (folder / "out-part" / "submissions.json").stat().st_mtime_ns == kept
    other = exam(folder, "honest", "--sites", "1", "--seed", "5", "--out", "out-part")
    assert other.returncode == 2 and "name another folder" in other.stderr
    (folder / "out-part" / "submissions.json").write_text("junk")
    damaged = exam(folder, "honest", "--sites", "1", "--budget", "60", "--out", "out-part")
    assert damaged.returncode == 2 and "submissions.json': this is damaged" in damaged.stderr


def test_seeds_of_the_verification_follow_from_the_layouts(folder: Path, tmp_path: Path) -> None:
    asked = specification.load(folder / "spec.toml")
    whole = specification.part(asked, budgets=(60,))
    known = specification.references(asked, folder / "spec.toml")
    job = scorer.Scorer(whole, known, "a:b", "", tmp_path)
    for name, count in ((SITES[0], 1), (SITES[1], 1), ("road", 2)):
        job._done[name, 60] = scorer.Submission(name, 60, [[]] * count, 0, 0, [])
    first = job.seeds(SITES[0], 60)
    assert first == job.seeds(SITES[0], 60) and len(set(first)) == 40
    assert set(first).isdisjoint(job.seeds(SITES[0], 60, 1))
    assert set(first).isdisjoint(job.seeds(SITES[1], 60))
    ditch = [{"kind": "ditch", "x": 30.0, "depth": 1.0, "width": 2.0}]
    job._done[SITES[1], 60] = scorer.Submission(SITES[1], 60, [ditch], 0, 0, [])
    assert set(first).isdisjoint(job.seeds(SITES[0], 60))


def test_practice_counts_and_refuses() -> None:
    task = practice(SITES[0], budget=30)
    assert task.evaluate((), 10).releases == 10
    assert (task.used, task.left) == (10, 20)
    first, again = task.evaluate((), 5), task.evaluate((), 5)
    assert first.objective == again.objective != task.evaluate((), 5, start=5).objective
    with pytest.raises(BadInput, match="at most the 5 that are left of 30"):
        task.evaluate((), 6)
    assert task.left == 5


def test_interquartile_mean_and_its_interval() -> None:
    values = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 100.0])
    assert ranking.interquartile_mean(values) == pytest.approx(3.5)
    low, high = ranking.interval(np.repeat(values, 2), ["a"] * 16)
    assert low < 3.5 < high
    assert np.isnan(ranking.interval(values, [str(i) for i in range(8)])).all()
    rng = np.random.default_rng(0)
    inside = 0
    for i in range(100):
        low, high = ranking.interval(rng.normal(size=24), ["a"] * 24, i)
        inside += low <= 0.0 <= high
    assert inside >= 85


def test_entries_that_cannot_be_told_apart_are_named() -> None:
    rng = np.random.default_rng(1)
    site = rng.normal(0.0, 1.0, 24)  # what all entries have in common
    noise = rng.normal(0.0, 0.02, (3, 24))
    scores = {"a": site + noise[0], "b": site + noise[1], "c": site + 0.1 + noise[2]}
    assert ranking.ties(scores) == {"a": ["b"], "b": ["a"], "c": []}
    assert ranking.ties({"a": site[:1], "b": site[:1] + 1.0}) == {"a": ["b"], "b": ["a"]}


@pytest.mark.parametrize(
    ("low", "high", "printed"),
    [(math.nan, math.nan, "0.900"), (0.9, 0.95, "0.900 (0.900 to 0.950)")],
    ids=["none", "some"],
)
def test_an_interval_without_resampling_is_not_shown(
    low: float, high: float, printed: str, tmp_path: Path
) -> None:
    row = {
        "entry": "mine", "track": "sites", "budget": 500, "tasks": 2, "score": 0.9,
        "score_low": low, "score_high": high, "distance": 0.1, "used": 500.0,
    }  # fmt: skip
    assert list(ranking.table([row]).columns[3].cells) == [printed]
    ranking.draw(tmp_path / "score.png", [row])


def test_an_exam_without_references_is_refused(folder: Path) -> None:
    asked = specification.load(folder / "spec.toml")
    with pytest.raises(BadInput, match="exam_reference"):
        specification.check_references(specification.part(asked), References("", {}))
    with pytest.raises(BadInput, match="sites"):
        specification.part(asked, sites=3)


def test_a_specification_is_current_with_the_mechanics_of_its_references() -> None:
    known = msgspec.structs.replace(specification.load(), mechanics=MECHANICS)
    other = msgspec.structs.replace(known, mechanics="0ld")
    assert known.current and not other.current
    assert known.key != other.key
    better = msgspec.structs.replace(known, reference_releases=10 * known.reference_releases)
    assert better.key == known.key


def test_intervals_of_few_tasks_are_not_given() -> None:
    values = np.linspace(0.0, 1.0, 27)
    families = [f"f{i % 9}" for i in range(27)]
    assert np.isfinite(ranking.interval(values, families)).all()
    assert np.isnan(ranking.interval(values[:3], ["corridors"] * 3)).all()
    assert np.isnan(ranking.interval(values[:10], families[:10])).all()  # eight single sites
    assert np.isnan(ranking.interval(values, [str(i) for i in range(27)])).all()


@pytest.mark.slow
def test_intervals_of_three_sites_of_each_family_hold_the_mean() -> None:
    """Without the correction for three values in a stratum, 90 % of them did."""
    rng = np.random.default_rng(0)
    families, centres = [f"f{i % 9}" for i in range(27)], rng.normal(0.7, 0.2, 9)
    true = ranking.interquartile_mean((centres + rng.normal(0.0, 0.1, (20_000, 9))).ravel())
    held = 0
    for i in range(400):
        values = centres[np.arange(27) % 9] + rng.normal(0.0, 0.1, 27)
        low, high = ranking.interval(values, families, i)
        held += low <= true <= high
    assert held / 400 > 0.92


def test_releases_without_barriers_count_in_practice() -> None:
    """The designer `value` simulates them itself."""
    before = catalogue.ensemble
    try:
        task = practice("quick", 200)
        result = value.design(task.problem, task.left, task.seed, None, task.store())
        assert 0 < result.simulations <= task.used <= 200
        again = practice("quick", 200)
        found = forecasts.of_site(again.problem, forecast_table.load().layouts)
        assert found is not None and 0 < again.used <= 200
    finally:
        catalogue.ensemble = before


def test_another_seed_cannot_enter_the_leaderboard() -> None:
    spec = specification.load()
    assert specification.part(spec).complete
    assert not specification.part(spec, seed=1).complete
