"""Envelope for the design of a fence: what the blocks of the design events do along a zone.

Each design event is simulated, usually without barriers, until at least `LEAST_BLOCKS` of its
blocks were released. Quantiles of velocity and bounce height are taken at fixed stations and
smoothed along the slope by local linear regression with tricube weights (Cleveland 1979, Journal of
the American Statistical Association 74, 829-836; Fan and Gijbels, Local Polynomial Modelling and
Its Applications, Chapman and Hall 1996). A characteristic value is never below the quantile
recorded at its station: the regression only raises quantiles that are too low by chance, and fills
narrow dips, in which no fence can be placed exactly.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Layout, Site
from rigdda.barriers import as_layout, to_tables
from rigdda.envs import site_store
from rigdda.envs.envelope import largest
from rigdda.envs.outcome_cache import Memory, release_key
from rigdda.envs.quantiles import BlockSample, Quantile, quantiles
from rigdda.geometry import polygon_properties
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.passages import Passages, passages
from rigdda.seeds import design_envelope_seed

Floats = NDArray[np.float64]

LEAST_BLOCKS = 2000
"""Least number of blocks that are released in each design event. The standard error of a 95 %
quantile of the velocity is then about 1 %."""

SPACING, MOST_STATIONS = 1.0, 100
"""Largest distance between stations [m] and largest number of stations."""

BANDWIDTH = 2.0
"""Distance at which the weight of another station in the regression is 0, in units of the distance
between stations."""


class DesignEnvelope(msgspec.Struct, frozen=True):
    """What the blocks of the design events of a site do at stations.

    Parameters
    ----------
    stations : list of K float
        Chainages of the stations, evenly spaced over the barrier zone [m].
    level : float
        Share of blocks below the quantiles [-].
    events : list of EventEnvelope
        The design events; all events if the site names none.
    crossing : list of K float
        Of the blocks of these events that reach the road, the share that passes each station [-].
        It is 0 if none reaches the road.
    """

    stations: list[float]
    level: float
    events: list[EventEnvelope]
    crossing: list[float]

    @property
    def reaches(self) -> bool:
        """Whether any block reaches the road."""
        return any(event.reaching > 0 for event in self.events)


class EventEnvelope(msgspec.Struct, frozen=True):
    """What the blocks of one event do at K stations.

    Parameters
    ----------
    name : str
        Name of the event.
    releases, blocks, reaching : int
        Number of releases, of released blocks and of blocks that reach the road.
    passing : list of K int
        Number of blocks that pass each station.
    speed, height : list of K Quantile
        Characteristic velocity [m/s] and height of the centroid above the ground [m], with the ends
        of their 95 % intervals; NaN where no block passes.
    mass : float
        Characteristic mass of a block [kg].
    radius : float
        Mean radius of the circumscribed circles of the blocks [m].
    """

    name: str
    releases: int
    blocks: int
    reaching: int
    passing: list[int]
    speed: list[Quantile]
    height: list[Quantile]
    mass: float
    radius: float


STORED_AS = "design_envelope"
"""Name under which design envelopes are stored on disk; see `rigdda.envs.site_store`."""

memory: Memory[bytes, DesignEnvelope] = Memory(256)
"""Design envelopes by site, zone and seed, about 20 kB each."""


def stations(zone: BarrierZone) -> list[float]:
    """Return evenly spaced stations from the start to the end of a zone [m].

    Those between the two ends are rounded to millimetres. The ends are exact, so that there is a
    demand at every chainage of the zone.
    """
    count = min(MOST_STATIONS, max(2, math.ceil((zone.end - zone.start) / SPACING) + 1))
    inner = np.linspace(zone.start, zone.end, count)[1:-1].round(3)
    return [zone.start, *inner.tolist(), zone.end]


def governing_events(site: Site) -> list[str]:
    """Return the names of the design events, or of all events if there are none."""
    named = [event.name for event in site.events if event.design]
    return named or list(site.event_names)


def of(
    site: Site,
    zone: BarrierZone,
    seed: int = 0,
    blocks: int = LEAST_BLOCKS,
    layout: Sequence[Barrier] = (),
) -> DesignEnvelope:
    """Return the design envelope of a site, simulating it if it is not stored.

    Parameters
    ----------
    site : Site
        The site; its `rule.quantile` is the level of the quantiles. Barriers that stand on it
        already are left out unless they are in `layout`.
    zone : BarrierZone
        Where barriers may stand.
    seed : int
        Seed of the releases.
    blocks : int
        Least number of blocks of each event.
    layout : sequence of Barrier
        Barriers that stand, by default none.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope.
    Diverged
        If a simulation diverges.
    """
    level, lines, built = site.rule.quantile, stations(zone), as_layout(layout)
    bare = msgspec.structs.replace(site, existing=()) if site.existing else site
    names = governing_events(site)
    key = _key(release_key(bare).hex(), names, lines, seed, blocks, level, to_tables(built))
    known = memory.recall([key]).get(key) or site_store.read(STORED_AS, key, DesignEnvelope)
    if known is None:
        known = _simulate(bare, built, lines, seed, blocks, level)
        site_store.write(STORED_AS, key, known)
    memory.remember({key: known})
    return known


def _key(*parts: Any) -> bytes:
    """Return a key of what affects the motion of rock on a site and of the other arguments."""
    return hashlib.sha256(msgspec.json.encode(parts)).digest()[:16]


def _simulate(
    site: Site, layout: Layout, lines: list[float], seed: int, blocks: int, level: float
) -> DesignEnvelope:
    """Simulate releases of every design event and return their envelope."""
    at = [*lines, site.road.start] if lines[-1] < site.road.start else lines
    events, through, reached = [], np.zeros(len(lines)), 0
    for name in governing_events(site):
        first = design_envelope_seed(seed)
        releases = [(first + i, name) for i in range(math.ceil(blocks / largest(site, name)))]
        crossed = passages(site, layout, releases, at)
        while len(crossed.stops) < blocks:  # events with a random number of blocks
            more = math.ceil((blocks - len(crossed.stops)) / len(crossed.stops) * len(releases))
            start = first + len(releases)
            new = [(start + i, name) for i in range(more)]
            crossed = Passages.join([crossed, passages(site, layout, new, at)])
            releases += new
        block = _blocks(crossed.table)
        over = block[crossed.table["station"] == len(at) - 1]
        events.append(_event(site, name, crossed, len(lines), len(over), level))
        risky = crossed.table[np.isin(block, over)]
        through += np.bincount(risky["station"], minlength=len(at))[: len(lines)]
        reached += len(over)
    return DesignEnvelope(lines, level, events, (through / max(reached, 1)).tolist())


def _blocks(table: NDArray[np.void]) -> NDArray[np.int64]:
    """Return a number for the block of each passage."""
    return table["release"].astype(np.int64) << 32 | table["block"]


def _event(
    site: Site, name: str, crossed: Passages, count: int, reaching: int, level: float
) -> EventEnvelope:
    """Return the envelope of the releases of an event at the first `count` stations."""
    rows_at = [crossed.at(k) for k in range(count)]
    speeds = [np.hypot(rows["vx"], rows["vy"]) for rows in rows_at]
    traits = [
        (block.density, *_size(block.vertices))
        for seed in crossed.seed
        for block in site.draw(seed, name).blocks
    ]
    density, area, radius = np.array(traits).T
    passing = np.array([len(rows) for rows in rows_at], dtype=np.float64)
    lines = crossed.stations[:count]

    def quantile(values: Sequence[Floats]) -> list[Quantile]:
        raw = [
            quantiles(_sample(v, rows, crossed), [level])[0]
            for v, rows in zip(values, rows_at, strict=True)
        ]
        table = _complete(np.array(raw))
        smooth = [np.fmax(column, smoothed(lines, column, passing)) for column in table.T]
        return [Quantile(*row) for row in np.array(smooth).T.tolist()]

    return EventEnvelope(
        name=name,
        releases=len(crossed.seed),
        blocks=len(crossed.stops),
        reaching=reaching,
        passing=[len(rows) for rows in rows_at],
        speed=quantile(speeds),
        height=quantile([rows["height"] for rows in rows_at]),
        mass=float(np.quantile(density * area**1.5, level)),
        radius=float(radius.mean()),
    )


def _sample(values: Floats, rows: NDArray[np.void], found: Passages) -> BlockSample:
    """Return values of passages of one event as a sample; the weights of its releases are equal."""
    event = np.zeros(len(found.seed), dtype=np.int64)
    return BlockSample(np.asarray(values, dtype=np.float64), rows["release"], event, np.ones(1))


def _complete(table: Floats) -> Floats:
    """Return quantiles with the value in place of ends that too few blocks leave open, (K, 3)."""
    return np.where(np.isnan(table), table[:, :1], table)


def _size(vertices: Floats) -> tuple[float, float]:
    """Return the area [m2] and the circumscribed radius [m] of a block."""
    area, centre, _ = polygon_properties(vertices)
    return area, float(np.hypot(*(vertices - centre).T).max())


def smoothed(x: Floats, values: Floats, weight: Floats, width: float = BANDWIDTH) -> Floats:
    """Return a curve smoothed by local linear regression with tricube weights.

    Parameters
    ----------
    x : (K,) array
        Evenly spaced, ascending chainages [m].
    values : (K,) array
        Values; NaN where there is none.
    weight : (K,) array
        Weight of each value.
    width : float
        Distance at which a weight is 0, in units of the spacing.

    Returns
    -------
    (K,) array
        NaN where `values` is.
    """
    known = ~np.isnan(values)
    reach = width * (x[1] - x[0]) if len(x) > 1 else 1.0
    out = np.full(len(x), np.nan)
    for k in np.flatnonzero(known).tolist():
        away = (x[known] - x[k]) / reach
        w = np.where(np.abs(away) < 1.0, (1.0 - np.abs(away) ** 3) ** 3, 0.0) * weight[known]
        mean, total = np.average(away, weights=w), w.sum()
        spread = float(w @ (away - mean) ** 2)
        level = float(w @ values[known]) / total
        slope = float(w @ ((away - mean) * values[known])) / spread if spread > 1e-12 else 0.0
        out[k] = level - slope * mean
    return out
