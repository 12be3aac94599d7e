"""What a site file states, as blocks of the report: section, events, grounds, prices, traffic."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from rigdda import Site, Surface
from rigdda.app import site_check, site_picture
from rigdda.app.reports.html_blocks import (
    Block,
    Items,
    Paragraph,
    Table,
    listed,
    picture,
    plain,
)
from rigdda.app.reports.wording import figure
from rigdda.fields import described
from rigdda.ground.grounds import GROUNDS, Span
from rigdda.ground.prices import Consequences, Prices
from rigdda.model.traffic import USUAL_VULNERABILITY

PROPERTIES = {
    "friction_deg": ("friction angle", "deg"),
    "restitution": ("restitution", "-"),
    "rolling": ("rolling resistance", "-"),
    "restitution_speed": ("impact speed of half restitution", "m/s"),
    "roughness": ("depth of pits", "m"),
}
"""Words and units of the properties of a ground."""

SPREADS = {
    "friction_deg": "friction_sd_deg",
    "restitution": "restitution_sd",
    "rolling": "rolling_sd",
}
"""Fields with the standard deviations of properties that vary."""


def site_blocks(site: Site) -> Iterator[Block]:
    """Yield the description of the site, a section, and sentences on what was computed."""
    yield Paragraph(site.description)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "site.png"
        site_picture.draw(file, site)
        caption = "Ground, sources of rock, barrier zone and road, to scale."
        yield picture(file.with_suffix(".svg"), "Section of the site", caption, "site")
    yield Items([_sentence(line, site.name) for line in site_check.facts(site)])


def _sentence(line: str, name: str) -> str:
    """Return a line as a sentence; one that begins with the name of the site keeps it."""
    return f"{line}." if line.startswith(name) else f"{line[0].upper()}{line[1:]}."


def event_table(site: Site) -> Table:
    """Return the table of the events with their rates and sizes."""
    rows = []
    for event in site.events:
        source = site.source(event.source)
        number, areas = site_check.blocks_of(event, source)
        volumes = [area**1.5 for area in areas]
        rows.append((
            event.name,
            source.name,
            "yes" if event.design else "no",
            figure(event.rate),
            figure(1.0 / event.rate) if event.rate > 0.0 else "never",
            number,
            site_check.range_of(volumes),
            site_check.range_of([volume * source.density / 1e3 for volume in volumes]),
            *map(site_check.range_of, site_check.size_of_release(event, source)),
        ))  # fmt: skip
    head = ("event", "source", "design event", "1/year", "years", "blocks", "m³", "t", "width [m]",
            "release [m³]")  # fmt: skip
    words = (
        "How often each event happens on 100 m of slope, as a rate and as a return period, and the "
        "number, volume and mass of its blocks. A block is as long along the road as the root of "
        "its cross-section. A release of several blocks is a strip of the given width: its volume, "
        "on which closure and clearing depend, is the sum of the cross-sections times this width. "
        "Targets apply to design events."
    )
    return listed("Events", words, head, rows, head[3:])


def ground_table(site: Site) -> Table:
    """Return the table of the surfaces: values, plausible ranges and their sources."""
    rows = [row for name in _used(site) for row in _surface(name, site.surfaces[name])]
    words = (
        "Values of rigid blocks with corners, with their plausible ranges where the ground is in "
        "the library. ±: standard deviation from release to release. They are the least certain "
        "input; where a source is “assumed”, only an observation can confirm the value."
    )
    head = ("surface", "property", "value", "range", "source")
    return listed("Ground", words, head, rows, ("value", "range"))


def _used(site: Site) -> list[str]:
    """Return the surfaces of the ground, from the crest on, and then all others of the site."""
    return [*dict.fromkeys((*site.slope.chain()[1], *site.surfaces))]


def _surface(name: str, surface: Surface) -> Iterator[tuple[str, ...]]:
    """Yield a row for each property of a surface."""
    ground = GROUNDS.get(surface.ground)
    called = f"{name} ({ground.words})" if ground else name
    for field, (meaning, unit) in PROPERTIES.items():
        value = getattr(surface, field)
        if value is None or (value == 0.0 and field == "roughness"):
            continue
        spread = getattr(surface, SPREADS[field]) if field in SPREADS else 0.0
        text = plain(value) + (f"\u00a0±\u00a0{plain(spread)}" if spread else "")
        known = getattr(ground, field) if ground else None
        known = known if isinstance(known, Span) else None
        ends = f"{plain(known.low)}\u00a0to\u00a0{plain(known.high)}" if known else "-"
        yield called, f"{meaning} [{unit}]", text, ends, _source(value, known)
        called = ""


def _source(value: float, known: Span | None) -> str:
    """Return where a value comes from."""
    if known is None:
        return "site file"
    if value == known.typical:
        return known.source
    return f"site file; library: {plain(known.typical)}, {known.source}"


def price_blocks(site: Site) -> Iterator[Block]:
    """Yield the tables of prices, of the cost of rock on the road and of the traffic."""
    yield _value_table("Prices of barriers", "price", site.prices)
    yield _value_table("Cost of rock on the road", "price", site.consequences)
    if site.traffic is not None:
        usual: dict[str, Any] = {}
        if site.traffic.run_into is None and site.traffic.decision_sight_distance is None:
            usual["decision_sight_distance"] = round(site.traffic.stopping, 1)
        if site.traffic.vulnerability is None:
            usual["vulnerability"] = USUAL_VULNERABILITY
        yield _value_table("Traffic", "quantity", site.traffic, usual)


def _value_table(
    title: str, what: str, given: msgspec.Struct, computed: Mapping[str, Any] = MappingProxyType({})
) -> Table:
    """Return the table of values of a site file, each with its unit and whether it is a default.

    `computed` has the values that are used for keys which are not given.
    """
    usual = {field.name: _default(field) for field in msgspec.structs.fields(given)}
    usual |= computed
    rows = []
    for field in described(type(given)):
        value = getattr(given, field.name)
        value = computed.get(field.name) if value is None else value
        if field.name == "source" or value in ("", None):
            continue
        same = value == usual[field.name]
        unit = f" [{field.unit}]" if field.unit not in ("", "-") else ""
        rows.append(
            (field.text.rstrip(".") + unit, _written(value), "default" if same else "given")
        )
    source = getattr(given, "source", "")
    words = f"Source: {source}." if source else ""
    return listed(title, words, (what, "value", "from"), rows)


def _default(field: msgspec.structs.FieldInfo) -> Any:
    """Return the default of a field; `msgspec.NODEFAULT` if it has none."""
    if field.default_factory is not msgspec.NODEFAULT:
        return field.default_factory()
    return field.default


def _written(value: Any) -> str:
    """Return a number, or a table of numbers, as text."""
    if isinstance(value, dict):
        return "; ".join(
            f"{name.replace('_', ' ')}: {_written(one)}" for name, one in value.items()
        )
    if isinstance(value, tuple):
        return f"[{', '.join(map(_written, value))}]"
    return f"{value:,.10g}" if isinstance(value, int | float) else str(value)


def default_values(site: Site) -> list[str]:
    """Return warnings about prices that are still the defaults of the program."""
    found = []
    for subject, given, usual in (
        ("The prices of barriers are", site.prices, Prices()),
        ("The costs of rock on the road are", site.consequences, Consequences()),
    ):
        if given == usual:
            found.append(
                f"{subject} the defaults of the program, which are orders of magnitude: replace "
                "them before a decision."
            )
    return found


def site_differences(site: Site, other: Site) -> list[str]:
    """Return what differs between two sites, one line for each value."""
    return [*_differ("", msgspec.to_builtins(site), msgspec.to_builtins(other))]


def _differ(path: str, one: Any, other: Any) -> Iterator[str]:
    """Yield the values that differ, with their paths in the site file."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys((*one, *other)):
            yield from _differ(f"{path}.{key}".lstrip("."), one.get(key), other.get(key))
    elif (
        isinstance(one, list | tuple) and isinstance(other, list | tuple) and len(one) == len(other)
    ):
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            name = a.get("name", i) if isinstance(a, dict) else i
            yield from _differ(f"{path}.{name}", a, b)
    elif one != other:
        yield f"{path} = {_short(other)} instead of {_short(one)}"


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def stated_assumptions(site: Site) -> Iterator[Block]:
    """Yield the assumptions: events, grounds and prices, with their sources."""
    for warning in default_values(site):
        yield Paragraph(warning, "warning")
    yield event_table(site)
    yield ground_table(site)
    yield from price_blocks(site)
