"""What a site file may say, and what it must not."""

from __future__ import annotations

import math
from itertools import pairwise

import msgspec
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from rigdda import (
    BadInput,
    Ditch,
    DoubtfulInput,
    Event,
    Forest,
    Mesh,
    Site,
    Source,
    Surface,
    Wall,
    sites,
)
from rigdda.ground.surface import Interface
from rigdda.ground.terrain import Terrain
from rigdda.model import loose_blocks
from rigdda.model.site_tables import Motion, Road, Slope, Stretch

QUICK = Site.load("quick")
VERGE = Site.load("verge")
replace = msgspec.structs.replace


def refused(folder, name: str, old: str, new: str) -> BadInput:
    """Return the error of a built-in site with a piece of its file changed."""
    text = sites.text(name)
    assert old in text
    path = folder / "site.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(BadInput) as caught:
        Site.load(path)
    return caught.value


def test_the_file_of_a_corridor_is_told_from_that_of_a_site(tmp_path):
    file = tmp_path / "road.toml"
    file.write_text('budget = 1e5\n[[sections]]\nsite = "verge"\nlength = 100.0\n')
    with pytest.raises(BadInput, match="this is the file of a corridor: use `rigdda corridor`"):
        Site.load(file)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("toe = 5.0", "toe = 5.0\nnonsense = 1"),
        ("{ start = 5.0,", "{ nonsense = 1, start = 5.0,"),
        ("band = [1.0, 2.8]", "band = [1.0, 2.8]\nnonsense = 1"),
        ("rate = 2.8", "rate = 2.8\nnonsense = 1"),
        ("max_height = 5.0", "max_height = 5.0\nnonsense = 1"),
        ("friction_deg = 30.0", "friction_deg = 30.0\nnonsense = 1"),
        ("embankment = 110.0", "nonsense = 110.0"),
        ("price = 80.0", "price = 80.0\nnonsense = 1"),
        ("duration = 20.0", "nonsense = 0.3"),
        ("[motion]", "[consequences]\nnonsense = 1\n\n[motion]"),
        ("[motion]", "[scatter]\nnonsense = 1\n\n[motion]"),
        ("[motion]", '[[interfaces]]\nfirst="rock"\nsecond="soil"\nnonsense=1\n[motion]'),
    ],
)
def test_unknown_keys_are_refused_at_every_depth(old, new, tmp_path):
    assert "nonsense" in str(refused(tmp_path, "verge", old, new))


@pytest.mark.parametrize(
    ("old", "new", "field", "mend"),
    [
        ("rate = 2.8", "rate = true", "events.small, face.rate", "a number"),
        ("rate = 2.8", "rate = [2.0]", "events.small, face.rate", "a number"),
        ("rate = 2.8", "rate = -1.0", "events.small, face.rate", "at least 0"),
        ("rate = 2.8", "rate = 36500.0", "events.small, face.rate", "at most 1000"),
        ("friction_deg = 30.0", "friction_deg = 0.577", "surfaces.rock.friction_deg", "degrees"),
        ("band = [1.0, 2.8]", "band = [2.8, 1.0]", "sources.face.band", "smaller number first"),
        (
            "band = [1.0, 2.8]",
            "band = [1.0, 2.8]\ndensity = 2.65",
            "sources.face.density",
            "kg/m3",
        ),
        ("[61.0, -3.0]", "[45.0, -3.0]", "slope.surfaces[2].end", "at most 45"),
        ("area = [0.05, 0.3]", "", "events.small, face.area", "band face"),
        ("width = 4.0", "", "events.group.width", "several blocks"),
        ('source = "face"', 'source = "fall"', "events.small, face.source", "crest, face"),
        ('name = "crest"', 'name = "face"', "sources[1].name", "unique name"),
        ("block = 0.7", "blocks = 0.7", "meshes.face.factors", "block, group"),
        ("embankment = 110.0", "interest = 3.0", "prices.interest", "at most 0.5"),
        ("embankment = 110.0", "fence = { 750 = 300.0 }", "prices.fence", "1000"),
        ("embankment = 110.0", "ditch = { sole = 5.0 }", "prices.ditch", "rock, soil"),
        ("embankment = 110.0", "ditch = {}", "prices.ditch", "at least 1 of its keys, or leave"),
        ("[road]", "[lumped.sole]\nnormal = 0.3\n\n[road]", "lumped", "rock"),
        (
            "[road]",
            "[lumped.rock]\nfriction_deg = 0.5\n\n[road]",
            "lumped.rock.friction_deg",
            "give degrees, such as 30: 0.5 looks like a tangent or radians",
        ),
        ("[61.0, -3.0]", "[61000.0, -3.0]", "slope.points", "give metres"),
        (
            "[road]",
            '[[interfaces]]\nfirst = "rock"\nsecond = "soil"\nfriction_deg = 20.0\n\n'
            '[[interfaces]]\nfirst = "soil"\nsecond = "rock"\nfriction_deg = 25.0\n\n[road]',
            "interfaces[1]",
            "only once",
        ),
        ("toe = 5.0", "toe = 15.0", "slope.toe", "at most 12"),
        ("band = [1.0, 2.8]", "", "sources.face.polygon", "give exactly one of band"),
        ("band = [1.0, 2.8]", "band = [1.0, 11.5]", "sources.face.band", "clear the road"),
    ],
)
def test_what_cannot_be_meant_is_refused(old, new, field, mend, tmp_path):
    error = refused(tmp_path, "verge", old, new)
    assert error.field == field
    assert mend in str(error)


def test_ground_that_ends_too_early_is_told(tmp_path):
    error = refused(tmp_path, "quick", "[80.0, -2.0]", "[60.0, -2.0]")
    assert error.field == "slope.points[10]"
    assert "at least x = 74.8, 30 m beyond the road" in error.hint


@pytest.mark.parametrize("value", [True, np.True_, np.array(5.0), np.array([5.0])])
def test_booleans_and_arrays_are_no_numbers(value):
    for make in (
        lambda: Event("block", value),
        lambda: Surface(value),
        lambda: Motion(duration=value),
        lambda: Wall(value, 1.0),
    ):
        with pytest.raises(BadInput, match="give a number"):
            make()


def test_damping_in_flight_is_warned_of_but_in_scenes_of_publications():
    always = Motion(0.3, "always")
    with pytest.warns(DoubtfulInput, match="four to ten times too low"):
        replace(QUICK, motion=always)
    assert Site.load("shu-hwa-paper").motion == Motion(0.6, "always", 30.0)


def test_closure_in_thousands_is_warned_of():
    with pytest.warns(DoubtfulInput, match="not thousands"):
        replace(QUICK, consequences=replace(QUICK.consequences, closure=50.0))


def test_without_events_each_mass_comes_down_once_a_year():
    assert Site.load("toppling").events == (Event("mass", 1.0, "mass"),)
    assert replace(QUICK, events=(), meshes=()).events == (Event("mass", 1.0, "mass"),)


def test_without_events_a_band_alone_brings_nothing_down():
    with pytest.raises(BadInput, match="events = "):
        replace(QUICK, events=(), sources=QUICK.sources[:1], meshes=())


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("restitution = 0.2", "restitution = 3.0", "surfaces.rock.restitution"),
        ("[motion]", "[lumped.rock]\nnormal = 3.0\n\n[motion]", "lumped.rock.normal"),
        ("duration = 20.0", "dt = 5.0", "motion.dt"),
    ],
)
def test_fields_are_told_with_their_table(old, new, field, tmp_path):
    assert refused(tmp_path, "quick", old, new).field == field


def test_the_plain_contact_has_no_word_in_a_file(tmp_path):
    site = replace(QUICK, surfaces={"rock": Surface(28.0, restitution=None)})
    with pytest.raises(BadInput, match=r"surfaces\.rock\.restitution = None"):
        site.save(tmp_path / "site.toml")
    assert not list(tmp_path.iterdir())


def test_a_stretch_of_the_slope_has_its_own_surface():
    slope = Slope(((0.0, 10.0), (10.0, 0.0), (50.0, 0.0)), 10.0, "rock", (Stretch(4, 20, "soil"),))
    points, names = slope.chain()
    assert points == ((0, 10), (4, 6), (10, 0), (20, 0), (50, 0))
    assert names == ("rock", "soil", "soil", "rock")
    with pytest.raises(BadInput, match=r"surfaces\[1\].start"):
        replace(slope, surfaces=(Stretch(4, 20, "soil"), Stretch(19, 30, "rock")))


BENDS = ((0.0, 60.0), (10.0, 50.0), (10.0, 30.0), (40.0, 5.0), (60.0, 0.0), (140.0, -1.0))
WITHIN = st.floats(-0.45e-9, 0.45e-9)


@given(
    ends=st.lists(st.sampled_from((10.0, 25.0, 40.0, 60.0, 140.0)), min_size=2, max_size=4,
                  unique=True).map(sorted),
    shifts=st.lists(st.tuples(WITHIN, WITHIN), min_size=3, max_size=3),
)  # fmt: skip
def test_ends_of_stretches_within_rounding_of_a_corner_are_at_the_corner(ends, shifts):
    exact, near = [], []
    for (start, end), (one, other), name in zip(pairwise(ends), shifts, "abc", strict=False):
        exact.append(Stretch(start, end, name))
        near.append(Stretch(start + one, end + other, name))
    points, names = Slope(BENDS, 10.0, "rock", tuple(exact)).chain()
    found, found_names = Slope(BENDS, 10.0, "rock", tuple(near)).chain()
    assert found_names == names
    np.testing.assert_allclose(found, points, rtol=0.0, atol=2e-9)
    Terrain(found, found_names)
    corners = [point for point in found if point[0] != pytest.approx(25.0)]
    assert corners == list(BENDS)


@pytest.mark.parametrize("at", [40.0, 20.0])
def test_a_stretch_shorter_than_rounding_has_no_effect(at):
    tiny = Slope(BENDS, 10.0, "rock", (Stretch(at, at + 1e-10, "soil"),))
    assert set(tiny.chain()[1]) == {"rock"}
    assert Terrain(*tiny.chain()).height(at) == pytest.approx(Terrain(BENDS).height(at))


def test_a_site_whose_stretch_begins_beside_a_corner_is_valid():
    near = replace(VERGE.slope.surfaces[0], start=VERGE.slope.surfaces[0].start + 1e-10)
    stretches = (near, *VERGE.slope.surfaces[1:])
    site = replace(VERGE, slope=replace(VERGE.slope, surfaces=stretches))
    assert site.slope.chain() == VERGE.slope.chain()


def test_the_surface_of_the_ground_decides():
    soil = replace(VERGE.surfaces["soil"], friction_sd_deg=0.0, restitution_sd=0.0, rolling_sd=0.0)
    even = replace(VERGE, surfaces={**VERGE.surfaces, "soil": soil})
    scene = even.realise((), 1, "block")
    assert scene.interface("rock", "soil") == soil
    assert scene.interface("soil", "rock").restitution == 0.25
    pair = Interface("soil", "rock", 12.0, restitution=0.01)
    other = replace(VERGE, interfaces=(pair,)).realise((), 1, "block")
    found = other.interface("rock", "soil")
    assert replace(found, rolling=0.0) == pair.surface
    assert found.rolling == VERGE.realise((), 1, "block").interface("rock", "soil").rolling
    stiff = replace(VERGE, surfaces={**VERGE.surfaces, "soil": Surface(40.0, restitution=0.9)})
    assert stiff.realise((), 1, "block").interface("rock", "soil").restitution == 0.9


def test_a_release_is_the_same_whatever_the_layout():
    for event in QUICK.event_names:
        one, other = (QUICK.realise(layout, 5, event) for layout in ((), (Ditch(30.0, 1.0, 3.0),)))
        for a, b in zip(one.blocks, other.blocks, strict=True):
            assert (a.vertices == b.vertices).all() and a.velocity == b.velocity


def test_events_come_as_often_as_their_rates_say():
    drawn = [QUICK.pick(seed) for seed in range(3000)]
    rates = {event.name: event.rate for event in QUICK.events}
    for name, rate in rates.items():
        share = rate / sum(rates.values())
        error = math.sqrt(share * (1.0 - share) / 3000)
        assert drawn.count(name) / 3000 == pytest.approx(share, abs=4.0 * error)


def test_blocks_of_a_band_are_as_the_event_says():
    event, source = QUICK.event("block"), QUICK.source("face")
    least, greatest = event.area
    areas, power = [], -1.5 * event.exponent
    for seed in range(2000):
        drawn = QUICK.draw(seed, "block")
        (block,) = drawn.blocks
        rock = shapely.Polygon(block.vertices)
        areas.append(rock.area)
        assert 5 <= len(block.vertices) <= 8 and rock.exterior.is_ccw
        assert rock.convex_hull.area == pytest.approx(rock.area)
        assert drawn.width == pytest.approx(math.sqrt(rock.area))
        vx, vy, spin = block.velocity
        assert 0.2 <= vx <= 1.0 and vy == 0.0 and abs(spin) <= 0.5
        left, _, right, _ = rock.bounds
        reach = loose_blocks.reach(source, event)
        assert source.band[0] - reach < left < right < source.band[1] + reach
    assert least <= min(areas) * (1 + 1e-9) and max(areas) <= greatest * (1 + 1e-9)
    for middle in (0.5, 1.0):  # N(> V) ~ V^-b, truncated
        above = (middle**power - greatest**power) / (least**power - greatest**power)
        assert np.mean(np.array(areas) > middle) == pytest.approx(above, abs=0.045)


def test_groups_have_their_number_and_width():
    counts = {len(QUICK.draw(seed, "group").blocks) for seed in range(60)}
    assert counts == {4, 5, 6}
    assert QUICK.draw(0, "group").width == 6.0


def test_barriers_do_not_stand_where_loose_rock_lies():
    bench = Site.load("bench")
    (start, low), (high, end) = bench.rooms
    assert start == bench.barrier_zone.start and end == bench.barrier_zone.end
    assert low < 18.5 and high > 21.5
    bench.realise((Wall(low - 1.0, 1.0), Wall(high, 1.0)), 0, "small")
    for x in (low - 0.5, 20.0, high - 0.1):
        with pytest.raises(BadInput, match="outside the loose rock"):
            bench.realise((Wall(x, 1.0),), 0, "small")
    with pytest.raises(BadInput, match="leave room"):
        replace(bench, barrier_zone=replace(bench.barrier_zone, start=18.5, end=21.5))


def test_a_band_needs_ground_without_overhangs():
    site = Site.load("toppling")
    band = Source(name="top", band=(20.0, 30.0))
    event = Event("block", 1.0, "top", area=(1.0, 2.0))
    with pytest.raises(BadInput, match="overhangs"):
        replace(site, sources=(band,), events=(event,))


def test_a_source_is_one_of_three():
    with pytest.raises(BadInput, match="give exactly one of band"):
        Source(band=(0.0, 1.0), polygon=((0, 0), (1, 0), (0, 1)))
    with pytest.raises(BadInput, match="defines its blocks"):
        replace(QUICK, events=(Event("mass", 1.0, "mass", number=(2, 3)),))


def test_mesh_is_no_part_of_a_scene():
    assert QUICK.realise((Mesh(5.0, "face"),), 1, "block").barriers == ()
    with pytest.raises(BadInput, match="choose one of face"):
        QUICK.realise((Mesh(5.0, "net"),), 1, "block")


def test_releases_that_take_minutes_are_doubted() -> None:
    text = sites.text("quick")
    with pytest.warns(DoubtfulInput, match=r"motion\.dt: increase it.* 2e\+06 steps"):
        Site.parse(text.replace("duration = 20.0", "duration = 20.0\ndt = 1e-5"), "site")
    with pytest.warns(
        DoubtfulInput, match=r"sources\.mass\.block_area: increase it.* 4\d{3} blocks"
    ):
        Site.parse(text.replace("block_area = ", "block_area = 0.01 # "), "site")


def test_volumes_and_return_periods_are_areas_and_rates(tmp_path):
    given = Event("boulder", return_period=8.0, volume=(0.3, 1.5), section_length=250.0)
    assert given.rate == pytest.approx(1.0 / 8.0 / 2.5)
    assert given.area == pytest.approx((0.3 ** (2 / 3), 1.5 ** (2 / 3)))
    assert given == Event("boulder", given.rate, area=given.area)
    assert Event("often", return_period=0.5).rate == 2.0
    text = sites.text("verge")
    old = text[text.index("rate = 2.8") :].partition("\n\n")[0]
    new = old.replace("rate = 2.8", "return_period = 4.0\nsection_length = 50.0")
    new = "\n".join(
        "volume = [0.027, 0.125]" if line.startswith("area") else line for line in new.splitlines()
    )
    site = Site.parse(text.replace(old, new), "verge")
    event = site.events[[e.rate for e in VERGE.events].index(2.8)]
    assert event.rate == 0.5 and event.area == pytest.approx((0.09, 0.25))
    drawn = site.draw(3, event.name)
    rock, area = drawn.blocks[0], drawn.width**2
    assert 0.027 <= area**1.5 <= 0.125 and rock.density == 2600.0
    site.save(tmp_path / "saved.toml")
    saved = (tmp_path / "saved.toml").read_text()
    assert "volume" not in saved.split("[road]")[0] and "return_period" not in saved
    assert Site.load(tmp_path / "saved.toml") == site


@pytest.mark.parametrize(
    ("old", "new", "field", "mend"),
    [
        ("rate = 2.8\n", "", "rate", "return_period"),
        ("rate = 2.8", "rate = 2.8\nreturn_period = 2.0", "return_period", "leave it out"),
        ("rate = 2.8", "rate = 2.8\nsection_length = 50.0", "section_length", "return_period"),
        ("rate = 2.8", "rate = 2.8\nvolume = [0.1, 0.2]", "volume", "gives its area, too"),
        ("rate = 2.8", "return_period = 0.0", "return_period", "above 0"),
        ("rate = 2.8", "return_period = 1e-5", "return_period", "give years"),
        ("rate = 2.8", "return_period = 1.0\nsection_length = 0.0", "section_length", "above 0"),
    ],
)  # fmt: skip
def test_events_say_each_thing_once(old, new, field, mend, tmp_path):
    error = refused(tmp_path, "verge", old, new)
    assert error.field == f"events.small, face.{field}" and mend in str(error)


def test_only_a_mass_has_an_area_to_be_cut_to(tmp_path):
    error = refused(tmp_path, "verge", "band = [1.0, 2.8]", "band = [1.0, 2.8]\nblock_area = 2.0")
    assert error.field == "sources.face.block_area" and "leave it out" in error.hint


def test_errors_of_stretches_name_the_surface(tmp_path):
    error = refused(tmp_path, "verge", "[61.0, -3.0]", "[58.0, -3.0]")
    assert error.field == "slope.surfaces[2].end" and "soil" in error.hint


def test_rock_far_below_the_ground_is_refused(tmp_path):
    text = sites.text("quick")
    old = text[text.index("polygon = ") :].partition("\n")[0]
    corners = msgspec.toml.decode(old)["polygon"]
    sunk = [[x, y - 500.0] for x, y in corners]
    error = refused(tmp_path, "quick", old, f"polygon = {sunk}")
    assert error.field.startswith("sources.mass.polygon[") and "raise it" in error.hint


FOREST = """[[forest]]
start = 4.0
end = 9.0
stems = 400.0
dbh = 0.3

[motion]"""


@pytest.mark.parametrize(
    ("old", "new", "field", "mend"),
    [
        ("stems = 400.0", "stems = 50000", "forest[0].stems", "at most 20000 [1/ha]"),
        ("stems = 400.0", "", "forest[0].stems", "Number of stems on a hectare"),
        ("dbh = 0.3", "dbh = 4.0", "forest[0].dbh", "at most 2.5 [m]"),
        ("dbh = 0.3", "dbh = 30", "forest[0].dbh", "at most 2.5 [m]"),
        ("dbh = 0.3", "dbh = 0.3\nconifers = 80", "forest[0].conifers", "at most 1"),
        ("dbh = 0.3", "dbh = 0.3\nspecies = 1", "forest[0].species", "there is no such key"),
        ("end = 9.0", "end = 3.0", "forest[0].end", "let it end beyond 4, where it begins"),
        ("end = 9.0", "end = 900.0", "forest[0].end", "keep it on the slope: at least -15"),
        ("start = 4.0", "start = -40.0", "forest[0].start", "keep it on the slope: at least -15"),
    ],
)
def test_a_forest_that_cannot_be_is_refused(old, new, field, mend, tmp_path):
    assert old in FOREST
    error = refused(tmp_path, "verge", "[motion]", FOREST.replace(old, new, 1))
    assert error.field == field
    assert mend in str(error)


def test_of_several_tables_the_wrong_one_is_told(tmp_path):
    forest = FOREST.removesuffix("[motion]")
    wrong = forest.replace("end = 9.0", "end = 3.0")
    named = wrong.replace("stems", 'name = "wood"\nstems')
    for second, field in ((wrong, "forest[1].end"), (named, "forest.wood.end")):
        error = refused(tmp_path, "verge", "[motion]", f"{forest}\n{second}\n[motion]")
        assert error.field == field
    sources = "[[sources]]\nband = [1.0, 2.0]\n[[sources]]\nband = [1.0, 2.0]\nblock_area = 1.0\n"
    error = refused(tmp_path, "verge", "[motion]", f"{sources}\n[motion]")
    assert error.field == "sources[3].block_area"
    with pytest.raises(BadInput, match=r"forest\.wood\.end = 3"):
        Forest(4.0, 3.0, 400.0, 0.3, name="wood")


def test_chainages_of_a_grid_are_told_with_their_decimals():
    grid, slope = 2_600_000.25, VERGE.slope
    points = tuple((x + grid, y) for x, y in slope.points)
    bands = [replace(s, band=tuple(x + grid for x in s.band)) for s in VERGE.sources]
    zone = replace(VERGE.barrier_zone, start=VERGE.barrier_zone.start + grid,
                   end=VERGE.barrier_zone.end + grid)  # fmt: skip
    road = Road(VERGE.road.start + grid, VERGE.road.end + grid)
    moved = {"slope": Slope(points, slope.toe + grid), "sources": tuple(bands), "road": road}
    site = replace(VERGE, **moved, barrier_zone=zone)
    with pytest.raises(BadInput, match=r"at least 2599985\.25 and at most 2600061\.25"):
        replace(site, forest=(Forest(4.0, 9.0, 400.0, 0.3),))
    with pytest.raises(BadInput, match=r"at least 2599985\.25 and at most 2600061\.25"):
        replace(site, road=Road(12.0, 18.0))


def test_blocks_that_are_too_large_for_the_slope_are_told():
    event = replace(VERGE.events[0], area=(400.0, 900.0))
    with pytest.raises(BadInput, match="give smaller blocks: they reach") as caught:
        replace(VERGE, events=(event, *VERGE.events[1:]))
    assert caught.value.field == f"events.{event.name}.area"
    assert caught.value.value == (400.0, 900.0)
    measured = replace(VERGE.sources[0], edges=(29.0, 20.0, 10.0))
    events = tuple(replace(e, area=None) if e.source == measured.name else e for e in VERGE.events)
    with pytest.raises(BadInput, match=r"edges = .*: give smaller blocks: they reach 29 m"):
        replace(VERGE, sources=(measured, *VERGE.sources[1:]), events=events)
