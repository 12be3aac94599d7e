"""Sizes and shapes of loose blocks as surveys give them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.stats import truncnorm

from rigdda import BadInput, Event, Site, Source
from rigdda.app import site_check
from rigdda.app.site_oddities import HUGE, oddities
from rigdda.geometry import polygon_properties
from rigdda.model import site_names
from rigdda.model.joints import JointSet
from rigdda.model.source import SHAPES

SITE = Site.load("verge")

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
JOINTS = (JointSet(45.0, 0.5), JointSet(-45.0, 0.5))


def with_event(**values: object) -> Site:
    """Return a site with one band and one event of single blocks."""
    event = Event("block", 0.1, SITE.sources[0].name, **values)  # type: ignore[arg-type]
    return replace(SITE, sources=SITE.sources[:1], events=(event,), meshes=())


def surveyed(*pairs: tuple[float, float]) -> dict[str, tuple[float, ...]]:
    """Return the fields of an event with surveyed volumes and the shares below them."""
    sizes, shares = zip(*pairs, strict=True)
    return {"volumes": sizes, "volume_shares": shares}


def volumes(site: Site, count: int = 3000) -> np.ndarray:
    """Return the volumes of the blocks of some releases [m3]."""
    blocks = [site.draw(seed, "block").blocks[0] for seed in range(count)]
    return np.array([polygon_properties(block.vertices)[0] ** 1.5 for block in blocks])


def test_lognormal_volumes_are_cut_to_their_limits():
    low, median, spread, high = 0.05, 0.4, 0.9, 4.0
    site = with_event(volume=(low, high), volume_median=median, volume_spread=spread)
    found = volumes(site)
    ends = (np.log([low, high]) - math.log(median)) / spread
    law = truncnorm(*ends, loc=math.log(median), scale=spread)
    for share in (0.1, 0.25, 0.5, 0.75, 0.9):
        below = np.mean(found <= math.exp(law.ppf(share)))
        assert below == pytest.approx(share, abs=4.0 * math.sqrt(share * (1 - share) / len(found)))
    assert low * (1 - 1e-9) <= found.min() and found.max() <= high * (1 + 1e-9)


def test_surveyed_volumes_have_their_shares():
    table = ((0.02, 0.0), (0.1, 0.3), (0.5, 0.9), (3.0, 1.0))
    found = volumes(with_event(**surveyed(*table)))
    for volume, share in table:
        assert np.mean(found <= volume * (1 + 1e-9)) == pytest.approx(share, abs=0.03)
    half = math.sqrt(0.1 * 0.5)  # the middle of a stretch of logarithms
    assert np.mean(found <= half) == pytest.approx(0.6, abs=0.03)


def test_the_power_law_is_as_it_was():
    site = with_event(volume=(0.1, 1.0), exponent=0.6)
    found = volumes(site)
    expected = [(0.1**-0.6 - u * (0.1**-0.6 - 1.0)) ** (-1 / 0.6) for u in (0.25, 0.5, 0.75)]
    assert np.quantile(found, (0.25, 0.5, 0.75)) == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize("name", SHAPES)
def test_a_named_shape_has_its_corners_and_aspect(name):
    source = Source("rock", band=(1.0, 2.0), shape=name)
    assert (source.corners, source.aspect) == SHAPES[name]
    kept = Source("rock", band=(1.0, 2.0), shape=name, aspect=(1.1, 3.9))
    assert kept.corners == SHAPES[name].corners and kept.aspect == (1.1, 3.9)


def test_ranges_that_are_given_hold_beside_a_shape(tmp_path):
    """Also if they equal the defaults, in Python, in a file and in a file that is written again."""
    usual = Source("rock", band=(1.0, 2.0))
    for shape, (corners, aspect) in SHAPES.items():
        for given in ({"corners": usual.corners[:1] + usual.corners[1:]}, {"corners": [5, 7]},
                      {"aspect": [1.0, 1.5]}):  # fmt: skip
            source = Source("rock", band=(1.0, 2.0), shape=shape, **given)
            expected = tuple(given.get("corners", corners)), tuple(given.get("aspect", aspect))
            assert (source.corners, source.aspect) == expected
    text = site_names.text("verge").replace("[[sources]]", '[[sources]]\nshape = "cube"', 1)
    written = text.replace('shape = "cube"', 'shape = "cube"\ncorners = [5, 8]')
    for file, expected in ((text, (4, 4)), (written, (5, 8))):
        site = Site.parse(file, "verge")
        assert site.sources[0].corners == expected
        assert site.sources[0].aspect == SHAPES["cube"].aspect
        site.save(tmp_path / "site.toml")
        assert Site.load(tmp_path / "site.toml") == site


def test_a_shape_without_effect_is_refused(tmp_path):
    """Files that are written have both ranges, so that a shape would change nothing in them."""
    with pytest.raises(BadInput, match="shape = 'slab': leave out it or one of corners and aspect"):
        Source("rock", band=(1.0, 2.0), shape="slab", corners=(4, 6), aspect=(1.0, 2.0))
    Site.parse(site_names.text("verge"), "verge").save(tmp_path / "site.toml")
    text = (tmp_path / "site.toml").read_text(encoding="utf-8")
    text = text.replace("[[sources]]", '[[sources]]\nshape = "slab"', 1)
    with pytest.raises(BadInput, match="shape = 'slab'"):
        Site.parse(text, "verge")


def test_a_shape_can_be_added_to_a_source_without_one():
    source = replace(Source("rock", band=(1.0, 2.0)), shape="disc")
    assert (source.corners, source.aspect) == SHAPES["disc"]


def test_sizes_and_shapes_are_kept_in_a_file(tmp_path):
    slabs = replace(SITE.sources[0], shape="slab")
    assert slabs.aspect == (2.5, 4.0)
    for values in (
        {"volume": (0.1, 2.0), "volume_median": 0.3, "volume_spread": 0.5},
        surveyed((0.1, 0.0), (0.5, 0.7), (2.0, 1.0)),
    ):
        site = replace(with_event(**values), sources=(slabs,))
        site.save(tmp_path / "site.toml")
        again = Site.load(tmp_path / "site.toml")
        assert replace(again, name=site.name) == site
        assert volumes(again, 20).tolist() == volumes(site, 20).tolist()


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"volume": (0.1, 1.0), "volume_median": 0.3}, "volume_spread"),
        ({"volume": (0.1, 1.0), "volume_spread": 0.3}, "volume_median"),
        ({"volume_median": 0.3, "volume_spread": 0.3}, "volume"),
        ({"volume": (0.1, 1.0), "volume_median": 3.0, "volume_spread": 0.3}, "volume_median"),
        (surveyed((0.1, 0.0), (0.05, 1.0)), "volumes"),
        (surveyed((0.1, 0.0)), "volumes"),
        ({"volume_shares": (0.0, 1.0)}, "volumes"),
        ({"volumes": (0.1, 1.0)}, "volume_shares"),
        (surveyed((0.1, 0.2), (0.5, 1.0)), "volume_shares"),
        (surveyed((0.1, 0.0), (0.5, 0.9)), "volume_shares"),
        (surveyed((0.1, 0.0), (1.0, 1.0)) | {"volume": (0.1, 1.0)}, "volume"),
        (surveyed((0.1, 0.0), (1.0, 1.0)) | {"area": (0.1, 0.2)}, "area"),
        (surveyed((0.1, 0.0), (1.0, 1.0)) | {"volume_spread": 1.0}, "volume_spread"),
    ],
)
def test_an_incomplete_distribution_is_refused(values, field):
    with pytest.raises(BadInput) as caught:
        Event("block", 0.1, "rock", **values)
    assert caught.value.field == f"events.block.{field}"


def test_only_bands_have_named_shapes():
    with pytest.raises(BadInput, match="shape"):
        Source("rock", blocks=(SQUARE,), shape="slab")
    with pytest.raises(BadInput, match="shape"):
        Source("rock", band=(1.0, 2.0), edges=(1.0, 0.5, 0.4), shape="slab")


KINDS = {
    "blocks": {"blocks": (SQUARE,)},
    "mass": {"polygon": SQUARE, "joints": JOINTS},
    "edges": {"band": (1.0, 2.0), "edges": (1.0, 0.5, 0.4)},
    "band": {"band": (1.0, 2.0)},
}
"""Keys of each kind of source."""

UNUSED = {
    "corners": ("blocks", "mass"),
    "aspect": ("blocks", "mass", "edges"),
    "spin": ("blocks", "mass"),
    "speed": ("blocks", "mass"),
    "disturbance": ("mass", "edges", "band"),
}
"""Kinds of source that do not use a key."""

OTHER = {
    "corners": (4, 6),
    "aspect": (3.0, 4.0),
    "spin": 5.0,
    "speed": (3.0, 4.0),
    "disturbance": 0.01,
}
"""Values of these keys other than the defaults."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("key", UNUSED)
def test_keys_that_a_kind_of_source_does_not_use_are_refused(kind, key):
    given = KINDS[kind] | {key: OTHER[key]}
    if kind in UNUSED[key]:
        with pytest.raises(BadInput, match="leave it out: ") as caught:
            Source("rock", **given)
        assert caught.value.field == f"sources.rock.{key}" and caught.value.value == OTHER[key]
    else:
        assert getattr(Source("rock", **given), key) == OTHER[key]
    usual = getattr(Source("rock", **KINDS[kind]), key)  # `Site.save` writes it
    assert Source("rock", **KINDS[kind], **{key: usual}) == Source("rock", **KINDS[kind])


LAWS = (
    {"volume": (0.1, 2.0), "volume_median": 0.3, "volume_spread": 0.5},
    surveyed((0.1, 0.0), (0.5, 0.7), (2.0, 1.0)),
)
"""Distributions of volumes in place of the power law."""


@pytest.mark.parametrize("law", LAWS)
def test_an_exponent_beside_another_law_is_refused(law, tmp_path):
    with pytest.raises(BadInput, match=r"events\.block\.exponent = 0\.4: leave it out: the event"):
        with_event(**law, exponent=0.4)
    site = with_event(**law)
    site.save(tmp_path / "site.toml")
    assert "exponent = 0.6" in (tmp_path / "site.toml").read_text()
    assert Site.load(tmp_path / "site.toml") == site


@pytest.mark.parametrize("kind", ["blocks", "mass", "edges"])
def test_an_exponent_is_refused_where_the_source_defines_the_volumes(kind):
    source = Source("rock", **KINDS[kind])
    Event("block", 0.1).check_source(source)
    with pytest.raises(BadInput, match=r"exponent = 0\.4: leave it out: .*source rock") as caught:
        Event("block", 0.1, exponent=0.4).check_source(source)
    assert caught.value.field == "events.block.exponent"


def measured(*edges: float, **values: object) -> Site:
    """Return a site with single blocks in a box with edges [m]."""
    source = replace(SITE.sources[0], edges=edges, **values)
    return replace(with_event(area=(1.0, 1.0)), sources=(source,), events=(
        Event("block", 0.1, source.name, design=True),))  # fmt: skip


@pytest.mark.parametrize(
    ("edges", "corners"),
    [((1.0, 1.0, 1.0), (5, 8)), ((0.5, 2.0, 1.0), (5, 8)), ((1.0, 1.0, 1.0), (4, 4)),
     ((0.3, 0.2, 0.4), (9, 12))],
)  # fmt: skip
def test_the_check_tells_the_volumes_of_measured_blocks_that_releases_draw(edges, corners):
    site = measured(*edges, corners=corners)
    (event,), (source,) = site.events, site.sources
    drawn = volumes(site)
    _, (least, most) = site_check.blocks_of(event, source)
    outside = (drawn < least**1.5) | (drawn > most**1.5)
    assert outside.mean() < 2e-3
    assert least**1.5 == pytest.approx(drawn.min(), rel=0.15)
    assert most**1.5 == pytest.approx(drawn.max(), rel=0.15)
    told = site_check.measured_areas(source) ** 1.5
    error = drawn.std() / math.sqrt(len(drawn))
    assert told.mean() == pytest.approx(drawn.mean(), abs=4.0 * error)
    _, released = site_check.size_of_release(event, source)
    assert released == pytest.approx((least**1.5, most**1.5))


def test_volumes_of_a_cube_are_those_of_its_outlines():
    """Values of 400 releases, in which the outlines fill 0.55 to 0.84 of a face."""
    site = measured(1.0, 1.0, 1.0)
    told = site_check.measured_areas(site.sources[0]) ** 1.5
    assert told.mean() == pytest.approx(0.59, abs=0.01)
    assert told.min() < 0.41 and 0.77 < told.max() < 0.85
    (line,) = [line for line in site_check.facts(site) if line.startswith("source")]
    assert (
        "edges of 1, 1 and 1 m; their volumes are 0.4 to 0.82 m3, 0.59 m3 on average: a block"
        in line
    )


def test_volumes_of_measured_blocks_grow_with_their_edges():
    one = site_check.measured_areas(measured(0.2, 0.1, 0.05).sources[0])
    other = site_check.measured_areas(measured(2.0, 1.0, 0.5).sources[0])
    np.testing.assert_allclose(other, 100.0 * one)


def test_the_largest_measured_block_is_as_long_as_its_longest_edge():
    site = measured(2.0, 1.0, 0.5)
    assert site_check.longest_block(site.events[0], site.sources[0]) == 2.0
    low = replace(site, barrier_zone=replace(site.barrier_zone, max_height=2.9))
    (line,) = [line for line in oddities(low) if "max_height" in line]
    assert "the largest block is 2.0 m long" in line


def test_measured_blocks_in_a_large_box_are_not_odd_if_their_outlines_are_small():
    assert 2.8**3 > HUGE
    assert not any("blocks of up to" in line for line in oddities(measured(2.8, 2.8, 2.8)))
    (line,) = [line for line in oddities(measured(3.2, 3.2, 3.2)) if "blocks of up to" in line]
    assert "blocks of up to 26.9 m3; are the edges in metres?" in line
