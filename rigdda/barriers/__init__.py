"""Protective structures, the elements of a layout.

Walls, gravity walls and fences stand on the ground; ditches and embankments change the ground; mesh
covers the face. The `x` of a barrier is the chainage of its uphill edge (of mesh: its middle).
"""

from rigdda.barriers.base import Barrier, Earthwork, Standing, section
from rigdda.barriers.ditch import Ditch
from rigdda.barriers.embankment import Embankment
from rigdda.barriers.fence import FENCE_CLASSES, Fence, FenceClass
from rigdda.barriers.gravity_wall import GravityWall
from rigdda.barriers.layout import (
    KINDS,
    Built,
    Layout,
    as_layout,
    describe,
    earthworks,
    from_record,
    from_table,
    standing,
    to_tables,
)
from rigdda.barriers.mesh import Mesh, MeshOption
from rigdda.barriers.removal import Removal
from rigdda.barriers.wall import Wall

__all__ = [
    "FENCE_CLASSES",
    "KINDS",
    "Barrier",
    "Built",
    "Ditch",
    "Earthwork",
    "Embankment",
    "Fence",
    "FenceClass",
    "GravityWall",
    "Layout",
    "Mesh",
    "MeshOption",
    "Removal",
    "Standing",
    "Wall",
    "as_layout",
    "describe",
    "earthworks",
    "from_record",
    "from_table",
    "section",
    "standing",
    "to_tables",
]
