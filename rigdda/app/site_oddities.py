"""Values of a site that may be mistakes, each with its field and what to check."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import shapely

from rigdda import Event, Site, Source
from rigdda.app.site_check import Trial, blocks_of, joint_scale, longest_block
from rigdda.barriers.fence import FENCE_CLASSES
from rigdda.envs.barrier_formulas import mean_scene
from rigdda.fields import Described, described, parse
from rigdda.files import read
from rigdda.ground.grounds import GROUNDS
from rigdda.ground.surface import WITHOUT_GROUND
from rigdda.model import site_names
from rigdda.model.existing import Existing
from rigdda.model.joints import spaced_area
from rigdda.model.soundness import LEAST_BEYOND
from rigdda.model.survey import spike_words, spikes
from rigdda.rounding import chainage

Written = Mapping[str, Mapping[str, Any]]
"""Tables of events as they are written, by the name of the event."""

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
"""Height above which it is doubted that stems take their energy [m]."""

HUGE = 20.0
"""Volume of a block above which an area may have been meant for one [m3]."""

HANGING = 0.05
"""Distance from the ground above which rock hangs in mid-air [m]."""

TINY = 5e-4
"""Volume of a block up to which its unit is doubted [m3]: half a litre weighs 1.3 kg."""

SLOW_LOOSE_BLOCKS, SLOW_MASS_BLOCKS = 100, 1000
"""Numbers of loose blocks, and of blocks of a mass, from which on a release is slow."""

LEAST_SHARE = 0.01
"""Share of a band from which it is reported that blocks may stay where they are on it [-]."""

FARTHER = 3.0
"""Length of the road over that of the slope on which events were counted, from which on it is
doubted whether their rates hold for all of the road."""

TALLEST = {"wall": 6.0, "gravity_wall": 8.0, "embankment": 12.0}
"""Heights above which a barrier is unusual for its kind [m]; assumed."""

SIZE_LIMITS = {"height": "max_height", "depth": "max_depth", "width": "max_width",
          "thickness": "max_thickness"}  # fmt: skip
"""Limits of the zone for sizes of barriers."""

DOUBTED_BASE_FRICTION = 5.0
"""Greatest plausible excess of the base friction of a wall over that of its own surface [deg]."""

DOUBTED_PRICE_FACTOR = 20.0
"""Factor above or below a usual price beyond which its unit is doubted."""

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

COSTLY_REMOVAL = 5000.0
"""Cost of the removal of a barrier above which its unit is doubted [EUR/m]."""

LAWS = ("friction_deg", "restitution", "rolling", "roughness")
"""Values of a surface for which its ground has a plausible range."""

SHORT = 1.2 * LEAST_BEYOND
"""Length of the ground beyond the road that leaves a run-out little room [m]."""

FALLING_DEG = 10.0
"""Inclination of the last segment of the ground above which rock continues beyond it [deg]."""

SCALED = 1.2
"""Factor on the spacings of joints from which it is reported, as well as its inverse."""

SLOW = 25.0
"""Speed below which a unit is doubted [km/h]."""

CHEAP = 1e5
"""Value of a prevented fatality below which its unit is doubted [EUR]."""

LEAST_ROOM = 3.0
"""Length of the zone below which there is little to choose [m]."""

LEAST_FENCE_CLASS = 500
"""Energy class of the least fence that there should be room for [kJ]."""


def written_events(source: str) -> Written:
    """Return the table of each event by its name, as it is written in a file or a built-in site.

    A site contains the area and the rate that follow from a volume and a return period, but not the
    values that were written. The result is empty for other names.
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
        Tables of the events as they are written, see `written_events`. Messages then give the keys
        and values that are written there.
    """
    return [
        *_odd_profile(site),
        *_odd_surfaces(site),
        *_odd_zone(site),
        *_odd_foundation(site),
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
            "above the road when releases end; use a longer duration"
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
        yield f"slope.points[{k}] = [{chainage(x[k])}, {y[k]:g}]: {spike_words(height)}"
    if wide > WIDE or wide < NARROW:
        yield f"road: it is {wide:g} m wide; are chainages in metres, not in feet or kilometres?"
    above = site.profile.height(toe) - foot
    if tall > 0.0 and above > 0.5 * tall:
        yield (
            f"slope.toe = {chainage(toe)}: it is {above:.1f} m above the road, in the upper half "
            "of the slope; give the chainage of its foot, not of its crest"
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
            "rock stops if harm below the road matters"
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
    low, high, whose = _plausible("", "friction_deg")
    for name, rebound in site.lumped.items():
        angle = rebound.friction_deg
        if angle != 0.0 and not low <= angle <= high:
            yield (
                f"lumped.{name}.friction_deg = {angle:g}: {low:g} to {high:g} is plausible for "
                f"{whose}; correct it"
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
            f"barrier_zone: only {longest:.1f} m are free of loose rock; the best place will lie on"
            " an end of the zone"
        )
    room, needed = site.road.start - rooms[0][0], FENCE_CLASSES[LEAST_FENCE_CLASS].elongation
    if room < needed:
        yield (
            f"barrier_zone.start = {chainage(zone.start)}: a fence of {LEAST_FENCE_CLASS} kJ gives "
            f"way by {needed:g} m, and there are {room:.1f} m up to the road; begin the zone "
            "farther uphill"
        )
    size = max(longest_block(event, site.source(event.source)) for event in site.events)
    for name, factor in (("max_height", 1.5), ("max_depth", 1.0), ("max_width", 1.5)):
        value = getattr(zone, name)
        if value < factor * size:
            yield (
                f"barrier_zone.{name} = {value:g}: the largest block is {size:.1f} m long, so that "
                "the best barrier will lie on this bound; allow more if it can be built"
            )


def _odd_foundation(site: Site) -> Iterator[str]:
    """Yield missing prices of excavation, and doubtful friction under walls, in the zone."""
    zone, prices = site.barrier_zone, site.prices.ditch
    points, names = site.slope.chain()
    parts = zip(points, points[1:], names, strict=False)
    ground = dict.fromkeys(
        name for (a, _), (b, _), name in parts if min(a, b) < zone.end and max(a, b) > zone.start
    )
    for name in ground:
        if name not in prices:
            yield (
                f"prices.ditch has no price for {name!r}: a ditch there costs as much as in the "
                f"most expensive ground, {max(prices.values()):g} EUR/m3; add a price for it"
            )
    scene = mean_scene(site)
    wall = scene.barrier_surface
    if wall == "concrete" or wall not in scene.surfaces:
        return
    usual = scene.surfaces[wall].friction_deg + DOUBTED_BASE_FRICTION
    for name in ground:
        base = scene.friction_deg(wall, name)
        if base > usual:
            yield (
                f"surfaces has no concrete: a gravity wall stands on {name!r} with a base friction "
                f"of {base:g} deg, which describes impacts of blocks; add [surfaces.concrete] with "
                'ground = "concrete"'
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
            yield (
                f"{where}.end = {chainage(one.end)}: all rock starts farther downhill, at x = "
                f"{chainage(first)} m"
            )
        if one.start < site.road.end and one.end > site.road.start:
            road = f"x = {chainage(site.road.start)} to {chainage(site.road.end)} m"
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
                f"existing[{i}].x = {chainage(barrier.x)}: the {barrier.words} gives way by up to "
                f"{barrier.deflection:g} m, {end - site.road.start:.1f} m onto the road; a new one "
                "would not be allowed there"
            )
    for i, one in enumerate(site.existing):
        yield from _odd_sizes(site, f"existing[{i}]", one)
        if (one.removal or 0.0) > COSTLY_REMOVAL:
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
            "the first of them would warn those that follow; give run_into instead"
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


def _odd_source(site: Site, source: Source) -> Iterator[str]:
    """Yield what is odd about a source."""
    if not LIGHT <= source.density <= USUAL_DENSITIES:
        yield f"{source.words}.density = {source.density:g} kg/m3: rock has 2,000 to 3,100"
    if source.band is not None:
        start, end = source.band
        yield from _odd_band(site, source)
        if start > site.slope.toe:
            yield (
                f"{source.words}.band = [{chainage(start)}, {chainage(end)}]: it lies below "
                "slope.toe"
            )
        return
    for words, high in _hanging(site, source):
        yield f"{words}: it hangs {high:.2f} m above the ground; let it rest there"
    scale = joint_scale(source)
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
        parts = " and ".join(f"{chainage(low)} to {chainage(high)}" for low, high in flat)
        yield (
            f"{source.words}.band = [{chainage(start)}, {chainage(end)}]: at x = {parts} m, "
            f"{100.0 * share:.0f} % of it, the ground is {_angles(steep)} deg steep, less than its "
            f"friction angle of {_angles(rough)} deg, so that blocks may stay where they are; "
            "leave this part out"
        )


def _angles(angles: Sequence[float]) -> str:
    """Return the least and the greatest of some angles [deg], in words."""
    low, high = (f"{angle:.1f}".removesuffix(".0") for angle in (min(angles), max(angles)))
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
        low, high = (area**1.5 for area in blocks_of(event, source)[1])
        what = f"{source.words}.edges = {_numbers(source.edges)} m"
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
