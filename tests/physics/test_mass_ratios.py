"""A heavy block that falls on a light stone rebounds by the restitution, at any ratio of masses.

The stone lies on the ground, so that the blow goes through it: with few sweeps it would act as a
spring.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import GRAVITY, box, ngon
from physics.steps import STEPS, each, mechanical, on_floor
from rigdda import Block, Simulation

SPEED, CLEARANCE = 8.0, 1e-3
"""Speed of the heavy block at the start [m/s], and its height over the stone [m]."""

DENSITY = 2600.0
AREA = 2.0 * math.sqrt(2.0)
"""Area of an octagon of circumradius 1 m [m2]."""


def dropped(
    ratio: float, side: float, restitution: float, dt: float, off: float = 0.0, tilt: float = 0.0
) -> Simulation:
    """Return an octagon of 2 m that falls on a stone of `side` [m], `ratio` times as heavy as it.

    It is `off` [m] beside the stone's centre and rotated by `tilt` [rad] from lying on a face.
    """
    corners = ngon(8, angle=math.pi / 8.0 + tilt)
    corners += (off, side + CLEARANCE - corners[:, 1].min())
    heavy = Block(corners, DENSITY, velocity=(0.0, -SPEED, 0.0))
    stone = box(0.0, side / 2.0, side, side, density=DENSITY * AREA / side**2 / ratio)
    return on_floor((heavy, stone), dt, restitution=restitution)


def side_of(ratio: float) -> float:
    """Return the side [m] of a stone of the octagon's density."""
    return math.sqrt(AREA / ratio)


STONES = [(ratio, side_of(ratio)) for ratio in (11.0, 31.0, 71.0, 283.0)]
STONES += [(ratio, 0.2) for ratio in (283.0, 1000.0)]
IDS = [f"{ratio:.0f}-of-{side:.2f}m" for ratio, side in STONES]


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize(("ratio", "side"), STONES, ids=IDS)
def test_a_heavy_block_rebounds_from_a_light_stone(ratio, side, restitution, dt):
    """By the restitution within 1 % of its speed; 10 ms after it the weight is allowed for."""
    sim = dropped(ratio, side, restitution, dt)
    impact = CLEARANCE / SPEED
    steps = round(0.02 / dt) + 1
    sim.step(steps)
    wanted = restitution * (SPEED + GRAVITY * impact)
    if restitution > 0.0:
        wanted -= GRAVITY * (steps * dt - impact)
    assert sim.velocities[0, 1] == pytest.approx(wanted, abs=0.01 * SPEED)
    assert np.abs(sim.velocities[0, [0, 2]]).max() < 0.01 * SPEED


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("ratio", [71.0, 1000.0, 1e4])
def test_energy_does_not_grow_when_heavy_falls_on_light(ratio, restitution, dt):
    """Also if the block lands with a corner or beside the stone's centre."""
    for off, tilt in ((0.0, 0.0), (0.3, 0.0), (0.05, 0.1), (0.0, math.pi / 8.0), (0.3, 0.1)):
        sim = dropped(ratio, 0.2, restitution, dt, off, tilt)
        start, blow = mechanical(sim), 0.5 * DENSITY * AREA * SPEED**2
        most = -math.inf
        for _ in range(round(0.5 / dt)):
            sim.step()
            most = max(most, mechanical(sim))
        assert most - start < 1e-3 * blow, (off, tilt)


@pytest.mark.parametrize("dt", each(STEPS))
@pytest.mark.parametrize("restitution", [0.0, 0.3])
@pytest.mark.parametrize("ratio", [100.0, 1000.0])
def test_a_heavy_slab_falls_flat_on_a_row_of_light_stones(ratio, restitution, dt):
    """It rebounds by the restitution and does not turn; energy does not grow."""
    density = DENSITY * 4.0 / 0.04 / ratio
    stones = [box(x, 0.1, 0.2, 0.2, density=density) for x in (-1.5, -0.5, 0.5, 1.5)]
    slab = box(0.0, 0.7 + CLEARANCE, 4.0, 1.0, velocity=(0.0, -SPEED, 0.0))
    sim = on_floor((slab, *stones), dt, restitution=restitution)
    start, blow = mechanical(sim), 0.5 * DENSITY * 4.0 * SPEED**2
    impact, steps = CLEARANCE / SPEED, round(0.02 / dt) + 1
    for _ in range(steps):
        sim.step()
        assert mechanical(sim) - start < 1e-3 * blow
    wanted = restitution * (SPEED + GRAVITY * impact)
    if restitution > 0.0:
        wanted -= GRAVITY * (steps * dt - impact)
    assert sim.velocities[0, 1] == pytest.approx(wanted, abs=0.01 * SPEED)
    # an end of the slab, 2 m from its centre, may move by the tolerance of sweeps, 1 cm/s
    assert abs(sim.velocities[0, 2]) < 5e-3
