"""A site of its own: nine blocks slide down a ramp, a good part of them onto the road."""

from __future__ import annotations

import pytest
from valley import Valley

from envs import DesignProblem
from rigdda import Site, Surface
from rigdda.joints import JointSet
from rigdda.site import BarrierZone, Costs, Motion, Road, Slope, Source

SITE = Site(
    name="chute",
    description="A plane ramp of 51 degrees, 25 m high, with a road 3 m from its toe.",
    slope=Slope(points=((-10.0, 25.0), (0.0, 25.0), (20.0, 0.0), (70.0, 0.0)), toe=20.0),
    source=Source(
        polygon=((1.0, 23.75), (7.0, 16.25), (9.0, 18.5), (4.0, 24.5)),
        joints=(JointSet(51.0), JointSet(-39.0)),
        block_area=2.5,
    ),
    road=Road(23.0, 31.0),
    barrier_zone=BarrierZone(10.0, 22.0, max_height=5.0),
    surfaces={"rock": Surface(22.0)},
    costs=Costs(limit=40.0),
    motion=Motion(damping=0.2, duration=4.0, dt=0.01),
)


@pytest.fixture(scope="session")
def site() -> Site:
    return SITE


@pytest.fixture
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site)


@pytest.fixture
def valley(site: Site) -> Valley:
    return Valley(site)
