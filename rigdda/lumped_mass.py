"""Releases by the lumped-mass model: a quick estimate, and the baseline of the block model.

A notch of a millimetre would stop a point, but not a block. Each point therefore moves on a ground
without features that are much smaller than the block it represents, see `smoothed`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda.barriers import Barrier, Earthwork, Mesh, Removal, as_layout, earthworks
from rigdda.dynamics.point_mass import (
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
from rigdda.ground.terrain import Terrain
from rigdda.model.scene import check_known
from rigdda.model.settings import EARTH
from rigdda.model.site import Site
from rigdda.model.site_tables import Drawn, Rebound
from rigdda.releases import as_site
from rigdda.rounding import chainage

Floats = NDArray[np.float64]

STEEPEST_DEG = 80.0
"""Upper limit of the friction angle of a surface with random deviations [deg]."""

SMOOTHING = 0.1
"""Depth of ground features over block size below which a block is not affected by them [-]: a block
rolls over a step of a tenth of its size. Features consist of segments shorter than the block; a
bend between two longer segments always counts."""

HEIGHT_ROUNDING = 1e-9
"""Height above a line below which a corner counts as being on it [m]."""


class Points(NamedTuple):
    """Results of releases in which each block is a point; arrays (n,) with one value per block."""

    release: NDArray[np.int64]
    """Index of the seed."""
    mass: Floats
    """[kg per metre of slope]"""
    run_out: Floats
    """Chainage at which the block stops, at most the end of the ground [m]."""
    speed: Floats
    """Speed at the first passage of the uphill edge of the road [m/s]; NaN without a passage."""
    height: Floats
    """Height above the ground at that passage [m]; NaN without a passage."""

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Whether the block reached the road."""
        return ~np.isnan(self.speed)

    @property
    def energy(self) -> Floats:
        """Kinetic energy at that passage [J per metre of slope]; NaN without a passage."""
        return 0.5 * self.mass * self.speed**2


def lumped(
    site: Site,
    layout: Sequence[Barrier] = (),
    seeds: Iterable[int] = (0,),
    event: str | None = None,
) -> Points:
    """Simulate releases by the lumped-mass model, of a given event or of events drawn by the seeds.

    Blocks start where `Site.draw` places them, each on the ground felt by a block of its size (see
    `smoothed`), which is the side of a square of equal area. Rebound coefficients are those of
    `site.lumped`; for surfaces not listed there, normal restitution and friction are those of
    `site.surfaces`. Friction and restitution vary randomly as those of the site and its surfaces
    do; the ground is smooth.

    Raises
    ------
    BadInput
        If the site has a forest, a barrier is not an earthwork or mesh or does not fit the site,
        the ground overhangs, there are no seeds, or `Site.draw` fails.
    """
    site, layout = as_site(site), as_layout(layout)
    if site.forest:
        hint = "remove it, or use the block model: points do not strike stems"
        raise BadInput("forest", f"{len(site.forest)} forests", hint)
    new = len(layout)
    layout = site.as_built(layout)
    for i, barrier in enumerate(layout):
        if not isinstance(barrier, Earthwork | Mesh | Removal):
            if i >= new:
                hint = "use the block model: points only react to ditches and embankments"
                raise BadInput(f"existing {barrier.words}", f"x = {chainage(barrier.x)}", hint)
            hint = (
                "leave it out, or use the block model: points only react to ditches and embankments"
            )
            raise BadInput(f"barriers[{i}]", barrier.kind, hint)
    site.built(layout, 1.0)
    check_known(site.surfaces, "barrier surface", site.soil)
    own = list(seeds) if isinstance(seeds, Iterable) else []
    if not own:
        raise BadInput("seeds", seeds, "give at least one seed")
    ground, _ = earthworks(site.profile, layout, site.soil)
    if (np.diff(ground.points[:, 0]) <= 0.0).any():
        hint = "use the block model: points need ground without overhangs or vertical faces"
        raise BadInput("slope.points", "an overhang", hint)
    starts, areas, densities, release, shifts = [], [], [], [], []
    for k, seed in enumerate(own):
        drawn = site.draw(seed, event)
        for block in drawn.blocks:
            area, centroid, _ = polygon_properties(block.vertices)
            starts.append((*centroid, *block.velocity[:2]))
            areas.append(abs(area))
            densities.append(block.density)
            release.append(k)
            shifts.append(_deviations(site, drawn))
    found = _follow(site, ground, np.array(starts), np.sqrt(areas), np.array(shifts))
    return Points(
        np.array(release),
        np.multiply(areas, densities),
        found[:, RUN_OUT],
        found[:, SPEED],
        found[:, HEIGHT],
    )


def _deviations(site: Site, drawn: Drawn) -> list[tuple[float, float]]:
    """Return the deviations of friction [deg] and restitution [-] of each surface in a release."""
    normals = drawn.strengths or ((0.0, 0.0, 0.0),) * len(site.surfaces)
    return [
        (drawn.friction_deg + normal[0] * s.friction_sd_deg, normal[1] * s.restitution_sd)
        for s, normal in zip(site.surfaces.values(), normals, strict=True)
    ]


def smoothed(ground: Terrain, size: float) -> tuple[Floats, tuple[str, ...]]:
    """Return the ground without features that are much smaller than a block.

    Corners between two segments that are at least as long as the block are kept. Between these
    corners, the ground is simplified (Douglas and Peucker 1973) with a tolerance of `SMOOTHING`
    times the size of the block.

    Parameters
    ----------
    ground : Terrain
        Ground with ascending chainages.
    size : float
        Size of the block [m].

    Returns
    -------
    corners : (m, 2) array
        The remaining corners, and points on the lines between them where the surface changes [m].
    surfaces : tuple of str
        Surface of each of the m - 1 segments.
    """
    points, names = ground.points, np.array(ground.surfaces)
    long = np.hypot(*np.diff(points, axis=0).T) >= size
    if long.all():
        return points, ground.surfaces
    kept = np.concatenate([[True], long[:-1] & long[1:], [True]])
    for low, high in pairwise(np.flatnonzero(kept).tolist()):
        if high > low + 1:
            piece = shapely.LineString(points[low : high + 1])
            left = shapely.simplify(piece, SMOOTHING * size, preserve_topology=False)
            x = shapely.get_coordinates(left)[:, 0]
            kept[low : high + 1] = np.isin(points[low : high + 1, 0], x)
    level = np.interp(points[:, 0], *points[kept].T)
    level = np.where(np.abs(level - points[:, 1]) <= HEIGHT_ROUNDING, points[:, 1], level)
    kept[1:-1] |= names[1:] != names[:-1]
    return np.column_stack([points[:, 0], level])[kept], tuple(names[kept[:-1]].tolist())


def _follow(
    site: Site, ground: Terrain, starts: Floats, sizes: Floats, shifts: Floats
) -> NDArray[np.float64]:
    """Follow points, each on the ground felt by a block of its size.

    Parameters
    ----------
    site : Site
        The site, for its road and its rebound coefficients.
    ground : Terrain
        The ground with its earthworks.
    starts : (n, 4) array
        Position [m] and velocity [m/s] of each point.
    sizes : (n,) array
        Size of the block that each point represents [m].
    shifts : (n, surfaces, 2) array
        Deviations of `_deviations` for each point.

    Returns
    -------
    (n, 3) array
        The results of `rigdda.dynamics.point_mass.trajectories`.
    """
    grounds: dict[bytes, tuple[Floats, tuple[str, ...]]] = {}
    members: dict[bytes, list[int]] = {}
    for i, size in enumerate(sizes.tolist()):
        corners, surfaces = smoothed(ground, size)
        key = corners.tobytes()
        grounds[key] = corners, surfaces
        members.setdefault(key, []).append(i)
    ends, every = np.zeros((len(starts), 3)), list(site.surfaces)
    for key, (corners, surfaces) in grounds.items():
        points, laws = members[key], np.array([law(site, name) for name in surfaces])
        each = np.repeat(laws[None], len(points), axis=0)
        off = shifts[points][:, [every.index(name) for name in surfaces]]
        angles = np.clip(each[:, :, FRICTION] + off[:, :, 0], 0.0, STEEPEST_DEG)
        each[:, :, FRICTION] = np.tan(np.radians(angles))
        each[:, :, NORMAL] = np.clip(each[:, :, NORMAL] + off[:, :, 1], 0.0, 1.0)
        moved, results = starts[points], np.zeros((len(points), 3))
        level = np.interp(moved[:, 0], *corners.T)
        moved[:, 1] = np.maximum(moved[:, 1], level)  # a thin slab may lie below this ground
        trajectories(np.array(corners), each, moved, EARTH, site.road.start, results)
        ends[points] = results
    return ends


def law(site: Site, name: str) -> tuple[float, float, float]:
    """Return normal and tangential restitution [-] and friction angle [deg] of a surface."""
    surface = site.surfaces[name]
    usual = Rebound(
        surface.restitution or 0.0, friction_deg=min(surface.friction_deg, STEEPEST_DEG)
    )
    rebound = site.lumped.get(name, usual)
    numbers = [math.nan] * 3
    numbers[NORMAL], numbers[TANGENTIAL], numbers[FRICTION] = (
        rebound.normal,
        rebound.tangential,
        rebound.friction_deg,
    )
    return numbers[0], numbers[1], numbers[2]
