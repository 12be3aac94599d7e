"""Cached outcomes of releases; simulates many releases at once and skips those already known.

If no block of a release without barriers comes near a layout, the outcome with the layout follows
from the outcome without barriers. A block that came to rest uphill of a barrier counts as held by
it if it lies below a line that rises from the top of the barrier, see `rigdda.Outcome`. Its
position is known exactly only for a single block.
"""

from __future__ import annotations

import hashlib
import math
import time
import zlib
from collections import OrderedDict
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from threading import Lock
from typing import Generic, NamedTuple, TypeVar

import msgspec
import numpy as np

import rigdda
from rigdda import (
    BarrierOutcome,
    Layout,
    Outcome,
    Site,
    distribution,
)
from rigdda.barriers import Built, Standing, earthworks
from rigdda.ground.terrain import REACH
from rigdda.model.settings import EARTH
from rigdda.releases import check_duration

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


DESCRIPTIVE_FIELDS = ("name", "description", "family")
"""Fields of a site that only describe it."""


def fingerprint(site: Site) -> bytes:
    """Return a key of a site: the hash of all but its `DESCRIPTIVE_FIELDS`; numbers are exact."""
    return _hashed(site, DESCRIPTIVE_FIELDS, ())


NO_MOTION = (
    *DESCRIPTIVE_FIELDS,
    "origin",
    "prices",
    "consequences",
    "existing",
    "traffic",
    "meshes",
    "rule",
    "lumped",
)
"""Tables of a site that do not affect the outcome of a release with given barriers. Existing
barriers are among the given ones, see `Key`."""

NO_EVENT_MOTION = ("rate", "rate_of", "design")
"""Fields of an event that do not affect the outcome of its releases."""


def release_key(site: Site) -> bytes:
    """Return a key of everything that affects the outcomes of the releases of a site.

    Sites that differ only in prices, rates, traffic or existing barriers have the same key.
    """
    return _hashed(site, NO_MOTION, NO_EVENT_MOTION)


def _hashed(site: Site, tables: Sequence[str], event_fields: Sequence[str]) -> bytes:
    """Return a hash of a site without some tables and without some fields of its events."""
    kept = {name: getattr(site, name) for name in site.__struct_fields__ if name not in tables}
    events = [msgspec.structs.asdict(event) for event in site.events]
    kept["events"] = [{k: v for k, v in e.items() if k not in event_fields} for e in events]
    return hashlib.sha256(msgspec.json.encode(kept)).digest()[:16]


class Memory(Generic[K, V]):
    """Thread-safe cache that keeps the `room` most recently used values.

    Parameters
    ----------
    room : int
        Maximum number of values.
    """

    def __init__(self, room: int):
        self.room = room
        self._kept: OrderedDict[K, V] = OrderedDict()
        self._lock = Lock()

    def recall(self, keys: Iterable[K]) -> dict[K, V]:
        """Return the values of those keys that are known."""
        known = {}
        with self._lock:
            for key in keys:
                if key in self._kept:
                    self._kept.move_to_end(key)
                    known[key] = self._kept[key]
        return known

    def remember(self, values: Mapping[K, V]) -> None:
        """Store values by key and discard the oldest if there are more than `room`."""
        with self._lock:
            self._kept.update(values)
            while len(self._kept) > self.room:
                self._kept.popitem(last=False)


class Sample(tuple[Outcome, ...]):
    """Outcomes of releases, and the time of their simulation.

    Attributes
    ----------
    ran : tuple of bool
        Whether each was simulated; of identical releases only one is.
    seconds : float
        Processor time of the simulations [s].
    """

    ran: tuple[bool, ...]
    seconds: float

    def __new__(
        cls, outcomes: Iterable[Outcome] = (), ran: Sequence[bool] = (), seconds: float = 0.0
    ) -> Sample:
        """Create a sample. By default, no outcome counts as newly simulated."""
        made = super().__new__(cls, outcomes)
        made.ran = tuple(ran) if ran else (False,) * len(made)
        made.seconds = seconds
        return made

    def __getnewargs__(self) -> tuple[tuple[Outcome, ...], tuple[bool, ...], float]:
        """Return the arguments that recreate the sample when it is unpickled."""
        return tuple(self), self.ran, self.seconds

    def __add__(self, other: object) -> Sample:
        """Return the concatenation of both samples."""
        if not isinstance(other, Sample):
            return NotImplemented
        both = (*self, *other), (*self.ran, *other.ran)
        return Sample(*both, self.seconds + other.seconds)

    @property
    def simulated(self) -> int:
        """Number of simulated releases."""
        return sum(self.ran)

    def split(self, ends: Sequence[int]) -> list[Sample]:
        """Return the parts between `ends`; time is divided in proportion to simulated releases."""
        each = self.seconds / max(self.simulated, 1)
        parts = [(self[a:b], self.ran[a:b]) for a, b in pairwise(ends)]
        return [Sample(outcomes, ran, each * sum(ran)) for outcomes, ran in parts]


CONTACT_MARGIN = 0.1
"""Distance from a barrier beyond which a block at the end of a step cannot touch it [m]."""

LARGEST_RADIUS = 1.5
"""Upper bound of the radius of a block divided by the square root of its area [-]."""

UNIT = 1.0
"""Width of an event for which cached resistances are stored [m]."""


@dataclass(frozen=True, slots=True)
class BarrierReach:
    """Region in which a barrier of a layout can be touched or can hold blocks.

    Parameters
    ----------
    start, end : float
        Chainages between which a block may touch the barrier [m]. They include a margin for blocks
        that touch it and rebound within a step, because the reach of a release is recorded at the
        ends of steps.
    face, top : float
        Start of the line below which the barrier holds rock that lies uphill [m]; `face` is -inf if
        it cannot hold any.
    bears : float
        Thrust that the barrier resists in an event of `UNIT` width, without scatter of friction
        [N/m].
    """

    start: float
    end: float
    face: float
    top: float
    bears: float


standing_layouts: Memory[tuple[bytes, tuple[Built, ...]], tuple[BarrierReach, ...]] = Memory(
    1 << 12
)
"""Barrier regions by site and layout."""


def misses(site: Site, key: bytes, layout: tuple[Built, ...], outcome: Outcome) -> bool:
    """Return whether the blocks of a release stay clear of a layout.

    Parameters
    ----------
    site, key : Site, bytes
        The site and its `release_key`.
    layout : tuple of Built
        The barriers.
    outcome : Outcome
        Outcome of the release, with or without the layout.
    """
    low, high = outcome.reach
    stands = _standing(site, key, layout) if layout else ()
    return all(high < b.start or low > b.end for b in stands)


def inferred_outcome(
    site: Site, key: bytes, layout: tuple[Built, ...], without: Outcome
) -> Outcome | None:
    """Return the outcome with a layout as it follows from the outcome without barriers.

    Returns None if it cannot be inferred without simulation; see `misses`.
    """
    if not layout:
        return without
    if not misses(site, key, layout, without):
        return None
    stands = _standing(site, key, layout)
    holds = [_holds(site, barrier, without) for barrier in stands]
    if None in holds or (site.friction_varies and not _known_to_bear(layout)):
        return None
    share = 1.0 if any(holds) else 0.0
    return replace(
        without,
        held_fraction=share * without.slope_fraction,
        slope_fraction=(1.0 - share) * without.slope_fraction,
        barriers=tuple(
            _idle(barrier.for_width(without.width), barrier, there, bool(held))
            for barrier, there, held in zip(layout, stands, holds, strict=True)
        ),
    )


def _holds(site: Site, barrier: BarrierReach, without: Outcome) -> bool | None:
    """Return whether a barrier holds a block that came to rest uphill of it; None if uncertain."""
    low, high = without.reach
    if without.slope_fraction == 0.0 or low > barrier.face or barrier.face == -math.inf:
        return False
    rise = math.tan(math.radians(min(s.friction_deg for s in site.surfaces.values())))
    points, at = site.profile.points, without.run_out
    alone = at[0] == at[2] and without.slope_fraction == 1.0
    inner = points[(points[:, 0] > low) & (points[:, 0] < high), 0]
    x = np.array([at[0]] if alone else [low, *inner, high])
    over = barrier.top + rise * (barrier.face - x) - np.interp(x, *points.T)
    if site.pit_spacing > 0.0:
        return None  # the block may lie in a pit
    if not site.friction_varies and (over <= 0.0).all():
        return False
    radius = LARGEST_RADIUS * math.sqrt(without.released_volume / without.width)
    if not site.friction_varies and alone and over[0] > 2.0 * radius:
        return True
    return None


def _known_to_bear(layout: Sequence[Built]) -> bool:
    """Return whether the resistance of a layout is independent of friction."""
    return not any(barrier.by_friction for barrier in layout)


def _standing(site: Site, key: bytes, layout: tuple[Built, ...]) -> tuple[BarrierReach, ...]:
    """Return the regions of the barriers of a layout."""
    known = standing_layouts.recall([(key, layout)]).get((key, layout))
    if known is None:
        drawn = site.draw(0, site.event_names[0])
        built = site.built(layout, UNIT)
        usual = drawn._replace(
            blocks=drawn.blocks[:1], friction_deg=0.0, strengths=(), roughness=None
        )
        scene = site.scene(usual, built)
        _, moved = earthworks(site.profile, layout, site.soil)
        known = tuple(
            _stands(site, barrier, moved.get(barrier), scene.resistance(i))
            for i, barrier in enumerate(layout)
        )
        standing_layouts.remember({(key, layout): known})
    return known


def _stands(site: Site, barrier: Built, moved: np.ndarray | None, bears: float) -> BarrierReach:
    """Return the region of a barrier; `moved` holds the corners of its earthworks."""
    if moved is None:
        assert isinstance(barrier, Standing)
        moved = barrier.outline(site.profile)
    (start, _), (end, top) = moved.min(axis=0).tolist(), moved.max(axis=0).tolist()
    face = barrier.holds(moved, site.profile, 0.0).end if barrier.left_height(0.0) else -math.inf
    # half of the distance that a corner moves in a step if the block has the full energy of a fall
    # from the top of the slope: its speed is at most twice the speed of the fall
    drop = float(np.ptp(site.profile.points[:, 1]))
    near = (
        CONTACT_MARGIN + site.motion.dt * math.sqrt(2.0 * EARTH * drop) + REACH * site.pit_spacing
    )
    return BarrierReach(start - near, end + near, face, top, bears)


def _idle(built: Built, barrier: Built, there: BarrierReach, holds: bool) -> BarrierOutcome:
    """Return the outcome of a barrier that no block comes near."""
    return BarrierOutcome(
        hits=0,
        max_energy=0.0,
        total_energy=0.0,
        absorbed_energy=0.0,
        impact_heights=(),
        overtopped=0,
        failed=False,
        caught=1.0 if holds else 0.0,
        state="stands",
        displacement=0.0,
        road_area=0.0,
        thrust=0.0,
        resistance=built.idle_resistance(barrier.for_width(UNIT), there.bears),
        left_height=built.left_height(0.0),
    )


Job = tuple[Site, Layout, int, str]
"""A release to simulate: site, layout, seed and name of the event."""


class Key(NamedTuple):
    """Key of a release: `release_key` of the site, all barriers that stand, seed and event."""

    site: bytes
    layout: tuple[Built, ...]
    seed: int
    event: str


bare_outcomes: Memory[Key, Outcome] = Memory(1 << 16)
"""Outcomes without barriers, about 1 kB each."""


def outcomes(jobs: Sequence[Job]) -> Sample:
    """Return the outcome of every job; identical jobs are simulated once.

    Parameters
    ----------
    jobs : sequence of (Site, Layout, int, str)
        The releases.

    Raises
    ------
    BadInput, Diverged
        As `rigdda.release` does.

    Warns
    -----
    DoubtfulInput
        As `rigdda.release_many` does, also for releases that are not simulated.
    """
    sites = {id(site): site for site, *_ in jobs}
    prints = {number: release_key(site) for number, site in sites.items()}
    keys = [
        Key(prints[id(site)], site.standing(layout), seed, event)
        for site, layout, seed, event in jobs
    ]
    known = _recall(keys, jobs)
    new = {key: job for key, job in zip(keys, jobs, strict=True) if key not in known}
    found, seconds = _simulate(list(new.values()))
    fresh = dict(zip(new, found, strict=True))
    _remember(fresh, new)
    known |= fresh
    if len(new) < len(keys):  # `release_many` checks only the releases that it simulates
        check_duration([site for site, *_ in jobs], [known[key] for key in keys])
    ran = []
    for key in keys:
        ran.append(key in new)
        new.pop(key, None)
    return Sample([known[key] for key in keys], ran, seconds)


def _simulate(jobs: list[Job]) -> tuple[list[Outcome], float]:
    """Return the outcomes and the processor time of their simulation [s].

    The time is NaN if they are simulated by an executor, see `rigdda.distribution`.
    """
    start = time.process_time()
    found = rigdda.release_many(jobs) if jobs else []
    remote = bool(jobs) and distribution.current() is not None
    return found, math.nan if remote else time.process_time() - start


def _recall(keys: Sequence[Key], jobs: Sequence[Job]) -> dict[Key, Outcome]:
    """Return the outcomes that follow from earlier simulations."""
    sites = {key.site: job[0] for key, job in zip(keys, jobs, strict=True)}
    wanted = set(keys)
    bare = bare_outcomes.recall({key._replace(layout=()) for key in wanted})
    known: dict[Key, Outcome] = {}
    for key in wanted:
        without = bare.get(key._replace(layout=()))
        if without is not None:
            found = inferred_outcome(sites[key.site], key.site, key.layout, without)
            if found is not None:
                known[key] = found
    return known


def _remember(fresh: Mapping[Key, Outcome], jobs: Mapping[Key, Job]) -> None:
    """Store the outcomes from which those of later releases can be inferred."""
    bare = {}
    for key, outcome in fresh.items():
        # a wall that has moved may be hit outside its original position
        struck = any(barrier.hits for barrier in outcome.barriers)
        if not struck and misses(jobs[key][0], key.site, key.layout, outcome):
            lies = outcome.slope_fraction + outcome.held_fraction
            alone = replace(outcome, barriers=(), held_fraction=0.0, slope_fraction=lies)
            bare[key._replace(layout=())] = alone
    bare_outcomes.remember(bare)


def pack(outcomes: Sequence[Outcome]) -> bytes:
    """Return outcomes in compressed form, about 100 bytes each."""
    return zlib.compress(msgspec.msgpack.encode(list(outcomes)))


def unpack(packed: bytes) -> list[Outcome]:
    """Return the outcomes of their compressed form; numbers are exact.

    Raises
    ------
    ValueError
        If the bytes are damaged.
    """
    try:
        return msgspec.msgpack.decode(zlib.decompress(packed), type=list[Outcome])
    except (zlib.error, msgspec.MsgspecError) as error:
        raise ValueError(f"damaged outcomes ({error})") from None
