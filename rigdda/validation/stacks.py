"""Stacks of cubes at rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rigdda.model.scene import Block, Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, box, rock

OFFSET = 1e-4
"""Greatest random horizontal offset of a cube [m]."""

SPACING = 1.1
"""Spacing of the cubes in a row of the pyramid [m], such that neighbours do not touch."""


def tower(rng: np.random.Generator, count: int) -> tuple[Block, ...]:
    """Return a tower of one-metre cubes, slightly out of line."""
    return tuple(box(x, 0.5 + i) for i, x in enumerate(rng.uniform(-OFFSET, OFFSET, count)))


def pyramid(rng: np.random.Generator, rows: int) -> tuple[Block, ...]:
    """Return rows of cubes, each with one cube less, placed on the gaps of the row below."""
    return tuple(
        box(SPACING * (i + 0.5 * row) + rng.uniform(-OFFSET, OFFSET), 0.5 + row)
        for row in range(rows)
        for i in range(rows - row)
    )


def heavy_on_light(rng: np.random.Generator, ratio: float) -> tuple[Block, ...]:
    """Return a cube of 2.6 t on a cube whose mass is smaller by the factor `ratio`."""
    low, high = rng.uniform(-OFFSET, OFFSET, 2)
    return box(low, 0.5, density=2600.0 / ratio), box(high, 1.5)


def measure(lab: Lab, blocks: Sequence[Block]) -> tuple[Measured, Measured, Measured]:
    """Simulate blocks at rest for 60 s without sleeping, and their speed over the last 10 s."""
    sim = lab.simulate(Scene(Terrain(FLAT), tuple(blocks), rock()), sleeping=False)
    start = sim.poses[:, :2]
    sim.step(lab.steps(50.0))
    speed = 0.0
    for _ in range(lab.steps(10.0) // 10):
        sim.step(10)
        speed = max(speed, float(np.hypot(*sim.velocities[:, :2].T).max()))
    moved = np.hypot(*(sim.poses[:, :2] - start).T)
    return Measured(moved), Measured(speed), Measured(sim.diagnostics.penetration)


def case(
    name: str, make: Callable[[np.random.Generator], Sequence[Block]], deepest: float, slow: bool
) -> Case:
    """Return the case of blocks whose penetration must not exceed `deepest` [m]."""
    return Case(
        name,
        (
            Check("displacement", "none: it stands", "m", 0.02, "bound"),
            Check("speed at end", "none: it is at rest", "m/s", 1e-4, "bound"),
            Check("penetration", "none: rigid", "m", deepest, "bound"),
        ),
        lambda lab: measure(lab, make(lab.random())),
        slow=slow,
    )


CASES = (
    case("stack-10", lambda rng: tower(rng, 10), 1e-3, False),
    case("stack-25", lambda rng: tower(rng, 25), 1e-3, False),
    case("stack-50", lambda rng: tower(rng, 50), 4e-4, False),
    case("stack-100", lambda rng: tower(rng, 100), 1e-4, True),
    case("pyramid-55", lambda rng: pyramid(rng, 10), 1e-3, False),
    case("mass-1-100", lambda rng: heavy_on_light(rng, 100.0), 1e-3, False),
    case("mass-1-1000", lambda rng: heavy_on_light(rng, 1000.0), 5e-3, False),
)
