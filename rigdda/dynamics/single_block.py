"""Repeated simulation of a single convex block on a fixed ground, in reused arrays.

Describing a block and its surroundings in Python takes as long as simulating its descent. Here,
kernels write the block and the interface properties into the arrays of a similar scene and read the
results. All entries that are used are bit-identical to those that `rigdda.dynamics.packing.pack`
gives for a scene of that block. This is one of the three ways in which releases are computed, see
`rigdda.releases`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.constants import AWAKE, MARGIN_RATIO, PENETRATION_RATIO
from rigdda.dynamics.frames import no_frames
from rigdda.dynamics.loop import Loop
from rigdda.dynamics.packing import fences, pack, write_bodies
from rigdda.dynamics.records import TARGET, Bodies, Interfaces
from rigdda.dynamics.stems import write_stems
from rigdda.dynamics.step_record import StepRecord
from rigdda.dynamics.template import together
from rigdda.errors import Diverged
from rigdda.geometry import is_sound
from rigdda.kernel import Direct, kernel, short_kernel
from rigdda.model.block import Block
from rigdda.model.interfaces import ContactProperties
from rigdda.model.overlap import surely_on_ground
from rigdda.model.scene import Scene
from rigdda.model.settings import EARTH, Settings

Stemmed = tuple[NDArray[np.float64], ...]

MOST_CORNERS = 12
"""Maximum number of corners of such a block; the blocks of a release band have no more."""


def with_room(outlines: Outlines) -> Outlines:
    """Return outlines, the first one of a single block, with room for `MOST_CORNERS` corners."""
    corner, local = outlines.corner, outlines.local
    more = max(0, MOST_CORNERS - corner.shape[1])
    wide = np.pad(corner.view(np.ndarray), ((0, 0), (0, more)))
    wide["number"][0] = np.arange(wide.shape[1])
    wide_local = np.pad(local.view(np.ndarray), ((0, 0), (0, more)))
    return Outlines(outlines.polygon, wide.view(np.recarray), wide_local.view(np.recarray))


class Surroundings(NamedTuple):
    """What is around a single block and does not change between releases."""

    chain: NDArray
    """Corners of the ground, (m, 2) [m]."""
    boxes: NDArray
    """Least x and y, greatest x and y of each barrier that is a body, (K, 4) [m]."""
    stations: NDArray
    """Chainages of the stations, (S,) [m]."""
    gravity: float
    """Acceleration that gives the block its weight [m/s2]."""


class SingleArrays(NamedTuple):
    """The arrays that depend on the block and on the properties of a release."""

    bodies: Bodies
    outlines: Outlines
    interfaces: Interfaces
    rock: NDArray  # (1,) of records.WATCHED
    parameters: NDArray  # of records.PARAMETERS


class PairProperties(NamedTuple):
    """Properties of each pair of surfaces of a site, see `ContactProperties`; (n, n) each."""

    friction_deg: NDArray
    restitution: NDArray
    rolling: NDArray
    restitution_speed: NDArray


@short_kernel
def start_single(
    corners: NDArray,
    traits: NDArray,
    around: Surroundings,
    pairs: PairProperties,
    arrays: SingleArrays,
) -> tuple[bool, float]:
    """Write a block and the interface properties into arrays that are in their initial state.

    Parameters
    ----------
    corners : (n, 2) array
        Corners of the block [m].
    traits : (1, 6) array
        Its other properties, see `packing.Trait`.
    around : Surroundings
        Ground, barriers, stations and gravity.
    pairs : PairProperties
        Properties of each pair of surfaces.
    arrays : SingleArrays
        Arrays that are written.

    Returns
    -------
    clear : bool
        Whether the block is certainly convex and clear of the ground and of barriers.
    start : float
        Chainage of its centroid [m].
    """
    if not is_sound(corners) or not surely_on_ground(around.chain, corners):
        return False, 0.0
    if _near(corners, around.boxes):
        return False, 0.0
    bodies, outlines, stations = arrays.bodies, arrays.outlines, around.stations
    bodies[0].count = outlines.polygon[0].count = len(corners)
    write_bodies(corners, traits, bodies, outlines)
    body, watched = bodies[0], arrays.rock[0]
    watched.low, watched.high = body.x - body.radius, body.x + body.radius
    passed = 0
    while passed < len(stations) and stations[passed] <= body.x:
        passed += 1
    watched.next = passed
    _set_interfaces(pairs, arrays.interfaces)
    size = math.sqrt(body.mass / traits[0, 0])
    for k in range(len(arrays.parameters)):
        p = arrays.parameters[k]
        p.block_weight = body.mass * around.gravity
        p.penetration, p.margin = PENETRATION_RATIO * size, MARGIN_RATIO * size
    return True, body.x


start_single_directly = Direct(start_single)


@kernel
def _near(corners: NDArray, boxes: NDArray) -> bool:
    """Return whether the bounding box of a block overlaps that of a barrier."""
    left, right, low, high = math.inf, -math.inf, math.inf, -math.inf
    for k in range(len(corners)):
        left, right = min(left, corners[k, 0]), max(right, corners[k, 0])
        low, high = min(low, corners[k, 1]), max(high, corners[k, 1])
    for i in range(len(boxes)):
        beside = left > boxes[i, 2] or right < boxes[i, 0]
        if not beside and low <= boxes[i, 3] and high >= boxes[i, 1]:
            return True
    return False


@kernel
def _set_interfaces(pairs: PairProperties, interfaces: Interfaces) -> None:
    """Write the properties of pairs of named surfaces.

    The surfaces of fences and gravity walls, which follow, stay as they are: that of fences never
    changes, and gravity walls are not among the barriers of single blocks.
    """
    for i in range(len(interfaces)):
        for j in range(len(interfaces)):
            interface = interfaces[i, j]
            if i < len(pairs.restitution) and j < len(pairs.restitution):
                interface.friction = math.tan(math.radians(pairs.friction_deg[i, j]))
                interface.restitution = pairs.restitution[i, j]
                interface.rolling = pairs.rolling[i, j]
                interface.restitution_speed = pairs.restitution_speed[i, j]


@short_kernel
def read_single(
    bodies: Bodies, rock: NDArray
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float], float]:
    """Return position [m], velocity [m/s], extent [m] and energy [J] of a block, see `Descent`."""
    body, watched = bodies[0], rock[0]
    extent = watched.low, watched.high
    return (body.x, body.y), (body.vx, body.vy), extent, watched.energy


read_single_directly = Direct(read_single)


ABSORBED, THRUST = (list(TARGET.fields or ()).index(name) for name in ("absorbed", "thrust"))
"""Indices of these fields in a record of a barrier."""


class Descent(NamedTuple):
    """Results of the descent of a block."""

    start: float
    """Chainage of its centroid at the start [m]."""
    place: tuple[float, float]
    """Its centroid at the end [m]."""
    velocity: tuple[float, float]
    """Velocity of its centroid at the end [m/s]."""
    extent: tuple[float, float]
    """Least and greatest chainage reached by its circumscribed circle [m]."""
    energy: float
    """Its largest kinetic energy in the watched interval [J]."""
    time: float
    """Duration of the run [s]."""
    events: list[tuple[Any, ...]]
    """Events in order of time, each with the fields of `rigdda.dynamics.run.EVENT`."""
    absorbed: list[float]
    """Energy that each barrier absorbed [J]."""
    thrust: list[float]
    """Greatest thrust on each barrier, averaged over a second [N/m]."""
    moved: list[float]
    """Downhill displacement of each barrier that is a body, in the order of the bodies [m]."""


class SingleBlock:
    """Reusable arrays of a scene with a single block.

    Parameters
    ----------
    scene : Scene
        A scene of this kind: its block is convex and free, no surface has a restitution of None,
        and no gravity wall can move.
    settings : Settings
        Settings of the computation.
    stations : (K,) array
        Ascending chainages whose first crossings are recorded [m].
    watch : (float, float)
        Interval of x in which energies are recorded [m].
    leave : float
        x beyond which a block that moves downhill may be ignored [m].
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        stations: NDArray[np.float64],
        watch: tuple[float, float],
        leave: float,
    ):
        assert len(scene.blocks) == 1 and scene.smooth_ground is not None
        self._scene = scene
        self._surfaces = {name: i for i, name in enumerate(scene.surfaces)}
        packed = pack(scene, settings, stations, watch, leave)
        packed = packed._replace(outlines=with_room(packed.outlines))
        self._memory, self._arrays = together(packed)
        a = self._arrays
        self._written = SingleArrays(
            a.bodies, a.outlines, a.interfaces, a.monitors.rock, a.parameters
        )
        self._fresh = self._memory.copy()
        self._loop = Loop(scene, self._arrays, settings.dt)
        self._no_frames = no_frames(packed.bodies)
        self._corners = np.zeros((MOST_CORNERS, 2))
        self._traits = np.zeros((1, 6))  # see `packing.Trait`
        outlines = [scene.outline(i) for i in scene.bodies]
        boxes = [[*corners.min(axis=0), *corners.max(axis=0)] for corners in outlines]
        self._around = Surroundings(
            np.array(scene.smooth_ground.points),
            np.array(boxes).reshape(-1, 4),
            stations,
            math.hypot(*scene.gravity_vector) or EARTH,
        )
        self._target = self._arrays.monitors.target.view(np.ndarray)
        self._brake = self._arrays.bodies.view(np.ndarray)["brake"]
        self._fences = list(fences(scene))
        self._start = packed.bodies["x"][1:].copy()

    def has_room(self, stems: Stemmed) -> bool:
        """Return whether the arrays have room for the stems that a block strikes."""
        return all(len(table) <= self._arrays.stems.stem.shape[1] for table in stems)

    def run(
        self,
        block: Block,
        properties: ContactProperties,
        forces: Sequence[float],
        limits: Sequence[float],
        stems: Stemmed,
        steps: int,
        record: StepRecord | None = None,
    ) -> Descent | None:
        """Simulate the descent of a block.

        Parameters
        ----------
        block : Block
            The block, with at most `MOST_CORNERS` corners.
        properties : ContactProperties
            Properties of each pair of surfaces.
        forces : sequence of float
            Braking force of each fence, in the order of the bodies [N/m].
        limits : sequence of float
            Thrust at which each barrier is pushed away, inf: never [N/m].
        stems : tuple of (k, 3) array
            Stems that the block strikes, see `Scene.stems`, for which `has_room`.
        steps : int
            Maximum number of steps.
        record : StepRecord, optional
            Filled with the states of the block.

        Returns
        -------
        Descent or None
            None if this method cannot decide the outcome: the block may start in the ground or in a
            barrier, is nearly non-convex, or the simulation diverges.
        """
        a, loop = self._arrays, self._loop
        self._memory[:] = self._fresh
        loop.start(a)
        if len(limits):
            self._target["limit"] = limits
            self._brake[self._fences] = forces
        write_stems(stems, self._scene, a.stems)
        corners = self._corners[: len(block.vertices)]
        corners[:] = block.vertices
        self._traits[0] = (block.density, *block.velocity, self._surfaces[block.surface], AWAKE)
        clear, start = start_single_directly.call(
            corners,
            self._traits,
            self._around,
            PairProperties(
                properties.friction_deg,
                properties.restitution,
                properties.rolling,
                properties.restitution_speed,
            ),
            self._written,
        )
        if not clear:
            return None
        try:
            if record is None:
                loop.advance(steps, self._no_frames)
            else:
                record.follow(loop, steps)
        except Diverged:
            return None
        place, velocity, extent, energy = read_single_directly.call(a.bodies, a.monitors.rock)
        barriers = self._target.tolist()
        return Descent(
            start,
            place,
            velocity,
            extent,
            energy,
            loop.time,
            loop.events().tolist(),
            [barrier[ABSORBED] for barrier in barriers],
            [barrier[THRUST] for barrier in barriers],
            (a.bodies["x"][1:] - self._start).tolist(),
        )
