"""The highway site of Figs 11 to 14 in variants of contact and damping."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from matplotlib.axes import Axes
from msgspec.structs import replace as changed

from experiments.bench.cases import RUN_OUT
from rigdda import Run, Site, release
from rigdda.barriers import Layout
from rigdda.envs.rendering import draw as draw_frame
from rigdda.errors import SoftContacts
from rigdda.geometry import polygon_properties
from rigdda.model.outcome import Outcome

SITE = Site.load("shu-hwa-paper")

ALPHA = SITE.motion.damping
"""Damping coefficient of the paper, 0.6 1/s."""

CONTACTS = {"restitution 0.2": 0.2, "plain": None}
"""Restitution of all surfaces; None is the paper's plain penalty contact."""

DURATION = 60.0
"""Simulated time [s]. At 1.2 1/s, blocks fall at no more than 8 m/s, and some still do after 40
s."""

ABOUT = 10.0
"""Distance uphill of the toe within which a deposit counts as near the toe [m]."""

ZONES = ("slope", "toe", "road", "beyond")
"""The slope, the area from near the toe to the road, the road, and beyond it."""


def variant(contact: str, alpha: float = ALPHA) -> Site:
    """Return the site with this contact and damping coefficient [1/s]."""
    surfaces = {k: changed(s, restitution=CONTACTS[contact]) for k, s in SITE.surfaces.items()}
    motion = changed(SITE.motion, damping=alpha, duration=DURATION)
    valley = (RUN_OUT, SITE.slope.points[-1][1])  # undamped blocks leave the site's ground
    slope = changed(SITE.slope, points=(*SITE.slope.points, valley))
    return changed(SITE, surfaces=surfaces, motion=motion, slope=slope)


def releases(site: Site, layout: Layout, seeds: Iterable[int]) -> list[tuple[Run, Outcome]]:
    """Return the releases of these seeds, computed in threads on all cores."""
    with warnings.catch_warnings(), ThreadPoolExecutor() as pool:
        # plain contacts share one stiffness, too low for the lowest blocks of a deposit
        warnings.simplefilter("ignore", SoftContacts)
        return list(pool.map(lambda seed: release(site, layout, seed), seeds))


def shares(run: Run) -> dict[str, float]:
    """Return the shares of the released rock in each zone at the end [-]."""
    area = np.array([polygon_properties(b.vertices)[0] for b in run.scene.blocks])
    edges = [SITE.slope.toe - ABOUT, SITE.road.start, SITE.road.end]
    zone = np.searchsorted(edges, run.poses[-1, :, 0])
    total = np.bincount(zone, weights=area, minlength=len(ZONES)) / area.sum()
    return dict(zip(ZONES, total.tolist(), strict=True))


def draw_slope(axes: Axes, run: Run, title: str, frame: int = -1, foot: bool = False) -> None:
    """Draw a frame of a run, with the whole slope or only its foot."""
    draw_frame(axes, run, (SITE.road.start, SITE.road.end), frame)
    x, y = ((55.0, 120.0), (-6.0, 45.0)) if foot else ((-8.0, 128.0), (-8.0, 140.0))
    axes.set(xlim=x, ylim=y)
    axes.set_title(title, fontsize=10)
