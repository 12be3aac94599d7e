"""One concrete mechanical problem: terrain, blocks, surfaces and barriers."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rigdda import check, fields
from rigdda.barriers import (
    Barrier,
    Built,
    Earthwork,
    Fence,
    GravityWall,
    Mesh,
    Wall,
    earthworks,
)
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.model.base_motion import history
from rigdda.model.block import Block
from rigdda.model.clearance import check_blocks, check_clear, check_order
from rigdda.model.composition import (
    check_capacities,
    check_indices,
    check_known,
    check_names,
    set_members,
)
from rigdda.model.loads import Load
from rigdda.model.roughness import Roughness
from rigdda.model.supports import Support
from rigdda.model.surface import Surface, smaller
from rigdda.model.terrain import Terrain

__all__ = ["Barrier", "Block", "Scene", "Surface", "Terrain", "Wall"]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A mechanical problem in two dimensions, per metre of slope width.

    Parameters
    ----------
    terrain : Terrain or None
        The natural ground; None: free space.
    blocks : sequence of Block
        The rock, at least one block of it free to move. Gravity walls are not among them.
    surfaces : mapping of str to Surface
        Every surface that a block or the terrain names. Two surfaces that meet take the smaller
        of each property.
    barriers : sequence of Wall, GravityWall, Fence, Ditch or Embankment
        Protective structures; their surface is "concrete" where the scene defines it, else "rock".
        That of embankments is "soil" where the scene defines it.
    interfaces : mapping of (str, str) to Surface
        Properties for pairs of surfaces, instead of the smaller of each.
    loads : sequence of PointLoad, LineLoad or BodyForce
        Dead loads.
    supports : sequence of FixedPoint or Bolt
        Supports.
    gravity : float or (gx, gy)
        Gravity [m/s2], a number acts downwards.
    damping : float
        Mass-proportional damping coefficient alpha [1/s] (Koo and Chern 1998, damping force) of
        contacts whose surfaces state none, and in flight if `damping_when` is "always".
    damping_when : {"always", "contact"}
        "always" is the paper's: a fall is capped at g/alpha, 16 m/s for 0.6 1/s, so energies at a
        barrier stay low. "contact" damps only blocks that touch something, or did within 0.1 s.
    base_motion : (m, 3) array_like, optional
        Time [s] and acceleration of the ground, x and y [m/s2]; linear in between, a repeated time
        makes a jump; before and after it the ground does not accelerate. Motion is computed
        relative to the ground.
    roughness : Roughness, optional
        Pits in the ground, where no barrier stands.

    Raises
    ------
    BadInput
        If a name has no surface, an index no block, a value is outside its range, a block starts
        deep in another one, in the ground or in a barrier, or a barrier stands in another one.
    """

    terrain: Terrain | None
    blocks: tuple[Block, ...]
    surfaces: Mapping[str, Surface] = field(
        default_factory=lambda: MappingProxyType({"rock": Surface()})
    )
    barriers: tuple[Barrier, ...] = ()
    interfaces: Mapping[tuple[str, str], Surface] = field(
        default_factory=lambda: MappingProxyType({})
    )
    loads: tuple[Load, ...] = ()
    supports: tuple[Support, ...] = ()
    gravity: float | tuple[float, float] = 9.81
    damping: float = 0.0
    damping_when: str = "always"
    base_motion: NDArray[np.float64] | None = None
    roughness: Roughness | None = None
    ground: Terrain | None = field(init=False, repr=False)
    _smooth: Terrain | None = field(init=False, repr=False)
    _moved: Mapping[Barrier, NDArray[np.float64]] = field(init=False, repr=False)
    _outlines: dict[int, NDArray[np.float64]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_members(self)
        if not isinstance(self.roughness, Roughness | None):
            raise BadInput("roughness", self.roughness, "give a Roughness or None")
        if isinstance(self.gravity, Sequence | np.ndarray):
            object.__setattr__(self, "gravity", check.vector("gravity", self.gravity))
        else:
            fields.set_number(self, "gravity", 0.0)
        fields.set_number(self, "damping", 0.0)
        check.one_of("damping_when", self.damping_when, ("always", "contact"))
        check_blocks(self.blocks)
        check_indices(self)
        if self.base_motion is not None:
            object.__setattr__(self, "base_motion", history(self.base_motion))
        check_names(self)
        object.__setattr__(self, "ground", self.terrain)
        object.__setattr__(self, "_moved", {})
        object.__setattr__(self, "_outlines", {})
        object.__setattr__(self, "_smooth", self.terrain)
        if self.barriers:
            self._build()
        if self._smooth is not None:
            check_clear(self, self._smooth)
        object.__setattr__(self, "ground", self._with_pits(self._smooth, self.barriers))

    def with_rock(
        self,
        blocks: tuple[Block, ...],
        surfaces: Mapping[str, Surface],
        interfaces: Mapping[tuple[str, str], Surface],
        barriers: Sequence[Built],
        roughness: Roughness | None = None,
    ) -> Scene:
        """Return the scene with other blocks, surfaces of the same names and pits in the ground.

        The ground and what stands on it are not built and checked again; `barriers` are those of
        the scene but for what they resist.

        Raises
        ------
        BadInput
            As the scene does, for the blocks; if it has loads or supports.
        """
        if self.loads or self.supports:
            raise BadInput("scene", self, "give one without loads and supports: they are on blocks")
        other = object.__new__(Scene)
        for name in Scene.__slots__:
            object.__setattr__(other, name, getattr(self, name))
        changed = {
            "blocks": blocks,
            "surfaces": surfaces,
            "interfaces": interfaces,
            "roughness": roughness,
        }
        for name, value in changed.items():
            object.__setattr__(other, name, value)
        if barriers:
            pairs = zip(self.barriers, barriers, strict=True)
            moved = {b: self._moved[a] for a, b in pairs if a in self._moved}
            object.__setattr__(other, "barriers", tuple(barriers))
            object.__setattr__(other, "_moved", moved)
        check_blocks(blocks)
        for i, block in enumerate(blocks):
            check_known(surfaces, f"block {i}: surface", block.surface)
        if other._smooth is not None:
            check_clear(other, other._smooth)
        if roughness is not self.roughness:
            ground = other._with_pits(other._smooth, other.barriers)
            object.__setattr__(other, "ground", ground)
        return other

    def _build(self) -> None:
        """Set the smooth ground with its earthworks; check that every barrier stands on it."""
        if self.terrain is None:
            raise BadInput("barriers", self.barriers, "give the scene a terrain to stand on")
        check_known(self.surfaces, "barrier surface", self.barrier_surface)
        check_capacities(self.barriers)
        ground, moved = earthworks(self.terrain, self.barriers, self.fill)
        object.__setattr__(self, "ground", ground)
        object.__setattr__(self, "_smooth", ground)
        object.__setattr__(self, "_moved", moved)
        for i in range(len(self.barriers)):
            self.outline(i)
        check_order(self)

    def _with_pits(self, ground: Terrain | None, barriers: Iterable[Barrier]) -> Terrain | None:
        """Return a smooth ground with pits where none of the barriers stands."""
        if ground is None or self.roughness is None:
            return ground
        even = []
        for barrier in barriers:
            if isinstance(barrier, Earthwork):
                x = self._moved[barrier][:, 0]
                even.append((float(x.min()), float(x.max())))
            elif not isinstance(barrier, Mesh):
                even.append((barrier.x, barrier.x + barrier.extent))
        return self.roughness.applied(ground, even)

    @property
    def smooth_ground(self) -> Terrain | None:
        """The ground with its earthworks and without pits."""
        return self._smooth

    def outline(self, barrier: int) -> NDArray[np.float64]:
        """Return the (n, 2) corners of a barrier at the start [m].

        Those of a ditch or an embankment enclose what is dug out or filled in.

        Raises
        ------
        BadInput
            If the barrier does not stand on the ground.
        """
        what = self.barriers[barrier]
        if isinstance(what, Earthwork):
            return self._moved[what]
        assert self._smooth is not None and not isinstance(what, Mesh)
        if barrier not in self._outlines:
            corners = what.outline(self._smooth)
            corners.setflags(write=False)
            self._outlines[barrier] = corners
        return self._outlines[barrier]

    @property
    def barrier_poses(self) -> NDArray[np.float64]:
        """x, y, theta of the centroid of each barrier's outline at the start, (B, 3) [m, rad]."""
        centres = [polygon_properties(self.outline(i))[1] for i in range(len(self.barriers))]
        return np.array([[*centre, 0.0] for centre in centres]).reshape(-1, 3)

    @property
    def bodies(self) -> tuple[int, ...]:
        """Barriers that are bodies, in the order in which they follow the blocks.

        Gravity walls first, which are free to move, then fences, which give way, then walls.
        """
        upright = [i for i, b in enumerate(self.barriers) if not isinstance(b, Earthwork)]
        order = (GravityWall, Fence)
        ranks = [[isinstance(b, kind) for kind in order] for b in self.barriers]
        return tuple(sorted(upright, key=lambda i: ranks[i], reverse=True))

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """Acceleration of gravity (gx, gy) [m/s2]."""
        return self.gravity if isinstance(self.gravity, tuple) else (0.0, -self.gravity)

    def ground_without(self, gone: Collection[int]) -> Terrain | None:
        """Return the ground after some of the barriers were pushed away: embankments change it."""
        if self.terrain is None or len(gone) == 0:
            return self.ground
        left = [
            b for i, b in enumerate(self.barriers) if i not in gone or not isinstance(b, Earthwork)
        ]
        return self._with_pits(earthworks(self.terrain, left, self.fill)[0], left)

    @property
    def fill(self) -> str:
        """Name of the surface of embankments."""
        return "soil" if "soil" in self.surfaces else self.barrier_surface

    @property
    def barrier_surface(self) -> str:
        """Name of the surface of every barrier."""
        return "concrete" if "concrete" in self.surfaces else "rock"

    def friction_deg(self, first: str, second: str) -> float:
        """Return the friction angle between two named surfaces [deg], that of `interface`."""
        pair = self.interfaces.get((first, second)) or self.interfaces.get((second, first))
        if pair is not None:
            return pair.friction_deg
        return min(self.surfaces[first].friction_deg, self.surfaces[second].friction_deg)

    def resistance(self, index: int) -> float:
        """Return the thrust that a barrier bears [N/m], inf for one that none can move."""
        return self.barriers[index].resistance(self, self.outline(index))

    def interface(self, first: str, second: str) -> Surface:
        """Return the properties of the contact between two named surfaces."""
        pair = self.interfaces.get((first, second)) or self.interfaces.get((second, first))
        if pair is not None:
            return pair
        return smaller(self.surfaces[first], self.surfaces[second])
