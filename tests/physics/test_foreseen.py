"""What a blow drives a block into is not sunk into deeply."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import rock
from rigdda import Block, Scene, Settings, Simulation, Terrain

BLOW = 8.0
"""Speed of the block that falls [m/s]: 0.08 m in a step of 10 ms."""


def square(x: float, y: float = 0.0, size: float = 1.0, **more) -> Block:
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    return Block(size * corners + [x, y], **more)


def struck_row(blocks: int, gap: float, speed: float) -> Scene:
    """Return blocks at rest in a row, a gap from a fixed one, and a heavier one that strikes."""
    row = [square(1.001 * i) for i in range(blocks)]
    end = square(1.001 * blocks + gap, fixed=True)
    striking = square(-2.1, -0.5, 2.0, velocity=(speed, 0.0, 0.0))
    return Scene(None, (striking, *row, end), rock(restitution=0.0), gravity=0.0)


def struck_overhang(lean: float) -> Scene:
    """Return a slab that reaches over the edge of a bench, and a heavier block that falls on it.

    It leans by so much [rad] the wrong way for its edge to rest on the ridge now.
    """
    cos, sin = math.cos(lean), math.sin(lean)
    slab = np.array([(-1.0, 0.0), (1.0, 0.0), (1.0, 0.5), (-1.0, 0.5)])
    slab = slab @ np.array([[cos, sin], [-sin, cos]]) + [0.3, 0.003 + 0.7 * sin]
    above = slab[:, 1].max() + 0.05
    bench = Terrain([(-10.0, 0.0), (0.0, 0.0), (6.0, -8.0), (30.0, -8.0)])
    falling = square(0.4, above, 2.0, velocity=(0.0, -BLOW, 0.0))
    return Scene(bench, (Block(slab), falling), rock(restitution=0.0))


def deepest(scene: Scene, dt: float) -> float:
    sim = Simulation(scene, Settings(dt=dt))
    sim.run(0.5, dt)
    return sim.diagnostics.penetration


@pytest.mark.parametrize("blocks", [1, 2])
@pytest.mark.parametrize("gap", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("speed", [8.0, 16.0, 32.0])
def test_a_block_at_rest_is_not_driven_into_its_neighbour(
    blocks: int, gap: float, speed: float
) -> None:
    """No deeper than a few hundredths of a block, where the blow comes 0.16 m in a step."""
    scene = struck_row(blocks, gap, speed)
    assert deepest(scene, 0.16 / speed) < 0.04


@pytest.mark.parametrize("lean", [0.0, 0.003, 0.01, 0.03])
def test_a_slab_is_not_driven_onto_a_ridge(lean: float) -> None:
    scene = struck_overhang(lean)
    assert deepest(scene, 0.01) < 0.015
