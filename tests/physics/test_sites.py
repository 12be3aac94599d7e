"""The built-in sites: their blocks start clear of all else, come down and are accounted for."""

from __future__ import annotations

from itertools import combinations

import msgspec
import numpy as np
import pytest
import shapely

from rigdda import (
    BadInput,
    DoubtfulInput,
    Simulation,
    Site,
    Surface,
    release,
    release_many,
    release_outcome,
    sites,
)
from rigdda.geometry import overlap
from rigdda.measurement import measure, stations, watch
from rigdda.model.site_generator import fallen
from rigdda.model.site_tables import Scatter
from rigdda.validation import slopes

NAMES = sites.names()
EVENTS = [(name, event) for name in NAMES for event in Site.load(name).event_names]
RITCHIE = [name for name in NAMES if name.startswith("ritchie-")]


def test_promised_sites_are_there():
    paper = {"ritchie-35", "ritchie-60", "ritchie-80", "shu-hwa-paper", "toppling"}
    assert {"quick", *paper, *sites.design_names(), *sites.WIDE_FAMILIES} == set(NAMES)
    assert len(sites.design_names()) == 6
    assert all(Site.load(name).family == "paper" for name in paper)
    assert all(Site.load(name).family == name for name in sites.design_names())


@pytest.mark.parametrize("name", sites.design_names())
def test_design_sites_begin_their_zone_where_rock_has_speed(name):
    site = Site.load(name)
    assert site.barrier_zone.start >= fallen(site.slope, site.sources)
    assert any(event.design for event in site.events)
    assert any(event.number[1] > 1 or event.name == "mass" for event in site.events)
    assert site.motion.damping_when == "contact"


@pytest.mark.parametrize("name", NAMES)
def test_name_is_that_of_the_file(name):
    assert Site.load(name).name == name


@pytest.mark.parametrize("name", NAMES)
def test_saved_site_is_the_same(name, tmp_path):
    site = Site.load(name)
    site.save(tmp_path / "site.toml")
    assert Site.load(tmp_path / "site.toml") == site


@pytest.mark.parametrize(("name", "event"), EVENTS)
@pytest.mark.parametrize("seed", range(3))
def test_blocks_start_clear_of_the_ground_and_of_each_other(name, event, seed):
    site = Site.load(name)
    scene, source = site.realise((), seed, event), site.source(site.event(event).source)
    chain = scene.terrain.points
    ground = shapely.Polygon([*chain, (chain[-1, 0], -999.0), (chain[0, 0], -999.0)])
    rocks = [shapely.Polygon(b.vertices) for b in scene.blocks]
    scale = shapely.area(rocks).mean()
    assert max(overlap(rock, ground) for rock in rocks) < 1e-6 * scale
    first, second = shapely.STRtree(rocks).query(rocks, predicate="intersects")
    pairs = [(rocks[i], rocks[j]) for i, j in zip(first, second, strict=True) if i < j]
    assert max((overlap(a, b) for a, b in pairs), default=0.0) < 1e-6 * scale
    if source.band is None:
        assert shapely.area(rocks).sum() == pytest.approx(source.area, rel=1e-9)
        assert shapely.union_all(rocks).within(shapely.Polygon(source.outline).buffer(1e-6))


@pytest.mark.parametrize(("name", "event"), EVENTS)
def test_rock_comes_down_and_is_accounted_for(name, event):
    site = Site.load(name)
    drawn = site.draw(1, event)
    scene = site.scene(drawn)
    sim = Simulation(scene, site.settings(scene), stations(site, ()), watch(site))
    alone = len(scene.blocks) == 1  # a block of `verge` hardly moves in the first seconds
    run = sim.run(12.0 if alone else 4.0)
    assert sim.diagnostics.penetration < 0.1
    fell = run.poses[0, :, 1] - run.poses[-1, :, 1]
    assert (fell > 1.0).mean() > 0.4  # below a joint that dips into the slope some blocks stay
    outcome = measure(site, run, drawn.event, drawn.width)
    assert outcome.slope_fraction + outcome.road_fraction + outcome.beyond_fraction == 1.0


@pytest.mark.parametrize("name", RITCHIE)
def test_slopes_of_ritchie_have_the_angle_of_their_name(name):
    points = np.array(Site.load(name).slope.points)
    run, rise = np.diff(points, axis=0)[1]
    assert np.degrees(np.arctan2(-rise, run)) == pytest.approx(float(name[-2:]), abs=0.05)


def test_sites_of_ritchie_differ_in_their_angle_only():
    first, *others = map(Site.load, RITCHIE)
    for other in others:
        for part in ("sources", "surfaces", "motion", "prices"):
            assert getattr(other, part) == getattr(first, part)
        assert other.road.start - other.slope.toe == pytest.approx(
            first.road.start - first.slope.toe
        )


def test_toppling_site_is_the_slope_of_goodman_and_bray():
    """Mirrored, so that it falls to the right, with the heel of the toe column at (140, 10)."""
    _, exact = slopes.toppling_slope()
    blocks = Site.load("toppling").realise().blocks
    assert len(blocks) == len(exact) == 16
    for block, column in zip(blocks, exact, strict=True):
        mirrored = shapely.Polygon([140.0, 10.0] + column.vertices * [-1.0, 1.0])
        assert shapely.Polygon(block.vertices).symmetric_difference(mirrored).area < 1e-4
        assert block.density == pytest.approx(column.density, rel=1e-5)


@pytest.mark.parametrize(("friction_deg", "stands"), [(39.0, True), (37.0, False)])
def test_toppling_site_falls_below_the_limiting_friction(friction_deg, stands):
    """38.151 deg (Goodman and Bray 1976); the jolt of settling brings it down up to 38.5 deg."""
    site = msgspec.structs.replace(
        Site.load("toppling"), surfaces={"rock": Surface(friction_deg)}, scatter=Scatter()
    )
    scene = site.realise()
    sim = Simulation(scene, site.settings(scene))
    start = sim.poses
    sim.step(1000)
    moved = np.hypot(*(sim.poses - start)[:, :2].T).max()
    # columns settle by centimetres against one another, then stand for good
    assert moved < 0.1 if stands else moved > 1.0


def columns(**change):
    """Return the source of the toppling site with other fields."""
    return msgspec.structs.replace(Site.load("toppling").sources[0], **change)


def test_a_source_is_a_jointed_mass_or_blocks():
    jointed = Site.load("quick").source("mass")
    with pytest.raises(BadInput) as caught:
        columns(polygon=jointed.polygon)
    assert caught.value.field == "sources.mass.blocks"
    with pytest.raises(BadInput) as caught:
        columns(blocks=())
    assert caught.value.field == "sources.mass.polygon"


def test_blocks_of_a_source_do_not_overlap():
    blocks = Site.load("toppling").sources[0].blocks
    shifted = tuple((x + 0.1, y) for x, y in blocks[3])
    with pytest.raises(BadInput) as caught:
        columns(blocks=(*blocks[:3], shifted, *blocks[4:]))
    assert caught.value.field == "sources.mass.blocks[3]"
    assert "in block 2" in caught.value.hint


def test_blocks_of_a_source_are_out_of_the_ground():
    site = Site.load("toppling")
    sunk = tuple((x, y - 0.1) for x, y in site.sources[0].blocks[0])
    with pytest.raises(BadInput) as caught:
        msgspec.structs.replace(site, sources=(columns(blocks=(sunk,)),))
    assert caught.value.field.startswith("sources.mass.blocks[0]")


def surveyed(**change):
    """Return `quick` with three surveyed blocks on its upper face."""
    site = Site.load("quick")
    rows = [
        ((3.0 + 1.2 * i, 42.0 - 1.35 * i), (4.0 + 1.2 * i, 42.0 - 1.35 * i),
         (4.0 + 1.2 * i, 43.0 - 1.35 * i), (3.0 + 1.2 * i, 43.0 - 1.35 * i))
        for i in range(3)
    ]  # fmt: skip
    mass = msgspec.structs.replace(
        site.sources[1], polygon=(), joints=(), block_area=None, blocks=tuple(rows), **change
    )
    return msgspec.structs.replace(site, sources=(site.sources[0], mass))


def test_releases_of_a_surveyed_slope_are_an_ensemble():
    site = surveyed()
    given = np.array(site.sources[1].blocks)
    copies = [site.draw(seed, "mass").blocks for seed in range(8)]
    assert all(np.array_equal(b.vertices, g) for c in copies for b, g in zip(c, given, strict=True))
    speeds = np.array([[np.hypot(*b.velocity[:2]) for b in c] for c in copies])
    assert 0.0 < speeds.min() and 0.5e-4 < speeds.max() <= 1e-4
    outcomes = [release_outcome(site, (), seed, "mass") for seed in range(4)]
    assert all(a != b for a, b in combinations(outcomes, 2))  # the slope ends where some run out
    assert release_outcome(site, (), 3, "mass") == outcomes[3]


def test_surveyed_blocks_lose_corners_within_an_edge():
    (first, *others), rng = surveyed().sources[1].blocks, np.random.default_rng(0)
    middle = tuple(np.mean(first[:2], axis=0))
    source = msgspec.structs.replace(
        surveyed().sources[1], blocks=((first[0], middle, *first[1:]), *others)
    )
    for block, exact in zip(source.cut(rng), (first, *others), strict=True):
        np.testing.assert_array_equal(block, exact)


def test_undisturbed_surveyed_blocks_are_the_same_in_every_release():
    one, other = (surveyed(disturbance=0.0).draw(seed, "mass").blocks for seed in (0, 1))
    assert all(a.velocity == b.velocity == (0.0, 0.0, 0.0) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("value", [-1.0, 2.0, float("nan"), "much"])
def test_a_disturbance_that_is_none_is_refused(value):
    with pytest.raises(BadInput, match=r"sources\.mass\.disturbance = "):
        surveyed(disturbance=value)


def test_a_release_that_is_cut_off_is_told() -> None:
    """Rock that still flies when the time is over counts as if it had stopped: not in silence."""
    site = Site.load("verge")
    event = next(e.name for e in site.events if e.design)
    short = msgspec.structs.replace(site, motion=msgspec.structs.replace(site.motion, duration=1.0))
    with pytest.warns(DoubtfulInput, match=r"motion.duration = 1 of site 'verge'.*longer duration"):
        release_many([(short, (), seed, event) for seed in range(4)])
    with pytest.warns(DoubtfulInput, match="longer duration"):
        release(short, (), 0, event)
    assert not any(o.cut_off for o in release_many([(site, (), s, event) for s in range(4)]))
