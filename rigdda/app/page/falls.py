"""Releases for the page: paths of blocks that a thread computes, and where the blocks end."""

from __future__ import annotations

import math
import threading
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rigdda import Error, Layout, Site, Trajectories, trajectory_parts
from rigdda.envs.intervals import Estimate, estimate
from rigdda.envs.quantiles import BlockSample
from rigdda.trajectory import Place, PointKind

Floats = NDArray[np.float64]

ENDS = {
    Place.NEVER_LEFT: "never leaves",
    Place.SLOPE: "stops on the slope",
    Place.HELD: "held by a barrier or ditch",
    Place.ROAD: "stops on the road",
    Place.BEYOND: "passes the road",
}
"""Where a block ends, in words."""

SIZE = 10
"""Number of releases that appear together."""


@dataclass(frozen=True, slots=True, eq=False)
class Fall:
    """The path of one block.

    Parameters
    ----------
    event : str
        Name of the event.
    seed : int
        Seed of the release.
    found : Trajectories
        The trajectories that hold the path.
    path : int
        Its index in them.
    """

    event: str
    seed: int
    found: Trajectories
    path: int

    @property
    def x(self) -> Floats:
        """Chainages of the points of the path [m]."""
        return self.found.x[self.found.points(self.path)]

    @property
    def y(self) -> Floats:
        """Elevations of the points of the path [m]."""
        return self.found.y[self.found.points(self.path)]

    @property
    def speed(self) -> Floats:
        """Speeds of the centroid at the points [m/s]."""
        own = self.found.points(self.path)
        return np.hypot(self.found.vx[own], self.found.vy[own])

    @property
    def energy(self) -> Floats:
        """Kinetic energies of the whole block at the points [kJ]."""
        return 1e-3 * self.found.energy[self.found.points(self.path)]

    @property
    def mass(self) -> float:
        """Mass of the block [t]."""
        return 1e-3 * float(self.found.mass[self.path])

    @property
    def duration(self) -> float:
        """Time at the end [s]."""
        return float(self.found.time[self.found.points(self.path)][-1])

    @property
    def end(self) -> str:
        """Where it ends, in words."""
        return ENDS[Place(int(self.found.place[self.path]))]

    @property
    def reaches(self) -> bool:
        """Whether its centroid ever passes the uphill edge of the road."""
        return bool(self.found.reached[self.path])

    @property
    def impacts(self) -> tuple[Floats, Floats]:
        """Chainages and elevations of the centroid at impacts [m]."""
        own = self.found.points(self.path)
        hits = self.found.kind[own] == PointKind.IMPACT
        return self.x[hits], self.y[hits]

    def outline(self, time: float) -> Floats:
        """Return the corners of the block at a time [s], (n, 2) [m]."""
        x, y, turn = self.found.states(self.path, [time])[0, :3]
        x0, y0, before = self.found.states(self.path, [0.0])[0, :3]
        cos, sin = np.cos(turn - before), np.sin(turn - before)
        arm = self.found.vertices[self.path] - np.array([x0, y0])
        turned: Floats = arm @ np.array([[cos, sin], [-sin, cos]]) + np.array([x, y])
        return turned


def falls_of(site: Site, found: Trajectories) -> list[Fall]:
    """Return the paths of some trajectories one by one."""
    names = site.event_names
    return [
        Fall(names[int(found.event[r])], found.seed[r], found, path)
        for path, r in enumerate(found.release.tolist())
    ]


def shares(falls: Sequence[Fall]) -> dict[str, Estimate]:
    """Return the share of blocks with each end, with its interval.

    Blocks of one release are not independent: a share has the interval of as many independent
    blocks as have its variance between releases (Kish 1965), at most that of all blocks.
    """
    found = {}
    seeds = np.unique([fall.seed for fall in falls], return_inverse=True)[1]
    releases = int(seeds.max(initial=-1)) + 1
    event = np.zeros(releases, dtype=np.int64)
    for end in ENDS.values():
        own = np.array([fall.end == end for fall in falls], dtype=np.float64)
        share, count = float(own.mean()) if len(own) else math.nan, len(own)
        sample = BlockSample(own, seeds, event, np.ones(1))
        variance = sample.variance(own - share) if count else 0.0
        if releases == 1:
            count = 1
        elif variance > 0.0:
            count = max(1, min(count, round(share * (1.0 - share) / variance)))
        one = estimate(round(share * count) if count else 0, count)
        found[end] = replace(one, probability=share, releases=len(own)) if count else one
    return found


def nearest(falls: Sequence[Fall], x: float, y: float, reach: float) -> Fall | None:
    """Return the fall with the nearest path; None if all are farther than `reach` [m]."""
    found = None
    for fall in falls:
        distance = _distance(fall, x, y)
        if distance <= reach:
            found, reach = fall, distance
    return found


def _distance(fall: Fall, x: float, y: float) -> float:
    """Return the least distance of a place from the path of a block [m]."""
    points = np.column_stack([fall.x, fall.y])
    start, along = points[:-1], np.diff(points, axis=0)
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((np.array([x, y]) - start) * along).sum(axis=1) / square, 0.0, 1.0)
    feet = np.vstack([points[:1], start + share[:, None] * along])
    return float(np.hypot(feet[:, 0] - x, feet[:, 1] - y).min())


class Release:
    """Releases of an event that a thread computes, which can be stopped.

    Parameters
    ----------
    site : Site
        The site.
    layout : Layout
        The barriers.
    event : str
        Name of the event.

    Attributes
    ----------
    falls : list of Fall
        What is computed so far; it only grows.
    done, asked : int
        Number of releases that are computed, with seeds from 0, and that were asked for.
    running : bool
        Whether releases are being computed.
    fault : str
        Why the computing ended early; empty if it did not.
    """

    def __init__(self, site: Site, layout: Layout, event: str):
        self.site, self.layout, self.event = site, layout, event
        self.falls: list[Fall] = []
        self.done = self.asked = 0
        self.fault = ""
        self.running = False
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def more(self, count: int) -> None:
        """Compute more releases."""
        with self._lock:
            self.asked += count
            if not self.running:
                self.running, self.fault = True, ""
                self._thread = threading.Thread(target=self._work, name="releases", daemon=True)
                self._thread.start()

    def stop(self) -> None:
        """Stop after the releases that are being computed."""
        with self._lock:
            self.asked = self.done

    def join(self) -> None:
        """Wait until the releases that were asked for are computed."""
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        try:
            while self._unfinished():
                self._compute(range(self.done, self.asked))
        except Error as error:
            self.fault = str(error)
        except Exception as error:  # shown on the page
            traceback.print_exc()
            self.fault = f"{type(error).__name__}: {error}"
        if self.fault:
            with self._lock:
                self.asked, self.running = self.done, False

    def _unfinished(self) -> bool:
        """Return whether more releases were asked for; the thread ends if not."""
        with self._lock:
            self.running = self.done < self.asked
            self.asked = max(self.asked, self.done)
            return self.running

    def _compute(self, seeds: range) -> None:
        """Compute releases until they are done or stopped."""
        parts = trajectory_parts(self.site, self.layout, self.event, seeds, size=SIZE)
        for found in parts:
            self.falls += falls_of(self.site, found)
            with self._lock:
                self.done += len(found.seed)
                stopped = self.done >= self.asked
            if stopped:
                parts.close()
                return
