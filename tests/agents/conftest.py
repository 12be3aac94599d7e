"""The ramp of `experiments.outcome_step` for less time: a good part of it slides onto the road."""

from __future__ import annotations

import pytest
from msgspec.structs import replace
from valley import Valley

from envs import DesignProblem
from experiments.outcome_step import RAMP
from rigdda import Site
from rigdda.place import BarrierZone, Motion

SITE = replace(
    RAMP,
    name="chute",
    barrier_zone=BarrierZone(10.0, 22.0, max_height=5.0),
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
