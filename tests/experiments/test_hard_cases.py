"""The judge of the hard cases: verdicts, losses, energy, processes that hang or die."""

from __future__ import annotations

import math
import os
import signal
import time

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.hard_cases import study, supports
from experiments.hard_cases.arch import VOUSSOIRS, joints, limit_load, voussoirs
from experiments.hard_cases.case import (
    DEGRADES,
    FAILS,
    HOLDS,
    REFUSES,
    Case,
    History,
    Result,
    judge,
)
from experiments.hard_cases.picture import verdicts
from experiments.hard_cases.stacks import cards, moved
from experiments.hard_cases.suite import CASES
from experiments.hard_cases.trial import growth, lost, play, trial
from experiments.hard_cases.worker import Worker, limit_processor_time
from rigdda import Scene, Simulation, Terrain
from rigdda.geometry import polygon_properties
from rigdda.validation.scenes import FLAT, box, rock

BLOCK = Scene(Terrain(FLAT), (box(0.0, 0.5),), rock())
STILL = Case("still", "displacement [m]: none", lambda: BLOCK, 0.2, moved, 1e-6)


def history(y: list[float], energy: list[float]) -> History:
    """Return a history of a block on level ground at these heights."""
    poses = np.zeros((len(y), 1, 3))
    poses[:, 0, 1] = y
    times = np.arange(len(y), dtype=float)
    return History(BLOCK, times, poses, 0.0 * poses, np.array(energy), Simulation(BLOCK))


def hang(pipe, limit) -> None:
    """Never answer, and compute nothing."""
    pipe.send(None)
    pipe.recv()
    time.sleep(600.0)


def loop(pipe, limit) -> None:
    """Compute for ever."""
    pipe.send(None)
    pipe.recv()
    limit_processor_time(limit)
    while True:
        pass


def die(pipe, limit) -> None:
    """End without a word."""
    pipe.send(None)
    pipe.recv()
    os._exit(1)


def raise_memory_error() -> Scene:
    raise MemoryError("no room")


def test_there_are_enough_of_them():
    assert len(CASES) == len({c.name for c in CASES}) >= 24
    assert all(c.duration / dt == pytest.approx(round(c.duration / dt)) for c in CASES
               for dt in study.STEPS)  # fmt: skip


@pytest.mark.parametrize(
    ("error", "penetration", "gain", "gone", "verdict"),
    [
        (0.0, 0.0, 0.0, 0, HOLDS),
        (2e-6, 0.0, 0.0, 0, DEGRADES),
        (math.nan, 0.0, 0.0, 0, DEGRADES),
        (0.0, 0.1, 0.0, 0, DEGRADES),
        (0.0, 0.0, 0.1, 0, DEGRADES),
        (0.0, 0.0, 0.0, 1, FAILS),
    ],
)
def test_verdicts(error, penetration, gain, gone, verdict):
    found, note = judge(STILL, error, penetration, gain, gone)
    assert found == verdict
    assert bool(note) == (verdict != HOLDS)


def test_a_trial_holds_refuses_or_fails():
    assert trial(STILL, 0.005).verdict == HOLDS
    assert trial(STILL, 0.2).verdict == REFUSES  # a step that is too long
    broken = Case("broken", "", raise_memory_error, 1.0, moved, 1.0)
    result = trial(broken, 0.005)
    assert (result.verdict, result.note) == (FAILS, "MemoryError: no room")


def test_a_block_in_the_ground_or_beyond_its_end_is_lost():
    assert lost(history([0.5, 0.5], [0.0, 0.0])) == 0
    assert lost(history([0.5, -0.1], [0.0, 0.0])) == 1
    beyond = history([0.5, 0.5], [0.0, 0.0])
    beyond.poses[-1, 0, 0] = 1e4
    assert lost(beyond) == 1


def test_growth_of_energy_is_over_weight_times_size_and_what_was_given_off():
    weight = 2600.0 * 9.81
    gain = growth(history([0.5] * 4, [weight, 0.0, 0.2 * weight, 0.1 * weight]))
    assert gain == pytest.approx(0.1)


def test_work_of_shaking_is_no_growth_of_energy():
    shaken = next(c for c in CASES if c.name == "shaken-above-yield")
    assert growth(play(shaken, 0.005)[0]) < 1e-4
    assert supports.YIELD == pytest.approx(9.81 * math.tan(math.radians(10.0)))


@pytest.mark.parametrize(
    ("target", "told"),
    [
        (hang, "no end within 2 s"),
        pytest.param(
            loop,
            "no end within 0.1 s",
            marks=pytest.mark.skipif(
                not hasattr(signal, "setitimer"), reason="needs a timer of processor time"
            ),
        ),
        (die, "the process died: 1"),
    ],
)
def test_a_process_that_hangs_or_dies_is_a_result(target, told):
    worker = Worker(0.1, target)
    try:
        result = worker.run("stack-50", 0.005)
        assert result.verdict == FAILS
        assert result.note.startswith(told)
    finally:
        worker.stop()


def test_without_a_timer_of_processor_time_trials_run_all_the_same(monkeypatch):
    """As on Windows, where the module has neither the timer nor its signal."""
    for name in ("setitimer", "SIGPROF", "ITIMER_PROF"):
        monkeypatch.delattr(signal, name, raising=False)
    limit_processor_time(0.1)
    with Worker(0.1, die) as worker:
        assert worker.run("stack-50", 0.005).note == "the process died: 1"


def mechanism_load(haunch: int) -> float:
    """Return the load with which the left half turns about hinges at foot, haunch and keystone.

    The kinematic theorem: an upper bound of the limit load. Hinges are outside at the foot, inside
    at the haunch and outside beside the keystone, which comes straight down.
    """
    ends, blocks = joints(), voussoirs()
    middle = VOUSSOIRS // 2
    crown, knee, foot = ends[middle + 1, 1], ends[haunch, 0], ends[-1, 1]
    to_knee = knee - foot
    at_knee = np.array([-to_knee[1], to_knee[0]])  # velocities at a unit rate about the foot
    rate = at_knee[0] / (crown[1] - knee[1])  # of the upper part: the crown moves straight down

    def rise(x: float, block: int) -> float:
        return x - foot[0] if block >= haunch else at_knee[1] + rate * (x - knee[0])

    work = 0.0
    for k in range(middle + 1, VOUSSOIRS):
        area, centre, _ = polygon_properties(blocks[k].vertices)
        work -= area * 2600.0 * 9.81 * rise(centre[0], k)
    area = polygon_properties(blocks[middle].vertices)[0]
    down = -rise(crown[0], middle + 1)
    work += 0.5 * area * 2600.0 * 9.81 * down
    return -2.0 * work / down if down > 0.0 else math.inf


def test_the_limit_load_of_the_arch_is_that_of_its_mechanism():
    bounds = [mechanism_load(k) for k in range(VOUSSOIRS // 2 + 2, VOUSSOIRS)]
    assert limit_load() == pytest.approx(min(bounds), rel=1e-6)


def test_cards_touch_at_their_corners():
    corners = np.concatenate([b.vertices for b in cards().blocks])
    assert corners[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert trial(next(c for c in CASES if c.name == "house-of-cards"), 0.005).verdict == HOLDS


def test_only_beyond_the_default_step_may_what_has_an_answer_be_refused():
    right = [
        Result("dominoes", 0.005, HOLDS),
        Result("dominoes", 0.1, REFUSES),
        Result("empty-segment", 1e-4, REFUSES),
    ]
    assert study.wrong(right) == []
    amiss = [
        Result("dominoes", 1e-4, REFUSES),
        Result("dominoes", 0.1, DEGRADES),
        Result("empty-segment", 0.1, HOLDS),
    ]
    assert study.wrong(amiss) == amiss


def test_only_what_degrades_beyond_the_default_step_may_be_chance():
    beyond = [Result("dominoes", 0.01, DEGRADES), Result("dominoes", 0.02, HOLDS)]
    assert study.share_wrong(beyond) == 0.5
    for grave in (Result("dominoes", 0.005, DEGRADES), Result("dominoes", 0.02, FAILS)):
        assert study.share_wrong([*beyond, grave]) == np.inf


def test_table_and_picture(tmp_path):
    results = [
        Result("stack-50", 0.005, HOLDS, 1e-6, 0.02, 1e-8),
        Result("stack-50", 0.1, FAILS, note="2 blocks lost"),
        Result("dominoes", 0.005, DEGRADES, 2.0, 0.0, 1e-2, note="error 2, bar 0"),
        Result("dominoes", 0.1, REFUSES, note="BadInput: dt"),
    ]
    lines = study.table(results).splitlines()
    assert lines[2].endswith("| holds | fails |")
    assert lines[3].endswith("| degrades | refuses |")
    assert study.report(results).splitlines()[-2:] == [
        "stack-50 100 ms fails: 2 blocks lost",
        "dominoes 5 ms degrades: error 2, bar 0",
    ]
    figure = Figure()
    verdicts(figure, results)
    figure.savefig(tmp_path / "verdicts.png")
