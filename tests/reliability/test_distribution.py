"""Releases on the workers of a real Dask scheduler equal those of this process."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import rigdda
from rigdda import BadInput, Ditch, Site, distribution
from rigdda.agents.corridor.planning import Planner
from rigdda.app import cli
from rigdda.app.reports import corridor_report
from rigdda.envs import CorridorProblem
from rigdda.passages import passages

pytest.importorskip("distributed")

ROOT = Path(rigdda.__file__).parents[1]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT), "DASK_DISTRIBUTED__ADMIN__LOG_LENGTH": "0"}
pytestmark = pytest.mark.filterwarnings("ignore")


def started(*arguments: object) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "dask", *map(str, arguments)]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=ENVIRONMENT, stdout=quiet, stderr=quiet)


def worker(address: str) -> subprocess.Popen[bytes]:
    return started("worker", address, "--nthreads", 1, "--no-dashboard", "--no-nanny")


def wait_for(count: int, address: str) -> None:
    from distributed import Client

    with Client(f"tcp://{address}", timeout=60) as client:
        client.wait_for_workers(count, timeout=120)


@contextmanager
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """Start a scheduler with two workers; yield its address, the workers and the scheduler."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"127.0.0.1:{port}"
    made = [started("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")]
    try:
        made += [worker(address), worker(address)]
        wait_for(2, address)
        yield address, [*made[1:], made[0]]
    finally:
        for process in made:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a scheduler with two workers."""
    with cluster() as (address, _):
        yield address


def jobs(count: int) -> list[tuple[Site, tuple[Ditch, ...], int, str]]:
    site = Site.load("quick")
    layouts = [(), (Ditch(site.slope.toe, 1.0, 3.0),)]
    return [(site, layouts[i % 2], i, site.event_names[i % 2]) for i in range(count)]


def test_outcomes_equal_those_of_threads(scheduler: str) -> None:
    asked = jobs(200)
    here = rigdda.release_many(asked)
    with distribution.connected(f"dask://{scheduler}"):
        there = rigdda.release_many(asked)
    assert here == there
    assert distribution.current() is None


def test_passages_equal_those_of_threads(scheduler: str) -> None:
    site = Site.load("quick")
    releases = [(seed, "block") for seed in range(150)]
    here = passages(site, (), releases, [20.0, 30.0])
    with distribution.connected(f"dask://{scheduler}"):
        there = passages(site, (), releases, [20.0, 30.0])
    assert (here.table == there.table).all() and (here.stops == there.stops).all()
    assert here.seed == there.seed and np.array_equal(here.event, there.event)


def test_errors_of_a_worker_are_those_of_this_process(scheduler: str) -> None:
    site = Site.load("quick")
    asked = [(site, (Ditch(-1e3, 1.0, 3.0),), 0, "block")]
    with pytest.raises(BadInput) as here:
        rigdda.release_many(asked)
    with distribution.connected(f"dask://{scheduler}"), pytest.raises(BadInput) as there:
        rigdda.release_many(asked)
    assert str(here.value) == str(there.value)


def test_a_worker_that_dies_loses_nothing(scheduler: str) -> None:
    asked = jobs(600)
    here = rigdda.release_many(asked)
    third = worker(scheduler)
    try:
        wait_for(3, scheduler)
        with distribution.connected(f"dask://{scheduler}"):
            found = []
            for start in range(0, len(asked), 200):
                found += rigdda.release_many(asked[start : start + 200])
                third.kill()
    finally:
        third.kill()
        third.wait()
    assert found == here


@pytest.mark.parametrize("returns", [True, False])
def test_the_death_of_the_last_worker_is_told(
    returns: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The computation goes on when a worker is back, and fails in one line if none comes."""
    monkeypatch.setattr(distribution, "GLANCE", 0.5)
    monkeypatch.setattr(distribution, "DESERTED", 120.0 if returns else 3.0)
    asked, more = jobs(200), []
    with cluster() as (address, processes), distribution.connected(f"dask://{address}"):
        rigdda.release_many(asked[:2])
        for process in processes[:2]:
            process.kill()
            process.wait()
        told = f"no worker is left on tcp://{address}: waiting for one; start one by dask worker "
        try:
            if returns:
                again = threading.Timer(4.0, lambda: more.append(worker(address)))
                again.start()
                assert rigdda.release_many(asked) == rigdda.release_many(asked, threads=2)
                again.join()
            else:
                with pytest.raises(rigdda.Error) as failed:
                    rigdda.release_many(asked)
                assert str(failed.value).startswith(f"no worker is left on tcp://{address} for 0.0")
                assert "run the command again" in str(failed.value)
        finally:
            for process in more:
                process.kill()
                process.wait()
    lines = capsys.readouterr().err.splitlines()
    assert sum(line.startswith(told) for line in lines) == 1
    assert any("a worker is back" in line for line in lines) == returns


def test_the_death_of_the_scheduler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distribution, "GLANCE", 0.5)
    with cluster() as (address, processes), distribution.connected(f"dask://{address}"):
        rigdda.release_many(jobs(2))
        kill = threading.Timer(0.3, processes[-1].kill)
        kill.start()
        with pytest.raises(rigdda.Error, match=f"the scheduler tcp://{address} stopped: start it"):
            for _ in range(200):
                rigdda.release_many(jobs(400))
        kill.join()


STUDY = """site = "verge"
releases = 20
[[layouts]]
name = "nothing"
[[layouts]]
name = "ditch"
barriers = [{ kind = "ditch", x = 8.0, depth = 1.0, width = 3.0, side_slope = 1.0 }]
"""

CORRIDOR = """name = "pass"
budget = 4_000
[[sections]]
site = "quick"
length = 50.0
[[sections]]
site = "verge"
length = 20.0
"""


FOUR = """name = "four"
budget = [3_000, 20_000]
[[sections]]
site = "quick"
length = 50.0
[[sections]]
site = "verge"
length = 20.0
[[sections]]
site = "verge-3"
length = 40.0
[[sections]]
site = "bench-3"
length = 30.0
"""


@pytest.mark.slow
def test_a_corridor_goes_on_without_a_worker_that_dies(tmp_path: Path) -> None:
    (tmp_path / "four.toml").write_text(FOUR)
    problem = CorridorProblem(tmp_path / "four.toml")
    with cluster() as (address, workers):
        killed = []

        def kill_one(releases: int, words: str) -> None:
            if words.startswith("evaluating") and not killed:
                workers[0].kill()
                killed.append(releases)

        with distribution.connected(f"dask://{address}"):
            there = Planner(problem, 300, tick=kill_one).plan()
    here = Planner(problem, 300).plan()
    assert killed and killed[0] < here.releases
    corridor_report.write(here, tmp_path / "here")
    corridor_report.write(there, tmp_path / "there")
    for name in ("budgets.csv", "sections.csv", "fronts.csv", "priorities.csv"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


@pytest.mark.slow
def test_commands_write_the_same_tables(scheduler: str, tmp_path: Path) -> None:
    (tmp_path / "pass.toml").write_text(CORRIDOR)
    (tmp_path / "study.toml").write_text(STUDY)
    seen = "".join(f"block,{9.0 + 0.5 * i}\n" for i in range(12))
    (tmp_path / "seen.csv").write_text("event,run_out_m\n" + seen)
    where = f"dask://{scheduler}"
    commands = {
        "simulate": (["verge", "--releases", "60"], "outcomes.csv"),
        "design": (["quick", "--budget", "400", "--verify", "40"], "evaluations.csv"),
        "corridor": ([str(tmp_path / "pass.toml"), "--releases", "200"], "sections.csv"),
        "study": ([str(tmp_path / "study.toml")], "study.csv"),
        "fit": (
            ["verge", str(tmp_path / "seen.csv"), "--parameters", "surfaces.soil.restitution",
             "--budget", "8", "--releases", "10"], "posterior.csv",
        ),
        "sensitivity": (["verge", "--samples", "2", "--releases", "20"], "samples.csv"),
        "evaluate": (
            ["--designer", "rule", "--budget", "60", "--sites", "1", "--verify", "20"],
            "scores.csv",
        ),
        "exam": (
            ["--entry", "rigdda.app.exam.entries:random_search", "--sites", "1",
             "--budget", "60", "--verify", "20"], "summary.csv",
        ),
        "dataset": (["--sites", "1", "--layouts", "4", "--releases", "10"], "**/*.parquet"),
    }  # fmt: skip
    for name, (arguments, table) in commands.items():
        for folder, extra in (("here", []), ("there", ["--executor", where])):
            out = tmp_path / f"{name}-{folder}"
            assert cli.main([name, *arguments, "--out", str(out), *extra]) == 0
        here, there = (tmp_path / f"{name}-{folder}" for folder in ("here", "there"))
        files = [file.relative_to(here) for file in here.glob(table)]
        assert files, name
        for file in files:
            assert (here / file).read_bytes() == (there / file).read_bytes(), (name, file)


def test_processes_are_an_executor_too() -> None:
    asked = jobs(100)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool, distribution.using(pool):
        found = rigdda.release_many(asked)
    assert found == rigdda.release_many(asked)


@pytest.mark.parametrize(
    "address, named",
    [
        ("localhost:8786", "dask://HOST:PORT"),
        ("dask://here", "dask://HOST:PORT"),
        ("tcp://127.0.0.1:1", "dask://HOST:PORT"),
        ("dask://127.0.0.1:1", "start the scheduler"),
    ],
)
def test_bad_addresses_are_one_line(
    address: str, named: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(distribution, "PATIENCE", 0.5)
    begun = time.monotonic()
    assert cli.main(["simulate", "quick", "--executor", address]) == 2
    assert time.monotonic() - begun < 30.0
    words = capsys.readouterr().err
    assert named in words and words.count("\n") == 1


def test_what_is_no_executor_is_refused() -> None:
    with pytest.raises(BadInput, match="executor"), distribution.using(3):  # type: ignore[arg-type]
        pass
