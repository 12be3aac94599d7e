"""A search and a verification stop when more releases would hardly change the answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace
from valley import Valley

from rigdda import BadInput, Fence, Layout, Site
from rigdda.agents.designers import race
from rigdda.agents.designers.protocol import Entry, verify
from rigdda.agents.designers.store import Store
from rigdda.agents.designers.surrogate import expected_gain
from rigdda.app import design
from rigdda.app.design_study import VerifiedLayout
from rigdda.app.interim_answer import BEST, InterimAnswer
from rigdda.app.reports import design_report
from rigdda.app.verification import Verification, is_clear, stages
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.comparison import Difference
from rigdda.envs.problem import Targets

MANY = 10_000
GOOD, NEAR, POOR = (
    (Fence(x, 3.0, energy_class=500),) for x in (20.0, 20.1, 12.0)
)  # what they hold in the valley: 95 %, about the same, next to nothing


def test_the_gain_of_releases_has_its_closed_form() -> None:
    """Of two normal numbers with equal means, the expected least is below them by s / sqrt(pi)."""
    none = np.full(2, -np.inf)
    one = np.array([[0.3, 0.0]])
    assert expected_gain(np.ones(2), one, none) == pytest.approx(
        0.3 / math.sqrt(2.0 * math.pi), rel=0.03
    )
    both = np.diag([0.3, 0.3])
    assert expected_gain(np.ones(2), both, none) == pytest.approx(
        0.3 / math.sqrt(math.pi), rel=0.05
    )
    apart = expected_gain(np.array([1.0, 1.6]), one * 2.0, none)
    u = 1.0  # the second is behind by one standard deviation of the first
    loss = 0.6 * (math.exp(-0.5 * u * u) / math.sqrt(2.0 * math.pi) - u * 0.158655)
    assert apart == pytest.approx(loss, rel=0.1)


def test_releases_that_cannot_change_the_choice_gain_nothing() -> None:
    floor = np.zeros(2)
    assert expected_gain(np.array([1.0, 9.0]), np.array([[0.2, 0.2]]), floor) == pytest.approx(0.0)
    assert expected_gain(np.array([1.0, 1.0]), np.array([[0.2, 0.2]]), floor) == pytest.approx(0.0)
    least = np.array([0.5, 0.5])  # the first costs no less, whatever the releases say
    assert expected_gain(np.array([0.5, 0.6]), np.array([[9.0, 0.0]]), least) == 0.0


def test_a_search_stops_when_it_gains_little(valley: Valley) -> None:
    whole, fine, coarse = (race.design(valley, MANY, 1, precision=p) for p in (0.0, 0.01, 0.2))
    assert coarse.simulations <= fine.simulations < 0.5 * whole.simulations
    assert whole.simulations == MANY
    nothing, best = valley.truth(()), valley.truth(whole.layout)
    assert valley.truth(fine.layout) - best < 0.1 * (nothing - best)


def test_a_stopped_search_repeats_and_resumes(valley: Valley, tmp_path: Path) -> None:
    file = tmp_path / "store.jsonl"
    whole = race.design(valley, MANY, 3, store=Store(file), precision=0.01)
    assert race.design(valley, MANY, 3, precision=0.01) == whole
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(b"".join(lines[: len(lines) // 2]) + b'{"key": "12')
    store = Store(file)
    assert race.design(valley, MANY, 3, store=store, precision=0.01) == whole
    assert store.resumed > 0 and store.simulated > 0


def test_a_search_for_a_target_uses_its_budget(site: Site, valley: Valley) -> None:
    strict = Valley(replace(site), targets=Targets(reach=0.2))
    assert race.design(strict, 3000, 0, precision=0.5).simulations == 3000


@pytest.mark.parametrize("precision", [-0.1, 1.5, math.nan, "small"])
def test_a_precision_is_a_share(precision: object, valley: Valley) -> None:
    with pytest.raises(BadInput, match="precision"):
        race.design(valley, 300, precision=precision)  # type: ignore[arg-type]


def test_a_verification_is_judged_after_each_doubling() -> None:
    assert stages(3000, 3) == (375, 750, 1500, 3000)
    assert stages(300, 2) == (150, 300)
    assert stages(40, 1) == (40,) and stages(1000, 300) == (1000,)


def test_a_difference_is_clear_or_does_not_matter() -> None:
    def found(value: float, half: float) -> Difference:
        return Difference(value, (value - half, value + half), 100, 10)

    assert is_clear(found(10.0, 7.0), 0.0, 4) and is_clear(found(-10.0, 7.0), 0.0, 4)
    assert is_clear(found(10.0, 9.0), 0.0, 1)
    assert not is_clear(found(10.0, 9.0), 0.0, 4)  # four questions widen the interval by 1.27
    assert is_clear(found(1.0, 3.0), 5.0, 4) and not is_clear(found(3.0, 3.0), 5.0, 4)
    assert is_clear(
        found(-9.0, 10.0), 5.0, 4
    )  # it may be cheaper by much, but does not cost much more


@pytest.fixture
def verification(valley: Valley, tmp_path: Path) -> Verification:
    return Verification(valley, 3000, 0, Store(tmp_path / "store.jsonl", outcomes=True))


def test_a_whole_verification_is_that_of_all_releases_at_once(verification: Verification) -> None:
    for layout in ((), GOOD):
        last = len(verification.stages) - 1
        parts = [verification.evaluate(layout, stage) for stage in range(last + 1)]
        assert [e.releases for e in parts] == list(verification.stages)
        whole = verify(verification.problem, layout, 3000, 0)
        assert parts[-1].objective == whole.objective and parts[-1].ci == whole.ci
        assert parts[-1].seeds == whole.seeds and parts[-1].reach == whole.reach


def stage_of(verification: Verification, layouts: Sequence[Layout], precision: float) -> int:
    """Return the stage after which the verification is decided."""
    for stage in range(len(verification.stages)):
        if verification.decided([verification.evaluate(x, stage) for x in layouts], precision):
            return stage
    return len(verification.stages)


def test_a_verification_ends_when_the_choice_is_clear(verification: Verification) -> None:
    assert stage_of(verification, [(), POOR, GOOD], 0.02) == 0
    assert stage_of(verification, [(), NEAR, GOOD], 0.02) > 0  # which of them is better?
    assert stage_of(verification, [(), NEAR, GOOD], 0.5) == 0  # whichever it is
    assert stage_of(verification, [(), POOR, NEAR, GOOD], 1e-9) == len(verification.stages)


def test_an_interrupted_verification_simulates_only_the_rest(
    verification: Verification, tmp_path: Path
) -> None:
    first = verification.evaluate(GOOD, 1)
    store = Store(tmp_path / "store.jsonl", outcomes=True)
    again = Verification(verification.problem, 3000, 0, store)
    assert again.evaluate(GOOD, 1) == first and store.simulated == 0
    again.evaluate(GOOD, 2)
    assert store.simulated == verification.stages[2] - verification.stages[1]


def entry(simulations: int, evaluation: Evaluation) -> Entry:
    return Entry(simulations, "search", evaluation)


def test_the_first_answer_comes_before_the_search_and_improves(verification: Verification) -> None:
    told: list[Sequence[VerifiedLayout]] = []
    interim, problem = InterimAnswer(verification, told.append), verification.problem
    interim.begin([("nothing", ()), ("rule", POOR)])
    assert [case.name for case in told[0]] == ["nothing", "rule"]
    interim.consider(entry(500, verify(problem, POOR, 50, 1)))
    assert len(told) == 1
    interim.consider(entry(1000, verify(problem, GOOD, 50, 1)))
    interim.consider(entry(1500, verify(problem, POOR, 50, 1)))
    assert len(told) == 2
    best = told[-1][-1]
    assert best.name == BEST and best.evaluation.layout == GOOD
    assert best.evaluation == verification.evaluate(GOOD)  # on releases that no search sees
    words = design_report.interim_line(told[-1])
    assert "with 375 releases of each layout" in words and "best so far: fence 500 kJ" in words
    for case in told[-1]:
        assert case.name in words
    assert design_report.interim_table(told[-1]).row_count == 3


def test_a_study_uses_all_releases_or_stops(site: Site, few_blocks: None, tmp_path: Path) -> None:
    problem = DesignProblem(site)
    found = {}
    for precision in (0.0, 0.1):
        out = tmp_path / str(precision)
        out.mkdir()
        done, _ = design.design(
            problem, "race", 1500, 0, 400, out, lambda *_: None, precision=precision
        )
        assert {c.evaluation.releases for c in done.cases} == {done.chosen.evaluation.releases}
        again, resumed = design.design(
            problem, "race", 1500, 0, 400, out, lambda *_: None, precision=precision
        )
        assert resumed.simulated == 0
        assert [c.evaluation for c in again.cases] == [c.evaluation for c in done.cases]
        found[precision] = done
    whole, stopped = found[0.0], found[0.1]
    assert whole.result.simulations == 1500 and whole.chosen.evaluation.releases == 400
    assert whole.chosen.evaluation == verify(problem, whole.result.layout, 400, 0)
    assert stopped.result.simulations < 1500 and stopped.chosen.evaluation.releases < 400
