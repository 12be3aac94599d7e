"""Contacts between two blocks: the face that a corner lies over, whatever splits the face."""

from __future__ import annotations

import pytest
import shapely
from physics.helpers import rock

from rigdda import Block, Scene, Settings, Simulation


@pytest.mark.parametrize("shift", [0.0, 1e-16, -1e-16])
def test_corner_on_a_face_with_a_corner_within_it(shift):
    """Edges in one line tie as face of contact: rounding must not choose the one off the corner."""
    floor = [(-2.0, -1.0), (2.0, -1.0), (2.0, 0.0), (-1.9, shift), (-2.0, 0.0)]
    wedge = [(1.5, 0.01), (2.3, 1.0), (0.8, 1.0)]
    scene = Scene(None, (Block(wedge, velocity=(0.0, -2.0, 0.0)), Block(floor)), rock(20.0))
    sim = Simulation(scene, Settings())
    for _ in range(200):
        sim.step()
        parts = [shapely.Polygon(sim.vertices(i)) for i in range(2)]
        assert parts[0].intersection(parts[1]).area < 1e-4
