"""Commands in processes of their own: they end when they are cancelled, or when the server ends."""

import os
import subprocess
import sys
import time

import pytest

from rigdda import BadInput, sites
from rigdda.app.page.jobs import (
    CANCELLED,
    FAILED,
    FINISHED,
    INTERRUPTED,
    RUNNING,
    Job,
    tried,
)


def _ended(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def _wait(done) -> None:
    latest = time.monotonic() + 120.0
    while not done():
        assert time.monotonic() < latest
        time.sleep(0.05)


def test_a_command_that_ends_is_finished_or_failed(tmp_path):
    job = Job(tmp_path, "schema")
    job.start(["schema", "layout"])
    assert job.state == RUNNING
    with pytest.raises(BadInput, match="wait until it has ended"):
        job.start(["schema"])
    _wait(lambda: job.state != RUNNING)
    assert job.state == FINISHED
    job.start(["check", "nowhere"])
    _wait(lambda: job.state != RUNNING)
    assert job.state == FAILED
    assert "nowhere" in job.words
    assert Job(tmp_path, "schema").state == FAILED


def test_a_cancelled_search_leaves_no_process(tmp_path):
    (tmp_path / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    job = Job(tmp_path, "search")
    job.start(["design", str(tmp_path / "site.toml"), "--out", str(tmp_path / "design")])
    pid = job.pid
    assert pid is not None
    _wait(lambda: (tmp_path / "design" / "problem.json").exists())
    job.cancel()
    assert _ended(pid)
    assert job.state == CANCELLED
    assert Job(tmp_path, "search").state == CANCELLED


def test_a_search_ends_with_its_server_and_is_known_to_the_next(tmp_path):
    (tmp_path / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    code = f"""
import time
from pathlib import Path
from rigdda.app.page.jobs import Job
folder = Path({str(tmp_path)!r})
job = Job(folder, "search")
job.start(["design", str(folder / "site.toml"), "--out", str(folder / "design")])
print(job.pid, flush=True)
time.sleep(600)
"""
    server = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    pid = int(server.stdout.readline())
    server.kill()
    server.wait()
    server.stdout.close()
    _wait(lambda: _ended(pid))
    again = Job(tmp_path, "search")
    assert again.state == INTERRUPTED
    again.resume()
    assert again.state == RUNNING
    again.cancel()


def test_a_row_that_is_being_written_is_left_out(tmp_path):
    head = "simulations,stage,releases,objective,objective_low,objective_high,capital,harm,"
    head += "repair,cost,debris,debris_share,targets,seconds,barriers\n"
    row = '25,search,11,197.5,119.1,225.4,0.0,190.0,7.5,0.0,0.07,0.87,,0.0,"[]"\n'
    (tmp_path / "evaluations.csv").write_text(head + row + "32,search,11,22", encoding="utf-8")
    (one,) = tried(tmp_path)
    assert (one.layout, one.simulations, one.objective, one.risk) == ((), 25, 197.5, 197.5)
    assert tried(tmp_path / "none") == []


def test_a_verified_layout_remains_verified(tmp_path):
    head = "simulations,stage,releases,objective,objective_low,objective_high,capital,harm,"
    head += "repair,cost,barriers\n"
    stages = {"search": 300.0, "verification": 200.0, "frontier": 250.0}
    rows = [f'25,{s},12,{z},100.0,400.0,0.0,{z},0.0,0.0,"[]"\n' for s, z in stages.items()]
    (tmp_path / "evaluations.csv").write_text(head + "".join(rows), encoding="utf-8")
    (one,) = tried(tmp_path)
    assert (one.stage, one.objective) == ("verification", 200.0)
