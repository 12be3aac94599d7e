"""The recorded history of a simulation."""

from __future__ import annotations

import os
import zipfile
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import display
from rigdda.barriers import Fence, GravityWall
from rigdda.barriers.base import STANDS
from rigdda.dynamics.monitors import CROSSING, FAILED, HIT
from rigdda.errors import BadInput
from rigdda.files import atomic, is_file
from rigdda.ground.terrain import Terrain
from rigdda.model.scene import Scene, scene_from_json, scene_to_json

if TYPE_CHECKING:
    from rigdda.replay.recording import Marks

EVENT = np.dtype(
    [
        ("time", "f8"),
        ("kind", "i4"),
        ("block", "i4"),
        ("target", "i4"),
        ("x", "f8"),
        ("y", "f8"),
        ("height", "f8"),
        ("speed", "f8"),
        ("energy", "f8"),
    ]
)
"""Fields of an event. block: N + i for barrier i, a gravity wall that hits or breaks another
barrier. target: index of the barrier or station. x, y: contact point of a hit or failure, centroid
at a crossing [m]. height: of that point above the highest ground there, or above 0 where there is
no ground [m]. speed: of the centroid [m/s]. energy: translational and rotational, just before a hit
or failure [J]."""


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Record of a simulation with N blocks, T frames and B barriers.

    Parameters
    ----------
    scene : Scene
        The simulated scene.
    times : (T,) array
        Times of the frames [s].
    poses, velocities : (T, N, 3) array
        x, y, theta of the centroids [m, m, rad] and their rates [m/s, m/s, rad/s].
    events : (E,) structured array
        Hits, crossings and failures in order of time, see `EVENT`.
    absorbed : (B,) array
        Energy that each barrier absorbed from the blocks [J], see `BarrierOutcome`.
    thrust : (B,) array
        Greatest thrust on each barrier, averaged over a second [N], see `BarrierOutcome`.
    watch_energy : (N,) array
        Largest kinetic energy of each block while its centroid was in the watched interval [J].
    extent : (N, 2) array
        Least and greatest chainage reached by the circumscribed circle of each block [m].
    barrier_poses : (T, B, 3) array
        x, y, theta of the centroid of each barrier's initial outline; gravity walls and fences
        move.
    """

    scene: Scene
    times: NDArray[np.float64]
    poses: NDArray[np.float64]
    velocities: NDArray[np.float64]
    events: NDArray[np.void]
    absorbed: NDArray[np.float64]
    thrust: NDArray[np.float64]
    watch_energy: NDArray[np.float64]
    extent: NDArray[np.float64]
    barrier_poses: NDArray[np.float64]

    def _check(self) -> None:
        """Check that every array has its shape and is finite, and that times increase."""
        t, n, b = self.times.size, len(self.scene.blocks), len(self.scene.barriers)
        shapes = {
            "times": (t,),
            "poses": (t, n, 3),
            "velocities": (t, n, 3),
            "events": self.events.shape[:1],
            "absorbed": (b,),
            "thrust": (b,),
            "watch_energy": (n,),
            "extent": (n, 2),
            "barrier_poses": (t, b, 3),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise BadInput(f"run file: {name}", array.shape, f"give an array of shape {shape}")
            wanted = EVENT if name == "events" else np.dtype(float)
            if array.dtype != wanted or (name != "events" and not np.isfinite(array).all()):
                raise BadInput(f"run file: {name}", str(array.dtype), "give finite numbers")
        if t == 0 or (np.diff(self.times) <= 0.0).any():
            raise BadInput("run file: times", f"{t} frames", "give times that rise")

    def hits(self, barrier: int) -> NDArray[np.void]:
        """Return the events in which a block hits `barrier`."""
        return self._of(HIT, barrier)

    def failure(self, barrier: int) -> float:
        """Return the time at which `barrier` failed [s], inf if it did not fail."""
        failed = self._of(FAILED, barrier)
        return float(failed["time"][0]) if len(failed) else np.inf

    def states(self, barrier: int) -> list[tuple[float, str]]:
        """Return the successive states of a barrier, each with the time at which it begins [s].

        The first state is "stands". Later ones are "failed" for a fence, "pushed" for an
        embankment, and "slid" or "overturned" for a gravity wall, determined from the frames of the
        run.
        """
        changes = self.scene.barriers[barrier].changes
        poses = self.barrier_poses[:, barrier]
        start = (float(self.times[0]), STANDS)
        return [start, *changes(self.times, poses, self.failure(barrier))]

    def state(self, barrier: int, frame: int = -1) -> str:
        """Return the state of a barrier in a frame, see `states`."""
        now = self.times[frame]
        return [state for time, state in self.states(barrier) if time <= now][-1]

    def passed(self, x: float) -> NDArray[np.bool_]:
        """Return whether each block's centroid has reached a chainage [m] by each frame, (T, N).

        Recorded crossings count as well, so that a block that returned between two frames is not
        missed.
        """
        seen = self.poses[:, :, 0] >= x
        for event in self.events[(self.events["kind"] == CROSSING) & (self.events["x"] >= x)]:
            seen[np.searchsorted(self.times, event["time"]) :, event["block"]] = True
        return np.logical_or.accumulate(seen, axis=0)

    def outline(self, barrier: int, frame: int = -1) -> NDArray[np.float64]:
        """Return the (n, 2) corners of a barrier in a frame, see `Scene.outline` [m]."""
        corners = self.scene.outline(barrier)
        one = self.scene.barriers[barrier]
        start, (x, y, theta) = self.barrier_poses[0, barrier], self.barrier_poses[frame, barrier]
        if isinstance(one, Fence):
            path = abs(x - start[0])
            sunk = np.array([0.0, 0.0, path, path]) * one.sag
            return corners + np.stack([np.full(4, x - start[0]), -sunk], axis=1)
        if not isinstance(one, GravityWall):
            return corners
        cos, sin = np.cos(theta), np.sin(theta)
        return (corners - start[:2]) @ np.array([[cos, sin], [-sin, cos]]) + [x, y]

    def corners(self, block: int, frame: int = -1) -> NDArray[np.float64]:
        """Return the (n, 2) corners of a block in a frame [m]; the first frame is turned by 0."""
        x, y, theta = self.poses[frame, block]
        cos, sin = np.cos(theta), np.sin(theta)
        turn = np.array([[cos, sin], [-sin, cos]])
        return (self.scene.blocks[block].vertices - self.poses[0, block, :2]) @ turn + [x, y]

    @property
    def ground(self) -> Terrain | None:
        """The ground at the end, without the embankments that were pushed away."""
        failed = self.events["target"][self.events["kind"] == FAILED]
        return self.scene.ground_without(failed)

    def crossings(self, station: int) -> NDArray[np.void]:
        """Return the events in which a block first passes `station`."""
        return self._of(CROSSING, station)

    def _of(self, kind: int, target: int) -> NDArray[np.void]:
        return self.events[(self.events["kind"] == kind) & (self.events["target"] == target)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the run as .npz; `load` restores exactly the same numbers."""
        with atomic(path) as part, part.open("wb") as file:
            np.savez_compressed(
                file,
                scene=np.frombuffer(scene_to_json(self.scene), dtype=np.uint8),
                times=self.times,
                poses=self.poses,
                velocities=self.velocities,
                events=self.events,
                absorbed=self.absorbed,
                thrust=self.thrust,
                watch_energy=self.watch_energy,
                extent=self.extent,
                barrier_poses=self.barrier_poses,
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Run:
        """Read a run written by `save`.

        Raises
        ------
        BadInput
            If the file is missing or is not a run.
        """
        if not is_file(path):
            raise BadInput("run file", str(path), "name an existing .npz file")
        try:
            with np.load(path) as stored:
                data = {name: stored[name] for name in stored.files}
            scene = scene_from_json(data.pop("scene").tobytes())
            run = cls(scene=scene, **data)
        except (
            KeyError, ValueError, TypeError, AttributeError, EOFError, OSError,
            NotImplementedError, RecursionError, zlib.error, zipfile.BadZipFile,
            msgspec.MsgspecError,
        ):  # fmt: skip
            raise BadInput("run file", str(path), "name a .npz file that Run.save wrote") from None
        run._check()
        return run

    def to_rerun(self, path: str | os.PathLike[str], marks: Marks | None = None) -> None:
        """Write the run as a Rerun recording (.rrd): static geometry, time series of poses.

        Parameters
        ----------
        path : path
            The .rrd file.
        marks : Marks, optional
            Information that the scene lacks: the road and a description of the episode.
        """
        from rigdda.replay.recording import write_rerun

        write_rerun(self, path, marks)

    def _repr_png_(self) -> bytes:
        """Return a picture of the last frame, for notebooks."""
        ground, scene = self.ground, self.scene
        blocks = [self.corners(i) for i in range(len(scene.blocks))]
        barriers = [
            display.Outline(self.outline(i), filled=barrier.drawn != "line")
            for i, barrier in enumerate(scene.barriers)
        ]
        points = np.concatenate(blocks) if ground is None else ground.points
        section = display.Section(points, blocks=blocks, barriers=barriers)
        return display.png(section, f"{len(blocks)} blocks after {self.times[-1]:.1f} s")
