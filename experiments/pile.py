"""A pile of bricks under its weight and a load, for measurements of one step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rigdda import Block, PointLoad, Scene, Settings, Simulation, Terrain
from rigdda.dynamics.arrays import Matrix, Scratch, Work
from rigdda.dynamics.equations import assemble_island
from rigdda.dynamics.islands import find_islands, pair_blocks
from rigdda.dynamics.records import CONTACTS, Bodies, Contacts
from rigdda.geometry import polygon_properties
from rigdda.kernel import entry_kernel
from rigdda.model.scene import Surface
from rigdda.validation.scenes import GRAVITY, box

WIDTH, HEIGHT, JOINT = 2.0, 1.0, 0.01
"""Size of a brick and width of the open vertical joints [m]."""

DT = 5e-3
"""Time step [s]."""

LOAD = 10.0
"""Load on a brick of the top course, over its weight [-]."""

STIR = 0.3
"""Standard deviation of random forces over the greatest force [-]."""

SETTLING = 20
"""Number of static steps after which all contacts are closed."""


def pile(courses: int) -> Scene:
    """Return a pile of bricks in running bond on level ground, with as many bricks as courses.

    Every other course ends in half bricks, and the load on the top course is uniform. Therefore all
    contacts of a course carry the same load and none changes its state. The contacts are the
    paper's plain penalty springs.
    """
    end = courses * (WIDTH + JOINT)
    blocks = []
    for course in range(courses):
        joints = [
            (WIDTH + JOINT) * (i - 0.5 * (course % 2)) for i in range(courses + 1 + course % 2)
        ]
        edges = [max(joints[0], 0.0), *joints[1:-1], min(joints[-1], end)]
        for left, right in pairwise(edges):
            width, y = right - left - JOINT, HEIGHT * (course + 0.5)
            blocks.append(box(0.5 * (left + right), y, width, HEIGHT))
    top = range(len(blocks) - len(edges) + 1, len(blocks))
    ground = Terrain(((-50.0, 0.0), (end + 50.0, 0.0)))
    surfaces = {"rock": Surface(30.0, restitution=None)}
    return Scene(ground, tuple(blocks), surfaces, loads=tuple(_load(i, blocks[i]) for i in top))


def _load(index: int, block: Block) -> PointLoad:
    """Return a load on the centroid of a block, proportional to its weight."""
    area, (x, y), _ = polygon_properties(block.vertices)
    return PointLoad(index, (x, y), (0.0, -LOAD * block.density * area * GRAVITY))


def settings(h: float, **more: object) -> Settings:
    """Return settings with k_n dt^2 / (2 m) = h, by a penetration of g dt^2 / (2 h)."""
    return Settings(dt=DT, penetration=0.5 * GRAVITY * DT**2 / h, sleeping=False, **more)  # type: ignore[arg-type]


def system(scene: Scene, h: float) -> tuple[tuple[Matrix, Scratch], int, int]:
    """Return the simultaneous equations of a step of a loaded scene.

    A random force and moment on each block represent its motion. A uniform load alone would not
    excite most modes, which helps conjugate gradients but not over-relaxation.

    Returns
    -------
    system : (Matrix, Scratch)
        The equations K d = F, block-sparse, and the working arrays of the solvers.
    n, pairs : int
        Number of blocks, and of pairs of blocks in contact.
    """
    sim = Simulation(scene, settings(h, mode="static", islands=False))
    sim.step(SETTLING)
    a = sim.loop.arrays
    count = int(sim.loop.counters[CONTACTS])
    a.bodies["vx"] = a.bodies["vy"] = a.bodies["omega"] = 0.0
    pairs = assemble(a.bodies, sim.loop.now, count, a.work, a.parameters)
    n = len(scene.blocks)
    stir = STIR * np.random.default_rng(n).standard_normal((n, 3))
    rhs = a.work.matrix.rhs
    rhs[:n] += stir * np.abs(rhs[:n]).max()
    return (a.work.matrix, a.work.scratch), n, pairs


@entry_kernel
def assemble(bodies: Bodies, contacts: Contacts, count: int, work: Work, levels: NDArray) -> int:
    """Assemble all blocks as one island with the current contact states; return the pairs."""
    p, m = levels[0], work.matrix
    find_islands(bodies, contacts, work.begin, work.islands, p.blocks, False)
    pairs = pair_blocks(bodies, contacts, m, work.islands, 0, count)
    assemble_island(bodies, contacts, m, work.islands, 0, pairs, p)
    return pairs
