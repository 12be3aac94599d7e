"""A single convex block on a ground that stays the same, run in the same arrays again and again.

To describe a block and its surroundings anew in Python takes as long as to compute how it comes
down. Here kernels write the block, and how surfaces meet, into the arrays of a scene like it, and
read what came of it. The arrays are to the bit what `rigdda.dynamics.pack.pack` gives for a scene
of that block, as far as they are read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.constants import AWAKE
from rigdda.dynamics.frames import no_frames
from rigdda.dynamics.loop import Loop
from rigdda.dynamics.pack import pack
from rigdda.dynamics.pack.again import together
from rigdda.dynamics.pack.bodies import fences
from rigdda.dynamics.pack.single import MOST_CORNERS, with_room
from rigdda.dynamics.pack.single import read_single_directly as read_single
from rigdda.dynamics.pack.single import start_single_directly as start_single
from rigdda.dynamics.records import TARGET
from rigdda.errors import Diverged
from rigdda.model.block import Block
from rigdda.model.meetings import Meetings
from rigdda.model.scene import Scene
from rigdda.model.settings import EARTH, Settings

ABSORBED, THRUST = (list(TARGET.fields or ()).index(name) for name in ("absorbed", "thrust"))
"""Places of these fields in a record of a barrier."""


class Descent(NamedTuple):
    """What came of a block."""

    start: float
    """Chainage of its centroid at the start [m]."""
    place: tuple[float, float]
    """Its centroid at the end [m]."""
    velocity: tuple[float, float]
    """Velocity of its centroid at the end [m/s]."""
    extent: tuple[float, float]
    """Least and greatest chainage that the circle about it came to [m]."""
    energy: float
    """Its largest kinetic energy in the watched interval [J]."""
    time: float
    """When it ended [s]."""
    events: list[tuple[Any, ...]]
    """What happened, in order of time, each with the fields of `rigdda.dynamics.run.EVENT`."""
    absorbed: list[float]
    """Energy that each barrier took [J]."""
    thrust: list[float]
    """Greatest mean over a second of the thrust on each barrier [N/m]."""
    moved: list[float]
    """How far each barrier that is a body has moved downhill, in the order of the bodies [m]."""


class SingleBlock:
    """The arrays of a scene of a single block, and what it takes to set them back for another one.

    Parameters
    ----------
    scene : Scene
        One such scene: its block is convex and free, no surface has a restitution of None, and no
        gravity wall can move.
    settings : Settings
        How it is computed.
    stations : (K,) array
        Ascending chainages whose first crossings are recorded [m].
    watch : (float, float)
        Interval of x in which energies are watched [m].
    leave : float
        x beyond which what moves on is left alone [m].
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
        self._stations = stations
        self._gravity = math.hypot(*scene.gravity_vector) or EARTH
        self._surfaces = {name: i for i, name in enumerate(scene.surfaces)}
        packed = pack(scene, settings, stations, watch, leave)
        packed = packed._replace(outlines=with_room(packed.outlines))
        self._memory, self._arrays = together(packed)
        self._fresh = self._memory.copy()
        self._loop = Loop(scene, self._arrays, settings.dt)
        self._no_frames = no_frames(packed.bodies)
        self._corners = np.zeros((MOST_CORNERS, 2))
        self._traits = np.zeros((1, 6))  # see `pack.bodies.Trait`
        self._chain = np.array(scene.smooth_ground.points)
        outlines = [scene.outline(i) for i in scene.bodies]
        self._boxes = np.array(
            [[*corners.min(axis=0), *corners.max(axis=0)] for corners in outlines]
        ).reshape(-1, 4)
        self._target = self._arrays.monitors.target.view(np.ndarray)
        self._brake = self._arrays.bodies.view(np.ndarray)["brake"]
        self._fences = list(fences(scene))
        self._start = packed.bodies["x"][1:].copy()

    def run(
        self,
        block: Block,
        meetings: Meetings,
        forces: Sequence[float],
        limits: Sequence[float],
        steps: int,
    ) -> Descent | None:
        """Return what comes of a block.

        Parameters
        ----------
        block : Block
            The block, with `MOST_CORNERS` at most.
        meetings : Meetings
            How surfaces meet.
        forces : sequence of float
            Force against which each fence gives way, in the order of the bodies [N/m].
        limits : sequence of float
            Thrust that each barrier bears before it is pushed away, inf: any [N/m].
        steps : int
            Most steps.

        Returns
        -------
        Descent or None
            None where it takes more than this to tell: the block may start in the ground or in a
            barrier, is hardly convex, or the simulation diverges.
        """
        a, loop = self._arrays, self._loop
        self._memory[:] = self._fresh
        loop.start(a)
        if len(limits):
            self._target["limit"] = limits
            self._brake[self._fences] = forces
        corners = self._corners[: len(block.vertices)]
        corners[:] = block.vertices
        self._traits[0] = (block.density, *block.velocity, self._surfaces[block.surface], AWAKE)
        clear, start = start_single.call(
            corners, self._traits, self._chain, self._boxes, meetings.friction_deg,
            meetings.restitution, meetings.damping, self._stations, self._gravity, a.bodies,
            a.outlines, a.interfaces, a.monitors.rock, a.parameters,
        )  # fmt: skip
        if not clear:
            return None
        try:
            loop.advance(steps, self._no_frames)
        except Diverged:
            return None
        place, velocity, extent, energy = read_single.call(a.bodies, a.monitors.rock)
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
