"""Reference layout of each built-in design site: a catalogue of all kinds, raced and verified.

`python -m experiments.reference [--quick] [--out DIR]`. All single barriers of every kind and size
at 24 stations race first, then promising pairs, then neighbours of the best layouts. The best of
every kind, the best for single blocks only and the constants of `rigdda.agents.designers.constant`
are verified on fresh releases, until half the 95 % interval of the best is below 1 % of Z without
barriers. Among layouts within that difference, the one with the fewest barriers is the best.

Writes reference.csv, one row per layout, and reference.png. An interrupted run is resumed: sites
whose rows were made by the current mechanics are not computed again.
"""

from __future__ import annotations

import csv
import json
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.contenders import contenders, kinds_of
from experiments.script import BLUE, GREY, RED, Number, draw, main, say, write
from rigdda import MECHANICS, Layout, Site, sites
from rigdda.agents.designers.constant import CONSTANTS, constant, place
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.store import Store
from rigdda.barriers import describe, from_table, to_tables
from rigdda.envs import DesignProblem, Evaluation

STATIONS, QUICK_STATIONS = 24, 6
"""Number of chainages across the zone for single barriers."""
FIRST, QUICK_FIRST = 40, 8
"""Releases per candidate, over all events, in the first round; doubled in each later round."""
WANTED, QUICK_WANTED = 0.01, 0.2
"""Half interval of a reference over Z without barriers at which its verification ends [-]."""
LEAST, MOST, QUICK_MOST = 1_500, 48_000, 1_000
"""Releases per layout in the verification: initial number and maximum."""
BEST = "best"
SINGLE = "for single blocks"

Row = Mapping[str, Any]


def of_single_blocks(site: Site) -> Site:
    """Return the site with its single-block events only."""
    events = tuple(e for e in site.events if single(site, e.name))
    names = {event.name for event in events}
    meshes = tuple(
        replace(m, factors={name: f for name, f in m.factors.items() if name in names})
        for m in site.meshes
    )
    return replace(site, name=f"{site.name}, single blocks", events=events, meshes=meshes)


def single(site: Site, event: str) -> bool:
    """Return whether an event always releases a single block."""
    return len(site.draw(0, event).blocks) == 1 and site.event(event).number[1] == 1


def settle(
    problem: DesignProblem, layouts: Iterable[Layout], wanted: float, most: int
) -> dict[Layout, Evaluation]:
    """Verify layouts on the same fresh releases until the best is known well enough.

    That is when its half interval is the fraction `wanted` of Z without barriers.
    Layouts that are already distinguishable from the best get no further releases.
    """
    store, half = Store(), wanted * problem.nothing.objective
    found: dict[Layout, Evaluation] = {}
    alive, n = list(dict.fromkeys(layouts)), min(LEAST, most)
    while alive:
        found |= {layout: verify(problem, layout, n, 0, store) for layout in alive}
        best = min(found.values(), key=lambda e: e.objective)
        if n >= most or 0.5 * (best.ci[1] - best.ci[0]) <= half:
            break
        alive = [layout for layout in alive if found[layout].ci[0] <= best.ci[1]]
        n = min(2 * n, most)
    return found


def study(name: str, quick: bool) -> list[dict[str, Any]]:
    """Return the rows of a site: no barriers, the best, the best of each kind and the baselines."""
    begun, problem = time.process_time(), DesignProblem(name)
    stations, first = (QUICK_STATIONS, QUICK_FIRST) if quick else (STATIONS, FIRST)
    say(f"{name}: racing")
    field = contenders(problem, stations, first)
    blocks = DesignProblem(of_single_blocks(problem.site))
    alone = contenders(blocks, stations, first)
    wanted, most = (QUICK_WANTED, QUICK_MOST) if quick else (WANTED, MOST)
    say(f"{name}: single blocks alone")
    for_blocks = min(settle(blocks, alone, wanted, most).values(), key=lambda e: e.objective).layout
    menu = Menu(problem)
    constants = [place(menu, barrier, share) for barrier, share in CONSTANTS]
    usual = constant(problem, menu)
    say(f"{name}: verifying {len(field)} layouts")
    found = settle(problem, [(), *field, for_blocks, usual, *constants], wanted, most)
    labels = {"nothing": (), SINGLE: for_blocks}
    labels |= {"constant": usual}
    labels |= {f"constant {i}": layout for i, layout in enumerate(constants)}
    least = min(e.objective for e in found.values()) + WANTED * problem.nothing.objective
    as_good = [layout for layout in found if found[layout].objective <= least]
    labels[BEST] = min(as_good, key=lambda layout: (len(layout), found[layout].objective))
    for layout in sorted(found, key=lambda layout: found[layout].objective):
        labels.setdefault(kinds_of(layout), layout)
    seconds = time.process_time() - begun
    return [row(problem, what, found[layout], seconds) for what, layout in labels.items()]


def row(problem: DesignProblem, what: str, e: Evaluation, seconds: float) -> dict[str, Any]:
    """Return the row of a layout; costs in EUR per metre of road and year, capital in EUR/m."""
    base = problem.nothing.objective
    groups = sum(v for k, v in problem.nothing.by_event.items() if not single(problem.site, k))
    return {
        "site": problem.site.name, "what": what, "kinds": kinds_of(e.layout),
        "z": e.objective, "z_low": e.ci[0], "z_high": e.ci[1], "capital": e.capital,
        "harm": e.harm, "repair": e.repair, "cost": e.cost, "debris_share": e.debris_share,
        "releases": e.releases, "z_nothing": base, "groups_share": groups / base,
        "cpu_s": seconds, "mechanics": MECHANICS,
        "layout": json.dumps(to_tables(e.layout)),
    }  # fmt: skip


def load(path: Path) -> list[dict[str, str]]:
    """Return the rows of a recorded reference, empty without a record."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def layout_of(recorded: Row) -> Layout:
    """Return the layout of a recorded row."""
    tables = json.loads(recorded["layout"])
    return tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(tables))


def picture(figure: Figure, rows: list[Row]) -> None:
    """Draw the best layouts of every kind, no barriers and the constants, site by site."""
    names = list(dict.fromkeys(str(r["site"]) for r in rows))
    grid = figure.subplots(2, (len(names) + 1) // 2, squeeze=False).ravel()
    for axes, name in zip(grid, names, strict=False):
        own = [r for r in rows if r["site"] == name and r["what"] != SINGLE]
        best = next(r for r in own if r["what"] == BEST)
        own = [r for r in own if r is best or r["layout"] != best["layout"]]
        base = float(own[0]["z_nothing"])
        own = sorted(own, key=lambda r: float(r["z"]))
        own = [r for r in own if float(r["z"]) < 1.3 * base][:12]
        for y, r in enumerate(reversed(own)):
            z, low, high = (float(r[k]) / base for k in ("z", "z_low", "z_high"))
            colour = RED if r["what"] == BEST else GREY if "constant" in r["what"] else BLUE
            axes.errorbar(z, y, xerr=[[z - low], [high - z]], fmt="o", color=colour, capsize=2)
        axes.set_yticks(range(len(own)), [words(r) for r in reversed(own)], fontsize=7)
        axes.axvline(1.0, color="0.8", zorder=0)
        title = f"{name}: {base:.0f} without barriers"
        axes.set(title=title, xlabel="Z over Z without barriers [-]")
        axes.set_xlim(left=0.0)
    for axes in grid[len(names) :]:
        axes.set_visible(False)


def words(recorded: Row) -> str:
    """Return a short description of a row."""
    layout = layout_of(recorded)
    head = "best: " if recorded["what"] == BEST else ""
    head = f"{recorded['what']}: " if "constant" in recorded["what"] else head
    return head + ("\n".join(describe(barrier) for barrier in layout) or "nothing")


def run(quick: bool, out: Path) -> Number:
    """Write reference.csv and reference.png."""
    path = out / "reference.csv"
    rows: list[Any] = []
    known = [r for r in load(path) if r["mechanics"] == MECHANICS]
    for name in sites.design_names():
        own: list[Any] = [r for r in known if r["site"] == name]
        rows += own or study(name, quick)
        write(path, rows)
    draw(out / "reference.png", (17.0, 9.0), lambda figure: picture(figure, rows))
    best = [r for r in rows if r["what"] == BEST]
    half = [0.5 * (float(r["z_high"]) - float(r["z_low"])) / float(r["z_nothing"]) for r in best]
    note = "\n".join(
        f"{r['site']}: {words(r)!r}, {float(r['z']):.1f} of {float(r['z_nothing']):.1f} EUR/(m a)"
        for r in best
    )
    return Number(
        "greatest half interval of a reference over Z without barriers",
        max(half), high=QUICK_WANTED if quick else WANTED, note=note,
    )  # fmt: skip


if __name__ == "__main__":
    main(run)
