"""One block that strikes level ground corner by corner, against its exact motion.

Without gravity: between blows the block flies straight, and each blow follows from Newton's
restitution and Coulomb's friction.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import FLAT, masses, polygon, rock, rough
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import polygon_properties

TIME, LOOK = 0.06, 2e-5
"""Time of the motion, and between looks at the corners for the next blow [s]."""


def blow(
    velocity: np.ndarray, arm: np.ndarray, mass: float, inertia: float, e: float, friction: float
) -> tuple[np.ndarray, float]:
    """Return the velocity after a blow of the ground on a corner, and the energy it gave [J]."""
    rows = np.array([[0.0, 1.0, arm[0]], [1.0, 0.0, -arm[1]]])  # normal, shear
    gives = rows / [mass, mass, inertia] @ rows.T
    normal, shear = rows @ velocity
    impulse = np.linalg.solve(gives, [-(1.0 + e) * normal, -shear])
    if abs(impulse[1]) > friction * impulse[0]:
        for sign in (-np.sign(shear), np.sign(shear)):
            along = np.array([1.0, sign * friction])
            impulse = -(1.0 + e) * normal / (gives[0] @ along) * along
            if impulse[0] > 0.0 and (shear + gives[1] @ impulse) * sign < 0.0:
                break
    after = velocity + impulse @ rows / [mass, mass, inertia]
    return after, float(impulse @ rows @ (velocity + after) / 2.0)


def exact(block: Block, e: float, friction: float) -> tuple[np.ndarray, int, float]:
    """Return the last velocity of a block, how many blows it took and the most that one gave."""
    area, centre, second = polygon_properties(block.vertices)
    mass, inertia = block.density * area, block.density * second
    corners, left = block.vertices - centre, TIME
    pose, velocity = np.array([*centre, 0.0]), np.array(block.velocity)
    blows, gain = 0, -math.inf
    while blows < 100:
        times = np.arange(0.0, left + LOOK, LOOK)[:, None]
        cos, sin = np.cos(pose[2] + times * velocity[2]), np.sin(pose[2] + times * velocity[2])
        x, y = corners.T
        height = pose[1] + times * velocity[1] + sin * x + cos * y
        rise = velocity[1] + velocity[2] * (cos * x - sin * y)
        struck = (height <= 1e-12) & (rise < -1e-9)
        if not struck.any():
            break
        k = int(struck.any(axis=1).argmax())
        corner = int(np.where(struck[k], -height[k], -math.inf).argmax())
        wait = times[k, 0] - (height[k, corner] / rise[k, corner] if k > 0 else 0.0)
        pose, left, blows = pose + wait * velocity, left - wait, blows + 1
        arm = polygon(corners, angle=pose[2])[corner]
        velocity, gave = blow(velocity, arm, mass, inertia, e, friction)
        gain = max(gain, gave)
    return velocity, blows, gain


def thrown(seed: int) -> Block:
    """Return a random block that comes down obliquely."""
    rng = np.random.default_rng(seed)
    corners = polygon(rough(rng, int(rng.integers(3, 9))), angle=rng.uniform(0.0, 2.0 * math.pi))
    corners += (0.0, rng.uniform(0.02, 0.08) - corners[:, 1].min())
    speed = (rng.uniform(-8.0, 8.0), rng.uniform(-8.0, -2.0), rng.uniform(-5.0, 5.0))
    return Block(corners, velocity=speed)


def tipped(seed: int) -> Block:
    """Return a square that lands on a corner, the next one 0.3 mm to 3 cm above the ground."""
    rng = np.random.default_rng(seed)
    tilt = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.5, -1.5)
    corners = polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], angle=tilt)
    corners += (0.0, rng.uniform(0.02, 0.08) - corners[:, 1].min())
    return Block(corners, velocity=(rng.uniform(-3.0, 3.0), rng.uniform(-6.0, -2.0), 0.0))


def error(block: Block, e: float, friction_deg: float, dt: float) -> float | None:
    """Return the error of the last velocity over the first; None where a blow would give energy."""
    velocity, blows, gain = exact(block, e, math.tan(math.radians(friction_deg)))
    if blows == 0 or gain >= 0.0:
        return None
    scene = Scene(Terrain(FLAT), (block,), rock(friction_deg, e), gravity=0.0)
    sim = Simulation(scene, Settings(dt=dt, sleeping=False))
    mass, inertia = (float(one[0]) for one in masses(scene))
    sim.step(round(TIME / dt))
    weights = np.array([1.0, 1.0, math.sqrt(inertia / mass)])
    off = weights * (sim.velocities[0] - velocity)
    return float(np.linalg.norm(off) / np.linalg.norm(weights * np.array(block.velocity)))


@pytest.mark.parametrize("dt", [1e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("e", [0.3, 0.6, 0.8, 0.9])
@pytest.mark.parametrize("kind", [thrown, tipped])
def test_restitution_is_as_prescribed_at_any_step(kind, e, dt):
    """Blow by blow, several in a step among them; friction may do work that is positive."""
    errors = [error(kind(seed), e, 10.0 + 35.0 * (seed % 7) / 6.0, dt) for seed in range(100)]
    errors = [one for one in errors if one is not None]
    assert len(errors) > 35
    assert max(errors) < 0.01
