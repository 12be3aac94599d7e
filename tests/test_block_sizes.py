"""Sizes and shapes of loose blocks as surveys give them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from msgspec.structs import replace
from scipy.stats import truncnorm

from rigdda import BadInput, Event, Site, Source
from rigdda.geometry import polygon_properties
from rigdda.model.source import SHAPES

SITE = Site.load("verge")


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


def test_sizes_and_shapes_are_kept_in_a_file(tmp_path):
    slabs = replace(SITE.sources[0], shape="slab", corners=(5, 8), aspect=(1.0, 1.5))
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
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    with pytest.raises(BadInput, match="shape"):
        Source("rock", blocks=(square,), shape="slab")
    with pytest.raises(BadInput, match="shape"):
        Source("rock", band=(1.0, 2.0), edges=(1.0, 0.5, 0.4), shape="slab")
