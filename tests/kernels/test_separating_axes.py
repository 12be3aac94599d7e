"""Separating axes: those that are left out would never have been the face of contact."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rigdda import Block, Scene, Settings
from rigdda.dynamics.contact.separating_axes import (
    NEVER,
    SQUARE,
    TOUCH,
    Approach,
    face_of_contact,
)
from rigdda.dynamics.packing import Arrays, pack
from rigdda.dynamics.post_correction import place_corners
from rigdda.kernel import from_python
from rigdda.validation.scenes import rock

SLACK = 0.01
face = from_python(face_of_contact)
place = from_python(place_corners)


def two_polygons(rng: np.random.Generator) -> Arrays:
    """Return two convex polygons of 3 to 8 corners, apart, touching or in one another."""
    blocks = []
    for centre in (0.0, 10.0):
        corners = int(rng.integers(3, 9))
        angles = 2.0 * math.pi * (np.arange(corners) + 0.8 * rng.random(corners)) / corners
        x, y = rng.uniform(0.3, 2.0) * np.cos(angles), rng.uniform(0.3, 2.0) * np.sin(angles)
        blocks.append(Block(np.stack([centre + x, y], axis=1)))
    arrays = pack(Scene(None, tuple(blocks), rock()), Settings(), np.zeros(0), (0.0, 0.0))
    way, angle = rng.uniform(0.2, 4.0), rng.uniform(0.0, 2.0 * math.pi)
    bodies = arrays.bodies
    bodies.x[1], bodies.y[1] = bodies.x[0] + way * math.cos(angle), way * math.sin(angle)
    bodies.theta[:] = rng.uniform(-4.0, 4.0, 2)
    for i in range(len(bodies)):
        place(bodies, arrays.outlines, i)
    return arrays


def over_all_edges(
    arrays: Arrays, i: int, j: int, way: np.ndarray, turning: np.ndarray, spread: float
) -> tuple[bool, float, float, float]:
    """Return what `face_of_contact` does, over every edge of i and corner of j."""
    out, count = arrays.outlines, arrays.outlines.polygon.count
    corners = np.stack([out.corner[j, : count[j]].x, out.corner[j, : count[j]].y], axis=1)
    ranks = []
    for edge in range(count[i]):
        normal = np.array([out.corner[i, edge].normal_x, out.corner[i, edge].normal_y])
        gaps = (corners - (out.corner[i, edge].x, out.corner[i, edge].y)) @ normal
        gap, (x, y) = gaps.min(), corners[gaps.argmin()]
        if gap > spread:
            return False, 0.0, 0.0, 0.0
        px, py, turn = turning if gap <= SLACK else np.zeros(3)
        approach = -(way + np.array([px - turn * y, py + turn * x])) @ normal
        struck = gap > 2.0 * TOUCH * SLACK and approach > SQUARE * math.hypot(*way)
        gone = gap - TOUCH * SLACK if struck else gap + SLACK
        late = gap + SLACK >= NEVER * approach
        if gap < -SLACK:
            ranks.append((0.0, gap))
        else:
            ranks.append((NEVER if late else gone / approach, gap))
    return True, *max(ranks), max(gap for _, gap in ranks)


@given(st.integers(0, 10**6))
def test_the_face_of_contact_is_that_of_all_edges(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arrays = two_polygons(rng)
    for i, j in ((0, 1), (1, 0)):
        for reach in (0.0, 0.5, 3.0):
            way = rng.uniform(-reach, reach, 2)
            spread = math.hypot(*way) + SLACK
            turning = rng.uniform(-reach, reach, 3)
            wanted = over_all_edges(arrays, i, j, way, turning, spread)
            approach = Approach(*way, *turning, spread, SLACK)
            square = SQUARE * math.hypot(*way)
            possible, time, depth, apart, _ = face(arrays.outlines, i, j, approach, 0.0, square)
            assert possible == wanted[0]
            if possible:
                found = time, depth, apart
                np.testing.assert_allclose(found, wanted[1:], rtol=1e-9, atol=1e-12)


def test_the_circle_in_a_square_touches_its_edges() -> None:
    corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
    scene = Scene(None, (Block(corners),), rock())
    outlines = pack(scene, Settings(), np.zeros(0), (0.0, 0.0)).outlines
    polygon = outlines.polygon[0]
    assert math.isclose(polygon.inside, 1.0, rel_tol=1e-8) and polygon.inside < 1.0
    assert (polygon.middle_x, polygon.middle_y) == (2.0, 1.0)
