"""Random clicks and drags on the page: no exception in the server's log, and no growing memory.

`python -m experiments.page.clicking --minutes 30` opens the page in a real Chromium and presses
buttons, chooses options, enters numbers, drags handles and changes tabs at random, with a seed.
Commands in processes of their own are started, too, and cancelled. Memory is that of the server, as
the mean of the first and of the last fifth of the time after a beginning in which all tabs are
used. Judged by its growth.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np

from experiments.page.browser import project
from experiments.page.driver import HANDLE, PLACE, SIZE, chromium, open_tab, served
from experiments.script import Number, say, write

TABS = ("Slope", "Falls", "Ground", "Barriers", "Decide", "Report")

GROWTH = 0.10
"""Largest growth of the memory of the server."""

BEGINNING = 0.2
"""Share of the time that is left out at the beginning, as modules and kernels are loaded in it."""

PAUSE = 150
"""Time between two actions [ms]."""

LIMIT = 5_000
"""Longest time that an action may wait for its element [ms]."""

FIGURES = {
    "Slope": "Section of the slope",
    "Falls": "Releases; a click on a path replays it",
    "Barriers": "Section with barriers",
}
"""Titles of the figures with handles, by tab."""

HANDLES = """
() => {
  const found = []
  for (const document of Bokeh.documents)
    for (const model of document._all_models.values())
      if (model.type === "ColumnDataSource") {
        const words = model.data instanceof Map ? model.data.get("words") : model.data["words"]
        const x = model.data instanceof Map ? model.data.get("x") : model.data["x"]
        if (words != null && x != null) found.push(...words)
      }
  return found
}
"""
"""Script that returns the names of all handles."""


class Clicker:
    """Someone who clicks at random.

    Parameters
    ----------
    tab : page of Playwright
        The tab of the browser.
    seed : int
        Seed of what is done.
    """

    def __init__(self, tab: Any, seed: int):
        self._tab, self._random = tab, random.Random(seed)
        self._open = TABS[0]
        self.done = self.missed = 0

    def act(self) -> None:
        """Do one thing; an element that disappears meanwhile is counted as missed."""
        from playwright.sync_api import Error

        actions: list[tuple[Callable[[], None], int]] = [
            (self._change_tab, 2), (self._press, 5), (self._drag, 4), (self._enter, 3),
            (self._choose, 2), (self._tick, 1), (self._click_figure, 2),
        ]  # fmt: skip
        kinds, weights = zip(*actions, strict=True)
        try:
            self._random.choices(kinds, weights)[0]()
            self.done += 1
        except Error:
            self.missed += 1
        self._tab.wait_for_timeout(PAUSE)

    def _one(self, found: Any) -> Any:
        """Return one of the elements that can be seen, or None."""
        seen = [one for one in found.all() if one.is_visible() and one.is_enabled()]
        return self._random.choice(seen) if seen else None

    def _change_tab(self) -> None:
        self._open = self._random.choice(TABS)
        open_tab(self._tab, self._open)

    def _press(self) -> None:
        if (one := self._one(self._tab.get_by_role("button"))) is not None:
            one.click(timeout=LIMIT)

    def _enter(self) -> None:
        one = self._one(self._tab.locator("input.bk-input[type=text], input.bk-input:not([type])"))
        if one is not None:
            value = self._random.choice(["0", "-3", "7.5", "25", "31.4", "1000", "x", ""])
            one.fill(value, timeout=LIMIT)
            one.press("Enter", timeout=LIMIT)

    def _choose(self) -> None:
        if (one := self._one(self._tab.locator("select"))) is not None:
            count = one.locator("option").count()
            if count:
                one.select_option(index=self._random.randrange(count), timeout=LIMIT)

    def _tick(self) -> None:
        if (one := self._one(self._tab.locator("input[type=checkbox]"))) is not None:
            one.click(timeout=LIMIT)

    def _drag(self) -> None:
        words = self._tab.evaluate(HANDLES)
        if self._open not in FIGURES or not words:
            return
        at = self._tab.evaluate(HANDLE, self._random.choice(words))
        start = at and self._tab.evaluate(PLACE, [FIGURES[self._open], *at])
        if start:
            mouse, by = self._tab.mouse, self._random.uniform
            mouse.move(*start)
            mouse.down()
            mouse.move(start[0] + by(-60.0, 60.0), start[1] + by(-40.0, 40.0), steps=4)
            mouse.up()

    def _click_figure(self) -> None:
        if (one := self._one(self._tab.locator(".bk-Figure"))) is not None:
            box = one.bounding_box()
            if box:
                x, y = self._random.random(), self._random.random()
                self._tab.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])


def clicked(minutes: float, seed: int, out: Path) -> Number:
    """Click for some time, and return the growth of the memory of the server.

    Raises
    ------
    AssertionError
        If the log of the server or the browser tells of an exception.
    """
    rows: list[dict[str, float]] = []
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as place, chromium() as browser:
        folder = project(Path(place) / "project")
        with served(folder) as server:
            tab = browser.new_page(viewport=SIZE)
            tab.on("pageerror", lambda error: faults.append(str(error)))
            tab.goto(server.address)
            for name in TABS:
                open_tab(tab, name)
                tab.wait_for_timeout(2000)
            user, start = Clicker(tab, seed), time.monotonic()
            while (passed := time.monotonic() - start) < 60.0 * minutes:
                user.act()
                if not rows or passed - rows[-1]["time_s"] > 5.0:
                    rows.append({"time_s": passed, "memory_MB": server.memory})
                    say(f"{passed:.0f} s: {user.done} actions, {server.memory:.0f} MB")
        log = server.log.read_text()
    write(out / "page_clicking.csv", rows)
    if "Traceback" in log or faults:
        raise AssertionError("\n".join([log, *faults]))
    times, memory = (np.array([row[name] for row in rows]) for name in ("time_s", "memory_MB"))
    share = times / times[-1]
    first = memory[(share >= BEGINNING) & (share < BEGINNING + 0.2)].mean()
    growth = memory[share >= 0.8].mean() / first - 1.0
    note = f"{user.done} actions in {minutes:g} minutes, {user.missed} missed; {first:.0f} MB"
    return Number("growth of the memory of the server [-]", float(growth), high=GROWTH, note=note)


@click.command(help=__doc__)
@click.option("--minutes", default=30.0, show_default=True, help="How long to click.")
@click.option("--seed", default=0, show_default=True, help="Seed of what is clicked.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("experiments/results"),
              show_default=True, help="Folder of the table.")  # fmt: skip
def main(minutes: float, seed: int, out: Path) -> None:
    """Click and print the result."""
    found = clicked(minutes, seed, out)
    say(f"{found.what}: {found.value:.3f}, target at most {found.high:g}; {found.note}")


if __name__ == "__main__":
    main()
