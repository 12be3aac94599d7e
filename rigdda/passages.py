"""Passages of blocks at stations, and the places where blocks stop.

The state of a block at a station is that of the first step at which its centroid is at or beyond
the station. Nothing depends on the interval of recorded frames. The motion is that of
`rigdda.releases.Batch`; `rigdda.releases` describes the ways in which releases are computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import check, distribution
from rigdda.barriers import Barrier, Layout, as_layout
from rigdda.dynamics.monitors import CROSSING
from rigdda.dynamics.simulation import Simulation
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.measurement import AT_REST
from rigdda.model.site import Site
from rigdda.releases import MOST_PER_THREAD, SENT, Batch, as_site, divided
from rigdda.rounding import chainage

PASSAGE = np.dtype(
    [
        ("release", "i8"),
        ("event", "i4"),
        ("block", "i4"),
        ("station", "i4"),
        ("time", "f8"),
        ("vx", "f8"),
        ("vy", "f8"),
        ("omega", "f8"),
        ("height", "f8"),
        ("normal", "f8"),
        ("translation", "f8"),
        ("rotation", "f8"),
        ("mass", "f8"),
        ("width", "f8"),
        ("radius", "f8"),
    ]
)
"""Fields of a passage: the first time that the centroid of a block is at or beyond a station.

release: index of the release. event: index of the event in `Site.event_names`. station: index of
the station. time: since the release [s]. vx, vy: velocity of the centroid, downhill and upwards
[m/s]. omega: angular velocity [rad/s]. height: of the centroid above the ground at the station,
vertically [m]. normal: the same at right angles to the slope, height times the cosine of the
inclination of the ground between half a width uphill and half a width downhill of the station [m].
translation, rotation: kinetic energy [J]. mass [kg], width: length of the block
along the road, the root of its cross-section [m]. radius: of the circumscribed circle about the
centroid [m]. Energies and masses are those of the whole block; divided by `width` they are per
metre of road."""

STOP = np.dtype(
    [
        ("release", "i8"),
        ("event", "i4"),
        ("block", "i4"),
        ("state", "i4"),
        ("x", "f8"),
        ("mass", "f8"),
    ]
)
"""Fields of a stop: where a block is at the end of a release.

state: index in `STATES`. x: chainage of the centroid, at most that of the end of the ground [m].
Other fields are as in `PASSAGE`."""

STATES = ("at rest", "moving", "left the profile")
"""States of a block at the end: at rest; still moving when `motion.duration` was over, so that it
would stop further downhill; beyond the end of the ground, so that nobody knows where it stops."""

AT_END, IN_MOTION, HAS_LEFT = range(3)

MEMORY = 64e6
"""Size of the frames of a part of a run [bytes]."""

Release = tuple[int, str | None]
"""A seed and the name of an event, or None for an event drawn by the seed."""


@dataclass(frozen=True, slots=True, eq=False)
class Passages:
    """Passages and stops in R releases of a site.

    Parameters
    ----------
    stations : (K,) array
        Chainages at which passages were recorded, ascending [m].
    seed : tuple of R int
        Seed of each release.
    event : (R,) array of int
        Index of the event of each release in `Site.event_names`.
    table : (P,) array of PASSAGE
        The passages, by release.
    stops : (N,) array of STOP
        Where each block is at the end, by release.
    """

    stations: NDArray[np.float64]
    seed: tuple[int, ...]
    event: NDArray[np.int64]
    table: NDArray[np.void]
    stops: NDArray[np.void]

    def at(self, station: int) -> NDArray[np.void]:
        """Return the passages of the station with this index."""
        return self.table[self.table["station"] == station]

    @classmethod
    def join(cls, parts: Sequence[Passages]) -> Passages:
        """Return several sets of releases with the same stations as one; there is at least one."""
        first = np.cumsum([0, *(len(part.seed) for part in parts[:-1])]).tolist()

        def rows(name: str) -> NDArray[np.void]:
            joined = np.concatenate([getattr(part, name) for part in parts])
            counts = [len(getattr(part, name)) for part in parts]
            joined["release"] += np.repeat(first, counts)
            return joined

        return cls(
            parts[0].stations,
            tuple(seed for part in parts for seed in part.seed),
            np.concatenate([part.event for part in parts]),
            rows("table"),
            rows("stops"),
        )

    def reordered(self, places: Sequence[int]) -> Passages:
        """Return the same R releases in another order, release i at position places[i], (R,)."""
        place = np.array(places, dtype=np.int64)
        order = np.argsort(place)

        def rows(table: NDArray[np.void]) -> NDArray[np.void]:
            release = place[table["release"]]
            first = np.argsort(release, kind="stable")
            table = table[first]
            table["release"] = release[first]
            return table

        seeds = tuple(self.seed[i] for i in order)
        return Passages(self.stations, seeds, self.event[order], rows(self.table), rows(self.stops))


def check_stations(site: Site, stations: Sequence[float]) -> NDArray[np.float64]:
    """Return stations in ascending order, each once (K,) [m].

    Raises
    ------
    BadInput
        If one is not a number between the ends of the profile.
    """
    low, high = ends(site)
    found = set()
    for x in check.sequence("stations", stations, (int, float), "a chainage"):
        if not low < x < high:
            hint = (
                f"give a chainage within the profile, between {chainage(low)} and "
                f"{chainage(high)} m"
            )
            raise BadInput("station", x, hint)
        found.add(float(x))
    return np.array(sorted(found), dtype=np.float64)


def ends(site: Site) -> tuple[float, float]:
    """Return the chainages between which the ground of a site lies [m]."""
    return site.slope.points[0][0], site.slope.points[-1][0]


def passages(
    site: Site,
    layout: Sequence[Barrier],
    releases: Sequence[Release],
    stations: Sequence[float],
    threads: int | None = None,
) -> Passages:
    """Simulate releases and return the passages at stations and where blocks stop.

    A release continues beyond the road: until every block is at rest or has left the ground at the
    end of the profile, or `motion.duration` is over.

    Parameters
    ----------
    site : Site
        The site.
    layout : sequence of Barrier
        The barriers.
    releases : sequence of (int, str or None)
        Seed and event of each release, see `rigdda.release`.
    stations : sequence of float
        Chainages of the stations [m].
    threads : int, optional
        Number of threads; by default one per core, or the executor in use.

    Raises
    ------
    BadInput
        If a station is not within the profile, or as `rigdda.release` does.
    Diverged
        If a simulation diverges.
    """
    site, built = as_site(site), as_layout(layout)
    lines = check_stations(site, stations)
    if threads is None and distribution.current() is not None:
        parts = divided([(site, built, *release) for release in releases], SENT)
        sent = [(site, built, lines, [releases[place] for place in part]) for part in parts]
        found = Passages.join([_none(lines), *distribution.mapped(_sent, sent)])
        return found.reordered([place for part in parts for place in part])
    usual = distribution.threads()
    count = usual if threads is None else check.integer("threads", threads, 1)
    return _in_threads(site, built, lines, releases, count)


def _in_threads(
    site: Site,
    built: Layout,
    lines: NDArray[np.float64],
    releases: Sequence[Release],
    threads: int,
) -> Passages:
    """Return the passages of releases, computed in threads of this process."""
    most = max(1, min(MOST_PER_THREAD, len(releases) // (4 * threads)))
    queue = iter(divided([(site, built, *release) for release in releases], most))

    def work(_: int) -> list[tuple[list[int], Passages]]:
        watch = _Watch(site, built, lines)
        return [(part, watch.passages([releases[place] for place in part])) for part in queue]

    with ThreadPoolExecutor(threads) as pool:
        done = [pair for found in pool.map(work, range(threads)) for pair in found]
    joined = Passages.join([_none(lines), *(found for _, found in done)])
    return joined.reordered([place for part, _ in done for place in part])


def _sent(sent: tuple[Site, Layout, NDArray[np.float64], Sequence[Release]]) -> Passages:
    """Return the passages of releases that were sent to this worker."""
    return _in_threads(*sent, distribution.threads())


def _none(lines: NDArray[np.float64]) -> Passages:
    """Return the passages in no release."""
    none = np.zeros(0, dtype=np.int64)
    return Passages(lines, (), none, np.zeros(0, dtype=PASSAGE), np.zeros(0, dtype=STOP))


class _Watch:
    """Releases of a site with a layout, watched one after another at the same stations."""

    def __init__(self, site: Site, layout: Sequence[Barrier], lines: NDArray[np.float64]):
        self._site, self._lines = site, lines
        self._batch = Batch(site, layout, tuple(lines.tolist()), ends(site)[1])
        self._number = {name: i for i, name in enumerate(site.event_names)}

    def passages(self, releases: Sequence[Release]) -> Passages:
        """Return the passages and stops in some releases."""
        return Passages.join([_none(self._lines), *(self._one(*release) for release in releases)])

    def _one(self, seed: int, event: str | None) -> Passages:
        """Return the passages and stops in one release."""
        drawn = self._site.draw(seed, event)
        simulation = self._batch.simulation(self._batch.scene(drawn))
        crossed, velocity, speed, x = _followed(simulation, self._site.motion.duration)
        traits = np.array([_traits(block.vertices) for block in drawn.blocks])
        width, radius = traits.T
        mass = np.array([block.density for block in drawn.blocks]) * width**3
        number = self._number[drawn.event]
        table = self._table(simulation, crossed, velocity, mass, width, radius)
        stops = np.zeros(len(drawn.blocks), dtype=STOP)
        stops["block"] = np.arange(len(stops))
        end = ends(self._site)[1]
        stops["mass"], stops["x"] = mass, np.minimum(x, end)
        stops["state"] = np.where(x >= end, HAS_LEFT, np.where(speed < AT_REST, AT_END, IN_MOTION))
        table["event"] = stops["event"] = number
        return Passages(self._lines, (seed,), np.array([number]), table, stops)

    def _table(
        self,
        simulation: Simulation,
        crossed: NDArray[np.void],
        velocity: NDArray[np.float64],
        mass: NDArray[np.float64],
        width: NDArray[np.float64],
        radius: NDArray[np.float64],
    ) -> NDArray[np.void]:
        """Return the passages of crossing events with their velocities, without their event."""
        lines = np.array(self._batch.lines(simulation.scene))
        asked = np.isin(lines[crossed["target"]], self._lines)
        crossed, velocity = crossed[asked], velocity[asked]
        out, block = np.zeros(len(crossed), dtype=PASSAGE), crossed["block"]
        out["block"] = block
        out["station"] = np.searchsorted(self._lines, lines[crossed["target"]])
        out["time"], out["height"] = crossed["time"], crossed["height"]
        out["vx"], out["vy"], out["omega"] = velocity.T
        out["mass"], out["width"], out["radius"] = mass[block], width[block], radius[block]
        ground = simulation.scene.smooth_ground
        assert ground is not None  # a site has one
        slope = ground.inclination(self._lines[out["station"]], out["width"])
        out["normal"] = out["height"] * np.cos(slope)
        out["translation"] = 0.5 * out["mass"] * crossed["speed"] ** 2
        whole = crossed["energy"] * out["width"]
        out["rotation"] = np.maximum(whole - out["translation"], 0.0)
        return out


def _traits(vertices: NDArray[np.float64]) -> tuple[float, float]:
    """Return the root of the area of a block and its circumscribed radius [m]."""
    area, centre, _ = polygon_properties(vertices)
    return float(np.sqrt(area)), float(np.hypot(*(vertices - centre).T).max())


def _followed(
    simulation: Simulation, duration: float
) -> tuple[NDArray[np.void], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Run a simulation and return its crossings with the velocities of the blocks then.

    Frames of every step are kept for a part of the run at a time.

    Returns
    -------
    crossed : (C,) array of EVENT
        The crossings.
    velocity : (C, 3) array
        vx, vy, omega of the block at each [m/s, m/s, rad/s].
    speed, x : (N,) array
        Speed of each centroid at the end [m/s] and its chainage [m].
    """
    dt, blocks = simulation.settings.dt, len(simulation.scene.blocks)
    left = max(1, round(duration / dt))
    most = max(1, int(MEMORY / (48 * blocks)))
    velocities: list[NDArray[np.float64]] = []
    seen = 0
    while True:
        steps = min(left, most)
        run = simulation.run(steps * dt, dt)
        crossed = run.events[run.events["kind"] == CROSSING]
        new = crossed[seen:]
        frame = np.searchsorted(run.times, new["time"] - 0.5 * dt)
        velocities.append(run.velocities[frame, new["block"]])
        seen, left = len(crossed), left - steps
        if left == 0 or len(run.times) <= steps:
            speed = np.hypot(*run.velocities[-1, :, :2].T)
            return crossed, np.concatenate(velocities), speed, run.poses[-1, :, 0]
