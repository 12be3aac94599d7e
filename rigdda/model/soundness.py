"""Consistency checks of the tables of a site, made before any computation."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import check, fields
from rigdda.errors import BadInput, DoubtfulInput
from rigdda.geometry import overlap
from rigdda.ground.prices import DITCHES
from rigdda.ground.surface import check_friction
from rigdda.ground.terrain import SAME_POINT
from rigdda.model import loose_blocks
from rigdda.model.settings import Settings
from rigdda.model.site_tables import SiteTables
from rigdda.model.source import ALLOWED_OVERLAP, Point, Source
from rigdda.model.survey import GREATEST_HEIGHT, GREATEST_LENGTH
from rigdda.rounding import chainage

LEAST_BEYOND = 30.0
"""Minimum length of the ground beyond the road [m], so that blocks that cross the road count as
beyond before they reach the end of the ground."""

MANY_STEPS, MANY_BLOCKS = 2e5, 3e3
"""Numbers of steps and blocks of a release that cause a warning. Releases of built-in sites take
some thousand steps and have up to some hundred blocks."""

CHEAPEST = 100.0
"""Cost of a day of closure [EUR] below which it may have been given in thousands of EUR."""


def check_site(site: SiteTables) -> None:
    """Check the consistency of a site.

    Raises
    ------
    BadInput
        If a field is inconsistent with another; the message names it.
    """
    _check_surfaces(site)
    _check_slope(site)
    _check_events(site)
    for source in site.sources:
        _check_source(site, source)
    _check_forest(site)
    _check_zone(site)
    _check_meshes(site)
    motion = site.motion
    if motion.damping > 0.0 and site.family != "paper":
        _warn(
            "motion.damping",
            "leave it out: it also acts in flight, and energies at a barrier are four to ten times "
            "too low",
        )
    steps = motion.duration / motion.dt
    if steps > MANY_STEPS:
        _warn("motion.dt", f"increase it or shorten the duration: a release takes {steps:g} steps")
    for source in site.sources:
        blocks = source.area / source.mean_block_area if source.band is None else 0.0
        if blocks > MANY_BLOCKS:
            where = "joints.spacing" if source.block_area is None else "block_area"
            _warn(f"{source.words}.{where}", f"increase it: a release has {blocks:.0f} blocks")
    if 0.0 < site.consequences.closure < CHEAPEST:
        _warn("consequences.closure", "give EUR per day, not thousands of EUR")
    Settings(dt=motion.dt)


def _warn(field: str, hint: str) -> None:
    warnings.warn(f"{field}: {hint}", DoubtfulInput, stacklevel=6)


def check_names(field: str, names: Iterable[str]) -> None:
    """Check that names are non-empty and unique.

    Raises
    ------
    BadInput
        If a name is empty or occurs twice.
    """
    seen: set[str] = set()
    for i, name in enumerate(names):
        if not isinstance(name, str) or not name:
            raise BadInput(f"{field}[{i}].name", name, "give it a name")
        if name in seen:
            raise BadInput(f"{field}[{i}].name", name, "give each a unique name")
        seen.add(name)


def _check_surfaces(site: SiteTables) -> None:
    for name, surface in site.surfaces.items():
        check_friction(f"surfaces.{name}", surface.friction_deg)
    check.one_of("slope.surface", site.slope.surface, site.surfaces)
    for i, stretch in enumerate(site.slope.surfaces):
        check.one_of(f"slope.surfaces[{i}].surface", stretch.surface, site.surfaces)
    for i, pair in enumerate(site.interfaces):
        fields.check(pair, f"interfaces[{i}].")
        check.one_of(f"interfaces[{i}].first", pair.first, site.surfaces)
        check.one_of(f"interfaces[{i}].second", pair.second, site.surfaces)
        check_friction(f"interfaces[{i}]", pair.friction_deg)
    pairs = [frozenset((pair.first, pair.second)) for pair in site.interfaces]
    for i, names in enumerate(pairs):
        if names in pairs[:i]:
            hint = "give each pair of surfaces only once, in either order"
            raise BadInput(f"interfaces[{i}]", " and ".join(sorted(names)), hint)
    for name, rebound in site.lumped.items():
        check.one_of("lumped", name, site.surfaces)
        check_friction(f"lumped.{name}", rebound.friction_deg)
    for name in site.prices.ditch:
        check.one_of("prices.ditch", name, {*site.surfaces, *DITCHES})
    for source in site.sources:
        check.one_of(f"{source.words}.surface", source.surface, site.surfaces)


def _check_slope(site: SiteTables) -> None:
    points, road = np.array(site.slope.points), site.road
    x, (low, high) = points[:, 0], points[[0, -1], 0]
    if not low < high or points[0, 1] <= points[-1, 1]:
        ends = f"from {points[0].tolist()} to {points[-1].tolist()}"
        hint = "list them downhill, from the crest at the least x to the end at the greatest x"
        raise BadInput("slope.points", ends, hint)
    outside = np.flatnonzero((x < low) | (x > high))
    if outside.size:
        hint = (
            f"give an x between {chainage(low)} and {chainage(high)}, those of the first and the "
            "last point: the points go downhill from the least x to the greatest x"
        )
        raise BadInput(f"slope.points[{outside[0]}]", points[outside[0]].tolist(), hint)
    _check_chain(points)
    tall, long = np.ptp(points[:, 1]), high - low
    if tall > GREATEST_HEIGHT or long > GREATEST_LENGTH:
        hint = f"give metres: at most {GREATEST_HEIGHT:g} m high and {GREATEST_LENGTH:g} m long"
        raise BadInput("slope.points", f"{tall:g} m high and {long:g} m long", hint)
    check.number("road.start", road.start, low, high)
    check.number("slope.toe", site.slope.toe, low, road.start)
    check.number("road.end", road.end, low, high)
    if road.end <= road.start:
        raise BadInput("road.end", road.end, f"put it beyond road.start {road.start}")
    for i, stretch in enumerate(site.slope.surfaces):
        for end in ("start", "end"):
            at = getattr(stretch, end)
            if not low <= at <= high:
                hint = (
                    f"keep {stretch.surface} on the slope: at least {chainage(low)} and at most "
                    f"{chainage(high)}"
                )
                raise BadInput(f"slope.surfaces[{i}].{end}", at, hint)
    if high < road.end + LEAST_BEYOND:
        raise BadInput(
            f"slope.points[{len(points) - 1}]",
            points[-1].tolist(),
            f"extend the ground to at least x = {chainage(road.end + LEAST_BEYOND)}, "
            f"{LEAST_BEYOND:g} m "
            "beyond the road, for rock that crosses it",
        )


def _check_chain(points: NDArray[np.float64]) -> None:
    """Check that no point of the ground repeats the one before, and that it crosses nowhere."""
    same = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) < SAME_POINT) + 1
    if same.size:
        hint = "remove it: it repeats the point before it"
        raise BadInput(f"slope.points[{same[0]}]", points[same[0]].tolist(), hint)
    if shapely.LineString(points).is_simple:
        return
    for k in range(2, len(points)):  # the first point whose piece meets an earlier one
        if not shapely.LineString(points[: k + 1]).is_simple:
            hint = "correct it or the points before it: the ground crosses itself before this point"
            raise BadInput(f"slope.points[{k}]", points[k].tolist(), hint)


def _check_events(site: SiteTables) -> None:
    check_names("sources", (source.name for source in site.sources))
    check_names("events", (event.name for event in site.events))
    if not site.sources:
        raise BadInput("sources", (), "give at least one")
    known = {source.name: source for source in site.sources}
    for event in site.events:
        check.one_of(f"{event.words}.source", event.source, known)
        event.check_source(known[event.source])
    if not any(event.rate > 0.0 for event in site.events):
        raise BadInput("events", [e.rate for e in site.events], "give at least one a rate above 0")


def _check_source(site: SiteTables, source: Source) -> None:
    chain = site.profile.points
    lowest = [y for _, piece in source.pieces() for _, y in piece]
    deep = min([float(chain[:, 1].min()), *lowest]) - 1.0
    ground = shapely.Polygon([*chain, (chain[-1, 0], deep), (chain[0, 0], deep)])
    if source.band is not None:
        _check_onward(site, source)
        room = max((loose_blocks.reach(source, e) for e in site.events_of(source)), default=0.0)
        low, high = source.band
        if low - room < chain[0, 0] or high + room >= site.road.start:
            first, last = chain[0, 0] + room, site.road.start - room
            if first >= last:
                raise _too_large(site, source, room)
            hint = (
                f"keep it between {chainage(first)} and {chainage(last)}, so that its blocks "
                "lie on the ground and clear the road"
            )
            raise BadInput(f"{source.words}.band", source.band, hint)
    for where, piece in source.pieces():
        _check_piece(site, where, piece, ground)


def _too_large(site: SiteTables, source: Source, room: float) -> BadInput:
    """Return the error of blocks that reach `room` [m] beyond a band, too far for the slope."""
    crest, road = site.slope.points[0][0], site.road.start
    hint = (
        f"give smaller blocks: they reach {room:.3g} m beyond their band on either side, and there "
        f"are {road - crest:.3g} m from the crest to the road"
    )
    if source.edges is not None:
        return BadInput(f"{source.words}.edges", source.edges, hint)
    event = max(site.events_of(source), key=lambda event: loose_blocks.reach(source, event))
    return BadInput(f"{event.words}.area", event.area, hint)


def _check_onward(site: SiteTables, source: Source) -> None:
    """Check that no chainage of the ground goes back, as the band of a source requires."""
    x = np.array(site.slope.points)[:, 0]
    back = np.flatnonzero(np.diff(x) < 0.0) + 1
    if back.size:
        k = int(back[0])
        hint = (
            f"it lies uphill of slope.points[{k - 1}] at x = {chainage(x[k - 1])}: correct one of "
            f"the two, or, if the ground overhangs there, give {source.words} a polygon or blocks "
            "instead of a band"
        )
        raise BadInput(f"slope.points[{k}]", list(site.slope.points[k]), hint)


def _check_piece(
    site: SiteTables, where: str, piece: tuple[Point, ...], ground: shapely.Polygon
) -> None:
    rock = shapely.Polygon(piece)
    left, _, right, _ = rock.bounds
    crest = site.slope.points[0][0]
    if left < crest:
        raise BadInput(where, piece, f"put it beyond the crest at {chainage(crest)}")
    if right >= site.road.start:
        raise BadInput(where, piece, f"put it uphill of the road at {chainage(site.road.start)}")
    sunk = overlap(rock, ground)
    if sunk > ALLOWED_OVERLAP * rock.length:
        corners = shapely.points(piece)
        depth = shapely.distance(ground.exterior, corners) * ground.contains(corners)
        corner = int(depth.argmax())
        hint = (
            "raise it, or lower slope.points, which are the ground without this rock: it overlaps "
            f"the ground by {sunk:g} m2"
        )
        raise BadInput(f"{where}[{corner}]", piece[corner], hint)


def _check_forest(site: SiteTables) -> None:
    check_names("forest", (forest.name for forest in site.forest))
    low, high = site.slope.points[0][0], site.slope.points[-1][0]
    for i, forest in enumerate(site.forest):
        for name in ("start", "end"):
            at = getattr(forest, name)
            if not low <= at <= high:
                hint = (
                    f"keep it on the slope: at least {chainage(low)} and at most {chainage(high)}"
                )
                raise BadInput(f"forest[{i}].{name}", at, hint)


def _check_zone(site: SiteTables) -> None:
    zone, ground = site.barrier_zone, site.profile
    check.number("barrier_zone.start", zone.start, site.slope.points[0][0])
    check.number("barrier_zone.end", zone.end, zone.start, site.road.start, open_low=True)
    corners = {float(x) for x, _ in site.slope.points}
    x = sorted({zone.start, zone.end} | {at for at in corners if zone.start < at < zone.end})
    foot = [(at, ground.height(at)) for at in x]
    over = [(at, y + zone.max_height) for at, y in reversed(foot)]
    room = shapely.Polygon([*foot, *over])
    for source in site.sources:
        for where, piece in source.pieces():
            taken = shapely.intersection(room, shapely.Polygon(piece))
            if taken.area > ALLOWED_OVERLAP * taken.length:
                hint = f"put it beyond {chainage(taken.bounds[2])}: {where} lies in the zone"
                raise BadInput("barrier_zone.start", zone.start, hint)


def _check_meshes(site: SiteTables) -> None:
    check_names("meshes", (option.name for option in site.meshes))
    for option in site.meshes:
        for name in option.factors:
            check.one_of(f"meshes.{option.name}.factors", name, site.event_names)
