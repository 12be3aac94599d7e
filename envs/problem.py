"""Barrier design as an optimisation problem: vectors, layouts, and what a layout is worth.

Targets ask something of a layout beside a low cost. Fidelity says whether a site is simulated as it
is or by a cheaper one that stands for it. Releases of an evaluation spread over the events of the
site.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Outcome, Site, check
from rigdda.barriers import KINDS
from rigdda.envs import cost, encoding, ensemble, outcome_cache
from rigdda.envs.cost import Evaluation
from rigdda.envs.intervals import Estimate
from rigdda.envs.outcome_cache import Sample, fingerprint
from rigdda.envs.siting import Room
from rigdda.model.site_tables import BarrierZone

MET, MISSED, UNDECIDED = "met", "missed", "undecided"
"""What targets are: the upper bounds of all probabilities are low enough; the lower bound of one is
too high; there are too few releases to say."""


@dataclass(frozen=True, slots=True)
class Targets:
    """Greatest probabilities in every design event, asked of one-sided 95 % bounds.

    Parameters
    ----------
    reach : float, optional
        Of a block that comes onto the road.
    failure : float, optional
        Of a barrier that fails.

    Raises
    ------
    BadInput
        If one is not between 0 and 1.
    """

    reach: float | None = None
    failure: float | None = None

    def __post_init__(self) -> None:
        for name in ("reach", "failure"):
            value = getattr(self, name)
            if value is not None:
                number = check.number(f"targets.{name}", value, 0.0, 1.0, open_low=True)
                object.__setattr__(self, name, number)

    def state(
        self,
        events: Iterable[str],
        reach: Mapping[str, Estimate],
        failure: Mapping[str, Estimate],
    ) -> str | None:
        """Return "met", "missed" or "undecided" over the design events, None if nothing is asked.

        Parameters
        ----------
        events : iterable of str
            The design events.
        reach, failure : mapping of str to Estimate
            What was seen in each event.
        """
        states = {
            decide(seen[event], greatest)
            for seen, greatest in ((reach, self.reach), (failure, self.failure))
            if greatest is not None
            for event in events
        }
        return next((state for state in (MISSED, UNDECIDED, MET) if state in states), None)


def decide(seen: Estimate, greatest: float) -> str:
    """Return whether a probability is at most `greatest`: "met", "missed" or "undecided"."""
    if seen.bound <= greatest:
        return MET
    return MISSED if seen.floor > greatest else UNDECIDED


FIDELITIES = ("fast", "full")

COARSER = 1.5
"""How much larger the mean area of blocks cut by joints is at fidelity "fast"; so their number
is two thirds. With twice the area the debris on quick is too high by 5 % of the mass."""

FAST_DT = 1.25e-2
"""Time step at fidelity "fast", if the site's is shorter [s]."""


def site_at_fidelity(site: Site, fidelity: str) -> Site:
    """Return the site to simulate.

    "full": as it is; "fast": with fewer, larger blocks of jointed masses and a longer step. Other
    blocks stay as they are. The bias and the gain are measured by `rigdda fidelity` and told in
    docs/fidelity.md.

    Raises
    ------
    BadInput
        If there is no such fidelity.
    """
    if check.one_of("fidelity", fidelity, FIDELITIES) == "full":
        return site
    replace, motion = msgspec.structs.replace, site.motion
    sources = tuple(
        replace(s, block_area=min(COARSER * s.block_area, s.area)) if s.polygon else s
        for s in site.sources
    )
    return replace(site, sources=sources, motion=replace(motion, dt=max(motion.dt, FAST_DT)))


MOST_BARRIERS = 100
"""Most slots of a layout; a site has room for a few."""

USUAL_KINDS = tuple(name for name, kind in KINDS.items() if kind.designed and name != "mesh")
"""Kinds of barrier that are designed if none are named, and mesh where a site has options. Not the
rigid wall, which nothing moves: it is for experiments."""


def checked_site(site: object, cheaper: str) -> Site:
    """Return a site at a fidelity."""
    if isinstance(site, str | os.PathLike):
        site = Site.load(site)
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a name, a TOML file or a rigdda.Site")
    return site_at_fidelity(site, cheaper)


def checked_zone(site: Site, zone: object) -> BarrierZone:
    """Return the zone of a site, or the part of it between two chainages."""
    own = site.barrier_zone
    if zone is None:
        return own
    start, end = check.interval("zone", zone, own.start, own.end)
    if start == end:
        raise BadInput("zone", zone, "give two chainages, the first one less than the other")
    return msgspec.structs.replace(own, start=start, end=end)


def checked_kinds(site: Site, kinds: Sequence[str] | None) -> tuple[str, ...]:
    """Return the kinds of barrier to choose from."""
    if kinds is None:
        return (*USUAL_KINDS, "mesh") if site.meshes else USUAL_KINDS
    if not isinstance(kinds, Sequence) or isinstance(kinds, str):
        raise BadInput("kinds", kinds, "give a sequence of names")
    names = tuple(check.one_of("kinds", kind, KINDS) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    if "mesh" in names and not site.meshes:
        raise BadInput("kinds", kinds, f"leave mesh out: {site.name} has no options of it")
    return names


def read_targets(targets: Targets | Mapping[str, float | None] | None) -> Targets:
    """Return targets that were given as such, or as a mapping of their names to numbers.

    Raises
    ------
    BadInput
        If they are neither.
    """
    if targets is None:
        return Targets()
    if isinstance(targets, Targets):
        return targets
    if not isinstance(targets, Mapping) or not set(targets) <= {"reach", "failure"}:
        mend = "give rigdda.envs.Targets(reach=..., failure=...), or a mapping of these names"
        raise BadInput("targets", targets, mend)
    return Targets(**targets)


def checked_targets(site: Site, given: Targets | Mapping[str, float | None] | None) -> Targets:
    """Return what is asked of a layout on a site: nothing by default."""
    targets = read_targets(given)
    if targets != Targets() and not any(event.design for event in site.events):
        raise BadInput("targets", targets, f"mark an event of {site.name} with design = true")
    return targets


def checked_seeds(name: str, seeds: Sequence[int], least: int = 1) -> tuple[int, ...]:
    """Return seeds as a tuple of at least so many, all different."""
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
    """Tell whether what is to be evaluated begins with a number."""
    return isinstance(layout, Sequence) and len(layout) > 0 and isinstance(layout[0], int | float)


GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Points this far apart on a circle of length 1 spread evenly, however many there are."""


def events_of_seeds(shares: Mapping[str, float], seeds: Sequence[int]) -> tuple[str, ...]:
    """Return the event of each release; the first ones' do not depend on how many follow.

    With at least two releases an event on the average, each event has one, then one more, and then
    as many as its share asks for. With fewer, each draws its event with its share as the chance:
    one number, drawn from the first seed, and steps of `GOLDEN` from it, so that every release
    has the right chances and together they are spread evenly.

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
    first = np.random.default_rng([int(seeds[0]), len(names), 2**31]).random()
    place = (first + GOLDEN * np.arange(len(seeds))) % 1.0
    return tuple(names[i] for i in np.searchsorted(edges, place, side="right"))


@lru_cache(maxsize=256)
def _order(shares: tuple[float, ...], releases: int) -> tuple[int, ...]:
    """Return the place of the event of each release."""
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
    """Which barriers to put where on a site, so that a year costs least.

    Z [EUR per metre of road and year] = what the barriers cost a year + expected harm on the road +
    expected repair, see `rigdda.envs.cost`.

    Parameters
    ----------
    site : str, path or Site
        Name of a built-in or generated site, a TOML file or the site itself.
    max_barriers : int
        Slots for barriers; each may be empty.
    kinds : sequence of str, optional
        Kinds of barrier to choose from: "fence", "ditch", "embankment", "gravity_wall", "mesh",
        "wall"; None: all but the last, mesh where the site has options.
    targets : Targets or mapping, optional
        What is asked of the design events beside a low cost, such as {"reach": 0.01}.
    fidelity : {"full", "fast"}
        At "fast" a cheaper site stands for it, see `rigdda.envs.problem`.
    zone : (start, end), optional
        Chainages between which barriers may stand [m], inside the site's own zone; the attribute
        is that zone so narrowed.

    Raises BadInput if there is no such site, or an argument is outside its range.
    """

    site: Site
    max_barriers: int
    kinds: tuple[str, ...]
    targets: Targets
    fidelity: str
    zone: BarrierZone
    place: Room = field(compare=False, repr=False)
    key: bytes = field(compare=False, repr=False)

    def __init__(
        self,
        site: str | os.PathLike[str] | Site,
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        targets: Targets | Mapping[str, float | None] | None = None,
        fidelity: str = "full",
        zone: tuple[float, float] | None = None,
    ):
        where = checked_site(site, fidelity)
        limits = checked_zone(where, zone)
        values = {
            "site": where,
            "max_barriers": check.integer("max_barriers", max_barriers, 1, MOST_BARRIERS),
            "kinds": checked_kinds(where, kinds),
            "targets": checked_targets(where, targets),
            "fidelity": fidelity,
            "zone": limits,
            "place": Room(where, limits),
            "key": fingerprint(where),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __hash__(self) -> int:
        return hash((self.key, self.max_barriers, self.kinds, self.targets, self.zone))

    @property
    def size(self) -> int:
        """Numbers in a vector: 4 a slot, and a score for each kind if there are several."""
        return encoding.slot_size(self.kinds) * self.max_barriers

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest vector, -1 and 1, each (size,)."""
        return np.full(self.size, -1.0), np.full(self.size, 1.0)

    def dropped(self, vector: ArrayLike) -> tuple[str, ...]:
        """Return which barriers that a (size,) vector asks for are not built, and why.

        Raises BadInput if the vector is unsound.
        """
        values = encoding.vector("vector", vector, self.size)
        return tuple(encoding.built_and_dropped(self.place, values, self.kinds)[1])

    def decode(self, vector: ArrayLike) -> Layout:
        """Return the layout that a (size,) vector stands for, see `rigdda.envs.encoding`.

        Every vector has one, that may be built; entries beyond [-1, 1] are clipped.

        Raises BadInput if the shape is wrong or an entry is not a number.
        """
        values = encoding.vector("vector", vector, self.size)
        return encoding.decode(self.place, values, self.kinds)

    def encode(self, layout: Sequence[Barrier]) -> Floats:
        """Return a (size,) vector that `decode` turns into `layout`.

        Raises BadInput if the layout is not one that `decode` can give.
        """
        return encoding.encode(self.place, self.check(layout), self.max_barriers, self.kinds)

    def check(self, layout: Sequence[Barrier]) -> Layout:
        """Return a layout sorted downhill, if it may be built.

        Raises
        ------
        BadInput
            If barriers are too many, not of the kinds allowed or too large, outside the zone, on
            ground that is too steep, or too near the road or one another.
        """
        return self.place.check_layout(layout, self.kinds, self.max_barriers)

    def fits(self, layout: Sequence[Barrier]) -> bool:
        """Tell whether a layout may be built, see `check`."""
        try:
            self.check(layout)
        except BadInput:
            return False
        return True

    def allocation(self, releases: int, seed: int = 0) -> dict[str, int]:
        """Return how many of some releases each event has, in proportion to what it tells.

        With at least two releases an event each has two or more; with fewer it is by chance, which
        `seed` decides.
        """
        first, n = check.integer("seed", seed, 0), check.integer("releases", releases, 1)
        count = Counter(self.plan(range(first, first + n)))
        return {name: count[name] for name in self.site.event_names}

    def plan(self, seeds: Sequence[int]) -> tuple[str, ...]:
        """Return the event of each release; a part of the seeds has a part of them."""
        return events_of_seeds(self._known.shares, checked_seeds("seeds", seeds))

    @property
    def _known(self) -> ensemble.Ensemble:
        return ensemble.of(self.site, self.key)

    @property
    def nothing(self) -> Evaluation:
        """The layout without barriers, known once a site; its outcomes are not kept."""
        return replace(self._known.nothing, targets=self._state(self._known.nothing))

    def evaluate(
        self,
        layout: Sequence[Barrier] | ArrayLike,
        seeds: Sequence[int],
        executor: Executor | None = None,
    ) -> Evaluation:
        """Simulate a layout in one release for each seed, spread over the events.

        The layout is one that may be built, see `check`, or a (size,) vector. An executor, for
        example a process pool, gives the same numbers as the threads that are used without.

        Raises
        ------
        BadInput
            If the layout may not be built, or the seeds are unsound.
        Diverged
            If a simulation diverges.
        """
        standing, drawn = self._standing(layout), checked_seeds("seeds", seeds)
        pairs = zip(drawn, events_of_seeds(self._known.shares, drawn), strict=True)
        jobs = [(self.site, standing, seed, event) for seed, event in pairs]
        return self.judge(standing, outcome_cache.outcomes(jobs, executor), drawn)

    def sample(
        self,
        layout: Sequence[Barrier],
        seeds: Mapping[str, Sequence[int]],
        executor: Executor | None = None,
    ) -> Sample:
        """Return the outcomes of releases of chosen events, in the order of `seeds`.

        Raises as `evaluate`, and if there is no such event.
        """
        return self.sample_many([(layout, seeds)], executor)[0]

    def sample_many(self, asks: Sequence[Ask], executor: Executor | None = None) -> list[Sample]:
        """Return what `sample` does of several layouts, simulated together.

        The processor time is shared out by the releases that were simulated.
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
        return outcome_cache.outcomes(jobs, executor).split(ends)

    def judge(
        self, layout: Layout, outcomes: Sequence[Outcome], seeds: Sequence[int] = ()
    ) -> Evaluation:
        """Return what a layout is worth that had these outcomes.

        There is at least one of every event; fewer than two an event on the average must be those
        of a `plan`. `seeds` are kept beside them.

        Raises
        ------
        BadInput
            If there are no outcomes, or none of an event that happens.
        """
        known = self._known
        found = cost.judge(self.site, layout, outcomes, known.facts, known.shares)
        without = known.nothing.debris
        return replace(
            found,
            seeds=tuple(seeds),
            debris_share=found.debris / without if without else 0.0,
            targets=self._state(found),
            simulated=getattr(outcomes, "simulated", len(outcomes)),
            seconds=getattr(outcomes, "seconds", 0.0),
        )

    def reward(self, evaluation: Evaluation) -> float:
        """Return the fall of Z over Z of nothing; without prices the share of debris kept off.

        Of a slope from which nothing comes onto the road it is 0, and -1 of whatever is built.
        Of a layout that misses a target it is -1 less the greatest excess of a probability over its
        target, whatever the layout costs.
        """
        if evaluation.targets == MISSED:
            return -1.0 - self._excess(evaluation)
        return evaluation.gain(self._known.nothing)

    def _excess(self, evaluation: Evaluation) -> float:
        """Return the most by which a probability in a design event exceeds its target [-]."""
        return max(
            seen[name].probability - greatest
            for greatest, seen in (
                (self.targets.reach, evaluation.reach),
                (self.targets.failure, evaluation.failure),
            )
            if greatest is not None
            for name in self._design_events
        )

    @property
    def _design_events(self) -> list[str]:
        return [event.name for event in self.site.events if event.design]

    def _state(self, found: Evaluation) -> str | None:
        return self.targets.state(self._design_events, found.reach, found.failure)

    def _standing(self, layout: Sequence[Barrier] | ArrayLike) -> Layout:
        """Return the layout of a vector, or one that was checked."""
        if isinstance(layout, np.ndarray) or is_vector(layout):
            return self.decode(layout)  # type: ignore[arg-type]
        return self.check(layout)  # type: ignore[arg-type]  # it says what is wrong
