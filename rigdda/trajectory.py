"""Trajectories of the blocks of many releases, with few points each, for drawing and for scripts.

`trajectories` gives the outcomes of `rigdda.release_many` and, in addition, the paths of all blocks
in flat arrays. A path keeps only the points that a drawing needs: straight lines between them are
within a tolerance of the states after every step. The motion is that of `rigdda.releases.Batch`;
`rigdda.releases` describes the ways in which releases are computed.
"""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from itertools import islice
from queue import Empty, SimpleQueue
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import check, distribution
from rigdda.barriers import Barrier, Layout, as_layout
from rigdda.dynamics import thinning
from rigdda.dynamics.records import LEDGER
from rigdda.dynamics.step_record import StepRecord
from rigdda.errors import BadInput
from rigdda.geometry import polygon_properties
from rigdda.ground.terrain import Terrain
from rigdda.measurement import Ending, holding, judge
from rigdda.model.outcome import Outcome
from rigdda.model.settings import EARTH
from rigdda.model.site import Site
from rigdda.model.site_tables import Drawn
from rigdda.releases import MOST_PER_THREAD, Batch, as_site, by_size, check_duration

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class PointKind(enum.IntEnum):
    """Kind of a point of a path."""

    START = thinning.START
    """The first point."""
    FLIGHT = thinning.FLIGHT
    """The block flew freely from the previous point to this one."""
    CONTACT = thinning.CONTACT
    """The block rolled, slid or rested, or left the ground at this point."""
    IMPACT = thinning.IMPACT
    """The first step with contact after a flight of at least 0.1 s."""
    END = thinning.END
    """The last point."""


class Place(enum.IntEnum):
    """Where a block is at the end of its release."""

    NEVER_LEFT = 0
    """Within the diameter of its circumscribed circle of where it started."""
    SLOPE = 1
    """Uphill of the road, and held by no barrier."""
    HELD = 2
    """Uphill of the road, behind a barrier or in a ditch, see `rigdda.Outcome`."""
    ROAD = 3
    """On the road."""
    BEYOND = 4
    """Downhill of the road."""


class Crossings(NamedTuple):
    """First passages of P paths at K stations, (K, P) arrays; NaN where a path does not pass."""

    time: Floats
    """Time since the release [s]."""
    vx: Floats
    """Velocity of the centroid downhill [m/s]."""
    vy: Floats
    """Velocity of the centroid upwards [m/s]."""
    omega: Floats
    """Angular velocity [rad/s]."""
    energy: Floats
    """Kinetic energy of the whole block, translational and rotational [J]."""
    height: Floats
    """Height of the centroid above the ground, vertically [m]."""
    normal: Floats
    """The same normal to the slope, see `rigdda.passages.PASSAGE` [m]."""

    @property
    def speed(self) -> Floats:
        """Speed of the centroid [m/s]."""
        return np.hypot(self.vx, self.vy)


class BarrierLoads(NamedTuple):
    """What a barrier received in each of R releases, (R,) arrays, see `rigdda.BarrierOutcome`."""

    hits: Ints
    """Number of hits."""
    max_energy: Floats
    """Largest energy of a hit, 0 without one [J per metre of width]."""
    total_energy: Floats
    """Total energy of the hits [J per metre of width]."""
    max_height: Floats
    """Greatest height of a hit above the ground, NaN without one [m]."""
    overtopped: Ints
    """Number of blocks that passed it."""
    failed: NDArray[np.bool_]
    """Whether it is no longer in its original state."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectories:
    """Paths of P blocks in R releases of a site, and the outcomes of the releases.

    The points of path p are `start[p]:start[p + 1]` in the (Q,) arrays. A release of a single block
    has one path. Energies and masses are those of whole blocks, which are as long along the road as
    the square root of their cross-section, `width`.

    Parameters
    ----------
    seed : tuple of R int
        Seed of each release.
    event : (R,) array of int
        Index of the event of each release in `Site.event_names`.
    outcomes : tuple of R Outcome
        Outcome of each release, the same as that of `rigdda.release_outcome`.
    release : (P,) array of int
        Index of the release of each path; ascending.
    vertices : tuple of P (n, 2) array
        Corners of each block at the start [m].
    mass, inertia, width, radius : (P,) array
        Mass [kg], moment of inertia [kg m2], length along the road [m] and radius of the
        circumscribed circle about the centroid [m] of each block.
    reached : (P,) array of bool
        Whether the centroid of each block ever passed the uphill edge of the road.
    place : (P,) array of int
        Where each block is at the end, a `Place`.
    start : (P + 1,) array of int
        Index of the first point of each path, and Q.
    time : (Q,) array
        Time since the release [s].
    x, y, theta : (Q,) array
        Centroid [m] and rotation since the start [rad].
    vx, vy, omega : (Q,) array
        Velocity of the centroid [m/s] and angular velocity [rad/s].
    energy : (Q,) array
        Kinetic energy, translational and rotational [J].
    kind : (Q,) array of int8
        Kind of each point, a `PointKind`.
    ground : Terrain
        The ground with its earthworks, without pits.
    tolerance : float
        Greatest deviation of the lines between points from the computed states [m].
    """

    seed: tuple[int, ...]
    event: Ints
    outcomes: tuple[Outcome, ...]
    release: Ints
    vertices: tuple[Floats, ...]
    mass: Floats
    inertia: Floats
    width: Floats
    radius: Floats
    reached: NDArray[np.bool_]
    place: Ints
    start: Ints
    time: Floats
    x: Floats
    y: Floats
    theta: Floats
    vx: Floats
    vy: Floats
    omega: Floats
    energy: Floats
    kind: NDArray[np.int8]
    ground: Terrain
    tolerance: float

    def __len__(self) -> int:
        """Return the number of paths."""
        return len(self.release)

    @property
    def speed(self) -> Floats:
        """Speed of the centroid at each point, (Q,) [m/s]."""
        return np.hypot(self.vx, self.vy)

    @property
    def path(self) -> Ints:
        """Index of the path of each point, (Q,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.start))

    @property
    def end_x(self) -> Floats:
        """Chainage of each block at the end of its release, (P,) [m]."""
        return self.x[self.start[1:] - 1]

    def points(self, path: int) -> slice:
        """Return the indices of the points of a path."""
        return slice(int(self.start[path]), int(self.start[path + 1]))

    def barrier(self, index: int) -> BarrierLoads:
        """Return what a barrier of the layout received in each release."""
        own = [outcome.barriers[index] for outcome in self.outcomes]
        return BarrierLoads(
            np.array([b.hits for b in own], dtype=np.int64),
            np.array([b.max_energy for b in own], dtype=np.float64),
            np.array([b.total_energy for b in own], dtype=np.float64),
            np.array([max(b.impact_heights, default=math.nan) for b in own], dtype=np.float64),
            np.array([b.overtopped for b in own], dtype=np.int64),
            np.array([b.failed for b in own], dtype=np.bool_),
        )

    def states(self, path: int, times: ArrayLike) -> Floats:
        """Return the states of a block at any times.

        Flights are parabolas through the points; between other points the states are linear in
        time. Before the start and after the end, a block is where it started and ended.

        Parameters
        ----------
        path : int
            Index of the path.
        times : (T,) array_like
            Times since the release [s].

        Returns
        -------
        (T, 6) array
            x, y, theta, vx, vy, omega [m, m, rad, m/s, m/s, rad/s].
        """
        own = self.points(path)
        at = np.clip(np.asarray(times, dtype=np.float64), self.time[own][0], self.time[own][-1])
        after = own.start + np.searchsorted(self.time[own], at)
        after = np.clip(after, min(own.start + 1, own.stop - 1), own.stop - 1)
        before = np.maximum(after - 1, own.start)
        span = self.time[after] - self.time[before]
        share = np.divide(at - self.time[before], span, out=np.zeros_like(at), where=span > 0.0)
        return self._between(before, after, share)

    def _between(self, before: Ints, after: Ints, share: Floats) -> Floats:
        """Return states at a share of the time between successive points, (n, 6)."""
        columns = (self.x, self.y, self.theta, self.vx, self.vy, self.omega)
        out = np.stack([c[before] + share * (c[after] - c[before]) for c in columns], axis=1)
        flies = self.kind[after] == PointKind.FLIGHT
        s, span = share[flies], (self.time[after] - self.time[before])[flies]
        for column, rate in ((0, self.vx), (1, self.vy)):
            bend = (rate[after] - rate[before])[flies] * span
            out[flies, column] -= 0.5 * s * (1.0 - s) * bend
        return out

    def crossings(self, stations: ArrayLike) -> Crossings:
        """Return the first passages of the paths at stations.

        A block passes a station when its centroid reaches it for the first time; blocks that start
        further downhill do not pass. States between two points follow as in `states`. Those of
        `rigdda.passages` belong to the first step at or beyond the station.

        Parameters
        ----------
        stations : (K,) array_like
            Chainages on the ground [m].

        Raises
        ------
        BadInput
            If a chainage is not a number or not on the ground.
        """
        asked = np.ravel(np.asarray(stations, dtype=object)).tolist()
        lines = np.array([check.number("stations", x) for x in asked], dtype=np.float64)
        level = np.array([self.ground.height(x) for x in lines.tolist()])
        after = np.full((len(lines), len(self)), -1)
        for p in range(len(self)):
            own = self.points(p)
            first = np.searchsorted(np.maximum.accumulate(self.x[own]), lines)
            passes = (first > 0) & (first < own.stop - own.start)
            after[passes, p] = own.start + first[passes]
        k, path = np.nonzero(after >= 0)
        then = after[k, path]
        share = (lines[k] - self.x[then - 1]) / (self.x[then] - self.x[then - 1])
        state = self._between(then - 1, then, share)
        out = np.full((7, len(lines), len(self)), math.nan)
        out[0, k, path] = self.time[then - 1] + share * (self.time[then] - self.time[then - 1])
        out[1, k, path], out[2, k, path], out[3, k, path] = state[:, 3], state[:, 4], state[:, 5]
        out[4, k, path] = self._energy_between(then - 1, then, share, path, state)
        out[5, k, path] = state[:, 1] - level[k]
        slope = self.ground.inclination(lines[k], self.width[path])
        out[6, k, path] = out[5, k, path] * np.cos(slope)
        return Crossings(*out)

    def _energy_between(
        self, before: Ints, after: Ints, share: Floats, path: Ints, state: Floats
    ) -> Floats:
        """Return the energies of such states [J]."""
        linear = self.energy[before] + share * (self.energy[after] - self.energy[before])
        square = state[:, 3] ** 2 + state[:, 4] ** 2
        own = 0.5 * self.mass[path] * square + 0.5 * self.inertia[path] * state[:, 5] ** 2
        return np.where(self.kind[after] == PointKind.FLIGHT, own, linear)

    def thinned(self, tolerance: float) -> Trajectories:
        """Return the same trajectories with fewer points.

        Parameters
        ----------
        tolerance : float
            Greatest deviation from these points, see `trajectories` [m].

        Raises
        ------
        BadInput
            If it is not a number of at least 0.
        """
        wide = check.number("tolerance", tolerance, 0.0, unit="m")
        if wide == 0.0:
            return self
        motion = np.stack([getattr(self, name) for name in MOTION], axis=1)
        kept, start = [], [0]
        for p in range(len(self)):
            own = self.points(p)
            heads = self.energy[own] / (self.mass[p] * EARTH)
            found = _kept(self.time[own], motion[own], heads, self.kind[own], self.radius[p], wide)
            kept.append(found + own.start)
            start.append(start[-1] + len(found))
        chosen = np.concatenate([np.zeros(0, dtype=np.int64), *kept])
        few = {name: getattr(self, name)[chosen] for name in POINTS}
        return replace(self, start=np.array(start), tolerance=self.tolerance + wide, **few)

    @classmethod
    def join(cls, parts: Sequence[Trajectories]) -> Trajectories:
        """Return the trajectories of several sets of releases as one.

        Parameters
        ----------
        parts : sequence of Trajectories
            At least one; all of the same site and layout.
        """
        if len(parts) == 1:
            return parts[0]
        joined = {
            field.name: np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(cls)
            if field.name not in ("seed", "outcomes", "vertices", "ground", "tolerance")
        }
        counts = np.cumsum([0, *(len(part.seed) for part in parts)])
        rows = np.cumsum([0, *(len(part.time) for part in parts)])
        joined["release"] += np.repeat(counts[:-1], [len(part) for part in parts])
        starts = [part.start[:-1] + row for part, row in zip(parts, rows, strict=False)]
        joined["start"] = np.concatenate([*starts, rows[-1:]])
        return cls(
            seed=tuple(seed for part in parts for seed in part.seed),
            outcomes=tuple(outcome for part in parts for outcome in part.outcomes),
            vertices=tuple(corners for part in parts for corners in part.vertices),
            ground=parts[0].ground,
            tolerance=max(part.tolerance for part in parts),
            **joined,
        )


MOTION = ("x", "y", "theta", "vx", "vy", "omega")
"""Fields of the state of a block, in the order of `thinning.X` and the like."""

POINTS = ("time", *MOTION, "energy", "kind")
"""Fields with one entry for each point."""


def _kept(
    times: Floats,
    motion: Floats,
    heads: Floats,
    kinds: NDArray[np.int8],
    radius: float,
    tolerance: float,
) -> Ints:
    """Return the indices of the states that are kept, see `thinning.keep`."""
    kept, door = np.empty(len(times), dtype=np.int64), np.empty((4, thinning.NUMBER))
    count = thinning.keep(times, motion, heads, kinds, radius, tolerance, kept, door)
    return kept[:count]


class RecordedReleases:
    """Records releases of a site with a layout, one after another.

    Parameters
    ----------
    site : Site
        The site.
    layout : sequence of Barrier
        The barriers.
    tolerance : float
        See `trajectories` [m].
    """

    def __init__(self, site: Site, layout: Sequence[Barrier], tolerance: float):
        self._site, self._tolerance = site, tolerance
        self._batch, self._record = Batch(site, layout), StepRecord()
        self._ledger = np.zeros(len(LEDGER))
        self._number = {name: i for i, name in enumerate(site.event_names)}

    def releases(self, event: str | None, seeds: Sequence[int]) -> Trajectories:
        """Return the trajectories of some releases. Raises the errors of `rigdda.release`."""
        return Trajectories.join([self._one(seed, event) for seed in seeds])

    def _one(self, seed: int, event: str | None) -> Trajectories:
        """Return the trajectories of one release."""
        drawn = self._site.draw(seed, event)
        ended = self._batch.ending(drawn, self._record)
        outcome = judge(self._site, ended, drawn.event, drawn.width)
        paths = [self._path(i, width) for i, width in enumerate(np.sqrt(ended.areas).tolist())]
        width = np.sqrt(ended.areas)
        bodies = self._record.loop.arrays.bodies.view(np.ndarray)[: len(paths)]
        road = ended.log.passed[self._site.road.start]
        return Trajectories(
            seed=(seed,),
            event=np.array([self._number[drawn.event]]),
            outcomes=(outcome,),
            release=np.zeros(len(paths), dtype=np.int64),
            vertices=tuple(block.vertices for block in drawn.blocks),
            mass=bodies["mass"] * width,
            inertia=bodies["inertia"] * width,
            width=width,
            radius=bodies["radius"].copy(),
            reached=np.array([time < math.inf for time in road]),
            place=self._places(drawn, ended, bodies["radius"]),
            start=np.cumsum([0, *(len(path[0]) for path in paths)]),
            **{name: np.concatenate([path[k] for path in paths]) for k, name in enumerate(POINTS)},
            ground=self._batch.ground,
            tolerance=self._tolerance,
        )

    def _path(self, i: int, width: float) -> list[NDArray]:
        """Return the points of block i of the last release, in the order of `POINTS`."""
        record = self._record
        arrays, times = record.loop.arrays, record.times
        motion = np.ascontiguousarray(record.frames[:, i])
        body, energies = arrays.bodies[i : i + 1].copy(), np.empty(len(times))
        kinds = np.empty(len(times), dtype=np.int8)
        weight, radius = body["mass"][0] * EARTH, body["radius"][0]
        thinning.classify(
            motion, body, arrays.parameters, record.stride, kinds, energies, self._ledger
        )
        if self._tolerance > 0.0:
            heads = energies / weight
            kept = _kept(times, motion, heads, kinds, radius, self._tolerance)
            times, motion, energies, kinds = times[kept], motion[kept], energies[kept], kinds[kept]
        return [times, *motion.T, energies * width, kinds]

    def _places(self, drawn: Drawn, ended: Ending, radius: Floats) -> Ints:
        """Return where each block is at the end, a `Place`, (N,)."""
        road, found = self._site.road, []
        held = [holding(barrier, ended.places) for barrier in ended.barriers]
        for k, (x, y) in enumerate(ended.places):
            start = polygon_properties(drawn.blocks[k].vertices)[1]
            if x >= road.start:
                place = Place.BEYOND if x > road.end else Place.ROAD
            elif any(own[k] for own in held):
                place = Place.HELD
            elif math.dist((x, y), start) < 2.0 * radius[k]:
                place = Place.NEVER_LEFT
            else:
                place = Place.SLOPE
            found.append(place)
        return np.array(found, dtype=np.int64)


def trajectories(
    site: Site,
    layout: Sequence[Barrier] = (),
    event: str | None = None,
    seeds: Sequence[int] = range(200),
    tolerance: float = 0.1,
    threads: int | None = None,
) -> Trajectories:
    """Return the trajectories and the outcomes of many releases.

    They are computed in threads of this process.

    Parameters
    ----------
    site : Site
        The site.
    layout : sequence of Barrier
        The barriers.
    event : str, optional
        Name of the event; by default each seed draws one by rate.
    seeds : sequence of int
        Seeds of the releases.
    tolerance : float
        How far the lines between the points of a path may be from the computed states [m]: in x,
        in y, in the path of a point on the circumscribed circle about the centroid, and in the
        kinetic energy over the weight. With 0 the state after every step is kept.
    threads : int, optional
        Number of threads; by default one per core.

    Returns
    -------
    Trajectories
        In the order of the seeds. The outcomes are those of `rigdda.release_outcome`.

    Raises
    ------
    BadInput
        If the tolerance or a seed is not valid, there are no seeds, or as `rigdda.release` does.
    Diverged
        If a simulation diverges.

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts off more than one release in twenty, see `Outcome.cut_off`.

    Examples
    --------
    >>> import rigdda
    >>> site = rigdda.Site.load("verge")
    >>> found = rigdda.trajectories(site, event="block", seeds=range(20))
    >>> found.x[found.points(0)].round(1)[:3]  # the first points of the first block
    >>> found.reached.mean()  # share of the blocks that come to the road
    >>> found.crossings([6.0]).energy  # of each block that passes 6 m, NaN for the others [J]
    """
    asked = _asked(site, layout, event, seeds, tolerance, threads)
    count = len(asked.seeds)
    size = max(1, min(MOST_PER_THREAD, count // (4 * asked.threads)))
    parts = [asked.seeds[i : i + size] for i in range(0, count, size)]
    found = Trajectories.join(list(_computed(asked, parts)))
    check_duration([asked.site] * count, found.outcomes)
    return found


def _checked_seeds(seeds: Sequence[int]) -> tuple[int, ...]:
    """Return the seeds of releases.

    Raises
    ------
    BadInput
        If there are none, or one is not a whole number of at least 0.
    """
    numbers = check.sequence("seeds", seeds, object, "whole numbers")
    if not numbers:
        raise BadInput("seeds", seeds, "give at least one seed")
    return tuple(check.integer(f"seeds[{i}]", seed, 0) for i, seed in enumerate(numbers))


def trajectory_parts(
    site: Site,
    layout: Sequence[Barrier] = (),
    event: str | None = None,
    seeds: Sequence[int] = range(200),
    tolerance: float = 0.1,
    threads: int | None = None,
    size: int = 25,
) -> Generator[Trajectories, None, None]:
    """Yield the trajectories of `trajectories` in parts, as soon as each is computed.

    The parts are in the order of the seeds, but each release of an event with many blocks is a part
    of its own and follows after all others. Closing the iterator ends the computation after the
    parts that are being computed.

    Parameters
    ----------
    site, layout, event, seeds, tolerance, threads
        As for `trajectories`.
    size : int
        Greatest number of releases of a part.

    Raises
    ------
    BadInput, Diverged
        As `trajectories` does; for invalid arguments before the first part is computed.
    """
    asked = _asked(site, layout, event, seeds, tolerance, threads)
    most = check.integer("size", size, 1)
    jobs = [(asked.site, asked.layout, seed, event) for seed in asked.seeds]
    large, small = by_size(jobs)
    parts = [small[i : i + most] for i in range(0, len(small), most)] + [[i] for i in large]
    return _computed(asked, [[asked.seeds[i] for i in part] for part in parts])


class _Asked(NamedTuple):
    """Checked arguments of `trajectories`."""

    site: Site
    layout: Layout
    event: str | None
    seeds: tuple[int, ...]
    tolerance: float
    threads: int


def _asked(
    site: Site,
    layout: Sequence[Barrier],
    event: str | None,
    seeds: Sequence[int],
    tolerance: float,
    threads: int | None,
) -> _Asked:
    """Check the arguments of `trajectories`. Raises BadInput."""
    where, built, numbers = as_site(site), as_layout(layout), _checked_seeds(seeds)
    if event is not None:
        where.index(event)
    wide = check.number("tolerance", tolerance, 0.0, unit="m")
    count = distribution.threads() if threads is None else check.integer("threads", threads, 1)
    return _Asked(where, built, event, numbers, wide, count)


AHEAD = 4
"""Number of parts for each thread that are computed before the first of them is taken."""


def _computed(asked: _Asked, parts: Sequence[Sequence[int]]) -> Generator[Trajectories, None, None]:
    """Yield the trajectories of parts of the seeds, computed in threads."""
    free: SimpleQueue[RecordedReleases] = SimpleQueue()

    def work(seeds: Sequence[int]) -> Trajectories:
        try:
            recorder = free.get_nowait()
        except Empty:
            recorder = RecordedReleases(asked.site, asked.layout, asked.tolerance)
        found = recorder.releases(asked.event, seeds)
        free.put(recorder)
        return found

    todo, ahead = iter(parts), deque[Future[Trajectories]]()
    with ThreadPoolExecutor(asked.threads) as pool:
        ahead.extend(pool.submit(work, part) for part in islice(todo, AHEAD * asked.threads))
        try:
            while ahead:
                found = ahead.popleft().result()
                ahead.extend(pool.submit(work, part) for part in islice(todo, 1))
                yield found
        finally:
            for future in ahead:
                future.cancel()
