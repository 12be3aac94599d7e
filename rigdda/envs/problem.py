"""Barrier design as an optimisation problem: vectors, layouts, evaluation, targets and fidelity.

`Targets` limit the probabilities that the road is reached or a barrier fails. The fidelity selects
whether the site itself is simulated or a cheaper approximation of it. The releases of an evaluation
are distributed over the events of the site.
"""

from __future__ import annotations

import copy
import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Outcome, Site, check, distribution
from rigdda.barriers import KINDS
from rigdda.envs import cost, encoding, ensemble, intervals, outcome_cache
from rigdda.envs.cost import Account, Evaluation, Risk
from rigdda.envs.intervals import Estimate, Mean, total
from rigdda.envs.outcome_cache import Sample, fingerprint
from rigdda.envs.siting import FeasiblePlaces
from rigdda.model.site_tables import BarrierZone
from rigdda.seeds import first_event_generator

MET, MISSED, UNDECIDED = "met", "missed", "undecided"
"""States of targets: the upper bounds of all probabilities and of the individual risk are low
enough; the lower bound of at least one is too high; there are too few releases to decide."""


@dataclass(frozen=True, slots=True)
class Targets:
    """Greatest acceptable probabilities in every design event, and individual risk of all events.

    Probabilities are compared with one-sided 95 % bounds, the individual risk with the ends of its
    95 % interval.

    Parameters
    ----------
    reach : float, optional
        Probability that a block reaches the road.
    failure : float, optional
        Probability that a barrier fails.
    individual : float, optional
        Probability that a commuter is killed within a year, see `rigdda.model.traffic`. The site
        must have a table `[traffic]`.

    Raises
    ------
    BadInput
        If one is not between 0 and 1.
    """

    reach: float | None = None
    failure: float | None = None
    individual: float | None = None

    def __post_init__(self) -> None:
        for name in ("reach", "failure", "individual"):
            value = getattr(self, name)
            if value is not None:
                number = check.number(f"targets.{name}", value, 0.0, 1.0, open_low=True)
                object.__setattr__(self, name, number)

    @property
    def given(self) -> bool:
        """Whether there is any target."""
        return any(t is not None for t in (self.reach, self.failure, self.individual))

    def state(
        self,
        events: Iterable[str],
        reach: Mapping[str, Estimate],
        failure: Mapping[str, Estimate],
        risk: Risk | None,
    ) -> str | None:
        """Return "met", "missed" or "undecided", or None without targets.

        Parameters
        ----------
        events : iterable of str
            The design events.
        reach : mapping of str to Estimate
            Estimates for each event.
        failure : mapping of str to Estimate
            Estimates for each event; empty if no barrier can fail, which meets any target.
        risk : Risk or None
            Risk to the traffic; None only if there is no target `individual`.
        """
        if not self.given:
            return None
        states = {MET} | {
            decide(seen[event], greatest)
            for seen, greatest in ((reach, self.reach), (failure, self.failure))
            if greatest is not None and seen
            for event in events
        }
        if self.individual is not None:
            assert risk is not None, "the target `individual` needs [traffic]"
            states.add(decide_mean(risk.individual, self.individual))
        return next(state for state in (MISSED, UNDECIDED, MET) if state in states)

    def excess(
        self,
        reach: Iterable[Estimate],
        failure: Iterable[Estimate],
        risk: Risk | Mean | None,
        end: End = "upper",
    ) -> float:
        """Return the largest excess over a target [-], 0 if there is none.

        It is computed from upper bounds, estimates or lower bounds, see `end`. For a probability,
        it is the difference from the target; for the individual risk, see `excess`.

        Parameters
        ----------
        reach, failure : iterable of Estimate
            Estimates for the design events. One without releases counts as 1. `failure` is empty if
            no barrier can fail.
        risk : Risk or Mean or None
            Risk to the traffic, or the individual risk itself; None only if there is no target
            `individual`.
        end : {"upper", "value", "lower"}
            What is compared.
        """
        over = [0.0]
        for wanted, seen in ((self.reach, reach), (self.failure, failure)):
            if wanted is not None:
                over += [of_chance(chance, end) - wanted for chance in seen]
        if self.individual is not None:
            assert risk is not None, "the target `individual` needs [traffic]"
            individual = risk.individual if isinstance(risk, Risk) else risk
            over.append(excess(of_mean(individual, end), self.individual))
        return max(over)


def can_fail(site: Site, layout: Layout) -> bool:
    """Return whether a barrier that stands on a site with a layout can fail.

    Ditches, mesh and rigid walls cannot. Existing barriers count if the layout keeps them.
    """
    return any(barrier.fallible for barrier in site.standing(layout))


End = Literal["upper", "value", "lower"]
"""Upper bound of a number, its estimate, or its lower bound."""


def of_chance(chance: Estimate, end: End) -> float:
    """Return a probability or a one-sided 95 % bound of it; without releases, the estimate is 1."""
    value = chance.probability if chance.releases else 1.0
    return {"upper": chance.bound, "value": value, "lower": chance.floor}[end]


def of_mean(mean: Mean, end: End) -> float:
    """Return a mean or an end of its 95 % interval."""
    return {"upper": mean.high, "value": mean.value, "lower": mean.low}[end]


def decide(seen: Estimate, greatest: float) -> str:
    """Return whether a probability is at most `greatest`: "met", "missed" or "undecided"."""
    if seen.bound <= greatest:
        return MET
    return MISSED if seen.floor > greatest else UNDECIDED


def decide_mean(seen: Mean, greatest: float) -> str:
    """Return whether a mean is at most `greatest`: "met", "missed" or "undecided"."""
    if seen.high <= greatest:
        return MET
    return MISSED if seen.low > greatest else UNDECIDED


def excess(value: float, greatest: float) -> float:
    """Return the excess over the greatest acceptable value as a share of the value, 0 to 1 [-].

    With this measure, an individual risk of the order of 1e-6 can be compared with probabilities.
    """
    return max(1.0 - greatest / value, 0.0) if value > 0.0 else 0.0


CHECKS = ("reported", "required")
"""What is done with the checks of barriers: they are reported, or a layout must satisfy them."""

FIDELITIES = ("fast", "full")

FAST_AREA_FACTOR = 1.5
"""Factor by which the mean area of blocks cut by joints is increased at fidelity "fast", so that
there are two thirds as many blocks. A factor of 2 would increase the debris on `quick` by 5 % of
the released mass."""

FAST_DT = 2.5e-2
"""Time step at fidelity "fast", unless that of the site is longer [s]. With 12.5 ms, releases of
single blocks and groups take almost as long as at full fidelity."""


def site_at_fidelity(site: Site, fidelity: str) -> Site:
    """Return the site to simulate at a fidelity.

    "full" returns the site unchanged. "fast" uses fewer, larger blocks in jointed masses and a
    longer time step; other blocks are unchanged. `rigdda fidelity` measures the bias and the
    speed-up on a site.

    Raises
    ------
    BadInput
        If there is no such fidelity.
    """
    if check.one_of("fidelity", fidelity, FIDELITIES) == "full":
        return site
    replace, motion = msgspec.structs.replace, site.motion
    sources = tuple(
        replace(s, block_area=min(FAST_AREA_FACTOR * s.mean_block_area, s.area)) if s.polygon else s
        for s in site.sources
    )
    return replace(site, sources=sources, motion=replace(motion, dt=max(motion.dt, FAST_DT)))


MOST_BARRIERS = 100
"""Maximum number of slots of a layout; a site has room for only a few barriers."""

USUAL_KINDS = tuple(name for name, kind in KINDS.items() if kind.designed and name != "mesh")
"""Default kinds of barrier. Mesh is added on sites that have mesh options, and removal on sites
with existing barriers that may be removed. The rigid wall,
which cannot move, is for experiments only and not included."""


def checked_site(site: object, cheaper: str) -> Site:
    """Return a site, loaded if necessary, at a fidelity; its rates must be those of releases."""
    if isinstance(site, str | os.PathLike):
        site = Site.load(site)
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a name, a TOML file or a rigdda.Site")
    for event in site.events:
        event.check_released()
    return site_at_fidelity(site, cheaper)


def checked_zone(site: Site, zone: object) -> BarrierZone:
    """Return the barrier zone of a site, or the part of it between two chainages."""
    own = site.barrier_zone
    if zone is None:
        return own
    start, end = check.interval("zone", zone, own.start, own.end)
    if start == end:
        raise BadInput("zone", zone, "give two chainages, the first less than the second")
    return msgspec.structs.replace(own, start=start, end=end)


def checked_kinds(site: Site, kinds: Sequence[str] | None) -> tuple[str, ...]:
    """Return the validated kinds of barrier to choose from."""
    if kinds is None:
        mesh = ("mesh",) if site.meshes else ()
        return (*USUAL_KINDS, *mesh, *(("removal",) if site.removals else ()))
    if not isinstance(kinds, Sequence) or isinstance(kinds, str):
        raise BadInput("kinds", kinds, "give a sequence of names")
    names = tuple(check.one_of("kinds", kind, KINDS) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    if "mesh" in names and not site.meshes:
        raise BadInput("kinds", kinds, f"leave mesh out: {site.name} has no options of it")
    if "removal" in names and not site.removals:
        hint = f"leave removal out: {site.name} has no existing barrier with removable = true"
        raise BadInput("kinds", kinds, hint)
    return names


def read_targets(targets: Targets | Mapping[str, float | None] | None) -> Targets:
    """Return targets given as `Targets`, as a mapping, or as None for no targets.

    Raises
    ------
    BadInput
        If they are neither.
    """
    if targets is None:
        return Targets()
    if isinstance(targets, Targets):
        return targets
    if not isinstance(targets, Mapping) or not set(targets) <= {"reach", "failure", "individual"}:
        hint = "give rigdda.envs.Targets(reach=..., failure=..., individual=...), or a mapping"
        raise BadInput("targets", targets, hint)
    return Targets(**targets)


def checked_targets(site: Site, given: Targets | Mapping[str, float | None] | None) -> Targets:
    """Return the validated targets on a site; none by default."""
    targets = read_targets(given)
    if targets.individual is not None and site.traffic is None:
        hint = f"add the table [traffic] to site {site.name}, for the risk to life"
        raise BadInput("targets.individual", targets.individual, hint)
    design = targets.reach is not None or targets.failure is not None
    if design and not any(event.design for event in site.events):
        raise BadInput("targets", targets, f"mark an event of {site.name} with design = true")
    return targets


def checked_cost(max_cost: float | None) -> float | None:
    """Return the validated largest capital cost of a layout [EUR/m]; None for no limit."""
    return None if max_cost is None else check.number("max_cost", max_cost, 0.0, unit="EUR/m")


def checked_seeds(name: str, seeds: Sequence[int], least: int = 1) -> tuple[int, ...]:
    """Return seeds as a tuple of at least `least` distinct whole numbers."""
    try:
        drawn = tuple(check.integer(f"{name}[{i}]", seed, 0) for i, seed in enumerate(seeds))
    except TypeError:
        raise BadInput(name, seeds, "give a sequence of whole numbers") from None
    if len(drawn) < least:
        raise BadInput(name, drawn, "give at least one")
    if len(set(drawn)) < len(drawn):
        raise BadInput(name, drawn, "give each once: the same seed gives the same release")
    return drawn


def is_vector(layout: object) -> bool:
    """Return whether `layout` is a sequence that begins with a number."""
    if not isinstance(layout, Sequence) or len(layout) == 0:
        return False
    return isinstance(layout[0], int | float | np.number)


GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Golden ratio minus 1. Points at multiples of it, modulo 1, are evenly distributed on [0, 1) for
any number of points."""


def events_of_seeds(shares: Mapping[str, float], seeds: Sequence[int]) -> tuple[str, ...]:
    """Return the event of each release; it does not depend on the number of later releases.

    With at least two releases per event on average, each event first gets two releases, and the
    others are distributed so that the counts follow the shares. With fewer, the events are random
    with the shares as probabilities: one uniform number, drawn from the first seed, is advanced in
    steps of `GOLDEN`, so that each release has the correct probabilities and the releases together
    are evenly distributed.

    Parameters
    ----------
    shares : mapping of str to float
        Share of each event; they add up to 1.
    seeds : sequence of int
        Seeds of the releases.
    """
    names = tuple(shares)
    if len(seeds) >= 2 * len(names):
        return tuple(names[i] for i in _order(tuple(shares.values()), len(seeds)))
    edges = np.cumsum(list(shares.values()))[:-1]
    first = first_event_generator(int(seeds[0]), len(names)).random()
    place = (first + GOLDEN * np.arange(len(seeds))) % 1.0
    return tuple(names[i] for i in np.searchsorted(edges, place, side="right"))


def _order(shares: tuple[float, ...], releases: int) -> tuple[int, ...]:
    """Return the index of the event of each release."""
    number = len(shares)
    out = [*range(number), *range(number)]
    counts = [2] * number
    while len(out) < releases:
        lacks = [
            share * (len(out) + 1) - count for share, count in zip(shares, counts, strict=True)
        ]
        most = lacks.index(max(lacks))
        counts[most] += 1
        out.append(most)
    return tuple(out)


Floats = NDArray[np.float64]
Ask = tuple[Sequence[Barrier], Mapping[str, Sequence[int]]]


@dataclass(frozen=True, slots=True, init=False)
class DesignProblem:
    """Barrier design on a site: find the layout with the lowest annual cost.

    Z [EUR per metre of road and year] = annual cost of the barriers + expected harm on the road +
    expected repair cost, see `rigdda.envs.cost`. A layout lists what is built or removed: the
    existing barriers of the site are part of every layout, also of the empty one.

    Parameters
    ----------
    site : str, path or Site
        Name of a built-in or generated site, a TOML file or the site itself.
    max_barriers : int
        Number of slots for barriers; each may be empty.
    kinds : sequence of str, optional
        Kinds of barrier to choose from: "fence", "ditch", "embankment", "gravity_wall", "mesh",
        "wall", "removal". By default all but "wall", "mesh" only on sites with mesh options, and
        "removal" (of an existing barrier) only on sites with removable barriers.
    targets : Targets or mapping, optional
        Greatest acceptable probabilities in the design events and individual risk, such as
        {"reach": 0.01} or {"individual": 1e-6}.
    fidelity : {"full", "fast"}
        "fast" simulates a cheaper approximation of the site, see `site_at_fidelity`.
    zone : (start, end), optional
        Chainages between which barriers may stand [m], within the barrier zone of the site. The
        attribute `zone` is the barrier zone limited to them.
    max_cost : float, optional
        Largest capital cost of a layout [EUR per metre of road]. Layouts that cost more are not
        feasible.
    checks : {"reported", "required"}
        With "required", only layouts are feasible in which every barrier satisfies the checks of
        its kind, such as energy and height of a fence, see `rigdda.envs.barrier_formulas`.

    Raises
    ------
    BadInput
        If there is no such site, or an argument is outside its range.
    """

    site: Site
    max_barriers: int
    kinds: tuple[str, ...]
    targets: Targets
    fidelity: str
    zone: BarrierZone
    max_cost: float | None
    checks: str
    place: FeasiblePlaces = field(compare=False, repr=False)
    key: bytes = field(compare=False, repr=False)

    def __init__(
        self,
        site: str | os.PathLike[str] | Site,
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        targets: Targets | Mapping[str, float | None] | None = None,
        fidelity: str = "full",
        zone: tuple[float, float] | None = None,
        max_cost: float | None = None,
        checks: str = "reported",
    ):
        where = checked_site(site, fidelity)
        limits, most = checked_zone(where, zone), checked_cost(max_cost)
        values = {
            "site": where,
            "max_barriers": check.integer("max_barriers", max_barriers, 1, MOST_BARRIERS),
            "kinds": checked_kinds(where, kinds),
            "targets": checked_targets(where, targets),
            "fidelity": fidelity,
            "zone": limits,
            "max_cost": most,
            "checks": check.one_of("checks", checks, CHECKS),
            "place": FeasiblePlaces(where, limits, most, checks),
            "key": fingerprint(where),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        own = self.max_barriers, self.kinds, self.targets, self.zone, self.max_cost, self.checks
        return hash((self.key, *own))

    @property
    def size(self) -> int:
        """Length of a vector: 4 per slot, plus one score for each kind if there are several."""
        return encoding.slot_size(self.kinds) * self.max_barriers

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lower and upper bounds of vectors, -1 and 1, each (size,)."""
        return np.full(self.size, -1.0), np.full(self.size, 1.0)

    def dropped(self, vector: ArrayLike) -> tuple[str, ...]:
        """Return the barriers that a (size,) vector requests but that are not built, with reasons.

        Raises
        ------
        BadInput
            If the vector is invalid.
        """
        values = encoding.vector("vector", vector, self.size)
        return tuple(encoding.built_and_dropped(self.place, values, self.kinds)[1])

    def decode(self, vector: ArrayLike) -> Layout:
        """Return the layout encoded by a (size,) vector, see `rigdda.envs.encoding`.

        Every vector decodes to a feasible layout; entries are clipped to [-1, 1].

        Raises
        ------
        BadInput
            If the shape is wrong or an entry is not a number.
        """
        values = encoding.vector("vector", vector, self.size)
        return encoding.decode(self.place, values, self.kinds)

    def encode(self, layout: Sequence[Barrier]) -> Floats:
        """Return a (size,) vector that `decode` turns into `layout`.

        Raises
        ------
        BadInput
            If `decode` cannot return this layout.
        """
        return encoding.encode(self.place, self.check(layout), self.max_barriers, self.kinds)

    def with_checks(self, checks: str) -> DesignProblem:
        """Return the same problem with checks of barriers that are "reported" or "required"."""
        other = copy.copy(self)
        place = FeasiblePlaces(self.site, self.zone, self.max_cost, checks)
        object.__setattr__(other, "checks", check.one_of("checks", checks, CHECKS))
        object.__setattr__(other, "place", place)
        return other

    def check(self, layout: Sequence[Barrier]) -> Layout:
        """Return a feasible layout, sorted downhill.

        Raises
        ------
        BadInput
            If barriers are too many, of other kinds or too large, outside the zone, on ground that
            is too steep, or too close to the road or to each other, or cost more than `max_cost`,
            or fail a check that is required.
        """
        return self.place.check_layout(layout, self.kinds, self.max_barriers)

    def fits(self, layout: Sequence[Barrier]) -> bool:
        """Return whether a layout is feasible, see `check`."""
        try:
            self.check(layout)
        except BadInput:
            return False
        return True

    def allocation(self, releases: int, seed: int = 0) -> dict[str, int]:
        """Return the number of releases of each event when `releases` are distributed.

        With at least two releases per event on average each event has two or more; with fewer the
        distribution is random and depends on `seed`.
        """
        first, n = check.integer("seed", seed, 0), check.integer("releases", releases, 1)
        count = Counter(self.plan(range(first, first + n)))
        return {name: count[name] for name in self.site.event_names}

    def plan(self, seeds: Sequence[int]) -> tuple[str, ...]:
        """Return the event of each release; a prefix of the seeds gives a prefix of the events."""
        return events_of_seeds(self.shares, checked_seeds("seeds", seeds))

    @property
    def shares(self) -> dict[str, float]:
        """Share of the releases for each event; they add up to 1."""
        return self._known.planned_shares(self.site)

    @property
    def _known(self) -> ensemble.Ensemble:
        return ensemble.of(self.site, self.key)

    @property
    def nothing(self) -> Evaluation:
        """Evaluation of the empty layout, computed once per site; its outcomes are not kept."""
        return replace(self._known.nothing, targets=self.state(self._known.nothing))

    def evaluate(
        self,
        layout: Sequence[Barrier] | ArrayLike,
        seeds: Sequence[int],
        executor: Executor | None = None,
    ) -> Evaluation:
        """Evaluate a layout by simulating one release per seed, distributed over the events.

        Parameters
        ----------
        layout : sequence of Barrier or (size,) array
            A feasible layout, see `check`, or a vector.
        seeds : sequence of int
            Distinct seeds of the releases.
        executor : Executor, optional
            Where to run the simulations, for example a process pool; by default that of
            `rigdda.distribution.using`, or threads on all cores. The result is the same.

        Raises
        ------
        BadInput
            If the layout is not feasible, or the seeds are invalid.
        Diverged
            If a simulation diverges.
        """
        standing, drawn = self._standing(layout), checked_seeds("seeds", seeds)
        with distribution.using(executor) if executor else nullcontext():
            pairs = zip(drawn, events_of_seeds(self.shares, drawn), strict=True)
            jobs = [(self.site, standing, seed, event) for seed, event in pairs]
            return self.judge(standing, outcome_cache.outcomes(jobs), drawn)

    def sample(self, layout: Sequence[Barrier], seeds: Mapping[str, Sequence[int]]) -> Sample:
        """Return the outcomes of releases of chosen events, in the order of `seeds`.

        Raises
        ------
        BadInput, Diverged
            As `evaluate` does, and if there is no such event.
        """
        return self.sample_many([(layout, seeds)])[0]

    def sample_many(self, asks: Sequence[Ask]) -> list[Sample]:
        """Return the samples of several layouts, simulated together; see `sample`.

        The processor time is divided in proportion to the number of simulated releases.
        """
        jobs, ends = [], [0]
        for layout, chosen in asks:
            standing = self.check(layout)
            check.mapping("seeds", chosen, Sequence, "sequences of whole numbers")
            for event, seeds in chosen.items():
                self.site.event(event)
                drawn = checked_seeds(f"seeds[{event!r}]", seeds, 0)
                jobs += [(self.site, standing, seed, event) for seed in drawn]
            ends.append(len(jobs))
        return outcome_cache.outcomes(jobs).split(ends)

    def judge(
        self, layout: Layout, outcomes: Sequence[Outcome], seeds: Sequence[int] = ()
    ) -> Evaluation:
        """Return the evaluation of a layout from its outcomes.

        There must be at least one outcome of every event; fewer than two per event on average must
        come from a `plan`. `seeds` are stored in the evaluation.

        Raises
        ------
        BadInput
            If there are no outcomes, or none of an event with a non-zero rate.
        """
        found = cost.judge(self.site, layout, outcomes, self._known.facts, self.shares)
        return replace(
            found,
            seeds=tuple(seeds),
            targets=self.state(found),
            simulated=getattr(outcomes, "simulated", len(outcomes)),
            seconds=getattr(outcomes, "seconds", 0.0),
        )

    def judge_account(self, layout: Layout, found: Account) -> Evaluation:
        """Return the evaluation of a layout from the account of its releases; see `judge`.

        Raises
        ------
        BadInput
            If there are no releases of an event with a non-zero rate.
        """
        judged = cost.judge_account(self.site, layout, found, self._known.facts, self.shares)
        return replace(judged, targets=self.state(judged))

    def reward(self, evaluation: Evaluation) -> float:
        """Return the reduction of Z divided by Z without barriers.

        If Z is 0 both without barriers and for the layout, it is the share of debris kept off the
        road, or 0 if none reaches it without barriers. If only Z without barriers is 0, it is -1.
        If the layout misses a target, it is -1 minus the greatest excess over a target, regardless
        of cost, see `Targets.excess`. Events without releases do not count.
        """
        if evaluation.targets == MISSED:
            reach, failure = (
                [chance for chance in chances if chance.releases]
                for chances in self._chances(evaluation)
            )
            return -1.0 - self.targets.excess(reach, failure, evaluation.risk, "value")
        return evaluation.gain(self._known.nothing)

    def excess(self, evaluation: Evaluation, end: End = "upper") -> float:
        """Return the largest excess of an evaluation over a target, see `Targets.excess` [-]."""
        return self.targets.excess(*self._chances(evaluation), evaluation.risk, end)

    @property
    def _design_events(self) -> list[str]:
        return [event.name for event in self.site.events if event.design]

    def state(self, found: Evaluation) -> str | None:
        """Return whether an evaluation meets the targets; None without targets."""
        failure = found.failure if can_fail(self.site, found.layout) else {}
        return self.targets.state(self._design_events, found.reach, failure, found.risk)

    def _chances(self, found: Evaluation) -> tuple[list[Estimate], list[Estimate]]:
        """Return the probabilities of reach and of failure in the design events.

        There are none of failure if no barrier can fail.
        """
        failure = self._design_events if can_fail(self.site, found.layout) else []
        return (
            [found.reach[name] for name in self._design_events],
            [found.failure[name] for name in failure],
        )

    def individual_risk(self, layout: Layout, fatalities: Mapping[str, Sequence[float]]) -> Mean:
        """Return the individual risk from the fatalities in releases of each event [1/year].

        Parameters
        ----------
        layout : Layout
            The layout.
        fatalities : mapping of str to sequence of float
            Expected fatalities in each release, by name of the event. An event without releases
            has those of releases without barriers.

        Raises
        ------
        BadInput
            If the site has no `[traffic]`, or no event of such a name.
        """
        site, facts = self.site, self._known.facts
        if site.traffic is None:
            raise BadInput("traffic", None, f"add the table [traffic] to site {site.name}")
        for name in fatalities:
            check.one_of("fatalities", name, site.event_names)
        parts = []
        for name in site.event_names:
            fact = facts[name]
            known, own = fact.toll[2], np.array(fatalities.get(name, ()), dtype=np.float64)
            costly = own > 0.0
            if not own.size:
                own, costly = known.sample(fact.toll_counts[2], fact.releases)
            mean = intervals.mean_cost(own, costly, known)
            parts.append(mean.times(site.rate(name, layout)))
        return total(parts).times(site.traffic.section_length * site.traffic.person)

    def _standing(self, layout: Sequence[Barrier] | ArrayLike) -> Layout:
        """Return the layout of a vector, or a checked layout."""
        if isinstance(layout, np.ndarray) or is_vector(layout):
            return self.decode(layout)  # type: ignore[arg-type]
        return self.check(layout)  # type: ignore[arg-type]  # raises if it is not a layout
