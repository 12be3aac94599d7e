"""The time steps at which what is right must be right, and scenes that several files share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest

from physics.helpers import FLAT, GRAVITY, rock
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.model.settings import longest_step

STEPS = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
"""Time steps [s]; a scene of small blocks does not accept the longest."""


def accepted(*areas: float) -> tuple[float, ...]:
    """Return the steps [s] that a scene with free blocks of these areas [m2] accepts."""
    longest = longest_step(np.array(areas), GRAVITY)
    return tuple(dt for dt in STEPS if dt <= longest)


def each(steps: Sequence[float]) -> list[Any]:
    """Return steps [s] as parameters of a test.

    The shortest is marked slow: it takes about as long as all others, and the same path.
    """
    shortest = min(steps)
    marks = pytest.mark.slow
    return [pytest.param(dt, marks=marks) if dt == shortest else dt for dt in steps]


def on_floor(
    blocks: Iterable[Block], dt: float, friction_deg: float = 30.0, restitution: float = 0.0
) -> Simulation:
    """Return a simulation of blocks on level ground, none of which sleeps."""
    scene = Scene(Terrain(FLAT), tuple(blocks), rock(friction_deg, restitution))
    return Simulation(scene, Settings(dt=dt, sleeping=False))


def in_space(
    blocks: Iterable[Block],
    dt: float,
    friction_deg: float = 0.0,
    restitution: float = 0.0,
    **scene: Any,
) -> Simulation:
    """Return a simulation of blocks in free space, by default without gravity."""
    how = {"gravity": 0.0} | scene
    scene_ = Scene(None, tuple(blocks), rock(friction_deg, restitution), **how)
    return Simulation(scene_, Settings(dt=dt, sleeping=False))


def mechanical(sim: Simulation) -> float:
    """Return kinetic plus potential plus elastic energy [J]."""
    return float(sum(sim.energy()[:3]))
