"""The design envelope: enough blocks, fixed stations, smoothing that never lowers a quantile."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigdda import Fence, Site
from rigdda.envs import design_envelope
from rigdda.envs.design_envelope import DesignEnvelope, governing_events, smoothed, stations
from rigdda.geometry import polygon_properties
from rigdda.passages import passages
from rigdda.seeds import design_envelope_seed

BLOCKS = 120


@pytest.fixture(scope="module")
def site() -> Site:
    return Site.load("verge")


@pytest.fixture(scope="module")
def found(site: Site) -> DesignEnvelope:
    return design_envelope.of(site, site.barrier_zone, 3, BLOCKS)


def test_every_design_event_releases_enough_blocks(site: Site, found: DesignEnvelope) -> None:
    assert [event.name for event in found.events] == ["block", "group"]
    assert all(event.blocks >= BLOCKS for event in found.events)
    assert found.events[0].releases == BLOCKS  # one block each
    assert found.events[1].releases < BLOCKS / 3  # four to eight blocks each


def test_without_design_events_all_events_count() -> None:
    site = Site.load("verge")
    plain = tuple(msgspec.structs.replace(event, design=False) for event in site.events)
    bare = msgspec.structs.replace(site, events=plain)
    assert governing_events(bare) == list(site.event_names)


def test_stations_are_fixed_and_at_most_a_metre_apart(site: Site, found: DesignEnvelope) -> None:
    zone = site.barrier_zone
    assert found.stations == stations(zone)
    assert found.stations[0] == zone.start and found.stations[-1] == zone.end
    assert np.diff(found.stations).max() <= 1.0
    long = msgspec.structs.replace(zone, end=zone.start + 1000.0)
    assert len(stations(long)) == design_envelope.MOST_STATIONS


def test_a_characteristic_value_is_never_below_the_quantile_of_its_station(
    site: Site, found: DesignEnvelope
) -> None:
    first = design_envelope_seed(3)
    releases = [(first + i, "block") for i in range(BLOCKS)]
    raw = passages(site, (), releases, found.stations)
    for k, event in enumerate(found.events[0].speed):
        rows = raw.at(k)
        speeds = np.sort(np.hypot(rows["vx"], rows["vy"]))
        assert found.events[0].passing[k] == len(rows)
        assert event.value >= speeds[math.ceil(0.95 * len(rows)) - 1] - 1e-9
        assert event.low <= event.value <= event.high


def test_the_mass_is_that_of_whole_blocks(site: Site, found: DesignEnvelope) -> None:
    first = design_envelope_seed(3)
    blocks = [site.draw(first + i, "block").blocks[0] for i in range(BLOCKS)]
    masses = [block.density * abs(polygon_properties(block.vertices)[0]) ** 1.5 for block in blocks]
    assert found.events[0].mass == pytest.approx(np.quantile(masses, 0.95))


def test_it_is_kept_and_prices_do_not_matter(site: Site, found: DesignEnvelope) -> None:
    dear = msgspec.structs.replace(
        site, prices=msgspec.structs.replace(site.prices, concrete=900.0)
    )
    assert design_envelope.of(dear, site.barrier_zone, 3, BLOCKS) is found
    other = design_envelope.of(site, site.barrier_zone, 4, BLOCKS)
    assert other.events[0].speed != found.events[0].speed


def test_a_fence_leaves_less_for_what_is_below_it(site: Site, found: DesignEnvelope) -> None:
    fence = Fence(7.0, 4.0, energy_class=500)
    behind = design_envelope.of(site, site.barrier_zone, 3, BLOCKS, [fence])
    assert behind.events[0].passing[-1] < 0.5 * found.events[0].passing[-1]
    assert behind.events[0].passing[0] == found.events[0].passing[0]


@given(
    slope=st.floats(-5.0, 5.0),
    level=st.floats(-50.0, 50.0),
    weights=st.lists(st.floats(0.1, 1e4), min_size=12, max_size=12),
)
def test_a_straight_line_is_not_changed_by_smoothing(
    slope: float, level: float, weights: list[float]
) -> None:
    x = np.arange(12.0)
    line = level + slope * x
    assert smoothed(x, line, np.array(weights)) == pytest.approx(line, abs=1e-8)


def test_smoothing_takes_out_noise_and_leaves_gaps() -> None:
    x = np.arange(40.0)
    rng = np.random.default_rng(1)
    truth = 10.0 + 0.1 * x
    noisy = truth + rng.normal(0.0, 1.0, 40)
    noisy[7] = np.nan
    found = smoothed(x, noisy, np.ones(40))
    assert np.isnan(found[7]) and np.isfinite(np.delete(found, 7)).all()
    known = ~np.isnan(found)
    assert (found - truth)[known].std() < 0.85 * (noisy - truth)[known].std()
