"""What a view on a scene takes in."""

from __future__ import annotations

import numpy as np

from rigdda.model.scene import Scene


def frame(scene: Scene) -> tuple[float, float, float, float]:
    """Return left, bottom, right, top of a view on the whole scene at its start [m]."""
    parts = [block.vertices for block in scene.blocks]
    if scene.ground is not None:
        parts += [scene.ground.points, *(scene.outline(i) for i in range(len(scene.barriers)))]
    points = np.concatenate(parts)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.04 * float((high - low).max())
    left, bottom = (low - margin).tolist()
    right, top = (high + margin).tolist()
    return left, bottom, right, top
