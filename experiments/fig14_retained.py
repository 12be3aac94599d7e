"""Fig. 14: a retaining structure near the toe of the highway site keeps rock off the road.

The slope above the toe is steeper than the friction angle, so that nearly all of the rock, about
250 m2, comes down. Over half of it would be deposited at the foot of the slope and a third on the
road and beyond (`fig13_deposit`). A structure needs room for all of it between its face and the
slope. Its height is varied, at the uphill edge of the road, for both contacts.

Judged by the least share of the rock reaching the road that a structure of the drawn height
retains.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.highway import ALPHA, CONTACTS, SITE, draw_slope, releases, variant
from experiments.script import BLUE, RED, Number, draw, interval, main, say, write
from rigdda import Run, Wall
from rigdda.barriers import Layout

THICKNESS = 1.5
"""Thickness of the structure [m], its downhill face at the road's edge."""

HEIGHT = 22.0
"""Height of the drawn structure [m]."""

HEIGHTS, QUICK_HEIGHTS = (2.0, 4.0, 8.0, 12.0, 16.0, 20.0, HEIGHT, 24.0), (8.0, HEIGHT)
"""Heights [m]."""

RELEASES, QUICK_RELEASES = 8, 2
"""Number of releases of each layout, the same with and without the structure."""

LEAST = 0.95
"""Target for the retained share of the rock that would reach the road [-]."""


def structure(height: float) -> Layout:
    """Return a wall of this height [m], or an empty layout for 0."""
    if height == 0.0:
        return ()
    return (Wall(x=SITE.road.start - THICKNESS, height=height, thickness=THICKNESS),)


def rows_of(
    contact: str, heights: tuple[float, ...], seeds: range
) -> tuple[list[dict[str, Any]], list[Run]]:
    """Return a row per height, 0 first, and the first runs without and with the drawn structure."""
    rows: list[dict[str, Any]] = []
    drawn = []
    for height in (0.0, *heights):
        say(f"fig14: {contact}, {height:g} m")
        found = releases(variant(contact), structure(height), seeds)
        debris, half = interval(outcome.debris_fraction for _, outcome in found)
        reached = rows[0]["debris_fraction"] if rows else debris
        blows = [b.max_energy for _, outcome in found for b in outcome.barriers]
        rows.append(
            {
                "contact": contact,
                "damping_1_s": ALPHA,
                "height_m": height,
                "releases": len(found),
                "debris_fraction": debris,
                "half_interval": half,
                "retained": 1.0 - debris / reached,
                "max_blow_kJ": 1e-3 * max(blows, default=0.0),
            }
        )
        if height in (0.0, HEIGHT):
            drawn.append(found[0][0])
    return rows, drawn


def draw_heights(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Draw the retained share against the height."""
    for contact, colour in zip(CONTACTS, (BLUE, RED), strict=True):
        here = [r for r in rows if r["contact"] == contact]
        height = [r["height_m"] for r in here]
        kept = np.array([r["retained"] for r in here])
        base = here[0]
        spread = [  # by the delta method; the share without a structure is uncertain, too
            math.hypot(r["half_interval"], (1.0 - r["retained"]) * base["half_interval"])
            / base["debris_fraction"]
            for r in here
        ]
        axes.errorbar(height, kept, yerr=spread, fmt="o-", color=colour, capsize=2, label=contact)
    axes.axhline(LEAST, color="0.7", zorder=0)
    axes.set(xlabel="height of the structure [m]", ylabel="retained of what would reach the road")
    axes.set(ylim=(-0.5, 1.1))
    axes.set_title("Retained against height", fontsize=10)
    axes.legend(loc="lower right")


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    rows: list[dict[str, Any]] = []
    drawn = {}
    seeds = range(QUICK_RELEASES if quick else RELEASES)
    for contact in CONTACTS:
        found, drawn[contact] = rows_of(contact, QUICK_HEIGHTS if quick else HEIGHTS, seeds)
        rows += found

    def picture(figure: Figure) -> None:
        grid = figure.subplot_mosaic([[0, 1, "heights"], [2, 3, "heights"]])
        for i, (contact, runs) in enumerate(drawn.items()):
            for j, what in enumerate(("without", "Fig. 14: with")):
                title = f"{what} the structure, {contact}"
                draw_slope(grid[2 * i + j], runs[j], title, foot=True)
        draw_heights(grid["heights"], rows)

    write(out / "fig14_retained.csv", rows)
    draw(out / "fig14_retained.png", (13.0, 6.6), picture, dpi=80)
    kept = {r["contact"]: r["retained"] for r in rows if r["height_m"] == HEIGHT}
    told = (
        f"{r['contact']}, {r['height_m']:g} m: {r['debris_fraction']:.3f} past the road's edge"
        for r in rows
    )
    return Number(
        f"least share of the rock reaching the road that {HEIGHT:g} m retain [-]",
        min(kept.values()),
        low=LEAST,
        note="\n".join(told),
    )


if __name__ == "__main__":
    main(run)
