"""Arrays of a scene that serve others, of which only the rock differs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import GravityWall
from rigdda.geometry import is_convex
from rigdda.pack import Arrays, pack
from rigdda.pack.bodies import barrier_trait, block_traits, write_polygons
from rigdda.pack.gauges import start_rock, start_targets
from rigdda.pack.parameters import frictions, rock_numbers, write_rock_numbers
from rigdda.scene import Scene
from rigdda.settings import Settings


class Template:
    """The arrays of a scene before its first step, and what it takes to set them back.

    Ground, barriers and space are packed once. A scene of `Scene.with_rock` with as many blocks,
    all convex, is written into the same arrays: they are to the bit what `pack` gives, as far as
    they are read. One simulation at a time uses them.

    Parameters
    ----------
    scene : Scene
        The first one, without fixed blocks.
    settings, stations, watch, leave
        As `pack` takes them.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        stations: NDArray[np.float64],
        watch: tuple[float, float],
        leave: float,
    ):
        self.scene, self._settings, self._stations = scene, settings, stations
        self._arrays = pack(scene, settings, stations, watch, leave)
        self._names = list(scene.surfaces)
        self._corners = self._arrays.outlines.corner.shape[1]
        flat = [
            array.view(np.ndarray).reshape(-1).view(np.uint8) for array in _leaves(self._arrays)
        ]
        self._fresh = [(array, array.copy()) for array in flat if array.size]

    def fits(self, scene: Scene) -> bool:
        """Return whether a scene of `with_rock` can be written into these arrays."""
        mine, blocks = self.scene.blocks, scene.blocks
        return (
            scene.ground is self.scene.ground
            and len(blocks) == len(mine)
            and self._most_corners(scene) == self._corners
            and not any(b.fixed for b in mine)
            and not any(b.fixed for b in blocks)
            and all(is_convex(b.vertices) for b in (*mine, *blocks))
        )

    def _most_corners(self, scene: Scene) -> int:
        standing = [len(scene.outline(i)) for i in scene.bodies]
        return max(*(len(b.vertices) for b in scene.blocks), 0, *standing)

    def write(self, scene: Scene) -> Arrays:
        """Return the arrays of a scene that fits, as `pack` would.

        Raises
        ------
        BadInput
            If its smallest block is too small for the step.
        """
        arrays = self._arrays
        for array, fresh in self._fresh:
            array[:] = fresh
        bodies, outlines = arrays.bodies, arrays.outlines
        count, number = bodies["count"], outlines.corner["number"]
        for i, block in enumerate(scene.blocks):
            n = len(block.vertices)
            count[i] = outlines.polygon["count"][i] = n
            number[i] = np.where(np.arange(self._corners) < n, np.arange(self._corners), 0)
        polygons = [b.vertices for b in scene.blocks]
        traits = block_traits(scene.blocks, self._names)
        for i in scene.bodies:
            barrier = scene.barriers[i]
            if isinstance(barrier, GravityWall):  # they follow the blocks
                polygons.append(scene.outline(i))
                traits.append(barrier_trait(scene, barrier, self._names))
        write_polygons(polygons, traits, bodies, outlines)
        if scene.barriers != self.scene.barriers:
            start_targets(arrays.gauges.target, scene)
        if scene.surfaces is not self.scene.surfaces:
            arrays.interfaces["friction"] = frictions(scene, len(arrays.interfaces))
        start_rock(arrays.gauges.rock, bodies, self._stations)
        write_rock_numbers(arrays.parameters, rock_numbers(scene, self._settings, bodies))
        return arrays


def _leaves(arrays: Any) -> list[NDArray[Any]]:
    """Return the arrays in nested tuples."""
    if isinstance(arrays, np.ndarray):
        return [arrays]
    parts = [_leaves(a) for a in arrays] if isinstance(arrays, tuple) else []
    return [array for part in parts for array in part]
