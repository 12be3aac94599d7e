"""Simulation of a scene with deformable blocks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.deformable.equations import Solid
from experiments.deformable.step import advance
from experiments.deformable.submatrices import UNKNOWNS
from rigdda import Scene, Settings, Simulation
from rigdda.dynamics.arrays import Totals, World
from rigdda.dynamics.records import CONTACTS, COUNTERS, ITERATIONS, SOLVER_ITERATIONS, STEPS
from rigdda.geometry import is_convex, polygon_properties

Floats = NDArray[np.float64]


class Rock(NamedTuple):
    """Young's modulus [Pa] and Poisson's ratio [-] of all blocks, in plane stress."""

    young: float = 1e10
    poisson: float = 0.25

    @property
    def elasticity(self) -> Floats:
        """The (3, 3) matrix E of sigma = E epsilon, with the shear strain gamma [Pa]."""
        nu = self.poisson
        shape = [[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]]
        return self.young / (1.0 - nu * nu) * np.array(shape)


class Deformable:
    """A scene of convex free blocks with plain penalty contacts (`restitution=None`).

    Parameters
    ----------
    scene : Scene
        A scene without barriers and supports.
    settings : Settings
        Settings, of which `dt`, `penetration`, `tolerance`, `open_close_iterations` and `mode` are
        used.
    rock : Rock
        Elasticity of the blocks.
    """

    def __init__(self, scene: Scene, settings: Settings, rock: Rock | None = None):
        if scene.barriers or scene.supports or scene.base_motion is not None:
            raise ValueError("give a scene without barriers, supports and base motion")
        if any(b.fixed for b in scene.blocks):
            raise ValueError("give a scene of free blocks")
        if not all(is_convex(b.vertices) for b in scene.blocks):
            raise ValueError("give convex blocks")
        self._sim = Simulation(scene, settings)  # used for contact detection
        self._counters = np.zeros(COUNTERS, dtype=np.int64)
        self._solid = empty_solid(scene, (rock or Rock()).elasticity, len(self._sim.loop.now))

    def step(self, n: int = 1) -> None:
        """Take `n` steps."""
        loop, a = self._sim.loop, self._sim.loop.arrays
        fits, swapped = advance(
            World(a.bodies, a.outlines, a.ground, a.interfaces, a.links, a.shaking, a.stems),
            loop.now,
            loop.before,
            a.work,
            a.monitors,
            a.parameters,
            Totals(self._counters, loop.ledger, loop.deepest),
            self._solid,
            n,
        )
        if not fits:
            raise RuntimeError("too many contacts")
        if swapped:
            loop.now, loop.before = loop.before, loop.now
        loop.counters[CONTACTS] = self._counters[CONTACTS]

    @property
    def stress(self) -> Floats:
        """Copy of sx, sy, txy of all blocks, tension positive, (N, 3) [Pa]."""
        return self._solid.stress.copy()

    @property
    def contacts(self) -> NDArray[np.void]:
        """The contacts of the last step, see `rigdda.dynamics.readings.CONTACT_TABLE`."""
        return self._sim.contacts()

    def vertices(self, block: int) -> Floats:
        """Return the current corners of a block, (n, 2) [m]."""
        return self._sim.vertices(block)

    @property
    def work(self) -> dict[str, float]:
        """Mean number of open-close iterations and solver iterations per step."""
        steps = max(self._counters[STEPS], 1)
        return {
            "open_close": float(self._counters[ITERATIONS] / steps),
            "solver": float(self._counters[SOLVER_ITERATIONS] / steps),
        }


def empty_solid(scene: Scene, elasticity: Floats, pairs: int) -> Solid:
    """Return the blocks of a scene in their initial state, without stress."""
    n = len(scene.blocks)
    velocity, load = np.zeros((n, UNKNOWNS)), np.zeros((n, UNKNOWNS))
    velocity[:, :3] = [b.velocity for b in scene.blocks]
    for one in scene.loads:
        area, centre, _ = polygon_properties(scene.blocks[one.block].vertices)
        (fx, fy), point = one.resultant(area, centre)
        x, y = point - centre
        load[one.block] += [fx, fy, x * fy - y * fx, x * fx, y * fy, 0.5 * (y * fx + x * fy)]
    square = (UNKNOWNS, UNKNOWNS)
    vectors = (np.zeros((n, UNKNOWNS)) for _ in range(6))
    return Solid(
        velocity,
        np.zeros((n, 3)),
        load,
        elasticity,
        np.zeros((n, *square)),
        np.zeros((n, *square)),
        np.zeros((pairs, *square)),
        *vectors,
    )
