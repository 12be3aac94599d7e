"""Check of a site: what will be computed, as text and as a picture, and which values look odd."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rigdda import Block, Event, Site, Source, seeds
from rigdda.app import new_site
from rigdda.app.reports.pictures import DPI, FONT, save, sources
from rigdda.app.reports.tables import empty_table
from rigdda.app.reports.wording import surveyed
from rigdda.barriers import Earthwork, earthworks
from rigdda.barriers.fence import FENCE_CLASSES
from rigdda.display import OLD
from rigdda.envs.rendering import ROAD, ROCK, Label, draw_barrier, top_of, write_labels
from rigdda.fields import Described, described, parse
from rigdda.files import read
from rigdda.geometry import polygon_properties
from rigdda.ground.grounds import GROUNDS
from rigdda.ground.surface import WITHOUT_GROUND
from rigdda.model import site_names
from rigdda.model.existing import Existing
from rigdda.model.forest import most_energy
from rigdda.model.joints import spaced_area
from rigdda.model.site_tables import Origin
from rigdda.model.soundness import LEAST_BEYOND
from rigdda.model.survey import spike_words, spikes
from rigdda.releases import Batch

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

Floats = NDArray[np.float64]

DRAWN_STEMS, WOOD = 60, "#2e7d32"
"""Stems on the whole length of the picture, and their colour."""

Written = Mapping[str, Mapping[str, Any]]
"""Tables of events as they are written, by the name of the event."""

CUTS = 20
"""Times that a jointed mass is cut to tell its blocks."""

WIDE, NARROW = 20.0, 3.0
"""Widths of a road beyond which its unit is doubted [m]."""

DOUBTED_HEIGHT, LOW = 1500.0, 2.0
"""Heights of a slope beyond which its unit is doubted [m]."""

LIGHT, USUAL_DENSITIES = 1500.0, 3500.0
"""Densities beyond which rock is unusual [kg/m3]."""

DOUBTED_RATE = 5.0
"""Rate from which on a return period may be meant [1/year per 100 m]."""

SPARSE, DENSE = 2.0, 90.0
"""Basal areas beyond which a forest is doubted [m2/ha]; dense protection forest has about 50."""

HIGH_UP = 15.0
"""Height above which stems are not thought to take their energy [m]."""

HUGE = 20.0
"""Volume of a block above which an area may have been meant for one [m3]."""

HANGING = 0.05
"""Distance from the ground above which rock hangs in mid-air [m]."""

TINY = 5e-4
"""Volume of a block up to which its unit is doubted [m3]: half a litre weighs 1.3 kg."""

SLOW_LOOSE_BLOCKS, SLOW_MASS_BLOCKS = 100, 1000
"""Numbers of loose blocks, and of blocks of a mass, from which on a release is slow."""

LEAST_SHARE = 0.01
"""Share of a band that is worth a word if blocks may stay where they are on it [-]."""

FARTHER = 3.0
"""Length of the road over that of the slope on which events were counted, from which on it is
doubted whether their rates hold for all of the road."""

TALLEST = {"wall": 6.0, "gravity_wall": 8.0, "embankment": 12.0}
"""Heights above which a barrier is unusual for its kind [m]; assumed."""

SIZE_LIMITS = {"height": "max_height", "depth": "max_depth", "width": "max_width",
          "thickness": "max_thickness"}  # fmt: skip
"""Limits of the zone for sizes of barriers."""

DOUBTED_PRICE_FACTOR = 20.0
"""Factor on a usual price, either way, beyond which its unit is doubted."""

NO_CHARGE = ("fence_base", "ditch_base", "removal", "clearing")
"""Prices that may well be 0."""

CLOSURES = (1e3, 5e6)
"""Costs of a day of closure beyond which its unit is doubted [EUR]."""

DOUBTED_CLOSURE_DAYS = 20.0
"""Days of closure for any rock, or for 1 m3, above which their unit is doubted."""

SHARES = {"interest": 0.15, "upkeep": 0.1}
"""Shares per year above which they may have been meant as percentages [1/year]."""

LIVES = (5.0, 150.0)
"""Service lives beyond which they are unusual [years]."""

DEAR = 5000.0
"""Cost of the removal of a barrier above which its unit is doubted [EUR/m]."""

LAWS = ("friction_deg", "restitution", "rolling", "roughness")
"""Values of a surface for which its ground has a plausible range."""

SHORT = 1.2 * LEAST_BEYOND
"""Length of the ground beyond the road that leaves a run-out little room [m]."""

FALLING_DEG = 10.0
"""Inclination of the last piece of the ground above which rock goes on beyond it [deg]."""

SCALED = 1.2
"""Factor on the spacings of joints that is worth a word, either way."""

SLOW = 25.0
"""Speed below which a unit is doubted [km/h]."""

CHEAP = 1e5
"""Value of a prevented fatality below which its unit is doubted [EUR]."""

LEAST_ROOM = 3.0
"""Length of the zone below which there is little to choose [m]."""

LEAST_FENCE_CLASS = 500
"""Energy class of the least fence that there should be room for [kJ]."""

TIMED_RELEASES = 3
"""Releases of each event that are timed."""

LONG = 2.0
"""Time of a release after which no other one of the event is tried [s]."""


class Trial(NamedTuple):
    """What releases of an event took."""

    event: str
    steps: int
    """Most time steps of a release."""
    seconds: float
    """Processor time of one, mean [s]."""
    cut_off: bool
    """Whether rock above the road still moved at the end of one."""


def facts(site: Site) -> list[str]:
    """Return sentences on what the site is and what will be computed."""
    x, y = np.array(site.slope.points).T
    road, zone = site.road, site.barrier_zone
    tall = y.max() - site.profile.height(road.start)
    rooms = " and ".join(f"{low:.1f} to {high:.1f} m" for low, high in site.rooms)
    total = sum(event.rate for event in site.events)
    design = [event.name for event in site.events if event.design]
    return [
        f"{site.name}: a slope {tall:.1f} m high above a road "
        f"{road.end - road.start:.1f} m wide at x = {road.start:g} to {road.end:g} m; "
        f"{len(x)} points from x = {x[0]:g} to {x[-1]:g} m, {x[-1] - road.end:.1f} m beyond the "
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
        energy = most_energy(np.array([one.dbh]), np.array([one.conifers >= 0.5]))[0]
        often = one.struck(size)
        yield (
            f"forest at x = {one.start:g} to {one.end:g} m: {one.stems:g} stems a hectare of "
            f"{one.dbh:g} m, a basal area of {one.basal_area:.3g} m2 a hectare; a block {size:.2g} "
            "m wide strikes one "
            + (f"in every {1.0 / often:.3g} m" if often > 0.0 else "never")
            + f", which takes at most {1e-3 * energy:.3g} kJ if it is of the mean diameter"
        )


def _standing(site: Site) -> Iterator[str]:
    """Yield what stands already, and how much traffic there is."""
    for one, barrier in zip(site.existing, site.existing_barriers, strict=True):
        may = "it stays in every layout"
        if one.removable:
            may = f"it may be removed or replaced for {one.removal or 0.0:g} EUR per metre"
        upkeep = site.prices.upkeep_of(barrier.kind, barrier.upkeep) * site.values(())[barrier]
        yield (
            f"existing {barrier.label} at x = {barrier.x:g} m{surveyed(site, barrier.x)}: {may}; "
            f"upkeep {upkeep:.3g} EUR per metre and year"
        )
    if (traffic := site.traffic) is not None:
        value = traffic.fatality_value
        yield (
            f"traffic: {traffic.vehicles_per_day:,.6g} vehicles a day at {traffic.speed:g} km/h, "
            f"{1e3 * traffic.density:.2g} on a km of road; {traffic.stopped_late:.2g} vehicles "
            "run into the debris of a release; fatalities are "
            + (f"priced at {value:,.6g} EUR" if value else "not part of Z")
        )


def placeholders(path: str) -> int:
    """Return how many values a file of `rigdda new` still marks as placeholders; 0 of a name."""
    file = Path(path)
    if not file.is_file():
        return 0
    return new_site.placeholders(file.read_text(encoding="utf-8", errors="replace"))


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
    return [f"{_called(site, name)} x = {a:g} to {b:g} m" for a, b, name in found]


def _called(site: Site, surface: str) -> str:
    """Return the name of a surface with its ground."""
    ground = site.surfaces[surface].ground
    return f"{surface} ({ground})" if ground not in ("", surface) else surface


def _fences(site: Site) -> str:
    """Return which fences have room for their elongation, in words."""
    room = site.road.start - site.rooms[0][0]
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
            f"source {source.name}: loose blocks at x = {source.band[0]:g} to {source.band[1]:g} m"
        )
    areas = [_areas(source, seed) for seed in range(CUTS if source.polygon else 1)]
    counts, every = [len(found) for found in areas], np.concatenate(areas)
    shares = np.array([*np.quantile(every, [0.1, 0.5, 0.9]), every.max()])
    low, middle, high, most = map(_figures, shares)
    light, usual, heavy, top = map(_figures, shares**1.5 * source.density / 1e3)
    what, way = "given blocks", ""
    if source.polygon:
        what = "a jointed mass"
        scale = _scale(source)
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


def _areas(source: Source, seed: int) -> list[float]:
    """Return the areas of the blocks of a mass or of given blocks [m2]."""
    outlines = source.cut(seeds.generator(seed, 0))
    return [abs(polygon_properties(outline)[0]) for outline in outlines]


def _scale(source: Source) -> float | None:
    """Return the factor that `block_area` sets on the spacings of joints, None without it."""
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
    """Simulate a few releases of each event without barriers, and return what they took.

    Raises
    ------
    Diverged
        If one diverges.
    """
    batch, found = Batch(site, ()), []
    batch.outcome(seed, site.event_names[0])  # compiles what is not compiled yet
    for event in site.events:
        spent, steps, cut = [], 0, False
        for k in range(TIMED_RELEASES):
            scene = site.realise((), seed + k, event.name)
            steps = max(steps, math.ceil(site.motion.duration / site.settings(scene).dt))
            start = time.process_time()
            outcome = batch.outcome(seed + k, event.name)
            spent.append(time.process_time() - start)
            cut = cut or outcome.cut_off
            if spent[-1] > LONG:
                break
        found.append(Trial(event.name, steps, float(np.mean(spent)), cut))
    return found


def table(site: Site, trials: Sequence[Trial]) -> Table:
    """Return the table of events: how often, how large, and what a release takes."""
    found = empty_table(("event", "1/year", "years", "blocks", "m3", "t", "steps", "ms"))
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
            f"{trial.steps:,}",
            f"{1e3 * trial.seconds:.3g}",
        )
    return found


def blocks_of(event: Event, source: Source) -> tuple[str, tuple[float, float]]:
    """Return the number of blocks of an event, and the least and greatest area of one [m2]."""
    low, high = event.number
    number = f"{low}" if low == high else f"{low} to {high}"
    if source.edges is not None:
        long, middle, short = sorted(source.edges, reverse=True)
        return number, (middle * short, long * middle)
    if event.area is not None:
        return number, event.area
    areas = _areas(source, 0)
    return f"{len(areas)}", (min(areas), max(areas))


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
        "a block; ms: processor time of a release.\n"
        f"1,000 releases by rate take about {1000.0 * each / cores:,.0f} s on {cores} cores"
    )


def written_events(source: str) -> Written:
    """Return the table of each event by its name, as it is written in a file or a built-in site.

    A site has the area and the rate that follow from a volume and a return period, and no longer
    knows what was written. The result is empty for other names.
    """
    if source in site_names.names():
        text = site_names.text(source)
    elif Path(source).is_file():
        text = read("site file", Path(source))
    else:
        return {}
    tables = parse("site file", source, text).get("events", [])
    return {str(table.get("name")): table for table in tables}


def oddities(
    site: Site, trials: Sequence[Trial] = (), written: Written = MappingProxyType({})
) -> list[str]:
    """Return values of a site that may be mistakes, each with its field and what to check.

    Parameters
    ----------
    site : Site
        The site.
    trials : sequence of Trial
        Releases that were tried.
    written : mapping
        Tables of the events as they are written, see `written_events`. Values are then called what
        they are called there.
    """
    return [
        *_odd_profile(site),
        *_odd_surfaces(site),
        *_odd_zone(site),
        *_odd_forest(site),
        *_odd_existing(site),
        *_odd_traffic(site, written),
        *_odd_prices(site),
        *(words for source in site.sources for words in _odd_source(site, source)),
        *(
            words
            for event in site.events
            for words in _odd_event(site, event, written.get(event.name, {}))
        ),
        *_odd_design(site),
        *(
            f"motion.duration = {site.motion.duration:g} s: rock of {trial.event!r} still moves "
            "above the road as releases end; use a longer duration"
            for trial in trials
            if trial.cut_off
        ),
    ]


def _odd_profile(site: Site) -> Iterator[str]:
    """Yield what is odd about the ground and the road."""
    x, y = np.array(site.slope.points).T
    road, toe = site.road, site.slope.toe
    foot, crest = site.profile.height(road.start), float(y.max())
    tall, wide = crest - foot, road.end - road.start
    if tall > DOUBTED_HEIGHT or tall < LOW:
        yield (
            f"slope.points: the crest is {tall:g} m above the road; are the coordinates in metres, "
            "not in millimetres or feet?"
        )
    for k, height in spikes(np.column_stack([x, y])):
        yield f"slope.points[{k}] = [{x[k]:g}, {y[k]:g}]: {spike_words(height)}"
    if wide > WIDE or wide < NARROW:
        yield f"road: it is {wide:g} m wide; are chainages in metres, not in feet or kilometres?"
    above = site.profile.height(toe) - foot
    if tall > 0.0 and above > 0.5 * tall:
        yield (
            f"slope.toe = {toe:g}: it is {above:.1f} m above the road, in the upper half of the "
            "slope; give the chainage of its foot, not of its crest"
        )
    beyond = float(x[-1]) - road.end
    if beyond < SHORT:
        yield (
            f"slope.points: the ground ends {beyond:.1f} m beyond the road; survey farther if rock "
            "can run on there"
        )
    fall = math.degrees(math.atan2(y[-2] - y[-1], abs(x[-1] - x[-2])))
    if fall > FALLING_DEG:
        yield (
            f"slope.points: the ground falls by {fall:.0f} deg where it ends; survey it to where "
            "rock stops if what lies below the road counts"
        )


def _odd_surfaces(site: Site) -> Iterator[str]:
    """Yield contact properties that are plausible for none of the grounds they may belong to."""
    for name, surface in site.surfaces.items():
        for law in LAWS:
            value = getattr(surface, law)
            if value is None or (not surface.ground and value == WITHOUT_GROUND[law]):
                continue
            low, high, whose = _plausible(surface.ground, law)
            if not low <= value <= high:
                yield (
                    f"surfaces.{name}.{law} = {value:g}: {low:g} to {high:g} is plausible for "
                    f"{whose}; correct it, or name another ground"
                )
    for i, pair in enumerate(site.interfaces):
        for law in ("restitution", "rolling"):
            value, (_, high, whose) = getattr(pair, law), _plausible("", law)
            if value is not None and value > high:
                yield (
                    f"interfaces[{i}].{law} = {value:g}: up to {high:g} is plausible for {whose}; "
                    "correct it"
                )


def _plausible(ground: str, law: str) -> tuple[float, float, str]:
    """Return the plausible range of a value of a ground, or of all grounds, and its words."""
    spans = [getattr(GROUNDS[name], law) for name in ([ground] if ground else GROUNDS)]
    whose = f"the ground {ground!r}" if ground else "the grounds of the library"
    return min(span.low for span in spans), max(span.high for span in spans), whose


def _odd_zone(site: Site) -> Iterator[str]:
    """Yield what is odd about the place and size of barriers."""
    zone, rooms = site.barrier_zone, site.rooms
    longest = max(high - low for low, high in rooms)
    if longest < LEAST_ROOM:
        yield (
            f"barrier_zone: {longest:.1f} m are free of loose rock; the best place will lie on an "
            "end of it"
        )
    room, needed = site.road.start - rooms[0][0], FENCE_CLASSES[LEAST_FENCE_CLASS].elongation
    if room < needed:
        yield (
            f"barrier_zone.start = {zone.start:g}: a fence of {LEAST_FENCE_CLASS} kJ gives way by "
            f"{needed:g} m, and there are {room:.1f} m up to the road; begin the zone farther "
            "uphill"
        )
    size = max(_size(site, event) for event in site.events)
    for name, factor in (("max_height", 1.5), ("max_depth", 1.0), ("max_width", 1.5)):
        value = getattr(zone, name)
        if value < factor * size:
            yield (
                f"barrier_zone.{name} = {value:g}: the largest block is {size:.1f} m long, so that "
                "the best barrier will lie on this bound; allow more if it can be built"
            )


def _odd_forest(site: Site) -> Iterator[str]:
    """Yield what is odd about the forest."""
    first = min(start for start, _ in _spans(site))
    for i, one in enumerate(site.forest):
        area, where = one.basal_area, f"forest[{i}]"
        if not SPARSE <= area <= DENSE:
            yield (
                f"{where}: {one.stems:g} stems of {one.dbh:g} m are a basal area of {area:.3g} m2 "
                f"a hectare, and that of a forest is {SPARSE:g} to {DENSE:g}; is `stems` a number "
                "on a hectare, and `dbh` a diameter in metres?"
            )
        if one.dbh_sd > one.dbh:
            yield (
                f"{where}.dbh_sd = {one.dbh_sd:g}: it is more than the mean diameter, "
                f"{one.dbh:g} m; is it a standard deviation in metres?"
            )
        if one.height > HIGH_UP:
            yield (
                f"{where}.height = {one.height:g}: the energy that a stem takes was measured near "
                "the ground; higher up it is less"
            )
        if one.end <= first:
            yield f"{where}.end = {one.end:g}: all rock starts farther downhill, at x = {first:g} m"
        if one.start < site.road.end and one.end > site.road.start:
            road = f"x = {site.road.start:g} to {site.road.end:g} m"
            yield f"{where}: it reaches onto the road, {road}"


def _spans(site: Site) -> Iterator[tuple[float, float]]:
    """Yield the chainages between which each source lies [m]."""
    for source in site.sources:
        if source.band is not None:
            yield source.band
        else:
            x = source.outline[:, 0]
            yield float(x.min()), float(x.max())


def _odd_existing(site: Site) -> Iterator[str]:
    """Yield what is odd about barriers that stand already."""
    for i, barrier in enumerate(site.existing_barriers):
        end = barrier.end + barrier.deflection
        if end > site.road.start:
            yield (
                f"existing[{i}].x = {barrier.x:g}: the {barrier.words} gives way by up to "
                f"{barrier.deflection:g} m, {end - site.road.start:.1f} m onto the road; a new one "
                "would not be allowed there"
            )
    for i, one in enumerate(site.existing):
        yield from _odd_sizes(site, f"existing[{i}]", one)
        if (one.removal or 0.0) > DEAR:
            yield f"existing[{i}].removal = {one.removal:g} EUR/m: is it the cost of one metre?"


def _odd_sizes(site: Site, where: str, one: Existing) -> Iterator[str]:
    """Yield the sizes of an existing barrier that are beyond the zone or unusual for its kind."""
    kind = one.kind.replace("_", " ")
    for name, bound in SIZE_LIMITS.items():
        value, most = getattr(one, name), getattr(site.barrier_zone, bound)
        fixed = (one.kind, name) in (("fence", "thickness"), ("embankment", "width"))
        if value is not None and value > most and not fixed:
            yield (
                f"{where}.{name} = {value:g} m: barrier_zone.{bound} = {most:g} allows no new "
                f"{kind} of this size; is it in metres?"
            )
        elif name == "height" and value is not None and value > TALLEST.get(one.kind, math.inf):
            yield (
                f"{where}.{name} = {value:g} m: few barriers of the kind {kind} are higher than "
                f"{TALLEST[one.kind]:g} m; is it in metres?"
            )


def _odd_prices(site: Site) -> Iterator[str]:
    """Yield prices and consequences whose unit may be another one."""
    for where, given in (("prices", site.prices), ("consequences", site.consequences)):
        usual = type(given)()
        for field in described(type(given)):
            if field.unit.startswith("EUR/m"):
                told = _odd_price(where, field, getattr(given, field.name), usual)
                yield from told
    daily = site.consequences.closure
    if 0.0 < daily < CLOSURES[0] or daily > CLOSURES[1]:
        yield (
            f"consequences.closure = {daily:g} EUR/day: a day of closure usually costs thousands "
            "to millions of EUR; is it in EUR, and for a day?"
        )
    for name in ("days_base", "days_factor"):
        days = getattr(site.consequences, name)
        if days > DOUBTED_CLOSURE_DAYS:
            yield f"consequences.{name} = {days:g} days: is it in hours?"
    shares = {"interest": site.prices.interest}
    shares |= {f"upkeep.{kind}": share for kind, share in site.prices.upkeep.items()}
    for name, share in shares.items():
        if share > SHARES[name.partition(".")[0]]:
            yield f"prices.{name} = {share:g}: this is {100.0 * share:g} % a year; give a share"
    lives = {"life": site.prices.life}
    lives |= {f"lives.{kind}": life for kind, life in site.prices.lives.items()}
    for name, life in lives.items():
        if not LIVES[0] <= life <= LIVES[1]:
            yield f"prices.{name} = {life:g} years: barriers last for 10 to 100 years"


def _odd_price(where: str, field: Described, value: Any, usual: Any) -> Iterator[str]:
    """Yield the first price of a field that is far from the usual one."""
    known = getattr(usual, field.name)
    pairs = {field.name: (value, known)}
    if isinstance(value, dict):
        most = max(known.values())
        pairs = {f"{field.name}.{key}": (v, known.get(key, most)) for key, v in value.items()}
    for name, (price, order) in pairs.items():
        if price == 0.0 and field.name not in NO_CHARGE:
            yield f"{where}.{name} = 0 {field.unit}: it would cost nothing; give its price"
            return
        if price > 0.0 and not 1.0 / DOUBTED_PRICE_FACTOR <= price / order <= DOUBTED_PRICE_FACTOR:
            yield (
                f"{where}.{name} = {price:g} {field.unit}: a usual value is {order:g}; is it in "
                f"{field.unit}, and in EUR, not in thousands of EUR?"
            )
            return


def _odd_traffic(site: Site, written: Written) -> Iterator[str]:
    """Yield what is odd about the traffic."""
    traffic = site.traffic
    if traffic is None:
        return
    if traffic.speed < SLOW:
        yield (
            f"traffic.speed = {traffic.speed:g} km/h: is it in m/s? Standing traffic is not "
            "computed"
        )
    if traffic.stopped_late > 1.0:
        yield (
            f"traffic: {traffic.stopped_late:.2g} vehicles run into the debris of each release; "
            "the first of them warn those that follow; give run_into instead"
        )
    if traffic.fatality_value is not None and traffic.fatality_value < CHEAP:
        yield (
            f"traffic.fatality_value = {traffic.fatality_value:g}: give EUR; values of a prevented "
            "fatality are millions"
        )
    lengths = {name: table["section_length"] for name, table in written.items()
               if "section_length" in table}  # fmt: skip
    if lengths:
        name = min(lengths, key=lambda name: lengths[name])
        if traffic.section_length >= FARTHER * lengths[name]:
            yield (
                f"traffic.section_length = {traffic.section_length:g} m: events.{name} was counted "
                f"on section_length = {lengths[name]:g} m; give the length of road below this "
                "slope, or check that its rate holds for all of the road"
            )


def _size(site: Site, event: Event) -> float:
    """Return the length of the largest block of an event [m]."""
    source = site.source(event.source)
    _, (_, most) = blocks_of(event, source)
    return math.sqrt(most * (source.aspect[1] if source.band is not None else 1.0))


def _odd_source(site: Site, source: Source) -> Iterator[str]:
    """Yield what is odd about a source."""
    if not LIGHT <= source.density <= USUAL_DENSITIES:
        yield f"{source.words}.density = {source.density:g} kg/m3: rock has 2,000 to 3,100"
    if source.band is not None:
        start, end = source.band
        yield from _odd_band(site, source)
        if start > site.slope.toe:
            yield f"{source.words}.band = [{start:g}, {end:g}]: it lies below slope.toe"
        return
    for words, high in _hanging(site, source):
        yield f"{words}: it hangs {high:.2f} m above the ground; let it rest there"
    scale = _scale(source)
    if scale is not None and not 1.0 / SCALED <= scale <= SCALED:
        area = spaced_area(source.joints)
        yield (
            f"{source.words}.block_area = {source.block_area:g} m2: the spacings as given make "
            f"blocks of {area:.2g} m2, and are scaled by {scale:.2f}; leave block_area out to keep "
            "them"
        )
    if source.polygon and source.area / source.mean_block_area < 2.0:
        yield f"{source.words}.joints: the mass is hardly cut; are the spacings in metres?"


def _odd_band(site: Site, source: Source) -> Iterator[str]:
    """Yield the parts of a band that are flatter than the friction angle of their ground."""
    start, end = source.band or (0.0, 0.0)
    pairs = {frozenset((pair.first, pair.second)): pair.friction_deg for pair in site.interfaces}
    points, names = site.slope.chain()
    flat: list[tuple[float, float]] = []
    steep, rough = [], []
    for (a, ya), (b, yb), name in zip(points, points[1:], names, strict=False):
        low, high = max(a, start), min(b, end)
        usual = site.surfaces[name].friction_deg
        friction = pairs.get(frozenset((source.surface, name)), usual)
        angle = math.degrees(math.atan2(ya - yb, b - a))
        if low < high and angle < friction:
            if flat and flat[-1][1] == low:
                low = flat.pop()[0]
            flat.append((low, high))
            steep.append(angle)
            rough.append(friction)
    share = sum(high - low for low, high in flat) / (end - start)
    if share >= LEAST_SHARE:
        parts = " and ".join(f"{low:g} to {high:g}" for low, high in flat)
        yield (
            f"{source.words}.band = [{start:g}, {end:g}]: at x = {parts} m, {100.0 * share:.0f} % "
            f"of it, the ground is {_angles(steep)} deg steep, less than its friction angle of "
            f"{_angles(rough)} deg, so that blocks may stay where they are; leave this part out"
        )


def _angles(angles: Sequence[float]) -> str:
    """Return the least and the greatest of some angles [deg], in words."""
    low, high = f"{min(angles):.0f}", f"{max(angles):.0f}"
    return low if low == high else f"{low} to {high}"


def _hanging(site: Site, source: Source) -> Iterator[tuple[str, float]]:
    """Yield the name of each heap of rock in mid-air and its height above the ground [m]."""
    ground = site.profile.solid
    names, rocks = zip(*source.pieces(), strict=True)
    shapes = [shapely.Polygon(rock) for rock in rocks]
    heaps = shapely.union_all([shape.buffer(0.5 * HANGING) for shape in shapes])
    for heap in shapely.get_parts(heaps):
        inside = [k for k, shape in enumerate(shapes) if heap.intersects(shape)]
        high = min(float(shapes[k].distance(ground)) for k in inside)
        if high > HANGING:
            yield names[inside[0]], high


def _odd_event(site: Site, event: Event, table: Mapping[str, Any]) -> Iterator[str]:
    """Yield what is odd about an event, whose table may be known as it is written."""
    source = site.source(event.source)
    if event.rate >= DOUBTED_RATE:
        often = f"{event.rate:.3g} events a year on 100 m of slope"
        if "return_period" in table:
            period, length = table["return_period"], table.get("section_length")
            on = "" if length is None else f" on section_length = {length:g} m"
            yield (
                f"{event.words}.return_period = {period:g} years{on}: this makes {often}; if it "
                f"happens {period:g} times a year, write rate = {period:g}"
            )
        else:
            yield (
                f"{event.words}.rate = {event.rate:g}: this makes {often}; if it happens once in "
                f"{event.rate:g} years, write return_period = {event.rate:g}"
            )
    yield from _odd_volume(event, source, table)
    if source.band is not None and event.number[1] >= SLOW_LOOSE_BLOCKS:
        low, high = event.number
        yield (
            f"{event.words}.number = [{low}, {high}]: releases of so many blocks are slow; check "
            "that the rate is that of releases, not of blocks"
        )
    elif source.band is None and (count := event.block_count(source)) >= SLOW_MASS_BLOCKS:
        yield (
            f"{event.words}: a release has about {count:,.0f} blocks and is slow; give fewer, "
            f"larger blocks of {source.words} if this is enough"
        )


def _odd_volume(event: Event, source: Source, table: Mapping[str, Any]) -> Iterator[str]:
    """Yield what is odd about the size of the blocks of an event."""
    if source.edges is not None:
        volume = math.prod(source.edges)
        low, high, what = volume, volume, f"{source.words}.edges = {_numbers(source.edges)} m"
        unit = "are the edges in metres?"
    elif event.area is not None:
        low, high = (area**1.5 for area in event.area)
        given = table.get("volume")
        what = f"{event.words}.area = {_numbers(event.area)} m2"
        unit = "if the numbers are volumes, write volume"
        if given is not None:
            what, unit = f"{event.words}.volume = {_numbers(given)} m3", "is it in m3?"
    else:
        low, high = source.mean_block_area**1.5, 0.0  # a mass may have blocks of any size
        what, unit = f"{event.words}: {source.words}", "are its lengths in metres?"
    if high > HUGE:
        yield f"{what}: blocks of up to {high:.3g} m3; {unit}"
    if low < (1.0 + 1e-9) * TINY:
        weight = low * source.density
        yield f"{what}: blocks of {1e3 * low:.2g} litres, {weight:.2g} kg; {unit}"


def _numbers(values: Sequence[float]) -> str:
    """Return numbers as a list of TOML."""
    return f"[{', '.join(f'{value:.3g}' for value in values)}]"


def _odd_design(site: Site) -> Iterator[str]:
    """Yield that no event is a design event."""
    if not any(event.design for event in site.events):
        yield (
            "events: none has design = true, so that no target can be set; mark those that "
            "barriers must withstand"
        )


COLOURS = {
    "hard_rock": "#a9a39b",
    "weathered_rock": "#bfae95",
    "coarse_talus": "#d8c08a",
    "fine_scree": "#e6d6a8",
    "hard_soil": "#c79f73",
    "meadow": "#b5cf92",
    "asphalt": "#5f6670",
    "concrete": "#8f9aa5",
}
"""Colour of each ground of the library in pictures."""

OTHER_COLOURS = ("#e0b8a0", "#c4b7d6", "#b8d4d0", "#d9d9d9")
"""Colours of surfaces that name no ground."""

ZONED, STARTS = "#1c5aa0", "#b3261e"
"""Colours of the barrier zone and of sources."""

INCHES = (11.0, 4.2, 9.0)
"""Width, and least and greatest height of the picture."""


def draw(path: str | os.PathLike[str], site: Site) -> None:
    """Write a PNG of the whole section: ground by materials, sources, barrier zone and road."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    points = np.array(site.slope.points)
    long, tall = np.ptp(points, axis=0)
    wide, low, high = INCHES
    height = min(max(low, 1.9 + (wide - 1.0) * 1.2 * tall / long), high)
    with rc_context({**FONT, "text.parse_math": False}):  # names may have the sign of a dollar
        figure = Figure((wide, height), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        bottom = float(points[:, 1].min() - 0.12 * tall)
        _draw_ground(axes, site, bottom)
        _draw_sources(axes, site)
        _draw_forest(axes, site, 0.05 * tall)
        _draw_places(axes, site, 0.03 * tall)
        axes.set_aspect("equal")
        axes.set(
            xlim=(points[0, 0], points[-1, 0]),
            ylim=(bottom, float(points[:, 1].max()) + 0.14 * tall),
        )
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.set_title(site.name, loc="left", fontweight="bold", fontsize=12)
        _draw_survey(axes, site)
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=10)
        write_labels(figure, [(axes, [*_names(site), *_draw_standing(axes, site)])])
        save(figure, path)


def _draw_ground(axes: Axes, site: Site, bottom: float) -> None:
    """Fill the ground below each segment with the colour of its surface."""
    points, names = site.slope.chain()
    used = list(dict.fromkeys(names))
    unknown = iter(OTHER_COLOURS * len(used))
    colours = {n: COLOURS.get(site.surfaces[n].ground) or next(unknown) for n in used}
    told: set[str] = set()
    overhangs = any(b[0] < a[0] for a, b in pairwise(points))
    if overhangs:  # columns below its pieces would lie over one another
        frame = [(points[-1][0], bottom), (points[0][0], bottom)]
        axes.fill(*np.array([*points, *frame]).T, color="#e8e4dc", linewidth=0)
    for (a, b), name in zip(pairwise(points), names, strict=True):
        label = None if name in told else _called(site, name)
        told.add(name)
        if overhangs:
            axes.plot([a[0], b[0]], [a[1], b[1]], color=colours[name], linewidth=6, label=label,
                      solid_capstyle="round", zorder=1.5)  # fmt: skip
        else:
            axes.fill([a[0], b[0], b[0], a[0]], [a[1], b[1], bottom, bottom],
                      facecolor=colours[name], edgecolor=colours[name], linewidth=0.8,
                      label=label)  # fmt: skip
    axes.plot(*np.array(points).T, color="#333333", linewidth=1.0, zorder=2)
    axes.plot(*np.array(site.slope.points).T, ".", color="#333333", markersize=4, zorder=2.1,
              label="points of the profile")  # fmt: skip


def _draw_sources(axes: Axes, site: Site) -> None:
    """Draw bands as lines on the ground, and the blocks of masses."""
    for source in site.sources:
        if source.band is None:
            blocks = [Block(outline) for outline in source.cut(seeds.generator(0, 0))]
            for block in blocks:
                axes.fill(*block.vertices.T, facecolor=ROCK, edgecolor="white", linewidth=0.4,
                          zorder=3)  # fmt: skip
    for i, corners in enumerate(sources(site)):
        axes.plot(*corners.T, color=STARTS, linewidth=3.0, zorder=3.2, solid_capstyle="butt",
                  label="rock starts here" if i == 0 else None)  # fmt: skip


def _draw_forest(axes: Axes, site: Site, tall: float) -> None:
    """Draw a stem [m] at each of some even places of the forests; the places are no survey."""
    length = float(np.ptp(np.array(site.slope.points)[:, 0]))
    for i, one in enumerate(site.forest):
        count = max(2, round(DRAWN_STEMS * (one.end - one.start) / length))
        x = np.linspace(one.start, one.end, count)
        foot = np.array([site.profile.height(at) for at in x.tolist()])
        axes.vlines(x, foot, foot + tall, color=WOOD, linewidth=1.6, zorder=2.5,
                    label="forest" if i == 0 else "")  # fmt: skip


def _names(site: Site) -> list[Label]:
    """Return the names of sources and where to write them: at the lower end of bands."""
    found = []
    for source in site.sources:
        if source.band is not None:
            at = source.band[1], site.profile.height(source.band[1])
        else:
            outline = source.outline
            at = tuple(outline[outline[:, 1].argmax()].tolist())
        found.append(Label(source.name, at, STARTS))
    return found


def _draw_standing(axes: Axes, site: Site) -> list[Label]:
    """Draw the barriers that stand already and return their labels."""
    built = site.standing()
    _, moved = earthworks(site.profile, built, site.soil)
    labels = []
    for barrier, words in zip(built, site.labels(), strict=True):
        outline = (
            moved[barrier] if isinstance(barrier, Earthwork) else barrier.outline(site.profile)
        )
        draw_barrier(axes, barrier, outline, colour=OLD, old=True)
        labels.append(Label(words, top_of(outline), OLD))
    return labels


def _draw_places(axes: Axes, site: Site, lift: float) -> None:
    """Draw the road and the parts of the zone, and name the toe."""
    ground = site.profile

    def line(start: float, end: float, up: float) -> tuple[Floats, Floats]:
        inner = [x for x, _ in site.slope.points if start < x < end]
        at = np.array([start, *inner, end])
        return at, np.array([ground.height(x) + up for x in at])

    road, toe = site.road, site.slope.toe
    axes.plot(*line(road.start, road.end, 0.0), color=ROAD, linewidth=5, zorder=3.1,
              solid_capstyle="butt", label="road")  # fmt: skip
    for i, (low, high) in enumerate(site.rooms):
        axes.plot(*line(low, high, lift), color=ZONED, linewidth=2.5, zorder=3.1,
                  label="barriers may stand here" if i == 0 else None)  # fmt: skip
    axes.annotate("toe", (toe, ground.height(toe)), xytext=(0, -22), textcoords="offset points",
                  ha="center", fontsize=10, zorder=6,
                  arrowprops={"arrowstyle": "->", "color": "black"})  # fmt: skip


def _draw_survey(axes: Axes, site: Site) -> None:
    """Add the coordinates of the survey on the upper and the right side, if they are others."""
    from matplotlib.ticker import FuncFormatter

    origin = site.origin
    if not origin.surveyed:
        return
    plain = FuncFormatter(lambda value, _: f"{value:,.0f}")
    if origin.chainage or origin.reversed:
        ways: Any = origin.chainage_of, origin.x_of
        above = axes.secondary_xaxis("top", functions=ways)
        above.set_xlabel("chainage of the survey [m]")
        above.xaxis.set_major_formatter(plain)
    if origin.elevation:
        level = Origin(origin.elevation)
        ways = level.chainage_of, level.x_of
        beside = axes.secondary_yaxis("right", functions=ways)
        beside.set_ylabel("elevation of the survey [m]")
        beside.yaxis.set_major_formatter(plain)
