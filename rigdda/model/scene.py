"""One concrete mechanical problem: terrain, blocks, surfaces and barriers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import msgspec
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.validation import explain_validity

from rigdda import check
from rigdda.barriers import (
    Barrier,
    Built,
    Earthwork,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    Wall,
    earthworks,
)
from rigdda.errors import BadInput
from rigdda.geometry import clearly_convex, edges, is_convex, polygon_properties
from rigdda.model.apart import check_apart, deepest, in_ground
from rigdda.model.loads import Load
from rigdda.model.supports import FixedPoint, Support
from rigdda.model.terrain import Terrain

__all__ = ["Barrier", "Block", "Layout", "Scene", "Surface", "Terrain", "Wall", "simple_polygon"]


class Surface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Strength and rebound of a surface.

    Parameters
    ----------
    friction_deg : float
        Coulomb friction angle [deg], from 0 to below 90.
    cohesion, tension : float
        Strength of a joint that is closed at the start, in shear beside friction and in tension
        [Pa]; it breaks once, as a whole.
    restitution : float or None
        Coefficient of restitution of a central impact, 0 (plastic) to 1. None: the paper's plain
        penalty contact, whose rebound is what step and stiffness make of it.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    friction_deg: float = 30.0
    cohesion: float = 0.0
    tension: float = 0.0
    restitution: float | None = 0.0

    def __post_init__(self) -> None:
        check.set_number(self, "friction_deg", 0.0, 89.9)
        check.set_number(self, "cohesion", 0.0)
        check.set_number(self, "tension", 0.0)
        if self.restitution is not None:
            check.set_number(self, "restitution", 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A rigid simple polygon, convex or not.

    Parameters
    ----------
    vertices : (n, 2) array_like
        Corners in either winding [m]; kept anticlockwise.
    density : float
        Density [kg/m3]; the mass is per metre of slope width.
    surface : str
        Name of its surface in the scene.
    velocity : (vx, vy, omega)
        Initial velocity of the centroid and rate of rotation [m/s, m/s, rad/s].
    fixed : bool
        A fixed block has no unknowns.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner or has no area, or a value is not finite.
    """

    vertices: NDArray[np.float64]
    density: float = 2600.0
    surface: str = "rock"
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fixed: bool = False

    def __init__(
        self,
        vertices: ArrayLike,
        density: float = 2600.0,
        surface: str = "rock",
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        fixed: bool = False,
    ):
        try:
            vx, vy, omega = velocity
        except (TypeError, ValueError):
            raise BadInput("block velocity", velocity, "give (vx, vy, omega)") from None
        vx, vy, omega = (check.number("block velocity", v) for v in (vx, vy, omega))
        if not isinstance(surface, str):
            raise BadInput("block surface", surface, "name a surface of the scene")
        object.__setattr__(self, "vertices", simple_polygon("block vertices", vertices))
        object.__setattr__(
            self, "density", check.number("block density", density, 0.0, open_low=True)
        )
        object.__setattr__(self, "surface", str(surface))
        object.__setattr__(self, "velocity", (vx, vy, omega))
        object.__setattr__(self, "fixed", check.boolean("block fixed", fixed))

    @classmethod
    def sound(
        cls,
        corners: Sequence[tuple[float, float]],
        density: float,
        surface: str,
        velocity: tuple[float, float, float],
    ) -> Block:
        """Return a block of finite floats that are known to be sound, unchecked.

        Corners anticlockwise, of a simple polygon. Checks take longer than all else in drawing a
        release of one block.
        """
        block = object.__new__(cls)
        vertices = np.array(corners)
        vertices.setflags(write=False)
        object.__setattr__(block, "vertices", vertices)
        object.__setattr__(block, "density", density)
        object.__setattr__(block, "surface", surface)
        object.__setattr__(block, "velocity", velocity)
        object.__setattr__(block, "fixed", False)
        return block


MEMBERS = (
    ("blocks", Block, "rigdda.Block"),
    ("barriers", Built, "barriers: rigdda.Wall, GravityWall, Fence, Ditch or Embankment"),
    ("loads", Load, "loads: rigdda.PointLoad, LineLoad or BodyForce"),
    ("supports", Support, "supports: rigdda.FixedPoint or Bolt"),
)
"""Fields of a scene that are sequences, the class of their members, and that in words."""


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
        Mass-proportional damping coefficient alpha [1/s] (Koo and Chern 1998, damping force).
    damping_when : {"always", "contact"}
        "always" is the paper's: a fall is capped at g/alpha, 16 m/s for 0.6 1/s, so energies at a
        barrier stay low. "contact" damps only blocks that touch something, or did within 0.1 s.
    base_motion : (m, 3) array_like, optional
        Time [s] and acceleration of the ground, x and y [m/s2]; linear in between, a repeated time
        makes a jump; before and after it the ground does not accelerate. Motion is computed
        relative to the ground.

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
    ground: Terrain | None = field(init=False, repr=False)
    _moved: Mapping[Barrier, NDArray[np.float64]] = field(init=False, repr=False)
    _outlines: dict[int, NDArray[np.float64]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._check_members()
        if isinstance(self.gravity, Sequence | np.ndarray):
            object.__setattr__(self, "gravity", check.vector("gravity", self.gravity))
        else:
            check.set_number(self, "gravity", 0.0)
        check.set_number(self, "damping", 0.0)
        check.one_of("damping_when", self.damping_when, ("always", "contact"))
        self._check_blocks()
        self._check_loads()
        if self.base_motion is not None:
            object.__setattr__(self, "base_motion", _history(self.base_motion))
        self._check_names()
        object.__setattr__(self, "ground", self.terrain)
        object.__setattr__(self, "_moved", {})
        object.__setattr__(self, "_outlines", {})
        if self.barriers:
            self._build()
        if self.ground is not None:
            self._check_clear(self.ground)

    def with_rock(
        self,
        blocks: tuple[Block, ...],
        surfaces: Mapping[str, Surface],
        interfaces: Mapping[tuple[str, str], Surface],
        barriers: Sequence[Built],
    ) -> Scene:
        """Return the scene with other blocks and other properties of the surfaces of that name.

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
        changed = {"blocks": blocks, "surfaces": surfaces, "interfaces": interfaces}
        for name, value in changed.items():
            object.__setattr__(other, name, value)
        if barriers:
            pairs = zip(self.barriers, barriers, strict=True)
            moved = {b: self._moved[a] for a, b in pairs if a in self._moved}
            object.__setattr__(other, "barriers", tuple(barriers))
            object.__setattr__(other, "_moved", moved)
        other._check_blocks()
        for i, block in enumerate(other.blocks):
            other._known(f"block {i}: surface", block.surface)
        if other.ground is not None:
            other._check_clear(other.ground)
        return other

    def _check_blocks(self) -> None:
        """Check that there is a free block and that blocks are apart."""
        if not any(not b.fixed for b in self.blocks):
            raise BadInput("blocks", f"{len(self.blocks)} blocks", "give at least one free block")
        check_apart([b.vertices for b in self.blocks], [b.fixed for b in self.blocks])

    def _check_members(self) -> None:
        """Check what the scene is made of, and set sequences to tuples and mappings to dicts."""
        if not isinstance(self.terrain, Terrain | None):
            raise BadInput("terrain", self.terrain, "give a rigdda.Terrain or None")
        for name, kind, what in MEMBERS:
            members = check.sequence(name, getattr(self, name), kind, what)
            object.__setattr__(self, name, members)
        for name in ("surfaces", "interfaces"):
            named = check.mapping(name, getattr(self, name), Surface, "rigdda.Surface")
            object.__setattr__(self, name, named)

    def _check_names(self) -> None:
        """Check that every surface that is named is there."""
        for i, block in enumerate(self.blocks):
            self._known(f"block {i}: surface", block.surface)
        for i, name in enumerate(self.terrain.surfaces if self.terrain else ()):
            self._known(f"terrain surfaces[{i}]", name)
        for pair in self.interfaces:
            if not isinstance(pair, tuple) or len(pair) != 2:
                raise BadInput("interfaces", pair, "name two surfaces (first, second)")
            for name in pair:
                self._known(f"interfaces {pair}", name)

    def _build(self) -> None:
        """Set the ground with its earthworks and check that every barrier stands on it."""
        if self.terrain is None:
            raise BadInput("barriers", self.barriers, "give the scene a terrain to stand on")
        self._known("barrier surface", self.barrier_surface)
        for i, barrier in enumerate(self.barriers):
            if isinstance(barrier, Fence) and barrier.capacity is None:
                mend = "give fence.for_width(width): a scene is a metre wide"
                raise BadInput(f"barriers[{i}].energy_class", barrier.energy_class, mend)
        ground, moved = earthworks(self.terrain, self.barriers, self.fill)
        object.__setattr__(self, "ground", ground)
        object.__setattr__(self, "_moved", moved)
        for i in range(len(self.barriers)):
            self.outline(i)
        upright = sorted(self.bodies, key=lambda i: self.barriers[i].x)
        for i, j in pairwise(upright):
            end = self.barriers[i].end
            if self.barriers[j].x < end - 1e-9 * max(1.0, abs(end)):
                mend = f"put it downhill of x = {end:g}, where barriers[{i}] ends"
                raise BadInput(f"barriers[{j}].x", self.barriers[j].x, mend)

    def _check_clear(self, ground: Terrain) -> None:
        """Check that no free block starts deep in the ground or in what stands on it."""
        free = {i: block.vertices for i, block in enumerate(self.blocks) if not block.fixed}
        found = in_ground(ground, list(free.values()))
        if found is not None:
            i = list(free)[found.block]
            mend = f"raise it: {found.shared:.3g} m2 of it are in the ground"
            raise BadInput(f"blocks[{i}]", self.blocks[i].vertices.tolist(), mend)
        for j in self.bodies:
            found = deepest(self.outline(j), list(free.values()))
            if found is not None:
                i = list(free)[found.block]
                mend = f"move it: {found.shared:.3g} m2 of block {i} are in it"
                raise BadInput(f"barriers[{j}].x", self.barriers[j].x, mend)

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
        assert self.ground is not None and not isinstance(what, Mesh)
        if barrier not in self._outlines:
            corners = what.outline(self.ground)
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

        Gravity walls first, which are free to move, then walls and fences.
        """
        upright = [i for i, b in enumerate(self.barriers) if not isinstance(b, Earthwork)]
        return tuple(sorted(upright, key=lambda i: not isinstance(self.barriers[i], GravityWall)))

    def _check_loads(self) -> None:
        for i, load in enumerate(self.loads):
            self._is_block(f"loads[{i}]: block", load.block)
        for i, support in enumerate(self.supports):
            if isinstance(support, FixedPoint):
                self._is_block(f"supports[{i}]: block", support.block)
            else:
                self._is_block(f"supports[{i}]: block_a", support.block_a)
                if support.block_b is not None:
                    self._is_block(f"supports[{i}]: block_b", support.block_b)

    def _is_block(self, where: str, index: int) -> None:
        if index >= len(self.blocks):
            raise BadInput(where, index, f"give the index of one of {len(self.blocks)} blocks")

    @property
    def gravity_vector(self) -> tuple[float, float]:
        """Acceleration of gravity (gx, gy) [m/s2]."""
        return self.gravity if isinstance(self.gravity, tuple) else (0.0, -self.gravity)

    def _known(self, where: str, name: str) -> None:
        if name not in self.surfaces:
            known = ", ".join(self.surfaces)
            raise BadInput(where, name, f"define it in surfaces or use one of {known}")

    def ground_without(self, gone: Collection[int]) -> Terrain | None:
        """Return the ground after some of the barriers were pushed away: embankments change it."""
        if self.terrain is None or len(gone) == 0:
            return self.ground
        left = [b for i, b in enumerate(self.barriers) if i not in gone]
        return earthworks(self.terrain, left, self.fill)[0]

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
        a, b = self.surfaces[first], self.surfaces[second]
        return Surface(
            friction_deg=min(a.friction_deg, b.friction_deg),
            cohesion=min(a.cohesion, b.cohesion),
            tension=min(a.tension, b.tension),
            restitution=None
            if a.restitution is None or b.restitution is None
            else min(a.restitution, b.restitution),
        )


def _history(value: ArrayLike) -> NDArray[np.float64]:
    """Return a history of ground acceleration as a read-only (m, 3) array."""
    try:
        history = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        history = np.zeros(0)
    if history.ndim != 2 or history.shape[1:] != (3,) or len(history) < 2:
        raise BadInput("base_motion", value, "give at least two rows (time, ax, ay)")
    if not np.isfinite(history).all():
        raise BadInput("base_motion", "NaN or infinity", "give finite numbers")
    if (np.diff(history[:, 0]) < 0.0).any() or history[0, 0] < 0.0:
        raise BadInput("base_motion", "times", "give times from 0 on that never fall")
    history.setflags(write=False)
    return history


def convex_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a convex polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner, has no area or is not convex.
    """
    corners = simple_polygon(where, value)
    if not is_convex(corners):
        raise BadInput(where, corners.tolist(), "make it convex, or cut it into convex blocks")
    return corners


def simple_polygon(where: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of a simple polygon, (n, 2), anticlockwise and read-only.

    Raises
    ------
    BadInput
        If the polygon crosses itself, repeats a corner or has no area.
    """
    corners = check.points(where, value, 3)
    if clearly_convex(corners):
        return corners
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid:
        raise BadInput(where, corners.tolist(), f"untangle it: {explain_validity(polygon)}")
    size = polygon.length
    if polygon.area < 1e-9 * size**2:
        raise BadInput(where, corners.tolist(), "give it an area")
    short = np.flatnonzero(np.hypot(*edges(corners).T) < 1e-9 * size)
    if short.size:
        raise BadInput(
            f"{where}[{short[0]}]", corners[short[0]].tolist(), "remove it: the next one repeats it"
        )
    if not polygon.exterior.is_ccw:
        corners = corners[::-1]
    corners = np.ascontiguousarray(corners)
    corners.setflags(write=False)
    return corners
