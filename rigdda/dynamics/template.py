"""Reusable arrays for scenes that differ only in rock, strength and ground elevations.

This is one of the three ways in which releases are computed, see `rigdda.releases`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import GravityWall
from rigdda.dynamics.packing import (
    Arrays,
    barrier_trait,
    block_traits,
    pack,
    pack_ground,
    pack_interfaces,
    rock_numbers,
    set_brakes,
    start_rock,
    start_targets,
    write_polygons,
)
from rigdda.dynamics.stems import room_for, write_stems
from rigdda.geometry import is_convex
from rigdda.model.scene import Scene, Terrain
from rigdda.model.settings import Settings


class Template:
    """The arrays of a scene before its first step, which can be reset and reused.

    Barriers and working arrays are packed once. The ground is packed again only if its pits change,
    and interface properties only if they change. A scene made by `Scene.with_rock`, with the same
    number of blocks, all convex, is written into the same arrays; all entries that are used are
    bit-identical to those of `pack`. Only one simulation at a time can use the arrays.

    Parameters
    ----------
    scene : Scene
        The first scene, without fixed blocks.
    settings, stations, watch, leave
        As for `pack`.
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
        self._names = list(scene.surfaces)
        packed = pack(scene, settings, stations, watch, leave)
        self._corners = packed.outlines.corner.shape[1]
        number = packed.outlines.corner["number"]
        number[: len(scene.blocks)] = np.arange(self._corners)  # including padding
        self._memory, self._arrays = together(packed)
        self._fresh = self._memory.copy()
        plain = [
            array.view(np.ndarray)  # faster to access than a recarray
            for array in (
                self._arrays.bodies,
                self._arrays.outlines.polygon,
                self._arrays.monitors.rock,
                self._arrays.parameters,
            )
        ]
        self._bodies, self._polygons, self._rock, self._parameters = plain

    def fits(self, scene: Scene) -> bool:
        """Return whether a scene made by `with_rock` can be written into these arrays."""
        mine, blocks = self.scene.blocks, scene.blocks
        return (
            _alike(scene.ground, self.scene.ground)
            and room_for(scene) <= self._arrays.stems.stem.shape[1]
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
            If the step is too long for its blocks.
        """
        arrays = self._arrays
        self._memory[:] = self._fresh
        bodies, outlines = self._bodies, arrays.outlines
        for i, block in enumerate(scene.blocks):
            bodies["count"][i] = self._polygons["count"][i] = len(block.vertices)
        polygons = [b.vertices for b in scene.blocks]
        traits = block_traits(scene.blocks, self._names)
        for i in scene.bodies:
            if isinstance(scene.barriers[i], GravityWall):  # they directly follow the blocks
                polygons.append(scene.outline(i))
                traits.append(barrier_trait(scene, i, self._names))
        write_polygons(polygons, traits, arrays.bodies, outlines)
        if scene.ground is not self.scene.ground and scene.ground is not None:
            ground = pack_ground(scene.ground, self._names)
            for mine, its in zip(arrays.ground[:3], ground[:3], strict=True):
                mine[...] = its
        other_surfaces = scene.surfaces is not self.scene.surfaces
        if other_surfaces or scene.barriers != self.scene.barriers:
            start_targets(arrays.monitors.target, scene)  # friction is the strength of embankments
            set_brakes(scene, arrays.bodies)
        if other_surfaces:
            arrays.interfaces[...] = pack_interfaces(scene, self._names)
        write_stems(scene.stems, scene, arrays.stems)
        start_rock(self._rock, bodies, self._stations)
        for name, value in rock_numbers(scene, self._settings, bodies).items():
            self._parameters[name] = value
        return arrays


def _alike(ground: Terrain | None, other: Terrain | None) -> bool:
    """Return whether two grounds differ in elevations only, or not at all."""
    if ground is other or ground is None or other is None:
        return ground is other
    same = ground.surfaces == other.surfaces
    return same and np.array_equal(ground.points[:, 0], other.points[:, 0])


def together(arrays: Arrays) -> tuple[NDArray[np.uint8], Arrays]:
    """Return one block of memory and copies of all arrays in it, so that all are reset at once.

    Arrays that are identical objects remain so.
    """
    leaves = {id(array): array for array in _leaves(arrays) if array.size}
    room = [-(-array.nbytes // LINE) * LINE for array in leaves.values()]
    memory = np.zeros(sum(room), dtype=np.uint8)
    moved, low = {}, 0
    for (key, array), size in zip(leaves.items(), room, strict=True):
        place = memory[low : low + array.nbytes].view(array.dtype).reshape(array.shape)
        place[...] = array
        moved[key] = place.view(type(array))
        low += size
    return memory, _replaced(arrays, moved)


LINE = 64
"""Alignment of the arrays in bytes: a cache line."""


def _leaves(arrays: Any) -> list[NDArray[Any]]:
    """Return the arrays in nested tuples."""
    if isinstance(arrays, np.ndarray):
        return [arrays]
    parts = [_leaves(a) for a in arrays] if isinstance(arrays, tuple) else []
    return [array for part in parts for array in part]


def _replaced(arrays: Any, by: dict[int, Any]) -> Any:
    """Return nested named tuples with arrays replaced by others, looked up by identity."""
    if isinstance(arrays, tuple):
        return type(arrays)(*(_replaced(a, by) for a in arrays))
    return by.get(id(arrays), arrays)
