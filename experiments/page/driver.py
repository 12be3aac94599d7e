"""A server of the page in a process of its own, and an installed Chromium that shows it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from rigdda import Error
from rigdda.app.browser import PROGRAMS

RUN = "import sys; from rigdda.app.cli import main; sys.exit(main())"
STARTED = "Ctrl-C"
PATIENCE = 120.0
"""Longest time that the server may take to start [s]."""

SIZE = {"width": 1280, "height": 720}
"""The window [pixels]."""

PLACE = """
([title, x, y]) => {
  for (const document of Bokeh.documents)
    for (const model of document._all_models.values())
      if (model.type === "Figure" && model.title?.text === title) {
        const view = Bokeh.index.find_one(model)
        if (view == null) continue
        const box = view.el.getBoundingClientRect()
        return [box.left + view.frame.x_scale.compute(x), box.top + view.frame.y_scale.compute(y)]
      }
  return null
}
"""
"""Script that returns where a point of a figure is in the window [pixels]."""

HANDLE = """
words => {
  for (const document of Bokeh.documents)
    for (const model of document._all_models.values())
      if (model.type === "ColumnDataSource") {
        const column = name => model.data instanceof Map ? model.data.get(name) : model.data[name]
        const k = Array.from(column("words") ?? []).indexOf(words)
        if (k >= 0) return [column("x")[k], column("y")[k]]
      }
  return null
}
"""
"""Script that returns where the handle of a name is in its figure [m]."""


class Server:
    """`rigdda open` for a folder, with its log beside the folder."""

    def __init__(self, folder: Path):
        self.log = folder.parent / f"{folder.name}.log"
        with self.log.open("wb") as log:
            self.process = psutil.Popen(
                [sys.executable, "-c", RUN, "open", str(folder), "--no-browser"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log,
            )  # fmt: skip
        latest = time.monotonic() + PATIENCE
        while STARTED not in (text := self.log.read_text()):
            if self.process.poll() is not None or time.monotonic() > latest:
                self.process.kill()
                raise Error(f"the server did not start: {text}")
            time.sleep(0.01)
        self.address = text.split()[0]

    @property
    def seconds(self) -> float:
        """Processor time that the server has used [s]."""
        times = self.process.cpu_times()
        return float(times.user + times.system)

    @property
    def memory(self) -> float:
        """Memory of the server [MB]."""
        return 1e-6 * float(self.process.memory_info().rss)

    def stop(self) -> None:
        """End the server as Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(20)
            except psutil.TimeoutExpired:
                self.process.kill()
                self.process.wait()


@contextmanager
def served(folder: Path) -> Iterator[Server]:
    """Yield a server that ends with the context."""
    server = Server(folder)
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def chromium() -> Iterator[Any]:
    """Yield an installed Chromium without a window.

    Raises
    ------
    Error
        If none is installed.
    """
    from playwright.sync_api import sync_playwright

    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise Error("no Chromium is installed: apt-get install chromium")
    root = hasattr(os, "geteuid") and os.geteuid() == 0  # Chromium refuses its sandbox to root
    with sync_playwright() as started:
        browser = started.chromium.launch(
            executable_path=program, args=["--no-sandbox"] if root else []
        )
        yield browser
        browser.close()


def open_tab(tab: Any, name: str) -> None:
    """Open a tab of the page."""
    tab.locator(".bk-tab", has_text=name).click()
