"""Annual cost of a layout and its parts, with confidence intervals.

`account` computes the cost of each release, `learn` summarises the releases of an event, and
`judge` evaluates a layout: its expected harm, repair cost and capital cost, and the probabilities
that the road is reached and that a barrier fails. The cost of one release is that of `Site.bill`,
and the capital cost per year that of `Site.annual`.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Outcome, Site, display
from rigdda.barriers import describe
from rigdda.envs.intervals import Estimate, Interval, Known, Mean, estimate, mean_cost, pair, total
from rigdda.model.traffic import Traffic
from rigdda.rounding import between


@dataclass(frozen=True, slots=True)
class Risk:
    """Expected consequences for the traffic on the section of a site, each with its 95 % interval.

    Parameters
    ----------
    hit, run_into : Mean
        Vehicles that falling rock hits, and vehicles that run into debris on the road [1/year].
    fatalities : Mean
        Fatalities [1/year].
    per_km : Mean
        Fatalities per km of road [1/year].
    individual : Mean
        Probability per year that a commuter is killed, see `rigdda.model.traffic.Traffic.person`.
    """

    hit: Mean
    run_into: Mean
    fatalities: Mean
    per_km: Mean
    individual: Mean

    @classmethod
    def of(cls, traffic: Traffic, toll: Sequence[Mean]) -> Risk:
        """Return the risk on a section.

        Parameters
        ----------
        traffic : Traffic
            The traffic.
        toll : three Mean
            Vehicles hit, vehicles that run into debris and fatalities per metre of road and year.
        """
        hit, run_into, fatalities = (mean.times(traffic.section_length) for mean in toll)
        individual = fatalities.times(traffic.person)
        return cls(hit, run_into, fatalities, toll[2].times(1000.0), individual)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Evaluation of a layout on a set of releases.

    Parameters
    ----------
    layout : tuple of Barrier
        The barriers.
    seeds : tuple of int
        Seed of each release, in the order of `outcomes`; empty if they are not kept.
    objective, ci : float, (float, float)
        Z and its 95 % interval [EUR per metre of road and year]. With fewer than two releases per
        event, Z, `harm` and `debris` may be negative, because known barrier-free costs are used as
        a control variate.
    capital, harm, repair : float
        The parts of Z: annual cost of the barriers, expected harm on the road, and expected cost of
        repairing and emptying the barriers.
    harm_ci, repair_ci : (float, float)
        Their 95 % intervals.
    cost : float
        Capital cost of the layout [EUR per metre of road].
    debris, debris_ci : float, (float, float)
        Expected volume of rock that reaches the road, and its interval [m3 per metre of road and
        year].
    debris_share : float
        `debris` divided by its value without barriers [-]; 0 if no rock reaches the road without
        barriers, NaN if that is not known.
    reach, failure : dict of str to Estimate
        For each event the probability that a block reaches the road, and that a barrier fails.
    by_event : dict of str to float
        Expected harm and repair cost due to each event [EUR per metre of road and year].
    targets : {"met", "missed", "undecided"} or None
        Whether the layout meets the targets; None if there are no targets.
    outcomes : tuple of Outcome
        One for each release; empty if they are not kept.
    releases, simulated : int
        Number of releases, and how many of them were simulated for this evaluation; the others came
        from the outcome cache. `simulated` is ignored in comparisons.
    seconds : float
        Processor time of the simulations [s], NaN if an executor ran them; ignored in comparisons.
    risk : Risk or None
        Risk to the traffic; None if the site has no `[traffic]`.
    """

    layout: Layout
    seeds: tuple[int, ...]
    objective: float
    ci: Interval
    capital: float
    harm: float
    harm_ci: Interval
    repair: float
    repair_ci: Interval
    cost: float
    debris: float
    debris_ci: Interval
    debris_share: float
    reach: dict[str, Estimate]
    failure: dict[str, Estimate]
    by_event: dict[str, float]
    targets: str | None
    outcomes: tuple[Outcome, ...]
    releases: int
    simulated: int = field(default=0, compare=False)
    seconds: float = field(default=0.0, compare=False)
    risk: Risk | None = None

    @property
    def typical(self) -> tuple[int, str]:
        """Seed and event of a representative release.

        The event is the one that contributes most to Z. Of its releases, the one whose volume on
        the road is closest to the mean of the event is chosen; ties go to the first.

        Raises
        ------
        BadInput
            If the evaluation has no seeds or no outcomes.
        """
        if not self.outcomes or len(self.seeds) != len(self.outcomes):
            raise BadInput(
                "seeds", self.seeds, "evaluate the layout with seeds and keep the outcomes"
            )
        seen = {outcome.event for outcome in self.outcomes}
        event = max(seen, key=lambda name: (self.by_event[name], name))
        own = [i for i, outcome in enumerate(self.outcomes) if outcome.event == event]
        volume = np.array([self.outcomes[i].road_volume for i in own])
        return self.seeds[own[int(np.argmin(np.abs(volume - volume.mean())))]], event

    def _repr_html_(self) -> str:
        """Return the results as an HTML table for notebooks."""
        unit = "EUR per metre and year"
        rows = [
            ("Z", f"{self.objective:,.1f}", _span(self.ci), unit),
            ("capital and upkeep", f"{self.capital:,.1f}", "", unit),
            ("harm on the road", f"{self.harm:,.1f}", _span(self.harm_ci), unit),
            ("repair", f"{self.repair:,.1f}", _span(self.repair_ci), unit),
            ("cost to build", f"{self.cost:,.0f}", "", "EUR per metre"),
            ("rock on the road", f"{self.debris:.3g}", _span(self.debris_ci, ".3g"),
             "m3 per metre and year"),
        ]  # fmt: skip
        for words, seen in (("reaches the road", self.reach), ("a barrier fails", self.failure)):
            for event, chance in seen.items():
                ends = _span((100.0 * chance.low, 100.0 * chance.high), ".1f")
                share = f"{100.0 * chance.probability:.1f}" if chance.releases else ""
                rows.append((f"{event}: {words}", share, ends, "% of releases"))
        if self.risk is not None:
            for words, mean, unit in (
                ("vehicles hit", self.risk.hit, "1/year"),
                ("vehicles that run into debris", self.risk.run_into, "1/year"),
                ("fatalities", self.risk.fatalities, "1/year"),
                ("individual risk of a commuter", self.risk.individual, "1/year"),
            ):
                rows.append((words, f"{mean.value:.2g}", _span(mean.interval, ".2g"), unit))
        if self.targets is not None:
            rows.append(("targets", self.targets, "", ""))
        rows.append(("releases", f"{self.releases:,}", "", ""))
        words = "; ".join(map(describe, self.layout)) or "no added barrier"
        head = ("", "mean", "95 % interval", "unit")
        return f"<p>{html.escape(words)}</p>" + display.table(head, rows)

    def gain(self, nothing: Evaluation) -> float:
        """Return the relative reduction of Z; see `DesignProblem.reward`."""
        if nothing.objective > 0.0:
            return (nothing.objective - self.objective) / nothing.objective
        if self.objective > 0.0:
            return -1.0
        return 1.0 - self.debris_share if nothing.debris else 0.0


def _span(ends: Interval, form: str = ",.1f") -> str:
    """Return an interval as text, its ends rounded outward; empty if an end is not finite."""
    low, high = ends
    return between(low, high, form) if math.isfinite(high - low) else ""


@dataclass(frozen=True, slots=True)
class Facts:
    """Statistics of an event from releases without barriers.

    Parameters
    ----------
    releases, reached : int
        Number of releases, and the number in which a block reached the road.
    harm, volume : Known
        Harm [EUR] and volume [m3] given that a block reached the road. If none did, they are
        computed as if all released rock had reached it.
    blocks, width : float
        Mean number of blocks per release, and mean width of a release [m].
    toll : tuple of Known
        Vehicles hit, vehicles that run into debris and fatalities given that any are, computed as
        harm is; empty if the site has no `[traffic]`.
    toll_counts : tuple of int
        Number of releases with each of them.
    """

    releases: int
    reached: int
    harm: Known
    volume: Known
    blocks: float
    width: float
    toll: tuple[Known, ...] = ()
    toll_counts: tuple[int, ...] = ()

    @property
    def debris(self) -> float:
        """Mean volume of rock on the road per release [m3]."""
        return self.volume.mean * self.reached / self.releases


Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Account:
    """Costs and outcomes of the releases of one layout, as arrays of shape (n,).

    `toll` has the columns vehicles hit, vehicles that run into debris and fatalities, (n, 3); None
    if the site has no `[traffic]`.
    """

    event: NDArray[np.str_]
    harm: Floats
    repair: Floats
    volume: Floats
    reached: Bools
    failed: Bools
    toll: Floats | None = None

    def of(self, which: Bools) -> Account:
        """Return the account of a selection of the releases."""
        return Account(
            self.event[which],
            self.harm[which],
            self.repair[which],
            self.volume[which],
            self.reached[which],
            self.failed[which],
            None if self.toll is None else self.toll[which],
        )

    @classmethod
    def join(cls, parts: Sequence[Account]) -> Account:
        """Return the account of the releases of several accounts, one after another."""

        def column(name: str) -> Any:
            return np.concatenate([getattr(part, name) for part in parts])

        return cls(
            column("event"),
            column("harm"),
            column("repair"),
            column("volume"),
            column("reached"),
            column("failed"),
            None if parts[0].toll is None else column("toll"),
        )


def account(site: Site, layout: Layout, outcomes: Sequence[Outcome]) -> Account:
    """Return the costs and outcomes of each release."""
    bills = [site.bill(layout, outcome) for outcome in outcomes]
    return Account(
        event=np.array([outcome.event for outcome in outcomes]),
        harm=np.array([bill.harm for bill in bills]),
        repair=np.array([bill.repair for bill in bills]),
        volume=np.array([outcome.road_volume for outcome in outcomes]),
        reached=np.array([outcome.reached for outcome in outcomes], dtype=bool),
        failed=np.array([any(b.failed for b in o.barriers) for o in outcomes], dtype=bool),
        toll=None
        if site.traffic is None
        else np.array(
            [site.traffic_consequences(layout, outcome) for outcome in outcomes], dtype=np.float64
        ),
    )


def learn(site: Site, own: Account, released: Floats, widths: Floats, blocks: float) -> Facts:
    """Return the statistics of an event from its releases.

    If no block reached the road, harm, volume and the toll are computed as if all released rock had
    reached it and lay there: zero occurrences in n releases do not prove that the event is
    harmless.

    Parameters
    ----------
    site : Site
        The site.
    own : Account
        The account of the releases of the event.
    released : (n,) array
        Volume of rock in each release [m3].
    widths : (n,) array
        Width of each release [m].
    blocks : float
        Mean number of blocks.
    """
    harm, volume = own.harm[own.reached], own.volume[own.reached]
    toll = None if own.toll is None else own.toll[own.reached]
    toll_counts = () if toll is None else tuple((toll > 0.0).sum(axis=0).tolist())
    if not len(harm):
        volume = released
        harm = np.array([site.consequences.harm(v, True) for v in volume.tolist()])
        if site.traffic is not None:
            ones = np.ones(len(released), dtype=bool)
            toll = np.column_stack(
                site.traffic.consequences(ones, ones, widths, volume, np.full(len(ones), np.inf))
            )
            harm = harm + site.traffic.price(toll[:, 2])
    tolls = () if toll is None else tuple(map(_known_of, toll.T))
    count = len(own.harm), int(own.reached.sum())
    width = float(widths.mean())
    return Facts(*count, Known.of(harm), Known.of(volume), blocks, width, tolls, toll_counts)


def _known_of(values: Floats) -> Known:
    """Return the statistics of the values above 0."""
    return Known.of(values[values > 0.0]) if (values > 0.0).any() else Known(0.0, 0.0)


REPAIR_VARIATION = 0.2
"""Coefficient of variation of the repair cost of a failed barrier [-]. It is small, because a
barrier is repaired over the width of the event, or over its least unit of repair if that is
longer."""


@dataclass(frozen=True, slots=True)
class Sums:
    """Expected values for a layout, in EUR and m3 per metre of road and year."""

    harm: Mean
    repair: Mean
    both: Mean
    volume: Mean
    by_event: dict[str, float]
    toll: tuple[Mean, ...] = ()
    """Vehicles hit, vehicles that run into debris and fatalities; empty without `[traffic]`."""


def judge(
    site: Site,
    layout: Layout,
    outcomes: Sequence[Outcome],
    facts: Mapping[str, Facts],
    shares: Mapping[str, float],
) -> Evaluation:
    """Return the evaluation of a layout from the outcomes of its releases; targets are ignored.

    Parameters
    ----------
    site, layout : Site, tuple of Barrier
        The site and the layout.
    outcomes : sequence of Outcome
        Either at least two per event on average with every event present, or fewer, whose events
        were drawn with the probabilities `shares`.
    facts : mapping of str to Facts
        Barrier-free statistics of each event. Those of some events may be left out if there are at
        least two releases per event; intervals of rare harm are then too short, and `debris_share`
        is NaN.
    shares : mapping of str to float
        Probability of each event.

    Raises
    ------
    BadInput
        If there are no releases, or none of an event with a non-zero rate.
    """
    if not len(outcomes):
        raise BadInput("outcomes", outcomes, "give at least one")
    judged = judge_account(site, layout, account(site, layout, outcomes), facts, shares)
    return replace(judged, outcomes=tuple(outcomes))


def judge_account(
    site: Site,
    layout: Layout,
    found: Account,
    facts: Mapping[str, Facts],
    shares: Mapping[str, float],
) -> Evaluation:
    """Return the evaluation of a layout from the account of its releases; see `judge`.

    It has no outcomes.

    Raises
    ------
    BadInput
        If there are no releases of an event with a non-zero rate.
    """
    names, count = site.event_names, len(found.event)
    if count >= 2 * len(names):
        sums = stratified(site, layout, found, facts)
    else:
        sums = _weighted(site, layout, found, facts, shares)
    annual = site.annual(layout)
    rates = {name: site.rate(name) for name in names if site.rate(name) > 0.0}
    without = math.fsum(r * (facts[n].debris if n in facts else math.nan) for n, r in rates.items())
    share = sums.volume.value / without if without else 0.0
    return Evaluation(
        layout=layout,
        seeds=(),
        objective=annual + sums.both.value,
        ci=(annual + sums.both.low, annual + sums.both.high),
        capital=annual,
        harm=sums.harm.value,
        harm_ci=sums.harm.interval,
        repair=sums.repair.value,
        repair_ci=sums.repair.interval,
        cost=site.capital(layout),
        debris=sums.volume.value,
        debris_ci=sums.volume.interval,
        debris_share=share,
        reach=_probabilities(names, found, found.reached),
        failure=_probabilities(names, found, found.failed),
        by_event=sums.by_event,
        targets=None,
        outcomes=(),
        releases=count,
        risk=Risk.of(site.traffic, sums.toll) if site.traffic is not None else None,
    )


def stratified(site: Site, layout: Layout, found: Account, facts: Mapping[str, Facts]) -> Sums:
    """Return the sums of the event means, each weighted by its annual rate.

    Raises
    ------
    BadInput
        If there are no releases of an event with a non-zero rate.
    """
    parts: list[tuple[Mean, ...]] = []
    tolls: list[tuple[Mean, ...]] = []
    largest_repair = _largest_repairs(site, layout, facts)
    by_event: dict[str, float] = {}
    for name in site.event_names:
        rate, own = site.rate(name, layout), found.of(found.event == name)
        if rate == 0.0:
            by_event[name] = 0.0
            continue
        if not len(own.harm):
            raise BadInput("outcomes", f"none of {name}", "include releases of every event")
        known = facts.get(name)
        parts.append(tuple(part.times(rate) for part in _means(own, known, largest_repair[name])))
        by_event[name] = parts[-1][2].value
        tolls.append(tuple(part.times(rate) for part in toll_means(own, known)))
    harm, repair, both, volume = (total(part[i] for part in parts) for i in range(4))
    toll = tuple(total(column) for column in zip(*tolls, strict=True))
    return Sums(harm, repair, both, volume, by_event, toll)


def _weighted(
    site: Site,
    layout: Layout,
    found: Account,
    facts: Mapping[str, Facts],
    shares: Mapping[str, float],
) -> Sums:
    """Return the sums in which each release is weighted by rate over sampling probability.

    The known barrier-free costs of the events serve as a control variate, so that the sums do not
    depend mainly on which events happened to be drawn. The result may be negative.
    """
    rate = {name: site.rate(name, layout) for name in site.event_names}
    weight = np.array([rate[name] / shares[name] for name in found.event.tolist()])
    drawn = Account(
        found.event,
        weight * found.harm,
        weight * found.repair,
        weight * found.volume,
        found.reached,
        found.failed,
        None if found.toll is None else weight[:, None] * found.toll,
    )
    mixed = _mixture(rate, facts, shares)
    largest_repair = _largest_repairs(site, layout, facts)
    harm, repair, both, volume = _means(
        drawn, mixed, math.fsum(rate[name] * largest_repair[name] for name in rate)
    )
    often = {name: rate[name] * fact.reached / fact.releases for name, fact in facts.items()}
    seen = {n: float((found.event == n).mean()) / shares[n] for n in often}
    unseen_harm = {n: (1.0 - seen[n]) * often[n] * facts[n].harm.mean for n in often}
    unseen_volume = math.fsum((1.0 - seen[n]) * often[n] * facts[n].volume.mean for n in often)
    spent = drawn.harm + drawn.repair
    by_event = {
        n: float(spent[found.event == n].sum() / len(spent)) + unseen_harm[n]
        for n in site.event_names
    }
    correction = math.fsum(unseen_harm.values())
    tolls = []
    for j, mean in enumerate(toll_means(drawn, mixed)):
        unseen_toll = math.fsum(
            (1.0 - seen[n]) * rate[n] * fact.toll[j].mean * fact.toll_counts[j] / fact.releases
            for n, fact in facts.items()
        )
        tolls.append(mean.moved(unseen_toll))
    both = both.moved(correction)
    return Sums(
        harm.moved(correction), repair, both, volume.moved(unseen_volume), by_event, tuple(tolls)
    )


def _mixture(
    rate: Mapping[str, float], facts: Mapping[str, Facts], shares: Mapping[str, float]
) -> Facts:
    """Return the statistics of a release with a random event, weighted by rate over probability."""
    names = list(facts)
    chance = np.array([shares[n] * (facts[n].reached + 0.5) for n in names])
    chance /= np.array([facts[n].releases + 1.0 for n in names])
    weight = np.array([rate[n] / shares[n] for n in names])

    def known(of: Callable[[Facts], Known]) -> Known:
        mean = weight * np.array([of(facts[n]).mean for n in names])
        square = mean**2 * (1.0 + np.array([of(facts[n]).variation for n in names]) ** 2)
        one, two = float(chance @ mean / chance.sum()), float(chance @ square / chance.sum())
        return Known(one, float(np.sqrt(max(two - one * one, 0.0)) / one) if one else 0.0)

    tolls = tuple(
        known(lambda f, j=j: f.toll[j])  # type: ignore[misc]
        for j in range(min(len(fact.toll) for fact in facts.values()))
    )
    return Facts(1, 1, known(lambda f: f.harm), known(lambda f: f.volume), 1.0, 1.0, tolls)


def _means(
    own: Account, known: Facts | None, largest_repair: float
) -> tuple[Mean, Mean, Mean, Mean]:
    """Return the means of harm, repair, their sum and volume over equally weighted releases.

    Harm can occur without a block on the road if a wall slides onto it.
    """
    harm = mean_cost(own.harm, own.reached | (own.harm > 0.0), known.harm if known else None)
    repair = mean_cost(own.repair, own.failed, Known(largest_repair, REPAIR_VARIATION))
    volume = mean_cost(own.volume, own.reached, known.volume if known else None)
    return harm, repair, pair(harm, repair, _correlation(own.harm, own.repair)), volume


def toll_means(own: Account, known: Facts | None) -> tuple[Mean, ...]:
    """Return the means of the columns of the toll over equally weighted releases."""
    if own.toll is None:
        return ()
    before = known.toll if known is not None else (None, None, None)
    pairs = zip(own.toll.T, before, strict=True)
    return tuple(mean_cost(values, values > 0.0, prior) for values, prior in pairs)


def _correlation(one: Floats, two: Floats) -> float:
    """Return the correlation of two costs; 0 if it is negative or undefined."""
    a, b = one - one.mean(), two - two.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return max(float(a @ b) / size, 0.0) if size > 0.0 else 0.0


def _probabilities(names: Sequence[str], found: Account, happened: Bools) -> dict[str, Estimate]:
    """Return the estimated probability of an occurrence for each event."""
    out = {}
    for name in names:
        own = found.event == name
        out[name] = estimate(int((happened & own).sum()), int(own.sum()))
    return out


def _largest_repairs(site: Site, layout: Layout, facts: Mapping[str, Facts]) -> dict[str, float]:
    """Return the repair cost of the most expensive barrier that can fail, for each event [EUR].

    It is repaired over the mean width of the event, but at least over its least unit of repair, as
    in `Site.bill`. The cost is 0 if no barrier can fail.
    """
    prices = [(b.repaired, price) for b, price in site.values(layout).items() if b.fallible]
    widths = {name: facts[name].width if name in facts else 0.0 for name in site.event_names}
    return {
        name: max((price * max(width, least) for least, price in prices), default=0.0)
        for name, width in widths.items()
    }
