"""Figs 9 and 10: rolling, bouncing and falling on slopes of 35, 60 and 80 deg.

Ritchie (1963) observed that rocks roll below 45 deg, bounce from 45 to 75 deg and fall above.
Single blocks are pushed off crests of 20 m, with prescribed restitution and with the paper's plain
penalty contact. Judged by the separation of the 95 % intervals of the number of touches during
descent (many for rolling, few for falling) for both contacts. The fraction of time in which a block
is farther from the slope than its size, and the touches per turn, are reported as well.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.script import BLUE, GREY, RED, Number, draw, interval, main, say, write
from rigdda import Scene, Settings, Simulation, Site
from rigdda.validation import slopes
from rigdda.validation.case import Lab
from rigdda.validation.scenes import Floats

SLOPES_DEG = {"rolling": 35, "bouncing": 60, "falling": 80}
"""Slope angle of each mode [deg]."""

CONTACTS = {"restitution 0.35": 0.35, "plain": None}

RELEASES, QUICK_RELEASES = 64, 32
"""Number of blocks pushed off each crest."""

DRAWN, EVERY, STRIDE, WATCHED = 3, 0.2, 4, 8.0
"""Number of blocks drawn, interval of outlines [s], steps between points of a path, duration
[s]."""


def site_of(slope_deg: int, restitution: float | None) -> Site:
    """Return the cut with this angle and this restitution of all surfaces."""
    site = Site.load(f"ritchie-{slope_deg}")
    surfaces = {
        k: msgspec.structs.replace(s, restitution=restitution) for k, s in site.surfaces.items()
    }
    return msgspec.structs.replace(site, surfaces=surfaces)


def descents(site: Site, slope_deg: int, releases: int) -> Floats:
    """Return the descents of a slope, one row each with the fields of `slopes.RitchieDescent`."""
    lab = Lab(Settings().dt)
    each = (slopes.descend(lab, site, lab.random(slope_deg, i)) for i in range(releases))
    return np.array(list(each))


def row(mode: str, contact: str, releases: int) -> dict[str, Any]:
    """Return the results of a mode: touches with interval, time fractions, touches per turn."""
    slope_deg = SLOPES_DEG[mode]
    say(f"fig10: {mode}, {contact}")
    found = descents(site_of(slope_deg, CONTACTS[contact]), slope_deg, releases)
    aloft, touching, touches, turns = found.T
    mean, half = interval(touches)
    return {
        "mode": mode,
        "slope_deg": slope_deg,
        "contact": contact,
        "releases": releases,
        "touches": mean,
        "half_interval": half,
        "time_aloft": float(aloft.mean()),
        "time_in_contact": float(touching.mean()),
        "touches_a_turn": float(touches.sum() / turns.sum()),
    }


def separation(rows: list[dict[str, Any]]) -> float:
    """Return the least gap between neighbouring intervals of the touches, < 0 if they overlap."""
    gaps = [
        a["touches"] - a["half_interval"] - b["touches"] - b["half_interval"]
        for a, b in pairwise(rows)
        if a["contact"] == b["contact"]
    ]
    return min(gaps)


def draw_descents(axes: Axes, mode: str, contact: str) -> None:
    """Draw blocks on their way down a slope."""
    slope_deg = SLOPES_DEG[mode]
    site, lab = site_of(slope_deg, CONTACTS[contact]), Lab(Settings().dt)
    x, y = np.array(site.slope.points).T
    axes.fill_between(x, y, -2.0, color="#c9bca5", linewidth=0)
    for i, colour in zip(range(DRAWN), (BLUE, RED, GREY), strict=True):
        block, _ = slopes.pushed(site, lab.random(slope_deg, i))
        sim = Simulation(Scene(site.profile, (block,), site.surfaces), Settings(dt=lab.dt))
        path = [sim.poses[0, :2]]
        for step in range(0, lab.steps(WATCHED), STRIDE):
            if step % lab.steps(EVERY) == 0:
                axes.fill(*sim.vertices(0).T, color=colour, alpha=0.6, linewidth=0)
            sim.step(STRIDE)
            path.append(sim.poses[0, :2])
        axes.plot(*np.array(path).T, color=colour, linewidth=0.6)
    axes.set(aspect="equal", xlim=(-2.0, 36.0), ylim=(-1.5, 22.5))
    axes.set_title(f"{mode}, {slope_deg}°, {contact}", fontsize=10)
    axes.label_outer()


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    releases = QUICK_RELEASES if quick else RELEASES
    rows = [row(mode, contact, releases) for contact in CONTACTS for mode in SLOPES_DEG]

    def picture(figure: Figure) -> None:
        grid = figure.subplots(len(CONTACTS), len(SLOPES_DEG), sharex=True, sharey=True)
        for line, contact in zip(grid, CONTACTS, strict=True):
            for axes, mode in zip(line, SLOPES_DEG, strict=True):
                draw_descents(axes, mode, contact)
        figure.supxlabel("x [m]", fontsize=10)
        figure.supylabel("y [m]", fontsize=10)

    write(out / "fig10_modes.csv", rows)
    draw(out / "fig10_modes.png", (13.0, 6.8), picture)
    told = (
        f"{r['mode']}, {r['contact']}: {r['touches']:.1f} touches, "
        f"{r['touches_a_turn']:.2f} a turn, "
        f"aloft {r['time_aloft']:.2f} of the time"
        for r in rows
    )
    return Number(
        "least distance of the 95 % intervals of the touches, 35 > 60 > 80 deg [-]",
        separation(rows),
        low=0.0,
        note="\n".join(told),
    )


if __name__ == "__main__":
    main(run)
