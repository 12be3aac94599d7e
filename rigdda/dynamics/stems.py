"""Stems of a forest, which take energy from the blocks that strike them.

Each block has its own stems, which it strikes one after the other as its centroid passes their
chainage, each once. A stem takes up to its energy, in an impact that leaves the direction of the
motion and the ratio of translation and rotation as they are. A stem that can take all of the energy
stops the block. A block above the top of a stem passes it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Stems
from rigdda.dynamics.motion import kinetic_energy
from rigdda.dynamics.records import STEM, Bodies, Body
from rigdda.kernel import kernel
from rigdda.model.scene import Scene

LEAST_ROOM = 16
"""Least number of stems for which a block has room, so that releases can share arrays."""


def room_for(scene: Scene) -> int:
    """Return the number of stems for which each block of a scene needs room; 0 without a forest."""
    most = max((len(stems) for stems in scene.stems), default=-1)
    return 0 if most < 0 else max(LEAST_ROOM, 1 << max(most - 1, 0).bit_length())


def pack_stems(scene: Scene) -> Stems:
    """Return the stems of the blocks of a scene in arrays with room for more."""
    shape = (len(scene.stems), room_for(scene))
    stems = Stems(np.zeros(shape, dtype=STEM).view(np.recarray), np.zeros(shape[0], dtype=np.int64))
    write_stems(scene.stems, scene, stems)
    return stems


def write_stems(tables: tuple[NDArray[np.float64], ...], scene: Scene, stems: Stems) -> None:
    """Write the stems of each block into arrays with room for them, see `Scene.stems`.

    The tops of the stems are those on the ground of the scene.
    """
    rows = stems.stem.view(np.ndarray)
    rows["x"] = np.inf
    stems.next[:] = 0
    ground = scene.smooth_ground
    assert ground is not None or not tables
    for row, table in zip(rows, tables, strict=True):
        x, energy, height = table.T
        row["x"][: len(x)], row["energy"][: len(x)] = x, energy
        feet = [] if ground is None else [ground.height(at) for at in x.tolist()]
        row["top"][: len(x)] = feet + height


@kernel
def strike(body: Body, energy: float) -> float:
    """Slow a body down by an energy, at most to rest; return the energy that it lost [J]."""
    before = kinetic_energy(body)
    taken = min(energy, before)
    left = math.sqrt(1.0 - taken / before) if before > 0.0 else 0.0
    body.vx *= left
    body.vy *= left
    body.omega *= left
    return taken


@kernel
def meet_stems(bodies: Bodies, stems: Stems, ledger: NDArray) -> None:
    """Let each block strike the stems whose chainage it has passed in this step."""
    for i in range(len(stems.next)):
        body, k = bodies[i], stems.next[i]
        while k < stems.stem.shape[1] and body.x >= stems.stem[i, k].x:
            if body.y <= stems.stem[i, k].top:
                ledger[1] -= strike(body, stems.stem[i, k].energy)
            k += 1
        stems.next[i] = k
