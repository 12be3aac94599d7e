"""Check of a site: a description of what will be computed, and trial releases."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import Event, Site, Source, seeds
from rigdda.app import value_origins
from rigdda.app.reports.tables import empty_table
from rigdda.app.reports.wording import surveyed
from rigdda.barriers.fence import FENCE_CLASSES, Fence
from rigdda.geometry import polygon_properties
from rigdda.model import loose_blocks
from rigdda.model.forest import most_energy
from rigdda.model.joints import spaced_area
from rigdda.releases import Batch
from rigdda.rounding import chainage

if TYPE_CHECKING:
    from rich.table import Table


CUTS = 20
"""Number of times that a jointed mass is cut to describe its blocks."""

OUTLINES = 10_000
"""Number of outlines that are drawn to describe measured blocks."""

TIMED_RELEASES = 3
"""Releases of each event that are timed."""

LONG = 2.0
"""Time of a release after which no other one of the event is tried [s]."""


Range = tuple[float, float]
"""Least and greatest value."""


class Trial(NamedTuple):
    """Processor time of trial releases of an event."""

    event: str
    seconds: float
    """Mean processor time of a release [s]."""
    cut_off: bool
    """Whether rock above the road still moved at the end of a release."""


def facts(site: Site) -> list[str]:
    """Return sentences on what the site is and what will be computed."""
    x, y = np.array(site.slope.points).T
    road, zone = site.road, site.barrier_zone
    tall = y.max() - site.profile.height(road.start)
    rooms = " and ".join(f"{low:.1f} to {high:.1f} m" for low, high in site.rooms)
    total = sum(event.rate for event in site.events)
    design = [event.name for event in site.events if event.design]
    return [
        f"{site.name}: a slope {tall:.1f} m high above a road {road.end - road.start:.1f} m wide "
        f"at x = {chainage(road.start)} to {chainage(road.end)} m; {len(x)} points from x = "
        f"{chainage(x[0])} to {chainage(x[-1])} m, {x[-1] - road.end:.1f} m beyond the "
        "road",
        *_origin(site),
        "ground: " + "; ".join(_grounds(site)),
        f"barriers may stand at x = {rooms}, up to {zone.max_height:g} m high; "
        + _fences(site),
        *_forests(site),
        *_standing(site),
        *(_source(source) for source in site.sources),
        f"{total:.3g} events a year on 100 m of slope, {_period(total)}; design events: "
        + (", ".join(design) or "none (design = true), so that no target can be set"),
    ]  # fmt: skip


def _forests(site: Site) -> Iterator[str]:
    """Yield what stands in each forest, and how often it is struck."""
    size = max(event.block_size(site.source(event.source)) for event in site.events)
    for one in site.forest:
        kinds = [one.conifers > 0.0, one.conifers < 1.0]
        words = [
            f"{1e-3 * most_energy(np.array([one.dbh]), np.array([is_conifer]))[0]:.3g} kJ ({kind})"
            for kind, is_conifer in (("conifer", True), ("broadleaved tree", False))
            if kinds[0 if is_conifer else 1]
        ]
        often = one.struck(size)
        yield (
            f"forest at x = {chainage(one.start)} to {chainage(one.end)} m: {one.stems:g} stems a "
            f"hectare of {one.dbh:g} m, a basal area of {one.basal_area:.3g} m2 a hectare; a block "
            f"{size:.2g} m wide strikes one "
            + (f"in every {1.0 / often:.3g} m" if often > 0.0 else "never")
            + f", which takes at most {' or '.join(words)} if it is of the mean diameter"
        )


def _standing(site: Site) -> Iterator[str]:
    """Yield what stands already, and how much traffic there is."""
    for one, barrier in zip(site.existing, site.existing_barriers, strict=True):
        may = "it stays in every layout"
        if one.removable:
            may = f"it may be removed or replaced for {one.removal or 0.0:g} EUR per metre"
        upkeep = site.prices.upkeep_of(barrier.kind, barrier.upkeep) * site.values(())[barrier]
        yield (
            f"existing {barrier.label} at x = {chainage(barrier.x)} m{surveyed(site, barrier.x)}: "
            f"{may}; upkeep {upkeep:.3g} EUR per metre and year"
        )
    if (traffic := site.traffic) is not None:
        value = traffic.fatality_value
        yield (
            f"traffic: {traffic.vehicles_per_day:,.6g} vehicles a day at {traffic.speed:g} km/h, "
            f"{1e3 * traffic.density:.2g} on a km of road; {traffic.stopped_late:.2g} vehicles "
            "run into the debris of a release; fatalities are "
            + (f"priced at {value:,.6g} EUR" if value else "not part of Z")
        )


def placeholders(path: str) -> list[str]:
    """Return the values that a file of `rigdda new` still marks as placeholders; none of a name."""
    return [mark.path for mark in value_origins.marks_of(path)]


def _origin(site: Site) -> Iterator[str]:
    """Yield where the survey has the origin of the site."""
    origin = site.origin
    if origin.surveyed:
        way = "falls" if origin.reversed else "grows"
        yield (
            f"survey: x = 0 is chainage {origin.chainage:,.10g}, which {way} downhill, and y = 0 "
            f"is elevation {origin.elevation:,.10g}; the road is at chainage "
            f"{origin.chainage_of(site.road.start):,.10g} to "
            f"{origin.chainage_of(site.road.end):,.10g}"
        )
    if origin.easting is not None and origin.northing is not None:
        yield (
            f"plan: x = 0 is at easting {origin.easting:,.10g}, northing {origin.northing:,.10g}, "
            f"and x grows towards {origin.azimuth_deg or 0.0:.1f} deg from north"
        )


def _grounds(site: Site) -> list[str]:
    """Return the stretches of the ground with their surfaces, from the crest on."""
    found: list[tuple[float, float, str]] = []
    points, names = site.slope.chain()
    for (a, _), (b, _), name in zip(points, points[1:], names, strict=False):
        start, end = min(a, b), max(a, b)
        if found and found[-1][2] == name:
            start, before, _ = found.pop()
            end = max(end, before)
        found.append((start, end, name))
    return [f"{called(site, name)} x = {chainage(a)} to {chainage(b)} m" for a, b, name in found]


def called(site: Site, surface: str) -> str:
    """Return the name of a surface with its ground."""
    ground = site.surfaces[surface].ground
    return f"{surface} ({ground})" if ground not in ("", surface) else surface


def _fences(site: Site) -> str:
    """Return which fences have room for their elongation, in words."""
    thickness = Fence(0.0, 2.0, energy_class=100).thickness
    room = site.road.start - site.rooms[0][0] - thickness
    fit = [kj for kj, kind in FENCE_CLASSES.items() if kind.elongation <= room]
    if not fit:
        return f"no fence has room for its elongation: {room:.1f} m up to the road"
    most = max(fit)
    return (
        f"fences up to {most:,} kJ have room for their elongation, "
        f"{FENCE_CLASSES[most].elongation:g} m, uphill of the road"
    )


def _source(source: Source) -> str:
    """Return what a source is and what blocks it makes."""
    if source.band is not None:
        return (
            f"source {source.name}: loose blocks at x = {chainage(source.band[0])} to "
            f"{chainage(source.band[1])} m{_measured(source)}"
        )
    areas = [_areas(source, seed) for seed in range(CUTS if source.polygon else 1)]
    counts, every = [len(found) for found in areas], np.concatenate(areas)
    shares = np.array([*np.quantile(every, [0.1, 0.5, 0.9]), every.max()])
    low, middle, high, most = map(_figures, shares)
    light, usual, heavy, top = map(_figures, shares**1.5 * source.density / 1e3)
    what, way = "given blocks", ""
    if source.polygon:
        what = "a jointed mass"
        scale = joint_scale(source)
        way = (
            ", cut at the spacings as given"
            if scale is None
            else f", cut at {scale:.2f} times the spacings to meet block_area = "
            f"{source.block_area:g} m2"
        )
    if max(counts) == 1:
        return f"source {source.name}: one block of {most} m2 ({top} t)"
    number = f"{min(counts)}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
    return (
        f"source {source.name}: {what} of {source.area:.4g} m2{way}: {number} blocks; 10, 50 and "
        f"90 % of them are below {low}, {middle} and {high} m2 ({light}, {usual} and {heavy} t), "
        f"and the largest has {most} m2 ({top} t)"
    )


def _measured(source: Source) -> str:
    """Return the volumes of the blocks of a band with edges, in words; nothing without edges."""
    if source.edges is None:
        return ""
    volumes = measured_areas(source) ** 1.5
    long, middle, short = sorted(source.edges, reverse=True)
    return (
        f", with edges of {long:g}, {middle:g} and {short:g} m; their volumes are "
        f"{range_of((volumes.min(), volumes.max()))} m3, {_figures(volumes.mean())} m3 on average: "
        "a block is as long along the road as the root of its cross-section; the box has "
        f"{_figures(math.prod(source.edges))} m3"
    )


def measured_areas(source: Source) -> NDArray[np.float64]:
    """Return the areas of a fixed sample of blocks of a band with edges, (3, OUTLINES) [m2].

    A row has the blocks on one face of the box. Releases draw the three faces equally often, and
    the outline on a face as here.
    """
    assert source.edges is not None
    first, second, third = source.edges
    faces = np.array([second * third, third * first, first * second])
    return np.multiply.outer(faces, _filled(source.corners))


@lru_cache(maxsize=64)
def _filled(corners: tuple[int, int]) -> NDArray[np.float64]:
    """Return the shares of a face that outlines with random numbers of corners fill, (OUTLINES,).

    The share does not depend on the edges of the box, so that the outlines are those in a cube with
    edges of 1 m.
    """
    least, most = corners
    numbers = seeds.generator(0, 0).random((OUTLINES, loose_blocks.RANDOM_NUMBERS + most))
    law = loose_blocks.ShapeLaw(least, most, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, True)
    outlines, count = np.empty((OUTLINES, most, 2)), np.empty(OUTLINES, dtype=np.int64)
    areas = np.empty(OUTLINES)
    loose_blocks.write_shapes_directly.call(numbers, law, outlines, count, areas)
    return areas


def _areas(source: Source, seed: int) -> list[float]:
    """Return the areas of the blocks of a mass or of given blocks [m2]."""
    outlines = source.cut(seeds.generator(seed, 0))
    return [abs(polygon_properties(outline)[0]) for outline in outlines]


def joint_scale(source: Source) -> float | None:
    """Return the factor by which `block_area` scales the spacings of joints, None without it."""
    if source.block_area is None or not source.joints:
        return None
    return math.sqrt(source.block_area / spaced_area(source.joints))


def _period(rate: float) -> str:
    """Return how often something happens, in words."""
    if rate <= 0.0:
        return "never"
    years = 1.0 / rate
    return f"one in {years:.3g} years" if years >= 1.0 else f"one in {365.0 * years:.3g} days"


def try_releases(site: Site, seed: int = 0) -> list[Trial]:
    """Simulate a few releases of each event without barriers, and return their computing effort.

    Raises
    ------
    Diverged
        If one diverges.
    """
    batch, found = Batch(site, ()), []
    for event in site.events:
        batch.outcome(seed, event.name)  # compiles what is not compiled yet
        spent, cut = [], False
        for k in range(TIMED_RELEASES):
            start = time.process_time()
            outcome = batch.outcome(seed + k, event.name)
            spent.append(time.process_time() - start)
            cut = cut or outcome.cut_off
            if spent[-1] > LONG:
                break
        found.append(Trial(event.name, float(np.mean(spent)), cut))
    return found


def table(site: Site, trials: Sequence[Trial]) -> Table:
    """Return the table of events: rate, size, and computing effort of a release."""
    found = empty_table(("event", "1/year", "years", "blocks", "m3", "t", "release", "ms"))
    for event, trial in zip(site.events, trials, strict=True):
        source = site.source(event.source)
        number, areas = blocks_of(event, source)
        volumes = [area**1.5 for area in areas]
        masses = [volume * source.density / 1e3 for volume in volumes]
        found.add_row(
            event.name,
            f"{event.rate:.3g}",
            f"{1.0 / event.rate:.3g}" if event.rate > 0.0 else "never",
            number,
            range_of(volumes),
            range_of(masses),
            range_of(size_of_release(event, source)[1]),
            f"{1e3 * trial.seconds:.3g}",
        )
    return found


def blocks_of(event: Event, source: Source) -> tuple[str, Range]:
    """Return the number of blocks of an event, and the least and greatest area of one [m2].

    The areas of measured blocks are those of a sample, see `measured_areas`.
    """
    low, high = event.number
    number = f"{low}" if low == high else f"{low} to {high}"
    if source.edges is not None:
        areas = measured_areas(source)
        return number, (float(areas.min()), float(areas.max()))
    if event.area is not None:
        return number, event.area
    cut = _areas(source, 0)
    return f"{len(cut)}", (min(cut), max(cut))


def longest_block(event: Event, source: Source) -> float:
    """Return the length of the largest block of an event [m].

    That of a measured block is its longest edge, which its outline fills.
    """
    if source.edges is not None:
        return max(source.edges)
    _, (_, most) = blocks_of(event, source)
    return math.sqrt(most * (source.aspect[1] if source.band is not None else 1.0))


def size_of_release(event: Event, source: Source) -> tuple[Range, Range]:
    """Return least and greatest width [m] and volume [m3] of a release of an event.

    The volume is the sum of the cross-sections of the blocks times the width.
    """
    _, (least, most) = blocks_of(event, source)
    if source.band is None:
        width = event.width_of([])
        volume = sum(_areas(source, 0)) * width
        return (width, width), (volume, volume)
    low, high = event.number
    widths = event.width_of([least]), event.width_of([most])
    return widths, (low * least * widths[0], high * most * widths[1])


def _figures(value: float) -> str:
    """Return a number in two figures, or as a whole number from 100 on."""
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"


def range_of(values: Sequence[float]) -> str:
    """Return the least and the greatest of some numbers, in words."""
    low, high = _figures(min(values)), _figures(max(values))
    return low if low == high else f"{low} to {high}"


def time_of(site: Site, trials: Sequence[Trial]) -> str:
    """Return how long 1,000 releases take, in words."""
    rates = np.array([event.rate for event in site.events])
    each = float(rates @ [trial.seconds for trial in trials] / rates.sum())
    cores = os.cpu_count() or 1
    return (
        "1/year and years: rate and return period on 100 m of slope; m3 and t: volume and mass of "
        "a block, as long along the road as the root of its cross-section; release: volume of a "
        "release [m3], the cross-sections of its blocks times the width of the event; ms: "
        "processor time of a release\n"
        f"1,000 releases by rate take about {1000.0 * each / cores:,.0f} s on {cores} cores"
    )
