"""Trajectories of releases for the page: ways, speeds and energies, and where blocks end."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import rigdda
from rigdda import Ditch, Error, Layout, Site
from rigdda.envs.intervals import Estimate, estimate

Floats = NDArray[np.float64]

ENDS = (
    "never leaves", "stops on the slope", "stops in a ditch", "stops on the road",
    "passes the road",
)  # fmt: skip
"""Where a block ends."""

LEAVES = 1.0
"""Distance from its start beyond which a block has left it [m]."""

FIRST, STEP = 5, 25
"""Number of releases that are computed together: at the start, and later."""

SHOWN = 160
"""Greatest number of points of a trajectory that is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Fall:
    """The way of one block.

    Parameters
    ----------
    event : str
        Name of the event.
    seed, block : int
        Seed of the release, and number of the block in it.
    time, x, y : (n,) array
        Times [s] and places of its centroid [m].
    speed : (n,) array
        Speed of the centroid [m/s].
    energy : (n,) array
        Kinetic energy of translation and rotation [kJ], of the whole block.
    end : str
        Where it ends, one of `ENDS`.
    """

    event: str
    seed: int
    block: int
    time: Floats
    x: Floats
    y: Floats
    speed: Floats
    energy: Floats
    end: str


def of_release(site: Site, layout: Layout, seed: int, event: str) -> list[Fall]:
    """Return the ways of the blocks of one release.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope.
    Diverged
        If the simulation diverges.
    """
    run, outcome = rigdda.release(site, layout, seed, event)
    moving = [block for block in run.scene.blocks if not block.fixed]
    found = []
    for i, block in enumerate(moving):
        poses, velocities = run.poses[:, i], run.velocities[:, i]
        area, _, inertia = rigdda.geometry.polygon_properties(block.vertices)[:3]
        mass = block.density * area
        polar = block.density * float(inertia)
        width = float(np.sqrt(area)) if len(moving) == 1 else outcome.width / len(moving)
        speed = np.hypot(velocities[:, 0], velocities[:, 1])
        energy = 5e-4 * width * (mass * speed**2 + polar * velocities[:, 2] ** 2)
        thin = max(1, len(run.times) // SHOWN)
        keep = np.unique(np.append(np.arange(0, len(run.times), thin), len(run.times) - 1))
        way = poses[keep]
        found.append(
            Fall(event, seed, i, run.times[keep], way[:, 0], way[:, 1], speed[keep],
                 energy[keep], end_of(site, layout, way[0], way[-1]))
        )  # fmt: skip
    return found


def end_of(site: Site, layout: Layout, start: Floats, end: Floats) -> str:
    """Return where a block ends, from the first and the last place of its centroid."""
    if float(np.hypot(*(end[:2] - start[:2]))) < LEAVES:
        return ENDS[0]
    x = float(end[0])
    if x > site.road.end:
        return ENDS[4]
    if x >= site.road.start:
        return ENDS[3]
    ditches = [b for b in site.standing(layout) if isinstance(b, Ditch)]
    return ENDS[2] if any(b.x <= x <= b.end for b in ditches) else ENDS[1]


def shares(falls: Sequence[Fall]) -> dict[str, Estimate]:
    """Return the share of blocks with each end, with its interval."""
    ends = [fall.end for fall in falls]
    return {end: estimate(ends.count(end), len(ends)) for end in ENDS}


class Crossing(NamedTuple):
    """What passes a station, one value for each block that does."""

    energy: Floats
    """Kinetic energy [kJ]."""
    speed: Floats
    """Speed [m/s]."""
    height: Floats
    """Height of the centroid above the ground, vertically [m]."""
    normal: Floats
    """The same at right angles to the slope [m]."""


def crossing(site: Site, falls: Sequence[Fall], x: float) -> Crossing:
    """Return energies, speeds and heights of blocks as they first pass a chainage.

    Values are interpolated between the points of the trajectories.
    """
    ground = site.profile.height(x)
    half = 0.5
    first, last = float(site.slope.points[0][0]), float(site.slope.points[-1][0])
    low, high = max(first, x - half), min(last, x + half)
    fall = site.profile.height(low) - site.profile.height(high)
    cosine = (high - low) / float(np.hypot(high - low, fall))
    rows = []
    for one in falls:
        if not one.x[0] < x or one.x.max() < x:
            continue
        k = int(np.argmax(one.x >= x))
        w = (x - one.x[k - 1]) / (one.x[k] - one.x[k - 1])
        values = [(1 - w) * a[k - 1] + w * a[k] for a in (one.energy, one.speed, one.y)]
        tall = values[2] - ground
        rows.append((values[0], values[1], tall, tall * cosine))
    table = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return Crossing(*table)


class Release:
    """Releases that a thread computes, which can be stopped.

    Attributes
    ----------
    falls : list of Fall
        What is computed so far; it only grows.
    done, asked : int
        Number of releases that are computed, and that were asked for.
    fault : str
        Why the computing ended early; empty if it did not.
    """

    def __init__(self, site: Site, layout: Layout, events: Sequence[str]):
        self.site, self.layout, self.events = site, layout, tuple(events)
        self.falls: list[Fall] = []
        self.done = self.asked = 0
        self.fault = ""
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def running(self) -> bool:
        """Whether releases are being computed."""
        return self._thread is not None and self._thread.is_alive()

    def more(self, count: int) -> None:
        """Compute more releases; those of several events take turns."""
        self.asked += count
        if not self.running:
            self._stop.clear()
            self._thread = threading.Thread(target=self._work, name="releases", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop after the releases that are being computed."""
        self._stop.set()
        self.asked = self.done

    def join(self) -> None:
        """Wait until the releases that were asked for are computed."""
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        try:
            while self.done < self.asked and not self._stop.is_set():
                k = self.done
                event = self.events[k % len(self.events)]
                seed = k // len(self.events)
                self.falls += of_release(self.site, self.layout, seed, event)
                self.done += 1
        except Error as error:
            self.fault = str(error)
            self.asked = self.done
        except Exception as error:  # shown on the page
            traceback.print_exc()
            self.fault = f"{type(error).__name__}: {error}"
            self.asked = self.done
