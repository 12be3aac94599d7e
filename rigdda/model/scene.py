"""Scene: one concrete mechanical problem of terrain, blocks, surfaces and barriers.

Its members are checked for consistency: their references to each other, overlaps at the start, and
the order of barriers. Scenes can be stored as JSON.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import check
from rigdda.barriers import (
    Barrier,
    Built,
    Earthwork,
    Fence,
    GravityWall,
    Standing,
    Wall,
    earthworks,
    from_record,
    to_tables,
)
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.ground.surface import Surface, smaller
from rigdda.ground.terrain import Roughness, Terrain
from rigdda.model.block import Block
from rigdda.model.loads import (
    BodyForce,
    Bolt,
    FixedPoint,
    LineLoad,
    Load,
    PointLoad,
    Support,
    history,
)
from rigdda.model.overlap import check_apart, deepest, in_ground
from rigdda.model.settings import check_damping
from rigdda.rounding import chainage

MEMBERS = (
    ("blocks", Block, "rigdda.Block"),
    ("barriers", Built, "barriers: rigdda.Wall, GravityWall, Fence, Ditch or Embankment"),
    ("loads", Load, "loads: rigdda.PointLoad, LineLoad or BodyForce"),
    ("supports", Support, "supports: rigdda.FixedPoint or Bolt"),
)
"""Fields of a scene that are sequences, the class of their members, and its description."""


def set_members(scene: Scene) -> None:
    """Check the members of a scene, and convert sequences to tuples and mappings to dicts.

    Raises
    ------
    BadInput
        If a member is of another type.
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
    """Check that every block to which a load or a support refers exists.

    Raises
    ------
    BadInput
        If one does not.
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
    """Check that every surface name is defined.

    Raises
    ------
    BadInput
        If one is not, or an interface is not a pair of names.
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
    """Check that a surface is defined.

    Raises
    ------
    BadInput
        If it is not.
    """
    if name not in surfaces:
        known = ", ".join(surfaces)
        raise BadInput(where, name, f"define it in surfaces or use one of {known}")


def check_capacities(barriers: Sequence[Barrier]) -> None:
    """Check that every fence has a capacity per metre.

    Raises
    ------
    BadInput
        If a fence has only an energy class, which refers to a panel.
    """
    for i, barrier in enumerate(barriers):
        if isinstance(barrier, Fence) and barrier.capacity is None:
            hint = "give fence.for_width(width): a scene needs the capacity per metre"
            raise BadInput(f"barriers[{i}].energy_class", barrier.energy_class, hint)


def check_blocks(blocks: Sequence[Block]) -> None:
    """Check that at least one block is free, and that blocks do not overlap.

    Raises
    ------
    BadInput
        If none is free, or two overlap by too much.
    """
    if not any(not b.fixed for b in blocks):
        raise BadInput("blocks", f"{len(blocks)} blocks", "give at least one free block")
    check_apart([b.vertices for b in blocks], [b.fixed for b in blocks])


def check_clear(scene: Scene, ground: Terrain) -> None:
    """Check that no free block starts deep in the ground or in a barrier that is a body.

    Raises
    ------
    BadInput
        If one does.
    """
    free = {i: block.vertices for i, block in enumerate(scene.blocks) if not block.fixed}
    overlap = in_ground(ground, list(free.values()))
    if overlap is not None:
        i = list(free)[overlap.block]
        hint = f"raise it: it overlaps the ground by {overlap.shared:.3g} m2"
        raise BadInput(f"blocks[{i}]", scene.blocks[i].vertices.tolist(), hint)
    for j in scene.bodies:
        overlap = deepest(scene.outline(j), list(free.values()))
        if overlap is not None:
            i = list(free)[overlap.block]
            hint = f"move it: it overlaps block {i} by {overlap.shared:.3g} m2"
            raise BadInput(f"barriers[{j}].x", scene.barriers[j].x, hint)


def checked_stems(
    stems: Sequence[ArrayLike], blocks: int, terrain: Terrain | None
) -> tuple[NDArray[np.float64], ...]:
    """Return the tables of stems of the blocks, each in order of chainage.

    Raises
    ------
    BadInput
        If there is not one (k, 3) table for each block, or a stem is not on the terrain or takes a
        negative energy.
    """
    if len(stems) == 0:
        return ()
    if len(stems) != blocks:
        raise BadInput("stems", f"{len(stems)} tables", f"give one for each of {blocks} blocks")
    if terrain is None:
        raise BadInput("stems", "no terrain", "give the scene a terrain on which they stand")
    low, high = terrain.points[:, 0].min(), terrain.points[:, 0].max()
    found = []
    for i, rows in enumerate(stems):
        table = np.array(rows, dtype=np.float64).reshape(-1, 3)
        for row in table[~((table >= (low, 0.0, 0.0)) & (table <= (high, np.inf, np.inf))).all(1)]:
            hint = (
                f"give a chainage from {chainage(low)} to {chainage(high)} m, and an energy and a "
                "height >= 0"
            )
            raise BadInput(f"stems[{i}]", row.tolist(), hint)
        found.append(table[np.argsort(table[:, 0], kind="stable")])
    return tuple(found)


def check_order(scene: Scene) -> None:
    """Check that every barrier that is a body starts downhill of the end of the one before.

    Raises
    ------
    BadInput
        If one does not.
    """
    upright = sorted(scene.bodies, key=lambda i: scene.barriers[i].x)
    for i, j in pairwise(upright):
        end = scene.barriers[i].end
        if scene.barriers[j].x < end - 1e-9 * max(1.0, abs(end)):
            hint = f"put it downhill of x = {chainage(end)}, where barriers[{i}] ends"
            raise BadInput(f"barriers[{j}].x", scene.barriers[j].x, hint)


__all__ = ["Barrier", "Block", "Scene", "Surface", "Terrain", "Wall"]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A mechanical problem in two dimensions, per metre of slope width.

    Parameters
    ----------
    terrain : Terrain or None
        The natural ground; None: free space.
    blocks : sequence of Block
        The rock blocks, at least one of them free to move. They do not include gravity walls.
    surfaces : mapping of str to Surface
        All surfaces to which blocks and the terrain refer. A contact of two surfaces has the
        smaller value of each property.
    barriers : sequence of Wall, GravityWall, Fence, Ditch or Embankment
        Protective structures. Their surface is "concrete" if the scene defines it, otherwise
        "rock"; that of embankments is "soil" if the scene defines it.
    interfaces : mapping of (str, str) to Surface
        Properties of pairs of surfaces, which replace the smaller values.
    loads : sequence of PointLoad, LineLoad or BodyForce
        Dead loads.
    supports : sequence of FixedPoint or Bolt
        Supports.
    gravity : float or (gx, gy)
        Gravity [m/s2]; a number acts downwards.
    damping : float
        Mass-proportional damping coefficient alpha [1/s] (Koo and Chern 1998, damping force). It
        acts on all blocks, also in flight, and limits the speed of a fall to g/alpha, 16 m/s for
        0.6 1/s, so that energies at a barrier are too low.
    damping_when : {"always", "contact"}
        "contact" is permitted without damping only: losses in contact are described by the rolling
        resistance of the surfaces.
    base_motion : (m, 3) array_like, optional
        Time [s] and acceleration of the ground, x and y [m/s2], with linear interpolation; a
        repeated time makes a jump. Before the first and after the last time the acceleration is
        zero. The motion of blocks is computed relative to the ground.
    roughness : Roughness, optional
        Pits in the ground, except under barriers.
    stems : sequence of (k, 3) array_like, optional
        Stems of a forest that each block strikes on its way downhill, one table for each block:
        chainage [m], energy that the stem takes at most [J/m], and height above the ground up to
        which it does [m]. A block strikes a stem when its centroid first passes the chainage. The
        stem slows its translation and its rotation by the same factor. None by default.

    Raises
    ------
    BadInput
        If a name has no surface, an index has no block, a value is outside its range, a block
        overlaps another one, the ground or a barrier by too much, or barriers overlap.
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
    stems: tuple[NDArray[np.float64], ...] = ()
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
            check.set_number(self, "gravity", 0.0)
        check.set_number(self, "damping", 0.0)
        check.one_of("damping_when", self.damping_when, ("always", "contact"))
        check_damping(self.damping, self.damping_when)
        check_blocks(self.blocks)
        check_indices(self)
        if self.base_motion is not None:
            object.__setattr__(self, "base_motion", history(self.base_motion))
        check_names(self)
        object.__setattr__(self, "stems", checked_stems(self.stems, len(self.blocks), self.terrain))
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
        stems: tuple[NDArray[np.float64], ...] = (),
    ) -> Scene:
        """Return the scene with other blocks, surface properties, pits in the ground and stems.

        The ground and the barriers are not built and checked again. `surfaces` must have the same
        names, and `barriers` may differ from those of the scene only in their resistance.

        Raises
        ------
        BadInput
            If the blocks are not valid, as in the constructor, or the scene has loads or supports.
        """
        if self.loads or self.supports:
            raise BadInput(
                "scene", self, "give one without loads and supports, which refer to blocks"
            )
        other = object.__new__(Scene)
        for name in Scene.__slots__:
            object.__setattr__(other, name, getattr(self, name))
        changed = {
            "blocks": blocks,
            "surfaces": surfaces,
            "interfaces": interfaces,
            "roughness": roughness,
            "stems": stems,
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
        """Set the smooth ground with its earthworks, and check that every barrier stands on it."""
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
        """Return a smooth ground with pits, except under the barriers."""
        if ground is None or self.roughness is None:
            return ground
        even = []
        for barrier in barriers:
            if isinstance(barrier, Earthwork):
                x = self._moved[barrier][:, 0]
                even.append((float(x.min()), float(x.max())))
            elif isinstance(barrier, Standing):
                even.append((barrier.x, barrier.x + barrier.extent))
        return self.roughness.applied(ground, even)

    @property
    def smooth_ground(self) -> Terrain | None:
        """The ground with its earthworks, without pits."""
        return self._smooth

    def outline(self, barrier: int) -> NDArray[np.float64]:
        """Return the (n, 2) initial corners of a barrier [m].

        For a ditch or an embankment they enclose the cut or the fill.

        Raises
        ------
        BadInput
            If the barrier does not stand on the ground.
        """
        what = self.barriers[barrier]
        if isinstance(what, Earthwork):
            return self._moved[what]
        assert self._smooth is not None and isinstance(what, Standing)
        if barrier not in self._outlines:
            corners = what.outline(self._smooth)
            corners.setflags(write=False)
            self._outlines[barrier] = corners
        return self._outlines[barrier]

    @property
    def barrier_poses(self) -> NDArray[np.float64]:
        """Initial x, y, theta of the centroid of each barrier's outline, (B, 3) [m, rad]."""
        centres = [polygon_properties(self.outline(i))[1] for i in range(len(self.barriers))]
        return np.array([[*centre, 0.0] for centre in centres]).reshape(-1, 3)

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of barriers that are bodies, in the order in which they follow the blocks.

        Gravity walls, which can move, come first; then fences, which can deflect; then walls.
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
        """Return the ground after embankments among the barriers `gone` were pushed away.

        Earthworks in an embankment, such as a ditch in its crest, are lost with it.
        """
        if self.terrain is None or len(gone) == 0:
            return self.ground
        lost = [self.barriers[i] for i in gone if isinstance(self.barriers[i], Earthwork)]
        left = [
            b
            for b in self.barriers
            if not isinstance(b, Earthwork) or not any(b.x < e.end and b.end > e.x for e in lost)
        ]
        return self._with_pits(earthworks(self.terrain, left, self.fill)[0], left)

    @property
    def fill(self) -> str:
        """Name of the surface of embankments."""
        return "soil" if "soil" in self.surfaces else self.barrier_surface

    @property
    def barrier_surface(self) -> str:
        """Name of the surface of barriers other than embankments."""
        return "concrete" if "concrete" in self.surfaces else "rock"

    def friction_deg(self, first: str, second: str) -> float:
        """Return the friction angle between two named surfaces [deg], as in `interface`."""
        pair = self.interfaces.get((first, second)) or self.interfaces.get((second, first))
        if pair is not None:
            return pair.friction_deg
        return min(self.surfaces[first].friction_deg, self.surfaces[second].friction_deg)

    def resistance(self, index: int) -> float:
        """Return the thrust that a barrier resists [N/m]; inf if it cannot move."""
        return self.barriers[index].resistance(self, self.outline(index))

    def interface(self, first: str, second: str) -> Surface:
        """Return the contact properties of two named surfaces."""
        pair = self.interfaces.get((first, second)) or self.interfaces.get((second, first))
        if pair is not None:
            return pair
        return smaller(self.surfaces[first], self.surfaces[second])


LOADS = {kind.__name__: kind for kind in (PointLoad, LineLoad, BodyForce)}
SUPPORTS = {kind.__name__: kind for kind in (FixedPoint, Bolt)}


def scene_to_json(scene: Scene) -> bytes:
    """Return a scene as JSON, in which numbers are exact."""
    return msgspec.json.encode(
        {
            "terrain": scene.terrain
            and {
                "points": scene.terrain.points.tolist(),
                "surfaces": scene.terrain.surfaces,
            },
            "blocks": [
                {
                    "vertices": b.vertices.tolist(),
                    "density": b.density,
                    "surface": b.surface,
                    "velocity": b.velocity,
                    "fixed": b.fixed,
                }
                for b in scene.blocks
            ],
            "surfaces": scene.surfaces,
            "barriers": to_tables(scene.barriers),
            "interfaces": [[*pair, surface] for pair, surface in scene.interfaces.items()],
            "loads": [[type(load).__name__, load] for load in scene.loads],
            "supports": [[type(support).__name__, support] for support in scene.supports],
            "base_motion": scene.base_motion is not None and scene.base_motion.tolist(),
            "gravity": scene.gravity,
            "damping": scene.damping,
            "damping_when": scene.damping_when,
            "roughness": scene.roughness,
            "stems": [table.tolist() for table in scene.stems],
        }
    )


def scene_from_json(text: bytes) -> Scene:
    """Return the scene written by `scene_to_json`.

    Raises
    ------
    BadInput
        If a value is invalid.
    """
    data = msgspec.json.decode(text)
    terrain, roughness = data.pop("terrain"), data.pop("roughness", None)
    return Scene(
        terrain=terrain and Terrain(**terrain),
        blocks=tuple(Block(**b) for b in data.pop("blocks")),
        surfaces={name: Surface(**s) for name, s in data.pop("surfaces").items()},
        barriers=tuple(
            from_record(f"barriers[{i}]", table) for i, table in enumerate(data.pop("barriers"))
        ),
        interfaces={(a, b): Surface(**s) for a, b, s in data.pop("interfaces")},
        loads=tuple(LOADS[name](**load) for name, load in data.pop("loads")),
        supports=tuple(SUPPORTS[name](**support) for name, support in data.pop("supports")),
        base_motion=data.pop("base_motion") or None,
        roughness=roughness and msgspec.convert(roughness, Roughness),
        **data,
    )
