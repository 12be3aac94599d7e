"""The original DDA: closed forms of stress and strain, and what it shares with the rigid blocks."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.deformable import cases
from experiments.deformable.model import Deformable, Rock
from experiments.deformable.submatrices import area_moments, set_inertia
from rigdda import Block, Scene, Settings, Simulation, Surface, Terrain
from rigdda.geometry import polygon_properties
from rigdda.kernel import from_python
from rigdda.validation.scenes import FLAT, box, ngon

pytestmark = pytest.mark.slow
"""Its kernels take a minute to compile, and nothing of the package depends on them."""

PLAIN = {"rock": Surface(30.0, restitution=None)}


def test_bar_bears_its_weight() -> None:
    computed, exact = cases.bar_under_its_weight()
    np.testing.assert_allclose(computed, exact, rtol=0.01)


def test_column_shortens_and_widens_under_a_load() -> None:
    computed, exact = cases.column_in_compression()
    np.testing.assert_allclose(computed, exact, rtol=0.01)


def test_stiff_block_falls_and_stops_as_a_rigid_one() -> None:
    scene = Scene(Terrain(FLAT), (box(0.0, 0.7),), PLAIN)
    settings = Settings(dt=2e-3, sleeping=False, penetration=1e-3)
    rigid, stiff = Simulation(scene, settings), Deformable(scene, settings, Rock(young=1e13))
    for steps in (90, 60):  # in flight, and at the ground
        rigid.step(steps)
        stiff.step(steps)
        np.testing.assert_allclose(stiff.vertices(0), rigid.vertices(0), atol=2e-4)


def test_inertia_of_a_polygon_is_that_of_a_rigid_block() -> None:
    corners = ngon(5, 1.3, (2.0, -1.0), 0.4)
    scene = Scene(None, (Block(corners, density=1.0),), PLAIN)
    arrays = Simulation(scene).loop.arrays
    area, (x, y), polar = polygon_properties(corners)
    moments = from_python(area_moments)(arrays.outlines, 0, len(corners), x, y)
    assert moments[0] == pytest.approx(area)
    matrix = np.zeros((6, 6))
    from_python(set_inertia)(matrix, area, moments)
    assert matrix[2, 2] == pytest.approx(polar)
    assert matrix[5, 5] == pytest.approx(0.25 * polar)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_concave_and_fixed_blocks_are_refused() -> None:
    notched = Block([(0, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)])
    with pytest.raises(ValueError, match="convex"):
        Deformable(Scene(None, (notched,), PLAIN), Settings())
    blocks = (box(), box(3.0, fixed=True))
    with pytest.raises(ValueError, match="free"):
        Deformable(Scene(None, blocks, PLAIN), Settings())
