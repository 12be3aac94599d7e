"""Barrier design as an optimisation problem: vectors, layouts, and what a layout is worth."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Barrier, Layout, Outcome, Site, check
from rigdda.envs import encoding, ensemble, estimator, plan, posing, reuse
from rigdda.envs.building import Room
from rigdda.envs.evaluation import Evaluation
from rigdda.envs.memory import fingerprint
from rigdda.envs.samples import Sample
from rigdda.envs.targets import Targets
from rigdda.model.place import BarrierZone

Floats = NDArray[np.float64]
Ask = tuple[Sequence[Barrier], Mapping[str, Sequence[int]]]


@dataclass(frozen=True, slots=True, init=False)
class DesignProblem:
    """Which barriers to put where on a site, so that a year costs least.

    Z [EUR per metre of road and year] = what the barriers cost a year + expected harm on the road +
    expected repair, see `rigdda.envs.estimator`.

    Parameters
    ----------
    site : str, path or Site
        Name of a built-in or generated site, a TOML file or the site itself.
    max_barriers : int
        Slots for barriers; each may be empty.
    kinds : sequence of str, optional
        Kinds of barrier to choose from: "fence", "ditch", "embankment", "gravity_wall", "mesh",
        "wall"; None: all but the last, mesh where the site has options.
    targets : Targets, optional
        What is asked of the design events beside a low cost.
    fidelity : {"full", "fast"}
        At "fast" a cheaper site stands for it, see `rigdda.envs.fidelity`.
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
        targets: Targets | None = None,
        fidelity: str = "full",
        zone: tuple[float, float] | None = None,
    ):
        where = posing.site(site, fidelity)
        limits = posing.zone(where, zone)
        values = {
            "site": where,
            "max_barriers": check.integer("max_barriers", max_barriers, 1, posing.MOST_BARRIERS),
            "kinds": posing.kinds(where, kinds),
            "targets": posing.targets(where, targets),
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
        """Return the event of each release: of a part of the seeds, a part (`rigdda.envs.plan`)."""
        return plan.events(self._known.shares, posing.seeds("seeds", seeds))

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
        standing, drawn = self._standing(layout), posing.seeds("seeds", seeds)
        pairs = zip(drawn, plan.events(self._known.shares, drawn), strict=True)
        jobs = [(self.site, standing, seed, event) for seed, event in pairs]
        return self.judge(standing, reuse.outcomes(jobs, executor), drawn)

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
                drawn = posing.seeds(f"seeds[{event!r}]", seeds, 0)
                jobs += [(self.site, standing, seed, event) for seed in drawn]
            ends.append(len(jobs))
        return reuse.outcomes(jobs, executor).split(ends)

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
        found = estimator.judge(self.site, layout, outcomes, known.facts, known.shares)
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
        """
        return evaluation.gain(self._known.nothing)

    def _state(self, found: Evaluation) -> str | None:
        design = [event.name for event in self.site.events if event.design]
        return self.targets.state(design, found.reach, found.failure)

    def _standing(self, layout: Sequence[Barrier] | ArrayLike) -> Layout:
        """Return the layout of a vector, or one that was checked."""
        if isinstance(layout, np.ndarray) or posing.is_vector(layout):
            return self.decode(layout)  # type: ignore[arg-type]
        return self.check(layout)  # type: ignore[arg-type]  # it says what is wrong
