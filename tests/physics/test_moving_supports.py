"""What holds or loads a block that moves: bolts keep energy, dead loads turn it as an ODE says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from physics.helpers import GRAVITY, box
from physics.steps import STEPS, accepted, each, in_space, mechanical
from rigdda import Block, Bolt, PointLoad, Simulation

STIFFNESS, DENSITY = 2e6, 2600.0


def drift(sim: Simulation, scale: float, time: float = 20.0) -> float:
    """Return the greatest change of energy in a time [s] over a scale [J]."""
    start, worst = mechanical(sim), 0.0
    for _ in range(round(time / sim.settings.dt)):
        sim.step()
        worst = max(worst, abs(mechanical(sim) - start))
    return worst / scale


@pytest.mark.parametrize("dt", each(accepted(0.64)))
@pytest.mark.parametrize("held", [(0.0, 0.4), (0.0, 0.0), (0.3, 0.4)], ids=["top", "centre", "off"])
def test_a_block_that_swings_on_a_bolt_keeps_its_energy(held, dt):
    """A block of 0.8 m on a bolt of 2.5 m, in 20 s."""
    block = box(0.0, 0.0, 0.8, 0.8, velocity=(1.5, 0.0, 0.0))
    bolt = Bolt(0, held, None, (held[0], held[1] + 2.5), STIFFNESS)
    sim = in_space((block,), dt, gravity=GRAVITY, supports=(bolt,))
    assert drift(sim, 0.5 * DENSITY * 0.64 * 1.5**2) < 1e-3


@pytest.mark.parametrize("dt", each(accepted(0.64)))
def test_a_block_that_swings_on_two_bolts_keeps_its_energy(dt):
    block = box(0.0, 0.0, 0.8, 0.8, velocity=(1.5, 0.0, 0.0))
    bolts = [Bolt(0, (x, 0.4), None, (1.5 * x, 2.9), STIFFNESS) for x in (-0.4, 0.4)]
    sim = in_space((block,), dt, gravity=GRAVITY, supports=tuple(bolts))
    assert drift(sim, 0.5 * DENSITY * 0.64 * 1.5**2, 5.0) < 1e-3


@pytest.mark.parametrize("dt", each(accepted(0.64)))
@pytest.mark.parametrize("stiffness", [1e4, STIFFNESS])
def test_two_blocks_on_one_bolt_keep_their_energy_and_momentum(stiffness, dt):
    """They turn about one another in free space; the first one also spins."""
    blocks = (
        box(0.0, 0.0, 0.8, 0.8, velocity=(0.0, 1.5, 1.0)),
        box(2.5, 0.3, 0.8, 0.8, velocity=(0.0, -1.5, 0.0)),
    )
    bolt = Bolt(0, (0.3, 0.2), 1, (2.2, 0.3), stiffness)
    sim = in_space(blocks, dt, supports=(bolt,))
    before = sim.velocities[:, :2].sum(axis=0)
    assert drift(sim, mechanical(sim), 5.0) < 1e-3
    assert sim.velocities[:, :2].sum(axis=0) == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize("dt", each(accepted(0.64)))
def test_a_chain_of_blocks_on_bolts_keeps_its_energy(dt):
    """Two blocks, one below the other, the upper one on the ground's bolt."""
    blocks = (
        box(0.0, 0.0, 0.8, 0.8, velocity=(1.0, 0.0, 0.0)),
        box(0.0, -2.0, 0.8, 0.8, velocity=(1.5, 0.0, 0.0)),
    )
    bolts = (
        Bolt(0, (0.0, 0.4), None, (0.0, 2.4), STIFFNESS),
        Bolt(0, (0.0, -0.4), 1, (0.0, -1.6), STIFFNESS),
    )
    sim = in_space(blocks, dt, gravity=GRAVITY, supports=bolts)
    assert drift(sim, 0.5 * DENSITY * 0.64 * 1.5**2, 5.0) < 1e-3


FORCE, ARM, TIME = -2e4, (-0.9, 0.4), 2.0
"""Dead load [N], where it acts from the centroid [m], and time of the motion [s]."""


def turned_by_a_dead_load() -> np.ndarray:
    """Return height [m] and angle [rad] after `TIME` of a block of 2 x 1 m under weight and load.

    I th'' = F (x cos th - y sin th) with the arm (x, y) and I = m (2^2 + 1^2)/12.
    """
    mass = DENSITY * 2.0

    def rate(_: float, state: np.ndarray) -> tuple[float, ...]:
        arm = ARM[0] * math.cos(state[1]) - ARM[1] * math.sin(state[1])
        return state[2], state[3], FORCE / mass - GRAVITY, FORCE * arm / (mass * 5.0 / 12.0)

    found = solve_ivp(rate, (0.0, TIME), (0.0,) * 4, "DOP853", rtol=1e-12, atol=1e-12)
    return found.y[:2, -1]


def error_under_a_dead_load(dt: float) -> float:
    """Return the error of the angle [rad]."""
    block = Block([(-1.0, -0.5), (1.0, -0.5), (1.0, 0.5), (-1.0, 0.5)])
    sim = in_space((block,), dt, gravity=GRAVITY, loads=(PointLoad(0, ARM, (0.0, FORCE)),))
    sim.step(round(TIME / dt))
    height, angle = turned_by_a_dead_load()
    assert sim.poses[0, 1] == pytest.approx(height, abs=1e-9)
    return abs(float(sim.poses[0, 2]) - angle)


def test_a_dead_load_turns_a_block_with_an_error_of_second_order():
    errors = [error_under_a_dead_load(dt) for dt in STEPS]
    assert errors[-1] < 2e-3
    for k in range(len(STEPS) - 1):
        order = math.log(errors[k + 1] / errors[k]) / math.log(STEPS[k + 1] / STEPS[k])
        assert order > 1.8, STEPS[k]
