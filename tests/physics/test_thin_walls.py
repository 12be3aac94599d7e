"""Nothing passes a wall or a roof, at any step that is accepted and at up to 100 m/s."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from physics.helpers import FLAT, polygon, rock, rough
from physics.shapes import SHAPES, overlap, star
from physics.steps import each
from rigdda import Block, Scene, Settings, Simulation, Terrain, Wall
from rigdda.geometry import polygon_properties

WALL = Wall(x=10.0, height=30.0, thickness=0.2)
STEPS = (1e-3, 5e-3, 1e-2)
DEEPEST = {1e-3: 0.02, 5e-3: 0.03, 1e-2: 0.05}
"""Deepest that a corner may be in the wall at the end of a step [m]: a quarter of its thickness."""


def any_shape(rng: np.random.Generator, kind: int) -> np.ndarray:
    """Return a convex block, a star or one of the named shapes, 0.3 to 1.5 m in radius."""
    size = rng.uniform(0.3, 1.5)
    if kind == 0:
        return rough(rng, int(rng.integers(3, 9)), size)
    if kind == 1:
        return star(rng, int(rng.integers(5, 12)), size)
    corners = list(SHAPES.values())[rng.integers(len(SHAPES))]
    corners = corners - polygon_properties(corners)[1]
    return corners * size / np.hypot(*corners.T).max()


def shot(seed: int) -> tuple[Scene, float]:
    """Return a random block that flies at the thin wall, and its time of flight [s]."""
    rng = np.random.default_rng(seed)
    corners = any_shape(rng, seed % 3)
    speed = np.exp(rng.uniform(np.log(5.0), np.log(100.0)))
    climb = np.radians(rng.uniform(-20.0, 40.0))
    start = (rng.uniform(6.0, 8.0), rng.uniform(10.0, 14.0))
    velocity = (speed * np.cos(climb), speed * np.sin(climb), rng.uniform(-20.0, 20.0))
    block = Block(polygon(corners, start, rng.uniform(0.0, 2.0 * np.pi)), velocity=velocity)
    surfaces = rock(rng.uniform(0.0, 40.0), rng.uniform(0.0, 0.6))
    return Scene(Terrain(FLAT), (block,), surfaces, (WALL,)), (10.0 - start[0]) / velocity[0]


@pytest.mark.parametrize("dt", each(STEPS))
def test_thin_wall_stops_every_shape(dt):
    """200 random blocks: all arrive, none goes deep, none passes."""
    for seed in range(200):
        scene, flight = shot(seed)
        sim = Simulation(scene, Settings(dt=dt))
        for _ in range(round(1.2 * flight / dt) + 25):
            sim.step()
            assert sim.vertices(0)[:, 0].max() < WALL.x + DEEPEST[dt], (seed, sim.time)
        assert len(sim.run(dt).hits(0)) > 0, seed


# a cave: floor, back wall, a roof 0.5 m thick with a blunt tip, a tooth under it, notches beside
CAVE = Terrain(
    [
        *[(-40.0, 6.0), (0.0, 6.0), (0.0, 5.5), (-1.0, 5.5), (-1.0, 5.0), (-2.0, 5.0), (-2.0, 5.5)],
        *[(-8.0, 5.5), (-8.0, 0.0), (40.0, 0.0)],
    ]
)


def solid(terrain: Terrain) -> shapely.Polygon:
    """Return the ground as a polygon."""
    points = terrain.points
    return shapely.Polygon([*points, (points[-1, 0], -50.0), (points[0, 0], -50.0)])


THROWS = {
    "at the tip": ((6.0, 5.7), (-30.0, 0.0)),
    "over the tip": ((-6.0, 8.0), (5.0, 0.0)),
    "into the cave": ((6.0, 2.5), (-40.0, 0.0)),
    "up to the roof": ((-4.5, 2.5), (0.0, 40.0)),
    "up into the notch": ((-0.5, 2.5), (-3.0, 30.0)),
    "down on the roof": ((-4.5, 14.0), (0.0, -60.0)),
    "into the corner under the roof": ((-4.0, 2.5), (-50.0, 35.0)),
}


@pytest.mark.parametrize("throw", THROWS)
def test_nothing_passes_an_overhang(throw):
    ground = solid(CAVE)
    start, velocity = THROWS[throw]
    for seed in range(12):
        rng = np.random.default_rng(seed)
        corners = any_shape(rng, seed % 3)
        corners = polygon(corners, start, rng.uniform(0.0, 6.28))
        block = Block(corners, velocity=(*velocity, rng.uniform(-8.0, 8.0)))
        sim = Simulation(Scene(CAVE, (block,), rock(30.0, 0.3 * (seed % 2))), Settings())
        for _ in range(400):
            sim.step()
            area = shapely.Polygon(sim.vertices(0)).intersection(ground).area
            assert area < 0.05, (seed, sim.time)


def test_block_rests_under_a_thin_roof():
    """The floor carries it; the roof close above it pushes nobody."""
    low = Terrain([(-40.0, 1.3), (0.0, 1.3), (0.0, 1.1), (-8.0, 1.1), (-8.0, 0.0), (40.0, 0.0)])
    corners = [(-3.0, 0.0), (-1.0, 0.0), (-1.0, 1.0), (-3.0, 1.0)]
    sim = Simulation(Scene(low, (Block(corners),), rock()), Settings(sleeping=False))
    sim.step(200)
    assert np.abs(sim.velocities).max() < 1e-4
    assert sim.poses[0] == pytest.approx([-2.0, 0.5, 0.0], abs=1e-3)


def lunge(seed: int) -> tuple[Scene, shapely.Polygon]:
    """Return a random block that flies down at jagged ground, and the ground."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([[-60.0], np.sort(rng.uniform(-15.0, 15.0, 10)), [60.0]])
    x = x[np.insert(np.diff(x) > 0.4, 0, True)]
    terrain = Terrain(np.stack([x, rng.uniform(-2.5, 2.5, len(x))], axis=1))
    corners = any_shape(rng, seed % 3)
    speed = np.exp(rng.uniform(np.log(5.0), np.log(100.0)))
    dive = np.radians(rng.uniform(-150.0, -30.0))
    way = np.array([np.cos(dive), np.sin(dive)])
    start = np.array([rng.uniform(-8.0, 8.0), 0.0]) - rng.uniform(8.0, 11.0) * way
    corners = polygon(corners, start, rng.uniform(0.0, 2.0 * np.pi))
    block = Block(corners, velocity=(*(speed * way), rng.uniform(-20.0, 20.0)))
    surfaces = rock(rng.uniform(0.0, 40.0), rng.uniform(0.0, 0.6))
    return Scene(terrain, (block,), surfaces), solid(terrain)


@pytest.mark.parametrize("dt", [5e-3, 1e-2])
def test_nothing_passes_jagged_ground(dt):
    for seed in range(60):
        scene, ground = lunge(seed)
        sim = Simulation(scene, Settings(dt=dt))
        for _ in range(round(0.8 / dt)):
            sim.step()
            block = shapely.Polygon(sim.vertices(0))
            assert block.intersection(ground).area < 0.04 * block.area, (seed, sim.time)


@pytest.mark.parametrize("speed", [5.0, 50.0])
def test_concave_blocks_do_not_pass_each_other(speed):
    """In free space, head on, beside each other and spinning."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        pair = []
        for side in (-1.0, 1.0):
            corners = any_shape(rng, 1 + seed % 2)
            place = (3.0 * side, rng.uniform(-0.6, 0.6))
            velocity = (-0.5 * side * speed, 0.0, rng.uniform(-8.0, 8.0))
            pair.append(Block(polygon(corners, place, rng.uniform(0.0, 6.28)), velocity=velocity))
        sim = Simulation(Scene(None, pair, rock(30.0, 0.3), gravity=0.0), Settings())
        for _ in range(round(8.0 / speed / 5e-3)):
            sim.step()
            assert overlap(sim, 0, 1) < 0.02, (seed, sim.time)
