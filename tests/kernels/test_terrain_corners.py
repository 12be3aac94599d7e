"""Corners of the terrain: blocks in notches, in wedges and on ridges, none through the ground."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from physics.helpers import box, ngon, polygon, rock, rough

import rigdda
from rigdda import Block, Scene, Settings, Simulation, Terrain, Wall


def notch(opening_deg: float) -> Terrain:
    """Return a V that opens upwards by `opening_deg`, its bottom at the origin."""
    half = math.radians(0.5 * opening_deg)
    x, y = 40.0 * math.sin(half), 40.0 * math.cos(half)
    return Terrain([(-x, y), (0.0, 0.0), (x, y)])


def solid(scene: Scene) -> shapely.Geometry:
    """Return ground and walls as one polygon."""
    points = scene.terrain.points
    low = points[:, 1].min() - 100.0
    parts = [shapely.Polygon([*points, (points[-1, 0], low), (points[0, 0], low)])]
    return shapely.union_all(
        parts + [shapely.Polygon(b.outline(scene.terrain)) for b in scene.barriers]
    )


def deepest(scene: Scene, duration: float, settings: Settings | None = None):
    """Run; return the simulation and the greatest area of the block that was in the ground."""
    sim, ground, most = Simulation(scene, settings or Settings(sleeping=False)), solid(scene), 0.0
    for _ in range(round(duration / sim.settings.dt)):
        sim.step()
        most = max(most, shapely.Polygon(sim.vertices(0)).intersection(ground).area)
    return sim, most


def tossed(terrain: Terrain, seed: int, at=(1.5, 8.0), barriers=()) -> Scene:
    """Return a random block with random friction and restitution, dropped into the corner."""
    rng = np.random.default_rng(seed)
    friction = rng.uniform(5.0, 45.0)
    corners = polygon(rough(rng, rng.integers(3, 9), rng.uniform(0.5, 1.2)), at)
    velocity = (rng.uniform(-2.0, 1.0), 0.0, rng.uniform(-3.0, 3.0))
    return Scene(
        terrain, (Block(corners, velocity=velocity),), rock(friction, 0.3 * (seed % 3)), barriers
    )


@pytest.mark.parametrize("seed", [2, 3, 8, 18, 34, 39])
@pytest.mark.parametrize("opening", [60.0, 90.0, 120.0])
def test_block_comes_to_rest_in_a_notch(opening, seed):
    """It hangs on both faces: at rest after 15 s, penetration under 1 mm, never deep."""
    sim, area = deepest(tossed(notch(opening), seed), 15.0)
    assert area < 0.02
    assert sim.diagnostics.penetration < 0.1
    assert sim.contacts()["penetration"].max() < 1e-3
    assert np.abs(sim.velocities).max() < 1e-2


@pytest.mark.parametrize("slope, seed", [(60, 10), (60, 16), (45, 125), (75, 146), (75, 3)])
def test_block_wedges_between_slope_and_wall(slope, seed):
    """A jam of rigid bodies stores nothing: no speed beyond that of the fall, no jump into it."""
    run = 40.0 * math.cos(math.radians(slope))
    terrain = Terrain([(-run, 40.0 * math.sin(math.radians(slope))), (0.0, 0.0), (30.0, 0.0)])
    start = (-1.2, 7.0 + 1.2 * math.tan(math.radians(slope)))
    scene = tossed(terrain, seed, start, (Wall(0.2, 6.0),))
    sim, area = deepest(scene, 8.0)
    assert area < 0.02
    assert sim.diagnostics.penetration < 0.1
    assert np.hypot(*sim.velocities[0, :2]) < 20.0


@pytest.mark.parametrize("sides", [24, 66, 74, 150])
def test_many_sided_block_stays_out_of_a_right_angle(sides):
    """All contacts of a step are kept, whatever the room of the contact buffer."""
    terrain = Terrain([(-60.0, 0.0), (0.0, 0.0), (0.0, 60.0)])
    block = Block(ngon(sides, 1.0, (-3.0, 3.0)), velocity=(30.0, -30.0, 0.0))
    sim = Simulation(Scene(terrain, (block,), rock(10.0)))
    worst = 0.0
    for _ in range(200):
        sim.step()
        corners = sim.vertices(0)
        worst = max(worst, corners[:, 0].max(), -corners[:, 1].min())
    assert worst < 0.1


RIDGE = Terrain([(-20.0, -20.0), (0.0, 0.0), (20.0, -20.0)])


@pytest.mark.parametrize("height", [0.5, 3.0])
def test_block_balances_on_a_ridge(height):
    """A square centred over the ridge stays there, flat."""
    sim, area = deepest(Scene(RIDGE, (box(0.0, height),), rock(40.0)), 5.0)
    assert sim.poses[0] == pytest.approx([0.0, 0.5, 0.0], abs=1e-3)
    assert area < 1e-3


SPIKE = Terrain([(-20.0, 0.0), (0.0, 0.0), (0.05, 10.0), (0.1, 0.0), (20.0, 0.0)])


@pytest.mark.parametrize("spin", [0.0, 5.0, 20.0])
@pytest.mark.parametrize(
    "terrain, at, velocity",
    [
        (RIDGE, (0.1, 10.0), (0.0, -60.0)),
        (SPIKE, (-5.0, 5.0), (50.0, 0.0)),
        (SPIKE, (0.03, 14.0), (0.0, -10.0)),
    ],
    ids=["ridge", "side of a spike", "tip of a spike"],
)
def test_block_does_not_pass_a_ridge(terrain, at, velocity, spin):
    block = box(*at, angle=0.2, velocity=(*velocity, spin))
    _, area = deepest(Scene(terrain, (block,), rock(40.0)), 2.0)
    assert area < 0.01


OVERHANG = Terrain([(-20.0, 10.0), (0.0, 10.0), (-3.0, 8.0), (-3.0, 0.0), (40.0, 0.0)])


@pytest.mark.parametrize(
    "at, velocity",
    [
        ((-8.0, 10.5), (6.0, 0.0, 0.0)),
        ((5.0, 1.5), (-20.0, 0.0, 3.0)),
        ((-1.0, 4.0), (-5.0, 30.0, 3.0)),
        ((5.0, 9.9), (-40.0, 3.0, 3.0)),
    ],
    ids=["over", "under", "up from below", "against its tip"],
)
def test_overhang_is_solid_from_all_sides(at, velocity):
    _, area = deepest(Scene(OVERHANG, (box(*at, velocity=velocity),), rock(10.0)), 5.0)
    assert area < 0.02


@pytest.mark.parametrize(
    "points",
    [
        [(-20.0, 16.8), (0.0, 0.0), (60.0, -21.9)],
        [(-20.0, 16.8), (0.0, 0.0), (80.0, 0.0)],
        [(-20.0, 7.3), (0.0, 0.0), (60.0, -61.8)],
    ],
    ids=["concave", "concave to flat", "convex"],
)
def test_block_slides_over_a_change_of_slope(points):
    terrain = Terrain(points)
    angle = math.atan2(points[0][1], -points[0][0])
    foot = np.array([-10.0, terrain.height(-10.0)])
    centre = foot + 0.5 * np.array([math.sin(angle), math.cos(angle)])
    sim, area = deepest(Scene(terrain, (box(*centre, angle=-angle),), rock(10.0)), 4.0)
    assert sim.poses[0, 0] > 0.0
    assert area < 0.02
    assert isinstance(sim, rigdda.Simulation)
