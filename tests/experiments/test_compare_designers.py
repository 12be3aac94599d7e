"""Designers side by side: rows, summaries against closed forms, and what dominates what."""

from __future__ import annotations

import csv
from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner

from agents.protocol import DesignResult, Entry, History
from envs import Evaluation
from experiments import designers, designers_curves, designers_front
from rigdda import Fence, Layout, Site


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of the site for tests with a shorter release."""
    site = Site.load("quick")
    site = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, duration=7.0))
    file = tmp_path_factory.mktemp("site") / "small.toml"
    site.save(file)
    return file


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))


def test_the_comparison_is_rows_a_summary_and_a_picture(small: Path, tmp_path: Path) -> None:
    options = ["--quick", "--simulations", "50", "--site", str(small), "--out", str(tmp_path)]
    names = [f"--designer={name}" for name in ("random", "cma", "rule", designers.WARM)]
    done = CliRunner().invoke(designers.main, [*options, *names], catch_exceptions=False)
    assert done.exit_code == 0 and "share of cma" in done.output
    table = rows(tmp_path / "designers.csv")
    assert len(table) == 2 * 4 * 2  # seeds, designers, budgets of 25 and 50
    for row in table:
        assert int(row["simulations"]) <= int(row["budget"])
        assert float(row["gain"]) == float(row["nothing"]) - float(row["objective"])
    whole = [r for r in rows(tmp_path / "summary.csv") if r["designer"] == "cma"][-1]
    gains = [float(r["gain"]) for r in table if (r["designer"], r["budget"]) == ("cma", "50")]
    # of what cma did not gain there is no share
    assert whole.get("share_of_cma", "") == ("1.0" if np.mean(gains) > 0.0 else "")
    assert (tmp_path / "designers.png").read_bytes().startswith(b"\x89PNG")
    before = (tmp_path / "designers.csv").read_bytes()
    CliRunner().invoke(designers.main, [*options, *names], catch_exceptions=False)
    assert (tmp_path / "designers.csv").read_bytes() == before


def evaluation(layout: Layout, objective: float, cost: float = 0.0) -> Evaluation:
    near = objective - 0.01, objective + 0.01
    return Evaluation(layout, (1,), objective, objective, near, near, cost, ())


def test_a_designer_gives_its_best_so_far_and_in_the_end_its_choice() -> None:
    a, b, c = ((Fence(16.0, h, 1e6),) for h in (1.0, 2.0, 3.0))
    tried = [(10, a, 0.5), (20, b, 0.2), (30, c, 0.3)]
    entries = [Entry(n, "search", evaluation(layout, value)) for n, layout, value in tried]
    final = Entry(60, "final", evaluation(c, 0.25))
    found = DesignResult(c, final.evaluation, History((*entries, final)), 60)
    given = dict(designers.incumbents(found, [5, 10, 29, 59, 60, 100]))
    assert given == {5: (), 10: a, 29: b, 59: b, 60: c, 100: c}


def test_the_summary_pairs_cases_and_its_intervals_hold_the_truth() -> None:
    rng, made = np.random.default_rng(3), []
    for case in range(400):
        ease = rng.normal(0.4, 0.1)
        for name, share in (("random", 0.5), ("cma", 1.0), ("rule", 0.8)):
            gain = share * ease + rng.normal(0.0, 0.01)
            made.append({"site": case, "designer": name, "budget": 100, "gain": gain})
    found = {row["designer"]: row for row in designers_curves.summary(made)}
    rule = found["rule"]
    assert rule["share_low"] < 0.8 < rule["share_high"] < rule["share_low"] + 0.01
    assert rule["ahead_low"] < 0.12 < rule["ahead_high"] < rule["ahead_low"] + 0.01
    assert rule["gain_low"] < 0.32 < rule["gain_high"]
    assert found["cma"]["share_of_cma"] == 1.0


def test_a_point_dominates_what_is_as_dear_and_less_safe() -> None:
    front = [evaluation((), 0.5, 0.0), evaluation((), 0.2, 5.0)]
    points = {
        "better": evaluation((), 0.1, 4.0),
        "dearer": evaluation((), 0.1, 6.0),
        "too close": evaluation((), 0.19, 4.0),
        "free": evaluation((), 0.4, 0.0),
    }
    assert designers_front.dominated(front, points) == ["better", "free"]


def test_the_front_is_drawn_with_every_designer(small: Path, tmp_path: Path) -> None:
    options = ["--quick", "--simulations", "32", "--site", str(small), "--out", str(tmp_path)]
    done = CliRunner().invoke(designers_front.main, options, catch_exceptions=False)
    assert done.exit_code == 0 and "dominated by" in done.output
    names = [row["designer"] for row in rows(tmp_path / "front.csv")]
    assert set(names) == {"front", *designers_front.OTHERS}
    assert (tmp_path / "front.png").read_bytes().startswith(b"\x89PNG")
