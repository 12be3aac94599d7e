"""A site of its own: ten blocks slide down a ramp, now and then one reaches the road."""

from __future__ import annotations

import pytest

from rigdda import Site, Surface
from rigdda.model.joints import JointSet
from rigdda.model.site_tables import BarrierZone, Motion, Road, Slope
from rigdda.model.source import Source


@pytest.fixture(scope="session")
def ramp() -> Site:
    return Site(
        name="ramp",
        description="A plane ramp of 51 degrees, 25 m high, with a road 4 m from its toe.",
        slope=Slope(points=((-10.0, 25.0), (0.0, 25.0), (20.0, 0.0), (70.0, 0.0)), toe=20.0),
        sources=(
            Source(
                name="mass",
                polygon=((1.0, 23.75), (7.0, 16.25), (9.0, 18.5), (4.0, 24.5)),
                joints=(JointSet(51.0), JointSet(-39.0)),
                block_area=2.5,
            ),
        ),
        road=Road(24.0, 32.0),
        barrier_zone=BarrierZone(10.0, 22.0),
        surfaces={"rock": Surface(25.0, rolling=0.1)},
        motion=Motion(duration=4.0, dt=0.01),
    )
