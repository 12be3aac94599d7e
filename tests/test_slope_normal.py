"""Heights normal to the slope, on planes and steps where they are known in closed form."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from rigdda import Fence, Site, Terrain
from rigdda.envs.design_envelope import DesignEnvelope, EventEnvelope
from rigdda.envs.fence_checks import FenceCheck, demand_at
from rigdda.envs.quantiles import Quantile
from rigdda.passages import passages

replace = msgspec.structs.replace


def plane(slope_deg: float) -> Site:
    """Return `quick` with a plane of this inclination from the crest to beyond the road."""
    site = Site.load("quick")
    left, right = site.slope.points[0][0], site.slope.points[-1][0]
    fall = math.tan(math.radians(slope_deg))
    points = ((left, 0.0), (right, -fall * (right - left)))
    surfaces = {n: replace(s, roughness=0.0, ground="") for n, s in site.surfaces.items()}
    return replace(site, slope=replace(site.slope, points=points), surfaces=surfaces)


@pytest.mark.parametrize("slope_deg", [20.0, 35.0, 50.0])
def test_the_height_on_a_plane_is_the_vertical_one_times_the_cosine(slope_deg: float) -> None:
    site = plane(slope_deg)
    found = passages(site, (), [(seed, None) for seed in range(12)], [20.0, 30.0]).table
    assert len(found) > 5 and (found["height"] > 0.0).all()
    cosine = math.cos(math.radians(slope_deg))
    assert found["normal"] == pytest.approx(found["height"] * cosine, rel=1e-12)


def test_on_level_ground_both_heights_are_the_same() -> None:
    site = Site.load("quick")
    found = passages(site, (), [(seed, None) for seed in range(30)], [site.road.end - 2.0]).table
    assert len(found) and (found["normal"] == pytest.approx(found["height"], rel=1e-3))


@pytest.mark.parametrize("base", [0.2, 1.0, 3.0])
def test_the_inclination_is_that_of_the_chord_over_the_base(base: float) -> None:
    """At a corner between level ground and 45 degrees, the chord falls by half of the base."""
    ground = Terrain([(0.0, 10.0), (10.0, 10.0), (20.0, 0.0)])
    half = math.atan(0.5)
    assert ground.inclination(10.0, base) == pytest.approx(half)
    at = ground.inclination([5.0, 10.0, 15.0], base)
    assert at == pytest.approx([0.0, half, math.pi / 4])


def test_the_inclination_at_the_ends_and_on_overhangs() -> None:
    ground = Terrain([(0.0, 10.0), (10.0, 0.0)])
    assert ground.inclination(0.0, 2.0) == pytest.approx(math.atan2(1.0, 2.0))
    over = Terrain([(0.0, 10.0), (6.0, 10.0), (5.0, 5.0), (10.0, 5.0)])
    assert over.inclination(3.0, 1.0) == 0.0
    assert over.inclination(6.0, 2.0) == pytest.approx(math.atan2(5.0, 2.0))


@pytest.mark.parametrize("slope_deg", [5.0, 30.0, 45.0])
def test_the_nominal_height_of_a_kit_is_that_of_a_net_normal_to_the_slope(slope_deg: float) -> None:
    """A disc of radius f whose centre moves along a line h above the ground, measured vertically,
    needs a net normal to the slope that is as long as the distance of this line plus f."""
    site, one = plane(slope_deg), [Quantile(10.0, 10.0, 10.0)] * 2
    high = [Quantile(2.0, 2.0, 2.0)] * 2
    event = EventEnvelope("e", 100, 2000, 10, [2000] * 2, one, high, 1000.0, 0.7)
    envelope = DesignEnvelope([20.0, 30.0], 0.95, [event], [1.0, 1.0])
    demand = demand_at(envelope, site.rule, 25.0)
    assert demand is not None
    check = FenceCheck.of(site, Fence(25.0, 3.0, energy_class=1000), demand)
    assert check.slope == pytest.approx(math.radians(slope_deg), abs=1e-12)
    h = 2.0 * site.rule.velocity
    along = np.array([math.cos(check.slope), -math.sin(check.slope)])  # direction of the slope
    away = abs(along[0] * h)  # distance of the point (0, h) from the line through the foot
    assert check.nominal_height == pytest.approx(away + 0.7)
    assert check.nominal_height <= demand.height() + 1e-12  # the vertical check is on the safe side
    rows = {row.symbol: row.value for row in check.rows()}
    assert rows["h_d cos b + f"] == check.nominal_height
    assert rows["h cos b"] == pytest.approx(2.0 * math.cos(check.slope))
    assert rows["b"] == pytest.approx(slope_deg)
