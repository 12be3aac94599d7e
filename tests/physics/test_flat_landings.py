"""Blocks that land flat do not turn, and rebound each time by the restitution."""

from __future__ import annotations

import math

import numpy as np
import pytest

from physics.helpers import GRAVITY, box
from physics.steps import accepted, each, on_floor
from rigdda import Block

COLUMNS = [(0.2, 0.8), (0.2, 2.0), (0.2, 4.0), (0.2, 8.0), (1.0, 4.0), (0.5, 5.0)]
"""Widths and heights [m], from 1:4 to 1:40."""


def rectangle(width: float, height: float, above: float, x: float = 0.0, first: int = 0) -> Block:
    """Return a rectangle `above` the ground [m]; its list of corners begins at `first`."""
    corners = box(x, above + height / 2.0, width, height).vertices
    return Block(np.roll(corners, -first, axis=0))


def cases() -> list:
    """Return columns, heights of fall and accepted steps."""
    return [
        pytest.param(width, height, drop, dt, id=f"{width:g}x{height:g}-{drop:g}m-{1e3 * dt:g}ms")
        for width, height in COLUMNS
        for drop in (0.3, 1.0, 3.0)
        for dt in accepted(width * height)
    ]


@pytest.mark.parametrize(("width", "height", "drop", "dt"), cases())
def test_a_column_lands_upright_and_stands(width, height, drop, dt):
    """Whichever corner is the first of its list."""
    for first in range(4):
        sim = on_floor([rectangle(width, height, drop, first=first)], dt)
        sim.step(round(math.sqrt(2.0 * drop / GRAVITY) / dt) + 3)
        assert abs(sim.velocities[0, 2]) < 1e-6, first
        assert abs(sim.velocities[0, 0]) < 1e-6, first
        assert abs(sim.velocities[0, 1]) < GRAVITY * dt, first
        sim.step(round(3.0 / dt))
        assert abs(sim.poses[0, 2]) < 1e-6, first
        assert sim.poses[0, :2] == pytest.approx((0.0, height / 2.0), abs=1e-3), first


def apexes(heights: list[float], speeds: list[float]) -> list[float]:
    """Return the heights [m] at which a thrown block turns, exact between its steps.

    `heights` and `speeds` are those of the steps: while it flies, h + v^2/2g is constant.
    """
    found, rises = [], False
    for h, v in zip(heights, speeds, strict=True):
        if v > 0.0:
            rises, last = True, h + v * v / (2.0 * GRAVITY)
        elif rises:
            found.append(last)
            rises = False
    return found


@pytest.mark.parametrize("dt", each(accepted(1.0)))
@pytest.mark.parametrize("restitution", [0.8, 0.5])
@pytest.mark.parametrize("first", [0, 2])
def test_a_square_rebounds_by_the_restitution_time_after_time(restitution, first, dt):
    """The n-th height is e^2n of the first; five rebounds, without a turn."""
    drop = 1.93
    sim = on_floor([rectangle(1.0, 1.0, drop, first=first)], dt, restitution=restitution)
    heights, speeds = [], []
    for _ in range(round(4.0 / dt)):
        sim.step()
        heights.append(float(sim.poses[0, 1]) - 0.5)
        speeds.append(float(sim.velocities[0, 1]))
    found = apexes(heights, speeds)
    # below 5 cm the rise to where the block rests, 0.1 mm, is felt
    wanted = [h for n in range(1, 6) if (h := drop * restitution ** (2 * n)) > 0.05]
    assert found[: len(wanted)] == pytest.approx(wanted, rel=0.01)
    assert np.abs(sim.poses[0, [0, 2]]).max() < 1e-6


@pytest.mark.parametrize("dt", each(accepted(1.0)))
@pytest.mark.parametrize("gap", [0.0, 1e-3, 1e-2, 0.1])
def test_a_row_of_squares_falls_and_rebounds_as_each_of_them(gap, dt):
    """Three side by side, dropped together, in 2 s: two rebounds."""
    blocks = [rectangle(1.0, 1.0, 1.93, i * (1.0 + gap)) for i in range(3)]
    sim = on_floor(blocks, dt, restitution=0.8)
    lone = on_floor(blocks[:1], dt, restitution=0.8)
    sim.step(round(2.0 / dt))
    lone.step(round(2.0 / dt))
    assert np.abs(sim.velocities - lone.velocities[0]).max() < 0.05
    assert np.abs(sim.poses[:, 2]).max() < 1e-6
    assert sim.poses[:, 1] == pytest.approx(np.full(3, lone.poses[0, 1]), abs=0.01)
