"""Predictability of a single slope: outcomes of perturbed copies of one survey and of others.

Each survey is a jointed mass of `quick` as cut by one seed. Its copies differ in small random
initial velocities of their blocks. An analysis of variance splits the variance of the debris share
into a part between surveys and a part between copies, which is chance.

Judged by the share of chance at the usual disturbance. If it is 1, a release of a surveyed slope
predicts its next release no better than a release of another slope does.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.script import BLUE, GREY, Number, draw, main, say, write
from rigdda import Site, release_many

SITE, EVENT = "quick", "mass"

DISTURBANCES = (1e-12, 1e-8, 1e-4, 1e-2)
"""Greatest initial speeds [m/s]."""

JUDGED = 1e-4
"""Usual value of `sources.disturbance` [m/s]."""

SURVEYS, QUICK_SURVEYS = 24, 4
COPIES, QUICK_COPIES = 40, 5


def surveyed(seed: int, disturbance: float) -> Site:
    """Return the site with the mass cut by a seed and a disturbance [m/s]."""
    site = Site.load(SITE)
    blocks = tuple(tuple(map(tuple, b.vertices.tolist())) for b in site.draw(seed, EVENT).blocks)
    sources = tuple(
        replace(s, polygon=(), joints=(), block_area=None, blocks=blocks, disturbance=disturbance)
        if s.polygon
        else s
        for s in site.sources
    )
    return replace(site, sources=sources)


def shares(disturbance: float, surveys: int, copies: int) -> np.ndarray:
    """Return the debris shares of copies of surveys, (surveys, copies)."""
    sites = [surveyed(seed, disturbance) for seed in range(surveys)]
    jobs = [(site, (), seed, EVENT) for site in sites for seed in range(copies)]
    found = [outcome.debris_fraction for outcome in release_many(jobs)]
    return np.array(found).reshape(surveys, copies)


def variances(found: np.ndarray) -> tuple[float, float]:
    """Return the variances between surveys and between copies, from their mean squares."""
    within = float(found.var(axis=1, ddof=1).mean())
    return max(float(found.mean(axis=1).var(ddof=1)) - within / found.shape[1], 0.0), within


def picture(figure: Figure, every: dict[float, np.ndarray]) -> None:
    """Draw the debris shares of all copies, a column per survey and a panel per disturbance."""
    panels = figure.subplots(1, len(every), sharey=True, squeeze=False)[0]
    for axes, (disturbance, found) in zip(panels, every.items(), strict=True):
        for k, each in enumerate(found[np.argsort(found.mean(axis=1))]):
            axes.plot([k] * len(each), each, "o", ms=2.5, color=BLUE, alpha=0.4)
            axes.plot(k, each.mean(), "_", ms=8, color="black")
        axes.axhline(found.mean(), color=GREY, lw=0.8)
        axes.set(title=f"up to {disturbance:g} m/s", xlabel="survey, by mean", xticks=[])
    figure.axes[0].set_ylabel("share of the rock past the road's edge")


def run(quick: bool, out: Path) -> Number:
    """Compute the releases; write the table and the picture."""
    surveys, copies = (QUICK_SURVEYS, QUICK_COPIES) if quick else (SURVEYS, COPIES)
    rows: list[dict[str, Any]] = []
    every = {}
    for disturbance in DISTURBANCES:
        say(f"one slope: up to {disturbance:g} m/s")
        found = every[disturbance] = shares(disturbance, surveys, copies)
        between, within = variances(found)
        row = {"disturbance_m_s": disturbance, "surveys": surveys, "copies": copies}
        row |= {"debris": float(found.mean()), "sd_between_surveys": between**0.5}
        row |= {"sd_between_copies": within**0.5, "chance": within / (within + between)}
        rows.append(row)
    write(out / "one_slope.csv", rows)
    draw(out / "one_slope.png", (12.0, 3.6), lambda figure: picture(figure, every))
    chance = next(row["chance"] for row in rows if row["disturbance_m_s"] == JUDGED)
    note = ", ".join(f"{row['disturbance_m_s']:g} m/s: {row['chance']:.2f}" for row in rows)
    return Number("share of the variance that is chance, at 1e-4 m/s [-]", chance, 0.5, 1.0, note)


if __name__ == "__main__":
    main(run)
