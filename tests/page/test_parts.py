"""Parts of a site that the page adds and removes."""

from pathlib import Path

import pytest

import rigdda
from rigdda import BadInput, Site, sites
from rigdda.app.page import parts
from rigdda.model import loose_blocks, site_names
from rigdda.model.site_tables import Stretch

INLINE = """
name = "inline"
description = ""
sources = [{name = "rock", band = [3.0, 6.0]}]
events = [{name = "block", rate = 1.0, volume = [0.1, 0.5]}]
slope = {points = [[0, 60], [10, 50], [40, 5], [60, 0], [140, -1]], toe = 50.0}
road = {start = 60.0, end = 68.0}
barrier_zone.start = 12.0
barrier_zone.end = 60.0
surfaces.rock.ground = "hard_rock"
surfaces.soil = {ground = "hard_soil"}
"""
"""A site file without headers of tables."""

WITHOUT_EVENTS = [name for name in site_names.names() if "[[events]]" not in sites.text(name)]
"""Built-in sites whose files leave their events out."""

BLOCKS = """
[[slope.surfaces]]
start = 10.0
end = 20.0
surface = "soil"
"""


def _ends(site):
    return [(s.start, s.end, s.surface) for s in site.slope.surfaces]


@pytest.mark.parametrize(
    ("new", "expected"),
    [
        (
            (12.0, 15.0),
            [(10.0, 12.0, "a"), (12.0, 15.0, "new"), (15.0, 20.0, "a"), (20.0, 30.0, "b")],
        ),
        ((5.0, 25.0), [(5.0, 25.0, "new"), (25.0, 30.0, "b")]),
        ((10.0, 20.0), [(10.0, 20.0, "new"), (20.0, 30.0, "b")]),
        ((40.0, 41.0), [(10.0, 20.0, "a"), (20.0, 30.0, "b"), (40.0, 41.0, "new")]),
    ],
)  # fmt: skip
def test_a_stretch_cuts_those_that_it_is_laid_over(new, expected):
    before = [Stretch(10.0, 20.0, "a"), Stretch(20.0, 30.0, "b")]
    found = parts.laid(before, Stretch(*new, "new"))
    assert [(s.start, s.end, s.surface) for s in found] == expected


def test_a_stretch_uses_the_surface_of_its_ground_or_adds_one():
    text, site = sites.text("verge"), Site.load("verge")
    known = next(name for name, s in site.surfaces.items() if s.ground is not None)
    same = parts.with_stretch(text, site, site.surfaces[known].ground, 6.0, 7.0)
    assert (6.0, 7.0, known) in _ends(Site.parse(same, "site.toml"))
    new = parts.with_stretch(text, site, "coarse_talus", 6.0, 7.0)
    changed = Site.parse(new, "site.toml")
    assert (6.0, 7.0, "coarse_talus") in _ends(changed)
    assert changed.surfaces["coarse_talus"].ground == "coarse_talus"
    place = _ends(changed).index((6.0, 7.0, "coarse_talus"))
    without = Site.parse(parts.without_stretch(new, changed, place), "site.toml")
    assert without.slope.surface_at(6.5) == without.slope.surface


def test_stretches_written_as_tables_stay_a_valid_file():
    text, site = sites.text("quick"), Site.load("quick")
    for k in range(len(site.slope.surfaces)):
        text = parts.without_stretch(text, site, 0)
        site = Site.parse(text, "site.toml")
        assert len(site.slope.surfaces) == len(Site.load("quick").slope.surfaces) - k - 1
    start = text.index("[slope]")
    end = text.index("\n[", start)
    kept = [line for line in text[start:end].splitlines() if not line.startswith("surfaces")]
    surface = next(iter(site.surfaces))
    tables = "\n".join(kept) + BLOCKS.replace("soil", surface)
    text = text[:start] + tables + text[end:]
    site = Site.parse(text, "site.toml")
    changed = Site.parse(parts.with_stretch(text, site, "concrete", 12.0, 13.0), "site.toml")
    assert _ends(changed) == [
        (10.0, 12.0, surface), (12.0, 13.0, "concrete"), (13.0, 20.0, surface)
    ]  # fmt: skip


@pytest.mark.parametrize(("start", "end"), [(-50.0, 5.0), (5.0, 5e3), (8.0, 8.0)])
def test_a_stretch_off_the_section_or_without_length_is_refused(start, end):
    with pytest.raises(BadInput, match="stretch"):
        parts.with_stretch(sites.text("verge"), Site.load("verge"), "concrete", start, end)


@pytest.mark.parametrize("name", ["quick", "verge"])
def test_a_band_comes_with_an_event_and_goes_with_it(name):
    text, site = sites.text(name), Site.load(name)
    added = parts.with_band(text, site)
    more = Site.parse(added, "site.toml")
    band, event = more.sources[-1], more.events[-1]
    assert (len(more.sources), len(more.events)) == (len(site.sources) + 1, len(site.events) + 1)
    assert event.source == band.name
    assert site.slope.points[0][0] < band.band[0] < band.band[1] < site.slope.toe
    other = Site.parse(parts.renamed_source(added, more, len(site.sources), "spur"), "site.toml")
    assert (other.sources[-1].name, other.events[-1].source) == ("spur", "spur")
    fewer = Site.parse(parts.without_source(added, more, len(site.sources)), "site.toml")
    assert (fewer.sources, fewer.events) == (site.sources, site.events)


def test_events_are_copied_under_names_that_are_free():
    text, site = sites.text("verge"), Site.load("verge")
    last = site.events[-1]
    for number in (2, 3):
        text = parts.with_event(text, site)
        site = Site.parse(text, "site.toml")
        assert site.events[-1].source == last.source
        assert site.events[-1].rate == last.rate
        assert len(set(site.event_names)) == len(site.events)
        assert site.events[-1].name.endswith(str(number))
    fewer = Site.parse(parts.without_event(text, site, len(site.events) - 1), "site.toml")
    assert fewer.events == site.events[:-1]


def test_factors_of_meshes_follow_their_events() -> None:
    text = Path(rigdda.__file__).parent.joinpath("sites/verge.toml").read_text()
    site = Site.load("verge")
    (mesh,) = [m for m in site.meshes if site.events[0].name in m.factors][:1]
    renamed = Site.parse(parts.renamed_event(text, site, 0, "stones"), "site.toml")
    assert renamed.events[0].name == "stones"
    assert renamed.mesh(mesh.name).factors["stones"] == mesh.factors[site.events[0].name]
    fewer = Site.parse(parts.without_event(text, site, 0), "site.toml")
    assert site.events[0].name not in fewer.mesh(mesh.name).factors


def test_events_that_a_file_leaves_out_are_written_first() -> None:
    text = Path(rigdda.__file__).parent.joinpath("sites/ritchie-35.toml").read_text()
    site = Site.load("ritchie-35")
    more = Site.parse(parts.with_event(text, site), "site.toml")
    assert len(more.events) == len(site.events) + 1 and more.events[0] == site.events[0]
    renamed = Site.parse(parts.renamed_event(text, site, 0, "stones"), "site.toml")
    assert renamed.events[0].name == "stones"


@pytest.mark.parametrize("name", WITHOUT_EVENTS)
@pytest.mark.parametrize("own", ["", "events = []\n"])
def test_values_of_events_that_a_file_leaves_out_are_set(name, own) -> None:
    text, site = own + sites.text(name), Site.load(name)
    values = {
        ("events", 0, "rate"): None,
        ("events", 0, "return_period"): 4.0,
        ("events", 0, "design"): True,
        ("events", 0, "width"): 8.0,
        ("events", 0, "source"): site.sources[-1].name,
    }
    (event,) = Site.parse(parts.with_values(text, site, values), "site.toml").events
    assert (event.name, event.source) == (site.events[0].name, site.sources[-1].name)
    assert (event.rate, event.design, event.width) == (0.25, True, 8.0)
    road = parts.with_values(text, site, {("road", "end"): site.road.end + 0.5})
    assert road.count("[[events]]") == 0
    assert Site.parse(road, "site.toml").road.end == site.road.end + 0.5


def test_some_built_in_sites_leave_their_events_out() -> None:
    assert {"toppling", "ritchie-35"} <= set(WITHOUT_EVENTS)


@pytest.mark.parametrize("name", sorted(set(site_names.names()) - {"toppling"}))
def test_new_bands_lie_clear_of_existing_barriers(name) -> None:
    text, site = sites.text(name), Site.load(name)
    for number in range(1, 5):
        text = parts.with_band(text, site)
        more = Site.parse(text, "site.toml")
        assert len(more.sources) == len(site.sources) + 1 and more.existing == site.existing
        band, reach = more.sources[-1].band, loose_blocks.reach(more.sources[-1], more.events[-1])
        assert site.slope.points[0][0] <= band[0] - reach
        assert band[1] + reach < site.road.start
        for barrier in site.existing_barriers:
            start, end = barrier.works(site.profile)
            assert band[1] + reach <= start or end <= band[0] - reach, number
        site = more


def test_a_slope_without_room_for_a_band_tells_it() -> None:
    text, site = sites.text("ritchie-80"), Site.load("ritchie-80")
    with pytest.raises(BadInput, match="make room for it"):
        for _ in range(40):
            text = parts.with_band(text, site)
            site = Site.parse(text, "site.toml")


@pytest.mark.parametrize("event", ["", '{name = "edged", source = "edged", rate = 0.1}'])
def test_a_band_whose_blocks_have_edges_gets_an_event_without_sizes(event) -> None:
    edged = '{name = "edged", band = [12.0, 14.0], edges = [0.5, 0.6, 0.7]}'
    text = INLINE.replace("6.0]}]", f"6.0]}}, {edged}]").replace("0.5]}]", f"0.5]}}, {event}]")
    site = Site.parse(text, "site.toml")
    more = Site.parse(parts.with_band(text, site), "site.toml")
    assert more.sources[-1].edges == (0.5, 0.6, 0.7)
    new = more.events[-1]
    rate = 0.1 if event else 1.0 / parts.PERIOD
    assert (new.source, new.area, new.rate) == (more.sources[-1].name, None, rate)


def test_parts_of_a_file_without_headers_are_added_and_removed() -> None:
    site = Site.parse(INLINE, "site.toml")
    text = parts.with_band(INLINE, site)
    more = Site.parse(text, "site.toml")
    assert [source.name for source in more.sources] == ["rock", "band"]
    assert [event.source for event in more.events] == ["rock", "band"]
    assert more.events[1].area == site.events[0].area
    assert Site.parse(parts.without_source(text, more, 1), "site.toml") == site
    text = parts.with_event(INLINE, site)
    more = Site.parse(text, "site.toml")
    assert [event.name for event in more.events] == ["block", "block 2"]
    assert Site.parse(parts.without_event(text, more, 1), "site.toml") == site
    text = parts.with_stretch(INLINE, site, "meadow", 20.0, 30.0)
    more = Site.parse(text, "site.toml")
    assert _ends(more) == [(20.0, 30.0, "meadow")]
    assert more.surfaces == site.surfaces | {"meadow": more.surfaces["meadow"]}
    assert more.surfaces["meadow"].ground == "meadow"
    assert parts.without_stretch(text, more, 0).count("20.0") == 0
    assert (
        Site.parse(parts.renamed_source(INLINE, site, 0, "a"), "site.toml").events[0].source == "a"
    )
