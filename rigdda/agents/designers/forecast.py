"""Forecasts of the remaining risk with any layout from releases without barriers.

The ensemble of a designer (`rigdda.agents.designers.catalogue`) shows which blocks pass each
station, how fast and how high. A block that reaches the road without barriers counts as stopped if
one of the barriers of a layout stops it on its path. This neglects the effect of a barrier on the
motion farther downhill, blocks that lie against a barrier and rebounds from it. A small network
that was trained on simulated layouts of many sites corrects for that (`Value`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Fence, Layout, Mesh, Site
from rigdda.agents.designers.catalogue import CrossingEnsemble, Effects
from rigdda.barriers import Removal
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import largest
from rigdda.envs.problem import excess
from rigdda.seeds import release_seeds

if TYPE_CHECKING:
    from rigdda.agents.network import Network

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

ENSEMBLE, HEAVY_ENSEMBLE, HEAVY = 40, 6, 30
"""Releases of each event that a forecast without a search is made from, the same for events of more
than `HEAVY` blocks, and this number of blocks. The value network is trained with them."""

FEATURE_KINDS = ("fence", "ditch", "embankment", "gravity_wall", "mesh")
"""Kinds of barrier that the features distinguish."""

QUANTILE = 0.95
"""Quantile of energies, heights and speeds at a barrier."""


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """Estimated effect of one barrier on the blocks that reach the road without barriers.

    Parameters
    ----------
    stops, low, passes : (B,) arrays of bool
        Blocks that the barrier stops, blocks that pass below its top, and blocks that pass its
        station at all.
    factor : (E,) array
        Factor on the harm of each event [-], less than 1 for mesh.
    mended : (R,) array
        Length of barrier to repair in each release [m].
    share : (E,) array
        Remaining share of the risk of each event with this barrier alone [-].
    numbers : (E, BARRIER_FEATURES) array
        Features of the barrier for each event.
    """

    stops: Bools
    low: Bools
    passes: Bools
    factor: Floats
    mended: Floats
    share: Floats
    numbers: Floats


class Forecast:
    """Forecasts of the remaining risk with layouts on a site.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    ensemble : CrossingEnsemble
        Releases without barriers.
    value : Value, optional
        Network for `remaining`; `features` does not need it.
    """

    def __init__(
        self, problem: DesignProblem, ensemble: CrossingEnsemble, value: Value | None = None
    ):
        site = problem.site
        self.problem, self.ensemble, self._value = problem, ensemble, value
        self.effects = Effects(site, ensemble)
        road = ensemble.at(len(ensemble.stations))
        keys = _keys(road)
        order = np.argsort(keys, kind="stable")
        self._keys, self._release = keys[order], road["release"][order]
        self._volume = road["volume"][order].astype(np.float64)
        self._whole = np.bincount(self._release, self._volume, minlength=len(ensemble.event))
        self._free = not self.effects.base.any()
        self._base = self._whole if self._free else self.effects.base
        names = site.event_names
        self._in_event = np.equal.outer(np.arange(len(names)), ensemble.event).astype(np.float64)
        risk = self._in_event @ self._base  # sum over releases, (E,)
        self._unseen, self._risk = risk <= 0.0, np.maximum(risk, 1e-12)
        count = np.maximum(self._in_event.sum(axis=1), 1.0)
        self._event_numbers = np.column_stack(
            [
                np.log10([largest(site, name) for name in names]),
                np.log10(np.maximum(self._in_event @ self._whole / count, 1e-3)),
                self._in_event @ (self._whole > 0.0) / count,
                np.log10(count),
            ]
        )
        self._known: dict[Barrier, Effect] = {}

    def effect(self, barrier: Barrier) -> Effect:
        """Return the estimated effect of a barrier."""
        found = self._known.get(barrier)
        if found is None:
            found = self._known[barrier] = self._effect(barrier)
        return found

    def _effect(self, barrier: Barrier) -> Effect:
        site, count, blocks = self.problem.site, len(self.ensemble.event), len(self._keys)
        none, mended = np.zeros(blocks, dtype=bool), np.zeros(count)
        ones = np.ones(len(self._risk))
        if isinstance(barrier, Mesh | Removal):
            factor = ones
            if isinstance(barrier, Mesh):
                rates = [(site.rate(n, (barrier,)), site.rate(n, ())) for n in site.event_names]
                factor = np.array([own / usual if usual > 0.0 else 1.0 for own, usual in rates])
            numbers = np.zeros((len(self._risk), BARRIER_FEATURES))
            return Effect(none, none, none, factor, mended, self._share(none, factor), numbers)
        k = int(np.argmin(np.abs(self.ensemble.stations - barrier.x)))
        table = self.effects.at(k)
        stopped, broken = self.effects.stopped(barrier, table)
        low = stopped if barrier.kind == "ditch" else table["height"] <= barrier.left_height(0.0)
        keys = _keys(table)
        place = np.minimum(np.searchsorted(self._keys, keys), max(blocks - 1, 0))
        known = self._keys[place] == keys if blocks else np.zeros(len(table), dtype=bool)
        stops, under, passes = none.copy(), none.copy(), none.copy()
        stops[place[known & stopped]] = True
        under[place[known & low]] = True
        passes[place[known]] = True
        failed = np.bincount(table["release"], broken, minlength=count) > 0
        mended = np.where(failed, np.maximum(self.ensemble.width, barrier.repaired), 0.0)
        numbers = self._numbers(barrier, table, stopped, failed)
        return Effect(stops, under, passes, ones, mended, self._share(stops, ones), numbers)

    def _numbers(
        self, barrier: Barrier, table: NDArray[np.void], stopped: Any, failed: Bools
    ) -> Floats:
        """Return the features of a barrier for each event, (E, BARRIER_FEATURES)."""
        site, zone, ground = self.problem.site, self.problem.zone, self.problem.site.profile
        tall = max(_tall(barrier), 0.1)
        capacity = 1e3 * (barrier.energy_class or 100.0) if isinstance(barrier, Fence) else 1e6
        at, end = barrier.x, barrier.x + barrier.extent
        above = ground.height(at - 4.0) - ground.height(at)
        below = ground.height(end) - ground.height(min(end + 4.0, site.road.end))
        own = (
            tall / 3.0,
            barrier.extent / 4.0,
            math.log10(capacity / 1e6),
            math.log10(max(site.road.start - end, 0.1)),
            (at - zone.start) / max(zone.end - zone.start, 1e-9),
            above / 4.0,
            below / 4.0,
        )
        taken = np.bincount(
            table["release"], table["volume"] * stopped, minlength=len(self._whole)
        ) / np.maximum(self.ensemble.width, 1.0)
        broken = self._in_event @ (self._base * failed) / self._risk
        event = self.ensemble.event[table["release"]]
        rows = []
        for i in range(len(self._risk)):
            mine = table[event == i]
            blows = np.array([mine[name] for name in ("energy", "height", "speed", "radius")])
            energy, height, speed, radius = _quantile(blows).tolist()
            fill = float(_quantile(taken[self.ensemble.event == i])) / tall**2
            rows.append(
                (
                    *own,
                    math.log10(max(energy, 1e3) / capacity),
                    min(height / tall, 4.0),
                    speed / 20.0,
                    min(radius / tall, 4.0),
                    float(broken[i]),
                    min(math.log10(max(fill, 1e-3)), 3.0),
                )
            )
        return np.array(rows)

    def _share(self, stopped: Bools, factor: Floats) -> Floats:
        """Return the remaining share of the risk of each event if some blocks are stopped, (E,).

        If no release of an event reaches the road without barriers, nothing is known of the effect
        of a barrier on it, and only `factor` counts.
        """
        volume = self._volume[stopped]
        taken = np.bincount(self._release[stopped], volume, minlength=len(self._whole))
        remains: Floats = np.asarray(self._whole - taken, dtype=np.float64)
        left: Floats = np.where(remains <= 1e-9 * self._whole, 0.0, remains)
        harm = left if self._free else self.effects.harm(left)
        share = np.where(self._unseen, 1.0, self._in_event @ harm / self._risk)
        return np.minimum(share * factor, 1.0)

    def analytic(self, layout: Layout) -> tuple[Floats, Floats, Floats]:
        """Return the remaining shares for stopped, low and passing blocks, each (E,)."""
        own = [self.effect(barrier) for barrier in layout]
        if len(own) == 1 and not own[0].passes.any():
            return own[0].share, own[0].share, own[0].share
        factor = np.prod([e.factor for e in own], axis=0) if own else np.ones(len(self._risk))
        none = np.zeros(len(self._keys), dtype=bool)
        stops, low, passes = (
            self._share(np.logical_or.reduce([none, *(getattr(e, name) for e in own)]), factor)
            for name in ("stops", "low", "passes")
        )
        return stops, low, passes

    def arrivals(self, layout: Layout, remaining: Floats) -> Floats:
        """Return the forecast probability that a block of each release reaches the road, (R,) [-].

        Blocks that no barrier stops reach the road. If less of the risk remains than theirs, as
        where a ditch also stops blocks that land beyond it, each of them reaches the road with the
        ratio of the two.

        Parameters
        ----------
        remaining : (E,) array
            Forecast share of the risk of each event that remains with the layout, see `remaining`.
        """
        stopped = np.zeros(len(self._keys), dtype=bool)
        for barrier in layout:
            stopped |= self.effect(barrier).stops
        share = np.maximum(self.analytic(layout)[0], 1e-12)
        each = np.minimum(remaining / share, 1.0)[self.ensemble.event]
        left = np.bincount(self._release[~stopped], minlength=len(self._whole))
        none: Floats = (1.0 - each) ** left
        return 1.0 - none

    def excess(self, layout: Layout, remaining: Floats) -> float:
        """Return the largest forecast excess over a target [-], 0 if there is none.

        Parameters
        ----------
        remaining : (E,) array
            Forecast share of the risk of each event that remains with the layout, see `remaining`.
        """
        problem, targets = self.problem, self.problem.targets
        events = [i for i, e in enumerate(problem.site.events) if e.design]
        own, over = [self.effect(barrier) for barrier in layout], [0.0]
        if targets.reach is not None:
            reached = self.arrivals(layout, remaining)
            over += [_mean(reached[self.ensemble.event == i]) - targets.reach for i in events]
        if targets.failure is not None:
            failed = sum((e.mended for e in own), np.zeros(len(self._whole))) > 0.0
            over += [_mean(failed[self.ensemble.event == i]) - targets.failure for i in events]
        risk = problem.nothing.risk
        if targets.individual is not None and risk is not None:
            harm = np.array([problem.nothing.by_event[name] for name in problem.site.event_names])
            share = float(remaining @ harm) / float(harm.sum()) if harm.any() else 1.0
            over.append(excess(share * risk.individual.value, targets.individual))
        return max(over)

    def features(self, layout: Layout) -> Floats:
        """Return the features of a layout for each event, (E, LAYOUT_FEATURES)."""
        order = sorted(layout, key=lambda b: float(self.effect(b).share.mean()))
        events = len(self._risk)
        repair = np.zeros(events)
        if not self._free:
            for b in layout:
                cost = self.problem.site.capital((b,)) * self.effect(b).mended
                repair += self._in_event @ cost / self._risk
        columns = [*self.analytic(layout), np.minimum(repair, 2.0)]
        columns.append(np.full(events, len(layout) - 1.0))
        parts = [np.column_stack(columns)]
        for i in range(2):
            kind = order[i].kind if i < len(order) else ""
            kind = "gravity_wall" if kind == "wall" else kind
            parts.append(np.tile([float(kind == name) for name in FEATURE_KINDS], (events, 1)))
            if i < len(order):
                own = self.effect(order[i])
                parts += [own.share[:, None], own.numbers]
            else:
                parts += [np.ones((events, 1)), np.zeros((events, BARRIER_FEATURES))]
        return np.hstack([*parts, self._event_numbers])

    def remaining(self, layouts: Sequence[Layout]) -> Floats:
        """Return the forecast share of the risk of each event that remains, (n, E) [-]."""
        assert self._value is not None
        features = np.array([self.features(layout) for layout in layouts])
        return self._value(features)


BARRIER_FEATURES = 13
"""Number of features of one barrier besides its kind and its share."""
LAYOUT_FEATURES = 5 + 2 * (len(FEATURE_KINDS) + 1 + BARRIER_FEATURES) + 4
"""Number of features of a layout for one event."""


def forecast_seeds(site: Site) -> dict[str, tuple[int, ...]]:
    """Return the seeds, by event, of the releases that a forecast without a search is made from."""
    return {
        name: release_seeds(
            "ensemble", 0, HEAVY_ENSEMBLE if largest(site, name) > HEAVY else ENSEMBLE
        )
        for name in site.event_names
    }


def _keys(table: NDArray[np.void]) -> NDArray[np.int64]:
    """Return a number for each crossing that identifies its block."""
    keys: NDArray[np.int64] = table["release"].astype(np.int64) << 32 | table["block"]
    return keys


def _mean(chances: Bools | Floats) -> float:
    """Return the mean over releases of a probability or of what happened, 0 without releases."""
    return float(chances.mean()) if len(chances) else 0.0


def _tall(barrier: Barrier) -> float:
    """Return the height of a barrier, or the depth of a ditch [m]."""
    return float(getattr(barrier, "height", 0.0) or getattr(barrier, "depth", 0.0))


def _quantile(values: Floats) -> Floats:
    """Return the `QUANTILE` along the last axis, 0 without values."""
    if values.shape[-1] == 0:
        return np.zeros(values.shape[:-1])
    found: Floats = np.quantile(values, QUANTILE, axis=-1)
    return found


class Value:
    """Network that predicts the remaining share of the risk from the features of a layout.

    Parameters
    ----------
    network : Network
        Network with `LAYOUT_FEATURES` features; the mean of its outputs is the prediction.
    """

    def __init__(self, network: Network):
        self.network = network

    def __call__(self, features: Floats) -> Floats:
        """Return the predicted share for (..., LAYOUT_FEATURES) features, from 0 to 1.2."""
        return np.clip(self.network(features.astype(np.float32)).mean(axis=-1), 0.0, 1.2)


NETWORK_FILE = Path(__file__).parent / "value.safetensors"
"""The network that ships with the package. It was trained with seed 1 and the method of
`rigdda train --model value`, which was added later, so that its metadata contain only the seed."""


@lru_cache(maxsize=1)
def value_network() -> Value:
    """Return the value network that ships with the package; the file is read once."""
    from rigdda.agents.network import Network

    return Value(Network.load(NETWORK_FILE))
