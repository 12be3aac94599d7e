"""Protective structures: what a layout is made of.

Walls, gravity walls and fences stand on the ground; ditches and embankments change it; mesh lies on
the face. The x of each is the chainage where it begins for a block that comes down the slope.
"""

from rigdda.barriers.earthworks import Ditch, Earthwork, Embankment
from rigdda.barriers.layout import (
    KINDS,
    Barrier,
    Built,
    Layout,
    as_layout,
    describe,
    earthworks,
    from_table,
    section,
    to_tables,
)
from rigdda.barriers.mesh import Mesh, MeshOption
from rigdda.barriers.standing import Fence, GravityWall, Standing, Wall

__all__ = [
    "KINDS",
    "Barrier",
    "Built",
    "Ditch",
    "Earthwork",
    "Embankment",
    "Fence",
    "GravityWall",
    "Layout",
    "Mesh",
    "MeshOption",
    "Standing",
    "Wall",
    "as_layout",
    "describe",
    "earthworks",
    "from_table",
    "section",
    "to_tables",
]
