"""Gaussian process over layouts, with the forecast of a value network as its prior mean.

Two layouts are strongly correlated if they have barriers of the same kind at nearby stations and of
similar sizes. All layouts of a site are slightly correlated, because a forecast may be wrong for a
whole site.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from rigdda import Barrier, Layout, Mesh
from rigdda.agents.designers.forecast import Forecast
from rigdda.agents.designers.racing import Arm, remaining
from rigdda.envs import DesignProblem

Floats = NDArray[np.float64]

STATION_LENGTH, STATION_LENGTH_SHARE = 2.0, 0.08
"""Correlation length over stations [m], and the same as a share of the zone [-]. The greater of the
two is used. Benches are a few metres long."""
HEIGHT, SIZE_LENGTHS, CLASS = 0.35, 0.5, 0.7
"""Correlation length over the logarithm of heights, of other lengths and of energy classes [-]."""
SPREAD, MORE = 0.03, 0.25
"""Prior standard deviation of the remaining share m of the risk is SPREAD + MORE m (1 - m) [-].

These are the errors of forecasts on sites outside the training: 0.02 to 0.05 for m near 0 and 1 and
0.09 in between."""
OF_SITE, OF_KIND = 0.2, 0.25
"""Shares of the prior variance that are common to all layouts and to all of a kind [-], as measured
on the same sites."""
COMMON = 0.5
"""Correlation of the errors of layouts that were simulated on the same releases [-]."""
EXCESS_PENALTY = 1e4
"""Penalty on the excess over a target, which ranks layouts that miss it behind all others, in units
of the risk without barriers [-]."""
FIRST_VARIANCE = 0.01
"""Variance of the estimate of a candidate before any is known, over the squared risk [-]."""
GAIN_DRAWS = 1000
"""Number of draws, each with its opposite, from which an expected gain is computed."""
HOPELESS_DEVIATIONS = 4.0
"""Number of standard deviations by which a layout must be behind to be left out of a gain [-]."""


def expected_gain(value: Floats, change: Floats, floor: Floats) -> float:
    """Return by how much further releases are expected to lower the least of some estimates.

    It is the knowledge gradient (Frazier et al. 2009, INFORMS Journal on Computing 21, 599-613):
    the least estimate now, minus the expectation of the least estimate after the releases. It is 0
    if no result of the releases would change the choice.

    Parameters
    ----------
    value : (M,) array
        The estimates, each the expectation of what it will be after the releases.
    change : (n, M) array
        Change of the estimates for each of n independent standard normal results.
    floor : (M,) array
        Least possible values.
    """
    half = np.random.default_rng(0).standard_normal((GAIN_DRAWS, len(change)))
    after = value + np.concatenate([half, -half]) @ change
    least = np.maximum(after, floor).min(axis=1)
    return max(float(value.min() - least.mean()), 0.0)


class Surrogate:
    """Estimates of Z for a growing pool of layouts.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    forecast : Forecast
        Features of layouts.

    Attributes
    ----------
    worth : float
        Risk without barriers: Z without barriers less the upkeep of existing barriers [EUR per m
        and year], or the debris on the road without prices.
    bare : float
        Z without barriers over the risk without barriers [-]: 1, plus the upkeep of existing
        barriers over the risk.
    layouts : list of Layout
        The pool.
    mean, deviation : (M,) arrays
        Estimated remaining share of the risk of each layout and its standard deviation [-].
    excess : (M,) array
        Estimated excess over a target [-].
    """

    def __init__(self, problem: DesignProblem, forecast: Forecast):
        self.problem, self._forecast = problem, forecast
        without = problem.nothing
        self.priced = without.objective > 0.0
        site, zone = problem.site, problem.zone
        standing = site.annual(()) if self.priced else 0.0
        self.worth = (without.objective - standing) if self.priced else without.debris
        self.worth = max(self.worth, 1e-9)
        self.bare = 1.0 + standing / self.worth
        names = site.event_names
        bare = [without.by_event[name] for name in names] if self.priced else [1.0] * len(names)
        self._bare = np.array(bare) / max(math.fsum(bare), 1e-300)
        self._shares = np.zeros((0, len(names)))
        self._scale = max(STATION_LENGTH, STATION_LENGTH_SHARE * (zone.end - zone.start))
        self.layouts: list[Layout] = []
        self.place: dict[Layout, int] = {}
        self._barriers: dict[Barrier, int] = {}
        self._numbers: list[tuple[float, ...]] = []
        self.mean, self.deviation, self.annual, self.capital, self.excess = np.zeros((5, 0))
        self._prior, self._missed_before = np.zeros((2, 0))
        self._index = np.zeros((0, 1), dtype=np.int64)
        self._seen: list[tuple[int, float, float, int]] = []
        self._batches, self._missed = 0, list[float]()

    def add(self, layouts: Iterable[Layout]) -> None:
        """Add layouts to the pool.

        Those that cost more than the whole risk are left out unless there is a target.
        """
        site = self.problem.site
        new = [x for x in dict.fromkeys(layouts) if x and x not in self.place]
        annual = [site.annual(x) if self.priced else 0.0 for x in new]
        most = math.inf if self.has_targets else self.bare * self.worth
        new = [x for x, a in zip(new, annual, strict=True) if a < most]
        if not new:
            return
        for layout in new:
            self.place[layout] = len(self.layouts)
            self.layouts.append(layout)
            for barrier in layout:
                if barrier not in self._barriers:
                    self._barriers[barrier] = len(self._barriers)
                    self._numbers.append(_coordinates(barrier, self._scale))
        shares = self._forecast.remaining(new)
        self._shares = np.concatenate([self._shares, shares])
        self._prior = self._shares @ self._bare
        more = [[site.annual(x) if self.priced else 0.0 for x in new]]
        self.annual = np.concatenate([self.annual, *more])
        self.capital = np.concatenate([self.capital, [site.capital(x) for x in new]])
        missed = [self._forecast.excess(x, own) for x, own in zip(new, shares, strict=True)]
        self._missed_before = np.concatenate([self._missed_before, missed])
        most_barriers = max(map(len, self.layouts))
        index = np.full((len(self.layouts), most_barriers), -1, dtype=np.int64)
        old = self._index
        index[: len(old), : old.shape[1]] = old
        for row, layout in enumerate(new, len(old)):
            index[row, : len(layout)] = [self._barriers[b] for b in layout]
        self._index = index
        self._update()

    def learn(self, arms: Sequence[Arm], nothing: Arm) -> None:
        """Take account of arms that were simulated on the same releases as no barrier."""
        for arm in arms:
            row = self.place.get(arm.layout)
            if row is not None:
                value, variance = remaining(arm, nothing)
                number = self._batches
                self._seen.append((row, value / self.worth, variance / self.worth**2, number))
                self._missed.append(arm.shortfall() if self.has_targets else 0.0)
        self._batches += 1
        self._update()

    def expect(self, layout: Layout) -> dict[str, float] | None:
        """Return the forecast mean bill of each event [EUR], or None for layouts outside the pool.

        The forecast is scaled to the estimate of the remaining risk.
        """
        row = self.place.get(layout)
        if row is None or not self.priced:
            return None
        site, bare = self.problem.site, self.problem.nothing.by_event
        scale = max(float(self.mean[row]), 0.0) / max(float(self._prior[row]), 1e-3)
        out = {}
        for name, share in zip(site.event_names, self._shares[row].tolist(), strict=True):
            rate = site.rate(name, layout)
            out[name] = min(share * scale, 1.2) * bare[name] / rate if rate > 0.0 else 0.0
        return out

    @property
    def has_targets(self) -> bool:
        """Whether the problem has a target."""
        return self.problem.targets.given

    def value(self, price: float = 0.0) -> Floats:
        """Return Z of every layout over the risk without barriers, (M,) [-].

        Parameters
        ----------
        price : float
            Additional annual cost per capital cost [1/year], which represents scarce money.
        """
        return self._hoped(self.deviation, 0.0, price)

    def _hoped(self, deviation: Floats, hope: float, price: float) -> Floats:
        """Return Z of every layout at `hope` standard deviations below the mean, (M,) [-]."""
        costs = (self.annual + price * self.capital) / self.worth
        left = np.maximum(self.mean - hope * deviation, 0.0)
        return costs + left + EXCESS_PENALTY * np.maximum(self.excess - hope * deviation, 0.0)

    def joint(self, arm: Arm, nothing: Arm) -> tuple[float, float]:
        """Return Z of an arm over the risk without barriers and the variance of this estimate [-].

        The estimate combines its releases with that of the pool. The two estimates of the remaining
        risk are weighted with their precision.
        """
        if not arm.layout and self.priced:
            return self.bare, 0.0
        left, variance = remaining(arm, nothing)
        left, variance = left / self.worth, variance / self.worth**2 + 1e-9
        row = self.place.get(arm.layout)
        if row is not None:
            known = float(self.deviation[row]) ** 2 + 1e-9
            both = 1.0 / (1.0 / variance + 1.0 / known)
            left = both * (left / variance + float(self.mean[row]) / known)
            variance = both
        return arm.annual / self.worth + left, variance

    def gain(self, layouts: Sequence[Layout]) -> float:
        """Return how much lower the least Z is expected to be if some layouts were simulated.

        It is relative to the least Z now, see `expected_gain`.
        """
        value = self.value()
        if not layouts:
            return 0.0
        columns = self._columns([self.place[layout] for layout in layouts])
        least = min(float(value.min()), self.bare)
        near = value - HOPELESS_DEVIATIONS * self.deviation <= least
        values = np.append(value[near], self.bare)
        change = np.concatenate([columns[:, near], np.zeros((len(columns), 1))], axis=1)
        floor = np.append(self.annual[near] / self.worth, self.bare)
        return expected_gain(values, change, floor) / max(least, 1e-9)

    def promising(self, n: int, hope: float, price: float = 0.0) -> list[Layout]:
        """Return the `n` layouts with the least Z at `hope` standard deviations below the mean.

        After each choice, the deviations are reduced as if the layout had been simulated.
        """
        if not self.layouts:
            return []
        variance = np.square(self.deviation)
        columns: list[Floats] = []
        chosen: list[int] = []
        for _ in range(min(n, len(self.layouts))):
            hoped = self._hoped(np.sqrt(variance), hope, price)
            hoped[chosen] = np.inf
            i = int(np.argmin(hoped))
            chosen.append(i)
            columns.append(self._column(i, columns))
            variance = np.maximum(variance - np.square(columns[-1]), 0.0)
        return [self.layouts[i] for i in chosen]

    def _columns(self, rows: Sequence[int]) -> Floats:
        """Return the change of all means by one standard deviation of each of n results, (n, M)."""
        columns: list[Floats] = []
        for i in rows:
            columns.append(self._column(i, columns))
        return np.array(columns)

    def _column(self, i: int, earlier: Sequence[Floats]) -> Floats:
        """Return the change of all means if layout i, simulated after others, deviates by one sd.

        The result deviates from the mean by one standard deviation of its forecast and noise.
        """
        noise = float(np.median([seen[2] for seen in self._seen])) if self._seen else FIRST_VARIANCE
        column = self._posterior_column(i)
        for other in earlier:
            column = column - other * other[i]
        scaled: Floats = column / np.sqrt(max(column[i], 0.0) + noise + 1e-6)
        return scaled

    def best(self, n: int, price: float = 0.0) -> list[Layout]:
        """Return the `n` layouts with the least estimated Z, the best first."""
        order = np.argsort(self.value(price), kind="stable")[:n]
        return [self.layouts[i] for i in order.tolist()]

    def _update(self) -> None:
        rows = np.array([seen[0] for seen in self._seen], dtype=np.int64)
        self.mean = self._prior.copy()
        spread = self._spread()
        self.deviation = spread.copy()
        self.excess = self._missed_before
        if not len(rows):
            return
        found, noise, batch = np.array([seen[1:] for seen in self._seen]).T
        alike = self._alike(rows)
        common = COMMON * np.equal.outer(batch, batch) + (1.0 - COMMON) * np.eye(len(rows))
        among = alike[:, rows] + common * np.sqrt(np.outer(noise, noise)) + 1e-6 * np.eye(len(rows))
        self._alike_seen = alike
        self._weight = np.linalg.solve(among, alike)
        self.mean = self._prior + self._weight.T @ (found - self._prior[rows])
        if self.has_targets:
            more = self._weight.T @ (np.array(self._missed) - self._missed_before[rows])
            self.excess = np.maximum(self._missed_before + more, 0.0)
        explained = np.einsum("ij,ij->j", self._weight, alike)
        self.deviation = np.sqrt(np.maximum(np.square(spread) - explained, 0.0))

    def _spread(self) -> Floats:
        """Return the prior standard deviation of every layout."""
        m = np.clip(self._prior, 0.0, 1.0)
        spread: Floats = SPREAD + MORE * m * (1.0 - m)
        return spread

    def _posterior_column(self, i: int) -> Floats:
        own = self._alike(np.array([i]))[0]
        if not self._seen:
            return own
        posterior: Floats = own - self._weight[:, i] @ self._alike_seen
        return posterior

    def _alike(self, rows: NDArray[np.int64]) -> Floats:
        """Return the prior covariance of some layouts with all layouts, (m, M)."""
        numbers = np.array(self._numbers)
        count = (self._index >= 0).sum(axis=1)
        out = np.full((len(rows), len(self.layouts)), OF_SITE)
        for m, row in enumerate(rows.tolist()):
            total = np.zeros(len(numbers) + 1)  # the last entry stands for no barrier
            for b in self._index[row, : count[row]].tolist():
                same = numbers[:, 0] == numbers[b, 0]
                apart = np.square(numbers[:, 1:] - numbers[b, 1:]).sum(axis=1)
                near = OF_KIND + (1.0 - OF_SITE - OF_KIND) * np.exp(-0.5 * apart)
                total[:-1] += same * near
            shared = total[self._index].sum(axis=1)
            out[m] += shared / np.sqrt(count[row] * count)
        spread = self._spread()
        covariance: Floats = out * spread[rows][:, None] * spread
        return covariance


def _coordinates(barrier: Barrier, near: float) -> tuple[float, ...]:
    """Return a number for the kind and scaled numbers whose distance gives the correlation."""
    kind = float(crc32(barrier.kind.encode()))
    if isinstance(barrier, Mesh):
        return kind, float(crc32(barrier.option.encode())), 0.0, 0.0, 0.0
    tall = getattr(barrier, "height", 0.0) or getattr(barrier, "depth", 0.0)
    size = getattr(barrier, "width", 0.0) or getattr(barrier, "thickness", 0.0)
    named = getattr(barrier, "energy_class", None) or getattr(barrier, "capacity", None)
    return (
        kind,
        barrier.x / near,
        np.log(max(tall, 0.1)) / HEIGHT,
        np.log(max(size, 0.1)) / SIZE_LENGTHS,
        np.log(named or 1.0) / CLASS,
    )
