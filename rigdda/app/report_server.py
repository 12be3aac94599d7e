"""A report in a browser on this machine, beside the replay of a release in the Rerun viewer.

Rerun has no setting for the time at which its viewer opens a recording. The replay that is shown
first is therefore recorded again from shortly before the first impact; a link opens the whole
replay. Nothing is sent to other machines: the pages of the viewer are passed on with a policy that
does not allow the browser to contact any other address.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, urlsplit

import numpy as np

import rigdda
from rigdda import BadInput, Error, Run
from rigdda.app.reports.wording import unchanged
from rigdda.barriers import from_table
from rigdda.envs import replay_record
from rigdda.envs.replay_record import ReleaseRecord
from rigdda.replay.recording import Marks

HOST = "127.0.0.1"
"""Address of the server: only this machine can reach it."""

LEAD = 0.5
"""Time before the first impact at which the replay begins [s]."""

LONGEST_START = 30.0
"""Longest time that the viewer may take to start [s]."""

PAGES_POLICY = "default-src 'self'; style-src 'unsafe-inline'; img-src data:"
"""Content that the browser may load for the report: nothing but the report itself."""

VIEWER_POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'"
)
"""Content that the browser may load for the viewer: nothing from another machine."""

ELSEWHERE = re.compile(rb"<link[^>]*https://[^>]*>", re.DOTALL)
"""Links of the viewer's page to other machines."""


class Moment(NamedTuple):
    """A time of a run [s], and what happens at it."""

    time: float
    words: str


def first_impact(run: Run, road: float) -> Moment | None:
    """Return the first impact on a barrier, otherwise the first arrival at the road.

    None if no block does either. `road` is the chainage of the road's uphill edge [m].
    """
    hits = [hit["time"] for i in range(len(run.scene.barriers)) for hit in run.hits(i)]
    if hits:
        return Moment(float(min(hits)), "first impact on a barrier")
    arrived = run.passed(road).any(axis=1)
    if not arrived.any():
        return None
    return Moment(float(run.times[arrived.argmax()]), "first arrival at the road")


def record_impact(replay: Path, out: Path) -> Moment | None:
    """Record the release of a replay again from shortly before its first impact into a file.

    Returns
    -------
    Moment or None
        The first impact. None, and no file, if there is none or the replay holds no release that
        this version can compute again.
    """
    try:
        known = replay_record.load(replay)
    except BadInput:
        return None
    if not isinstance(known, ReleaseRecord):
        return None
    layout = tuple(from_table(f"barriers[{i}]", row) for i, row in enumerate(known.barriers))
    run, outcome = rigdda.release(known.site, layout, known.seed, known.event)
    road = known.site.road.start, known.site.road.end
    when = first_impact(run, road[0])
    if when is None:
        return None
    notes = {
        "layout": "; ".join(barrier.label for barrier in layout) or unchanged(known.site),
        "release": f"event {outcome.event}, seed {known.seed}",
        when.words: f"{when.time:.2f} s after the release; the replay begins {LEAD:g} s before",
    }
    labels = known.site.labels(layout)
    _since(run, when.time - LEAD).to_rerun(out, Marks(road, notes, known.site.name, labels))
    return when


def _since(run: Run, start: float) -> Run:
    """Return the part of a run from a time on."""
    k = min(int(np.searchsorted(run.times, start)), len(run.times) - 1)
    return replace(
        run,
        times=run.times[k:],
        poses=run.poses[k:],
        velocities=run.velocities[k:],
        barrier_poses=run.barrier_poses[k:],
    )


class _Shown(NamedTuple):
    """What a server shows: files by their paths, and the address of the viewer's own server."""

    files: dict[str, tuple[str, bytes | Path]]
    """Type and content of each path; a content that is a path is read when it is asked for."""
    viewer: str


def serve(page: Path, replay: Path, say: Callable[[str], None]) -> None:
    """Show a report beside a replay until Ctrl-C.

    Parameters
    ----------
    page : path
        The report.
    replay : path
        The .rrd file.
    say : callable
        Function that prints a line with the address.

    Raises
    ------
    Error
        If the Rerun viewer does not start.
    """
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        _interrupt_on_termination(stack)
        with contextlib.suppress(KeyboardInterrupt):
            part = Path(folder) / "impact.rrd"
            when = record_impact(replay, part)
            server = stack.enter_context(_Server((HOST, 0), _Handler))
            address = f"http://{HOST}:{server.server_port}"
            viewer = stack.enter_context(_viewer(f"{address}/whole.rrd"))
            server.shown = _Shown(
                {
                    "/": ("text/html; charset=utf-8", _frame(address, when).encode()),
                    f"/{page.name}": ("text/html; charset=utf-8", page),
                    "/whole.rrd": ("application/octet-stream", replay),
                    "/impact.rrd": ("application/octet-stream", replay if when is None else part),
                },
                viewer,
            )
            say(f"{address}/ shows the report and the replay; Ctrl-C ends it")
            server.serve_forever()


def _interrupt_on_termination(stack: contextlib.ExitStack) -> None:
    """Let the signal to terminate end the server like Ctrl-C, so that the viewer ends with it."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    stack.callback(signal.signal, signal.SIGTERM, before)


def _frame(address: str, when: Moment | None) -> str:
    """Return the page with the report on the left and the viewer on the right."""

    def link(name: str) -> str:
        asked = quote(f"{address}/{name}.rrd", safe="")
        return f"viewer/?url={asked}&amp;hide_welcome_screen=1&amp;persist=0&amp;notebook=0"

    words = "no impact" if when is None else f"{when.words} at {when.time:.2f} s"
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Report and replay</title><style>
body {{ margin: 0; height: 100vh; display: grid; grid-template-columns: 1fr 1fr; }}
iframe {{ border: 0; width: 100%; height: 100%; }}
div {{ display: grid; grid-template-rows: auto 1fr; border-left: 1px solid #d5dae0; }}
nav {{ font: 14px/1.5 system-ui, sans-serif; padding: .3rem .8rem; background: #f4f6f8; }}
a {{ color: #1c5aa0; margin-left: .8rem; }}
</style></head><body>
<iframe src="report.html" title="Report"></iframe>
<div><nav>Replay: {words},
<a href="{link("impact")}" target="viewer">from there</a>
<a href="{link("whole")}" target="viewer">from the start</a></nav>
<iframe src="{link("impact")}" name="viewer" title="Replay"></iframe></div>
</body></html>
"""


class _Server(ThreadingHTTPServer):
    """Serves each request in a thread; connections that end early are not reported."""

    daemon_threads = True
    shown: _Shown

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report an error of a request, unless its connection was closed.

        A browser closes connections when it leaves a page, and the server when it ends.
        """
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers requests for the report, the replay and the pages of the viewer."""

    def do_GET(self) -> None:
        """Answer a request."""
        assert isinstance(self.server, _Server)
        shown = self.server.shown
        host = self.headers.get("Host", "").rpartition(":")[0]
        asked = urlsplit(self.path)
        if host not in (HOST, "localhost"):  # another site's name that was pointed here
            self.send_error(403)
        elif asked.path in shown.files:
            kind, content = shown.files[asked.path]
            try:
                data = content.read_bytes() if isinstance(content, Path) else content
            except OSError:
                self.send_error(404)
            else:
                self._answer(kind, data, PAGES_POLICY)
        elif asked.path.startswith("/viewer/"):
            self._pass_on(f"{shown.viewer}/{asked.path.removeprefix('/viewer/')}")
        else:
            self.send_error(404)

    def _pass_on(self, address: str) -> None:
        """Answer with what the viewer's own server answers, without links to other machines."""
        try:
            with urllib.request.urlopen(address, timeout=LONGEST_START) as found:
                kind, data = found.headers.get("Content-Type", ""), found.read()
        except urllib.error.HTTPError as error:
            self.send_error(error.code)
            return
        except OSError:  # the viewer's server has ended
            self.send_error(502)
            return
        if kind.startswith("text/html"):
            data = ELSEWHERE.sub(b"", data)
        self._answer(kind, data, VIEWER_POLICY)

    def _answer(self, kind: str, data: bytes, policy: str) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Content-Security-Policy", policy)
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_: Any) -> None:
        """Print nothing."""


@contextlib.contextmanager
def _viewer(url: str) -> Iterator[str]:
    """Start the server of Rerun's web viewer, yield its address, and end it.

    Raises
    ------
    Error
        If it does not start.
    """
    with socket.socket() as free:
        free.bind((HOST, 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "rerun", url, "--serve-web", "--bind", HOST,
               "--web-viewer-port", str(port)]  # fmt: skip
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, start_new_session=True, stdout=quiet, stderr=quiet)
    try:
        _wait(process, port)
        yield f"http://{HOST}:{port}"
    finally:
        _end(process)


def _wait(process: subprocess.Popen[bytes], port: int) -> None:
    """Wait until a server listens at a port."""
    latest = time.monotonic() + LONGEST_START
    while process.poll() is None and time.monotonic() < latest:
        with contextlib.suppress(OSError), socket.create_connection((HOST, port), 1.0):
            return
        time.sleep(0.1)
    raise Error("the rerun viewer did not start: try `python -m rerun --serve-web`")


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and those that it has started."""
    with contextlib.suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGTERM)
        else:  # Windows
            process.terminate()
    process.wait()
