"""The step is compiled once, whatever a scene holds."""

from __future__ import annotations

import pytest
from physics.helpers import FLAT, box, rock

from rigdda import Fence, PointLoad, Scene, Settings, Simulation, Terrain
from rigdda.dynamics.step import advance


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"barriers": (Fence(2.0, 3.0, 1e5),)},
        {"loads": (PointLoad(0, (0.0, 0.5), (1.0, 0.0)),)},
        {"base_motion": ((0.0, 0.0, 0.0), (1.0, 1.0, 0.0)), "gravity": (1.0, -9.0)},
    ],
)
def test_one_version_serves_every_scene(more):
    Simulation(Scene(Terrain(FLAT), (box(0.0, 0.5),), rock(), **more), Settings(dt=1e-3)).step()
    assert len(advance.signatures) == 1
