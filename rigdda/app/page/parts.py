"""Parts of a site that the page adds and removes: stretches of ground, source bands and events.

Each function returns the text of a site file after the change. `Project.change_site` checks it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec
import tomlkit

from rigdda import BadInput, Site, fields
from rigdda.app.page import edits
from rigdda.ground.grounds import GROUNDS
from rigdda.model import loose_blocks
from rigdda.model.site_tables import Event, Stretch
from rigdda.model.source import Source
from rigdda.rounding import chainage

STRETCHES = ("slope", "surfaces")
"""Path of the stretches in a site file."""

PERIOD, VOLUME = 10.0, (0.1, 1.0)
"""Return period [years] and volumes [m3] of the event of a new band if no event comes from the band
that it is like: placeholders that the user replaces."""

LEAST_ROOM = 0.6
"""Least length of the slope in which a new band is put, a third of which it covers [m]."""


def with_values(text: str, site: Site, values: Mapping[tuple[str | int, ...], Any]) -> str:
    """Return the text with other values at several paths, see `edits.with_values`.

    Events that the file leaves out are written first if one of the values is theirs.
    """
    if any(path[0] == "events" for path in values):
        text = _with_events(text, site)
    return edits.with_values(text, values)


def laid(stretches: Sequence[Stretch], new: Stretch) -> list[Stretch]:
    """Return the stretches of a slope after another is laid over them, which cuts them.

    Raises
    ------
    BadInput
        If the new stretch does not end beyond its start.
    """
    if not new.end > new.start:
        raise BadInput("end of the stretch", new.end, f"let it end beyond {chainage(new.start)}")
    found = [new]
    for old in stretches:
        pieces = (old.start, min(old.end, new.start)), (max(old.start, new.end), old.end)
        found += [Stretch(low, high, old.surface) for low, high in pieces if high > low]
    return sorted(found, key=lambda one: one.start)


def with_stretch(text: str, site: Site, ground: str, start: float, end: float) -> str:
    """Return the text with a stretch of a ground of the library; it cuts other stretches.

    A surface that has this ground is used if the site has one, and otherwise added.

    Raises
    ------
    BadInput
        If the ground is not in the library, the stretch is not on the slope, or it has no length.
    """
    if ground not in GROUNDS:
        raise BadInput("ground", ground, "choose one of the library")
    first, last = site.slope.points[0][0], site.slope.points[-1][0]
    for words, value in (("start", start), ("end", end)):
        if not first <= value <= last:
            hint = f"stay on the section, between {first:g} and {last:g}"
            raise BadInput(f"{words} of the stretch", value, hint)
    known = next((name for name, s in site.surfaces.items() if s.ground == ground), None)
    name = known or _free(ground, site.surfaces)
    if known is None:
        text = edits.with_value(text, ("surfaces", name, "ground"), ground)
    return _with_stretches(text, laid(site.slope.surfaces, Stretch(start, end, name)))


def without_stretch(text: str, site: Site, place: int) -> str:
    """Return the text without a stretch, so that the ground there is that of the slope."""
    return _with_stretches(text, [s for i, s in enumerate(site.slope.surfaces) if i != place])


def _with_stretches(text: str, stretches: Iterable[Stretch]) -> str:
    rows = [msgspec.to_builtins(stretch) for stretch in stretches]
    return edits.with_rows(text, STRETCHES, rows)


def with_band(text: str, site: Site) -> str:
    """Return the text with another source band and an event from it, both like the last ones.

    The band lies in the middle of the longest part of the slope above its toe without a band and
    without an existing barrier.

    Raises
    ------
    BadInput
        If there is no room for it.
    """
    text = _with_events(text, site)
    name = _free("band", (source.name for source in site.sources))
    bands = [k for k, source in enumerate(site.sources) if source.band is not None]
    like = site.sources[bands[-1]] if bands else Source(name, band=(0.0, 1.0))
    alike = [k for k, event in enumerate(site.events) if bands and event.source == like.name]
    source = _table(text, "sources", bands[-1]) if bands else {}
    event = _table(text, "events", alike[-1]) if alike else _usual_event(like)
    event |= {"name": _free(f"block, {name}", site.event_names), "source": name}
    reach = loose_blocks.reach(like, fields.read(Event, event, "events"))
    source |= {"name": name, "band": list(_room_for_band(site, reach))}
    return edits.with_table(edits.with_table(text, "sources", source), "events", event)


def _usual_event(source: Source) -> dict[str, Any]:
    """Return the values of an event of usual rate and volumes, unless its source gives their size.

    The user replaces them.
    """
    sizes = {"volume": list(VOLUME)} if source.edges is None else {}
    return {"return_period": PERIOD} | sizes


def _room_for_band(site: Site, reach: float) -> tuple[float, float]:
    """Return the middle third of the longest part of the slope where a band may lie [m].

    Its blocks reach farther than the band on either side [m]: they must lie on the ground, uphill
    of the road and clear of existing barriers.
    """
    first, last = site.slope.points[0][0] + reach, min(site.slope.toe, site.road.start - reach)
    taken = [source.band for source in site.sources if source.band is not None]
    for barrier in site.existing_barriers:
        start, end = barrier.works(site.profile)
        taken.append((start - reach, end + reach))
    gaps, free = [], first
    for low, high in sorted(taken):
        gaps.append((free, min(low, last)))
        free = max(free, high)
    low, high = max([*gaps, (free, last)], key=lambda gap: gap[1] - gap[0])
    if high - low < LEAST_ROOM:
        hint = (
            "make room for it: no part of the slope above its toe that is free of bands and "
            "existing barriers is long enough for its blocks"
        )
        raise BadInput("new source band", None, hint)
    third = (high - low) / 3.0
    return round(low + third, 1), round(high - third, 1)


def without_source(text: str, site: Site, place: int) -> str:
    """Return the text without a source and without the events from it."""
    name, text = site.sources[place].name, _with_events(text, site)
    for k in reversed(range(len(site.events))):
        if site.events[k].source == name:
            text = without_event(text, site, k)
    return edits.without(text, ("sources", place))


def renamed_source(text: str, site: Site, place: int, name: str) -> str:
    """Return the text with another name of a source, which its events follow."""
    text = _with_events(text, site)
    values: dict[tuple[str | int, ...], Any] = {("sources", place, "name"): name}
    for k, event in enumerate(site.events):
        if event.source == site.sources[place].name:
            values["events", k, "source"] = name
    return edits.with_values(text, values)


def with_event(text: str, site: Site) -> str:
    """Return the text with another event like the last one."""
    text, last = _with_events(text, site), len(site.events) - 1
    event = _table(text, "events", last)
    event["name"] = _free(site.events[last].name, site.event_names)
    return edits.with_table(text, "events", event)


def without_event(text: str, site: Site, place: int) -> str:
    """Return the text without an event, and without the factors of meshes on its rate."""
    text = _with_events(text, site)
    name = _table(text, "events", place)["name"]
    for k, mesh in enumerate(tomlkit.parse(text).unwrap().get("meshes", [])):
        if name in mesh.get("factors", {}):
            text = edits.without(text, ("meshes", k, "factors", name))
    return edits.without(text, ("events", place))


def renamed_event(text: str, site: Site, place: int, name: str) -> str:
    """Return the text with another name of an event, which the factors of meshes follow."""
    text = _with_events(text, site)
    before = _table(text, "events", place)["name"]
    for k, mesh in enumerate(tomlkit.parse(text).unwrap().get("meshes", [])):
        if before in mesh.get("factors", {}):
            own = {name if key == before else key: v for key, v in mesh["factors"].items()}
            text = edits.with_value(text, ("meshes", k, "factors"), own)
    return edits.with_value(text, ("events", place, "name"), name)


def _with_events(text: str, site: Site) -> str:
    """Return the text with the events of the site, which a file may leave out."""
    if tomlkit.parse(text).get("events"):
        return text
    for event in site.events:
        values = msgspec.to_builtins(event)
        text = edits.with_table(
            text, "events", {key: value for key, value in values.items() if value is not None}
        )
    return text


def _table(text: str, name: str, place: int) -> dict[str, Any]:
    """Return the values of a table in a list of the file."""
    found: dict[str, Any] = tomlkit.parse(text).unwrap()[name][place]
    return found


def _free(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not taken: the name itself, or with another number at its end."""
    stem, known, number, free = re.sub(r" \d+$", "", name), set(taken), 1, name
    while free in known:
        number += 1
        free = f"{stem} {number}"
    return free
