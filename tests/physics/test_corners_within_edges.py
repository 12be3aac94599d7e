"""Corners within an edge change nothing: neither at rest nor in a fall."""

import numpy as np
import pytest

from rigdda import Block, Scene, Settings, Simulation, Terrain
from tests.physics.helpers import FLAT, rock

SQUARE = np.array([(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)])


def split(corners: np.ndarray, extra: int, bend: float, rng: np.random.Generator) -> np.ndarray:
    """Return corners with others at random within each edge, bent outwards by up to `bend` [m]."""
    found = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        out = np.array([b[1] - a[1], a[0] - b[0]])
        places = np.sort(rng.uniform(0.1, 0.9, extra))
        found += [a, *(a + t * (b - a) + 4.0 * t * (1.0 - t) * bend * out for t in places)]
    return np.array(found)


def moved(blocks: list[Block], time: float = 5.0) -> tuple[float, float]:
    """Return how far a scene on level ground moves at most [m], and how far it turns [rad]."""
    run = Simulation(Scene(Terrain(FLAT), blocks, rock(30.0))).run(time)
    way = run.poses[-1] - run.poses[0]
    return float(np.hypot(*way[:, :2].T).max()), float(np.abs(way[:, 2]).max())


@pytest.mark.parametrize("bend", [0.0, 1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize(("count", "extra"), [(5, 1), (5, 3), (10, 2), (20, 1)])
def test_a_stack_stands(count, extra, bend):
    rng = np.random.default_rng(count)
    blocks = [Block(split(SQUARE, extra, bend, rng) + np.array([0.0, i])) for i in range(count)]
    way, turn = moved(blocks)
    assert way < 1e-3  # what contacts give way under the load, each in its own measure
    assert turn < 1e-4


def test_edges_that_are_bent_by_a_tenth_of_a_millimetre_rest_on_what_bears():
    rng = np.random.default_rng(0)
    way, turn = moved([Block(split(SQUARE, 1, 1e-4, rng) + np.array([0.0, i])) for i in range(5)])
    assert way < 5e-3
    assert turn < 2e-3


def test_brickwork_whose_nodes_are_corners_of_its_blocks_stands():
    """Each course is half a block off, so that the joints above and below split its edges."""
    brick = np.array([(0, 0), (0.5, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0, 0.5)], dtype=float)
    half = np.array([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)], dtype=float)
    blocks = []
    for course in range(6):
        if course % 2 == 0:
            rows = [brick + np.array([x, 0.0]) for x in range(4)]
        else:
            rows = [
                half,
                *(brick + np.array([x + 0.5, 0.0]) for x in range(3)),
                half + np.array([3.5, 0.0]),
            ]
        blocks += [Block(row + np.array([0.0, 0.5 * course])) for row in rows]
    way, turn = moved(blocks)
    assert way < 1e-3
    assert turn < 1e-3


@pytest.mark.parametrize("dt", [2e-3, 5e-3, 1e-2])
def test_a_flat_drop_does_not_turn(dt):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        base = Block(split(SQUARE, 2, 0.0, rng), fixed=True)
        top = Block(split(SQUARE, 2, 0.0, rng) + np.array([rng.uniform(-0.3, 0.3), 1.5]))
        run = Simulation(Scene(None, [base, top], rock(30.0)), Settings(dt=dt)).run(3.0)
        assert abs(run.poses[-1, 1, 2]) < 1e-3
        assert run.poses[-1, 1, 1] == pytest.approx(run.poses[0, 1, 1] - 0.5, abs=2e-3)


def test_a_block_slides_over_edges_that_are_split():
    """As far as over one edge: half the square of the speed over friction times gravity."""
    rng = np.random.default_rng(3)
    floor = np.array([(-5.0, -1.0), (15.0, -1.0), (15.0, 0.0), (-5.0, 0.0)])
    ways = []
    for extra in (0, 4):
        base = Block(split(floor, extra, 0.0, rng), fixed=True)
        block = Block(split(SQUARE, extra, 0.0, rng), velocity=(6.0, 0.0, 0.0))
        run = Simulation(Scene(None, [block, base], rock(30.0))).run(3.0)
        ways.append(run.poses[-1, 0, 0] - run.poses[0, 0, 0])
    assert ways[0] == pytest.approx(18.0 / (9.81 * np.tan(np.radians(30.0))), rel=0.01)
    assert ways[1] == pytest.approx(ways[0], rel=0.01)
