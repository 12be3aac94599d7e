"""A server of the page in a process of its own, and a Chromium that is installed."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigdda.app.browser import PROGRAMS

PATIENCE = 60.0
RUN = "import sys; from rigdda.app.cli import main; sys.exit(main())"


class Server:
    """`rigdda open` for a folder; it may be killed and started again."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.start()

    def start(self) -> None:
        self.log = self.folder.parent / "server.log"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", RUN, "open", str(self.folder), "--no-browser"],
                cwd=self.folder.parent, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
            )  # fmt: skip
        latest = time.monotonic() + PATIENCE
        while "Ctrl-C" not in self.log.read_text():
            assert self.process.poll() is None, self.log.read_text()
            assert time.monotonic() < latest, "the server did not start"
            time.sleep(0.05)
        self.address = self.log.read_text().split()[0]

    def kill(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def stop(self) -> None:
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(20)
        finally:
            self.kill()
        assert "Traceback" not in self.log.read_text(), self.log.read_text()


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[object]:
    servers = []

    def start(folder: Path) -> Server:
        servers.append(Server(folder))
        return servers[-1]

    yield start
    for server in servers:
        server.stop()


@pytest.fixture(scope="module")  # its event loop must not outlast the tests of the browser
def chromium() -> Iterator[object]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        pytest.skip("no Chromium is installed")
    options = ["--no-sandbox"] if os.geteuid() == 0 else []
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=options)
        yield browser
        browser.close()


@pytest.fixture
def tab(chromium) -> Iterator[object]:
    """A tab of the browser in which nothing may fail and nothing may leave this machine."""
    faults: list[str] = []
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on(
        "request",
        lambda request: (
            faults.append(request.url)
            if not request.url.startswith(("http://127.0.0.1", "data:", "blob:"))
            else None
        ),
    )
    page.set_default_timeout(PATIENCE * 1e3)
    yield page
    page.close()
    assert faults == []
