"""What a scene is made of: the kinds of its members, and how they refer to one another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rigdda import check
from rigdda.barriers import Barrier, Built, Fence
from rigdda.errors import BadInput
from rigdda.model.block import Block
from rigdda.model.loads import Load
from rigdda.model.supports import FixedPoint, Support
from rigdda.model.surface import Surface
from rigdda.model.terrain import Terrain

if TYPE_CHECKING:
    from rigdda.model.scene import Scene

MEMBERS = (
    ("blocks", Block, "rigdda.Block"),
    ("barriers", Built, "barriers: rigdda.Wall, GravityWall, Fence, Ditch or Embankment"),
    ("loads", Load, "loads: rigdda.PointLoad, LineLoad or BodyForce"),
    ("supports", Support, "supports: rigdda.FixedPoint or Bolt"),
)
"""Fields of a scene that are sequences, the class of their members, and that in words."""


def set_members(scene: Scene) -> None:
    """Check what a scene is made of, and set sequences to tuples and mappings to dicts.

    Raises
    ------
    BadInput
        If a member is of another kind.
    """
    if not isinstance(scene.terrain, Terrain | None):
        raise BadInput("terrain", scene.terrain, "give a rigdda.Terrain or None")
    for name, kind, what in MEMBERS:
        members = check.sequence(name, getattr(scene, name), kind, what)
        object.__setattr__(scene, name, members)
    for name in ("surfaces", "interfaces"):
        named = check.mapping(name, getattr(scene, name), Surface, "rigdda.Surface")
        object.__setattr__(scene, name, named)


def check_indices(scene: Scene) -> None:
    """Check that every block is there that a load or a support is on.

    Raises
    ------
    BadInput
        If one is not.
    """
    for i, load in enumerate(scene.loads):
        _check_index(scene, f"loads[{i}]: block", load.block)
    for i, support in enumerate(scene.supports):
        if isinstance(support, FixedPoint):
            _check_index(scene, f"supports[{i}]: block", support.block)
        else:
            _check_index(scene, f"supports[{i}]: block_a", support.block_a)
            if support.block_b is not None:
                _check_index(scene, f"supports[{i}]: block_b", support.block_b)


def _check_index(scene: Scene, where: str, index: int) -> None:
    if index >= len(scene.blocks):
        raise BadInput(where, index, f"give the index of one of {len(scene.blocks)} blocks")


def check_names(scene: Scene) -> None:
    """Check that every surface that is named is there.

    Raises
    ------
    BadInput
        If one is not, or an interface is not of two.
    """
    for i, block in enumerate(scene.blocks):
        check_known(scene.surfaces, f"block {i}: surface", block.surface)
    for i, name in enumerate(scene.terrain.surfaces if scene.terrain else ()):
        check_known(scene.surfaces, f"terrain surfaces[{i}]", name)
    for pair in scene.interfaces:
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise BadInput("interfaces", pair, "name two surfaces (first, second)")
        for name in pair:
            check_known(scene.surfaces, f"interfaces {pair}", name)


def check_known(surfaces: Mapping[str, Surface], where: str, name: str) -> None:
    """Check that a surface is there.

    Raises
    ------
    BadInput
        If it is not.
    """
    if name not in surfaces:
        known = ", ".join(surfaces)
        raise BadInput(where, name, f"define it in surfaces or use one of {known}")


def check_capacities(barriers: Sequence[Barrier]) -> None:
    """Check that the capacity of every fence is that of a metre.

    Raises
    ------
    BadInput
        If a fence has only the class of a panel.
    """
    for i, barrier in enumerate(barriers):
        if isinstance(barrier, Fence) and barrier.capacity is None:
            mend = "give fence.for_width(width): a scene is a metre wide"
            raise BadInput(f"barriers[{i}].energy_class", barrier.energy_class, mend)
