"""Plots of a replay: what is computed from each frame of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.monitors import CROSSING
from rigdda.dynamics.run import Run
from rigdda.geometry import polygon_properties
from rigdda.results.frame import frame
from rigdda.results.marks import Marks
from rigdda.results.style import ROAD

Floats = NDArray[np.float64]

MOVING = 0.1
"""Speed above which a block counts as moving [m/s]; slower is a creep of under 1 m in 10 s."""

PLOTS = {
    "kinetic_energy": ("kinetic energy [J]", ROAD),
    "debris": ("debris past the road's edge [share of mass]", (214, 40, 70)),
    "greatest_speed": ("greatest speed [m/s]", (150, 90, 200)),
    "moving": ("moving blocks", (40, 150, 90)),
    "potential_energy": ("potential energy [J]", (60, 130, 210)),
}
"""Title and colour of every scalar."""


def scalars(run: Run, marks: Marks) -> dict[str, Floats]:
    """Return the (T,) numbers of every plot, of the free blocks; debris where there is a road."""
    free = np.array([not block.fixed for block in run.scene.blocks])
    shapes = [polygon_properties(block.vertices) for block in run.scene.blocks]
    density = np.array([block.density for block in run.scene.blocks])
    mass = (density * [area for area, _, _ in shapes])[free]
    inertia = (density * [moment for _, _, moment in shapes])[free]
    vx, vy, omega = np.moveaxis(run.velocities[:, free], -1, 0)
    squared = vx**2 + vy**2
    x, y = run.poses[:, free, 0], run.poses[:, free, 1] - frame(run.scene)[1]
    gx, gy = run.scene.gravity_vector
    out = {
        "kinetic_energy": 0.5 * (squared @ mass + omega**2 @ inertia),
        "potential_energy": -(gx * x + gy * y) @ mass,
        "greatest_speed": np.sqrt(squared.max(axis=1)),
        "moving": np.count_nonzero(squared > MOVING**2, axis=1).astype(np.float64),
    }
    if marks.road is not None:
        out["debris"] = _passed(run, marks.road[0])[:, free] @ mass / mass.sum()
    return out


def _passed(run: Run, edge: float) -> NDArray[np.bool_]:
    """Return whether each block's centroid was ever at or past chainage `edge`, (T, N).

    Crossings count where they happened, so that a block which came back between two frames is
    not missed.
    """
    seen = run.poses[:, :, 0] >= edge
    for event in run.events[(run.events["kind"] == CROSSING) & (run.events["x"] >= edge)]:
        seen[np.searchsorted(run.times, event["time"]) :, event["block"]] = True
    return np.logical_or.accumulate(seen, axis=0)
