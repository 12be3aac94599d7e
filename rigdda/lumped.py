"""Releases by the lumped-mass model: a quick look, and the baseline of the block model."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Barrier, Earthwork, Mesh, as_layout, earthworks
from rigdda.batch import as_site
from rigdda.dynamics.lumped import (
    FRICTION,
    HEIGHT,
    NORMAL,
    RUN_OUT,
    SPEED,
    TANGENTIAL,
    trajectories,
)
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.model.composition import check_known
from rigdda.model.place import Rebound
from rigdda.model.settings import EARTH
from rigdda.model.site import Site

Floats = NDArray[np.float64]

STEEPEST_DEG = 80.0
"""Friction angle up to which scatter may raise that of a surface [deg]."""


class Points(NamedTuple):
    """What became of the blocks of some releases, each a point; arrays (n,), a number a block."""

    release: NDArray[np.int64]
    """Which of the seeds."""
    mass: Floats
    """[kg per metre of slope]"""
    run_out: Floats
    """Chainage at which it stops, at most the end of the ground [m]."""
    speed: Floats
    """Where it first passes the uphill edge of the road [m/s]; NaN if it does not."""
    height: Floats
    """Above the ground there [m]; NaN if it does not."""

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Whether it came onto the road."""
        return ~np.isnan(self.speed)

    @property
    def energy(self) -> Floats:
        """Kinetic energy there [J per metre of slope]; NaN if it does not."""
        return 0.5 * self.mass * self.speed**2


def lumped(
    site: Site,
    layout: Sequence[Barrier] = (),
    seeds: Iterable[int] = (0,),
    event: str | None = None,
) -> Points:
    """Return what becomes of releases of an event, or of those that seeds draw, as points.

    Blocks start where `Site.draw` puts them. They rebound by `site.lumped`; of a surface that is
    not listed there normal restitution and friction are those of `site.surfaces`. The scatter of
    friction is that of the site.

    Raises
    ------
    BadInput
        If a barrier stands on the ground or where loose rock lies, the ground overhangs, there is
        no seed, or as `Site.draw`.
    """
    site, layout = as_site(site), as_layout(layout)
    for i, barrier in enumerate(layout):
        if not isinstance(barrier, Earthwork | Mesh):
            mend = "leave it out, or use the block model: points know only what is cut or filled"
            raise BadInput(f"barriers[{i}]", barrier.kind, mend)
    site.built(layout, 1.0)
    check_known(site.surfaces, "barrier surface", site.soil)
    own = list(seeds) if isinstance(seeds, Iterable) else []
    if not own:
        raise BadInput("seeds", seeds, "give at least one seed")
    ground, _ = earthworks(site.profile, layout, site.soil)
    corners = np.ascontiguousarray(ground.points)
    if (np.diff(corners[:, 0]) <= 0.0).any():
        mend = "use the block model: points need ground without overhangs or vertical faces"
        raise BadInput("slope.points", "an overhang", mend)
    laws = np.array([law(site, name) for name in ground.surfaces])
    starts, masses, release, shifts = [], [], [], []
    for k, seed in enumerate(own):
        drawn = site.draw(seed, event)
        for block in drawn.blocks:
            area, centroid, _ = polygon_properties(block.vertices)
            starts.append((*centroid, *block.velocity[:2]))
            masses.append(abs(area) * block.density)
            release.append(k)
            shifts.append(drawn.friction_deg)
    each = np.repeat(laws[None], len(starts), axis=0)
    angles = np.clip(each[:, :, FRICTION] + np.array(shifts)[:, None], 0.0, STEEPEST_DEG)
    each[:, :, FRICTION] = np.tan(np.radians(angles))
    found = np.zeros((len(starts), 3))
    trajectories(corners, each, np.array(starts), EARTH, site.road.start, found)
    return Points(
        np.array(release), np.array(masses), found[:, RUN_OUT], found[:, SPEED], found[:, HEIGHT]
    )


def law(site: Site, name: str) -> tuple[float, float, float]:
    """Return normal and tangential restitution [-] and friction angle [deg] of a surface."""
    surface = site.surfaces[name]
    usual = Rebound(
        surface.restitution or 0.0, friction_deg=min(surface.friction_deg, STEEPEST_DEG)
    )
    own = site.lumped.get(name, usual)
    found = [math.nan] * 3
    found[NORMAL], found[TANGENTIAL], found[FRICTION] = own.normal, own.tangential, own.friction_deg
    return found[0], found[1], found[2]
