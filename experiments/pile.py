"""A wall of bricks, pressed by its weight and a load, for measurements of one step."""

from __future__ import annotations

import numpy as np

from rigdda import Block, PointLoad, Scene, Settings, Simulation, Terrain
from rigdda.islands import find_islands, pair_blocks
from rigdda.kernel import entry_kernel
from rigdda.open_close import assemble_island
from rigdda.records import CONTACTS, Bodies, Contacts, Matrix, Parameters, Work
from rigdda.scene import Surface
from rigdda.validation.scenes import GRAVITY, box

WIDTH, HEIGHT = 2.0, 1.0
"""Size of a brick [m]."""

DT = 5e-3
"""Time step [s]."""

LOAD = 10.0
"""Load on each brick of the top course over its weight [-]."""

SETTLING = 20
"""Static steps after which every contact is pressed."""


def wall(courses: int, columns: int) -> Scene:
    """Return bricks in running bond on level ground, every other course shifted by half a brick.

    Contacts are the paper's plain penalty springs.
    """
    blocks = tuple(
        box(WIDTH * (column + 0.5 * (course % 2)), HEIGHT * (course + 0.5), WIDTH, HEIGHT)
        for course in range(courses)
        for column in range(columns)
    )
    top = range((courses - 1) * columns, courses * columns)
    loads = [_load(i, blocks[i]) for i in top]
    ground = Terrain(((-50.0, 0.0), (WIDTH * columns + 50.0, 0.0)))
    return Scene(ground, blocks, {"rock": Surface(30.0, restitution=None)}, loads=tuple(loads))


def _load(index: int, block: Block) -> PointLoad:
    x, y = block.vertices.mean(axis=0)
    weight = block.density * WIDTH * HEIGHT * GRAVITY
    return PointLoad(index, (float(x), float(y)), (0.0, -LOAD * weight))


def settings(h: float, **more: object) -> Settings:
    """Return settings with k_n dt^2 / (2 m) = h in contacts: the penetration g dt^2 / (2 h)."""
    return Settings(dt=DT, penetration=0.5 * GRAVITY * DT**2 / h, sleeping=False, **more)  # type: ignore[arg-type]


def system(scene: Scene, h: float) -> tuple[Matrix, int, int]:
    """Return the simultaneous equations of the next step of a pressed scene.

    Returns
    -------
    matrix : Matrix
        K d = F, block-sparse.
    n, pairs : int
        Blocks, and pairs of blocks that touch.
    """
    sim = Simulation(scene, settings(h, mode="static", islands=False))
    sim.step(SETTLING)
    a = sim._arrays
    count = int(sim._counters[CONTACTS])
    a.bodies["vx"] = a.bodies["vy"] = a.bodies["omega"] = 0.0
    pairs = assemble(a.bodies, sim._now, count, a.matrix, a.work, a.parameters[0])
    return a.matrix, len(scene.blocks), pairs


@entry_kernel
def assemble(
    bodies: Bodies, c: Contacts, count: int, m: Matrix, work: Work, p: Parameters
) -> int:
    """Assemble all blocks as one island with their contacts as they are; returns the pairs."""
    find_islands(bodies, c, count, work, p.blocks, False)
    pairs = pair_blocks(bodies, c, m, work, 0, count)
    assemble_island(bodies, c, m, work, 0, pairs, p)
    return pairs
