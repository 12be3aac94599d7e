"""Response times of the page in a real Chromium.

- From the command to the visible page, of a server in a new process.
- From the end of the drag of a fence until 25 and 200 new trajectories of single blocks are drawn.
- Frames per second while a handle is dragged over 500 trajectories.

Elapsed times are those of an idle machine only. The processor time that the server uses until the
page is visible depends less on other work. Judged by the largest quotient of a median time and its
limit, or of the least frame rate and the median.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from experiments.page.driver import HANDLE, PLACE, SIZE, chromium, open_tab, served
from experiments.script import Number, main, say, write
from rigdda import Fence, save_layout
from rigdda.model import site_names

SITE = "quick"

OPENING, FIRST, ALL, RATE = 3.0, 0.2, 1.0, 20.0
"""Longest times until the page is visible and until 25 and 200 trajectories are drawn [s], and the
least frame rate [1/s]."""

COUNTS = (25, 200)
DRAWN = 500
"""Numbers of trajectories."""

SOURCE = """
() => {
  for (const document of Bokeh.documents)
    for (const model of document._all_models.values())
      if (model.type === "Figure" && model.title?.text === "Section with barriers")
        for (const renderer of model.renderers)
          if (renderer.glyph?.type === "MultiLine" && renderer.glyph.line_width?.value === 1.2)
            return renderer.data_source
}
"""
"""Script that returns the source of the trajectories of the tab Barriers."""

SIZES = f"""
window.source = ({SOURCE})()
window.paths = () => {{
  const data = source.data
  return (data instanceof Map ? data.get("xs") : data["xs"]).length
}}
"""
"""Script that defines a function for the number of trajectories."""

WATCH = """
counts => {
  const before = source.data
  window.found = {}
  let start = null, fresh = false
  const note = () => { start = performance.now() }
  window.addEventListener("pointerup", note, {once: true, capture: true})
  const look = () => {
    fresh ||= start != null && source.data !== before
    if (fresh)
      for (const count of counts)
        if (paths() >= count && !(count in found)) found[count] = performance.now() - start
    if (counts.some(count => !(count in found))) requestAnimationFrame(look)
  }
  look()
}
"""
"""Script that notes when so many new trajectories are drawn after the mouse is released [ms]."""

FRAMES = """
() => {
  window.frames_seen = []
  const look = now => { window.frames_seen.push(now); window.going = requestAnimationFrame(look) }
  window.going = requestAnimationFrame(look)
}
"""
"""Script that notes the time of each frame [ms]."""


def project(folder: Path) -> Path:
    """Return a new project with a fence."""
    folder.mkdir()
    (folder / "site.toml").write_text(site_names.text(SITE), encoding="utf-8")
    save_layout((Fence(31.0, 3.0, energy_class=1000),), folder / "layout.toml")
    return folder


def opening(browser: Any, folder: Path) -> dict[str, float]:
    """Return the time until the page is visible, and the processor time of the server [s]."""
    start = time.perf_counter()
    with served(folder) as server:
        address = time.perf_counter() - start
        tab = browser.new_page(viewport=SIZE)
        tab.goto(server.address)
        tab.get_by_text("Where rock starts").wait_for()
        elapsed, used = time.perf_counter() - start, server.seconds
        tab.close()
    return {"address_s": address, "opening_s": elapsed, "server_processor_s": used}


def _drag(tab: Any, title: str, words: str, change: float) -> None:
    """Drag a handle along the slope by a length [m]."""
    x, y = tab.wait_for_function(HANDLE, arg=words).json_value()
    a = tab.wait_for_function(PLACE, arg=[title, x, y]).json_value()
    b = tab.evaluate(PLACE, [title, x + change, y])
    tab.mouse.move(*a)
    tab.wait_for_timeout(200)
    tab.mouse.down()
    tab.mouse.move(*b, steps=5)
    tab.mouse.up()


def dragging(tab: Any, change: float) -> dict[str, float]:
    """Return the times from the end of a drag until trajectories are drawn [s]."""
    tab.wait_for_function(f"paths() === {COUNTS[-1]}")
    tab.evaluate(WATCH, list(COUNTS))
    _drag(tab, "Section with barriers", "place of the fence 1", change)
    tab.wait_for_function(f"Object.keys(window.found).length === {len(COUNTS)}")
    found = tab.evaluate("window.found")
    return {f"after_{count}_s": 1e-3 * float(found[str(count)]) for count in COUNTS}


def frame_rate(tab: Any) -> float:
    """Return the frames per second while the collector is dragged over many trajectories."""
    open_tab(tab, "Falls")
    asked = 0
    while asked < DRAWN:
        tab.get_by_role("button", name="Release 200").click()
        asked += 200
        tab.get_by_text(f"{asked} of {asked} releases").wait_for()
    title = "Releases; a click on a path replays it"
    x, y = tab.wait_for_function(HANDLE, arg="collector").json_value()
    at = tab.evaluate(PLACE, [title, x, y])
    tab.mouse.move(*at)
    tab.wait_for_timeout(300)
    tab.mouse.down()
    tab.evaluate(FRAMES)
    for k in range(60):
        tab.mouse.move(at[0] - 2 * k, at[1])
    frames = tab.evaluate("() => { cancelAnimationFrame(window.going); return frames_seen }")
    tab.mouse.up()
    return 1e3 * (len(frames) - 1) / (frames[-1] - frames[0])


def run(quick: bool, out: Path) -> Number:
    """Measure the page and write the table."""
    repeats = 1 if quick else 5
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as place, chromium() as browser:
        folder = project(Path(place) / "project")
        opening(browser, folder)  # kernels are compiled and pages of files are read
        openings = []
        for _ in range(repeats):
            openings.append(opening(browser, folder))
            say(f"opening: {openings[-1]['opening_s']:.2f} s")
        with served(folder) as server:
            tab = browser.new_page(viewport=SIZE)
            tab.set_default_timeout(30_000)
            tab.goto(server.address)
            open_tab(tab, "Barriers")
            tab.get_by_text("1. fence").wait_for()
            tab.evaluate(SIZES)
            dragging(tab, -2.0)
            drags = [dragging(tab, 1.0 if k % 2 else -1.0) for k in range(repeats)]
            rate = frame_rate(tab)
    rows = [one | two for one, two in zip(openings, drags, strict=True)]
    write(out / "page_browser.csv", [row | {"frames_per_s": rate} for row in rows])
    median = {name: float(np.median([row[name] for row in rows])) for name in rows[0]}
    share = {
        "opening": median["opening_s"] / OPENING,
        "first trajectories": median[f"after_{COUNTS[0]}_s"] / FIRST,
        "all trajectories": median[f"after_{COUNTS[1]}_s"] / ALL,
        "frames": RATE / rate,
    }
    note = f"opening {median['opening_s']:.2f} s, of which the server computes "
    note += f"{median['server_processor_s']:.2f} s; {COUNTS[0]} trajectories after "
    note += f"{median[f'after_{COUNTS[0]}_s']:.2f} s and {COUNTS[1]} after "
    note += f"{median[f'after_{COUNTS[1]}_s']:.2f} s; {rate:.0f} frames/s over {DRAWN} trajectories"
    return Number("largest quotient of a time and its limit", max(share.values()), high=1.0,
                  note=note)  # fmt: skip


if __name__ == "__main__":
    main(run)
