"""Sites of episodes, fixed or drawn from a split or list, and the slots that actions fill.

The slots have the same width for all sites of an environment, even if some lack mesh.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigdda import BadInput, Barrier, Layout, Site, check, sites
from rigdda.barriers import KINDS as ALL
from rigdda.envs.encoding import SLOT_NUMBERS, Floats, built_and_dropped, encode, slot_size
from rigdda.envs.problem import (
    CHECKS,
    FIDELITIES,
    MOST_BARRIERS,
    DesignProblem,
    Targets,
    checked_cost,
    read_targets,
)
from rigdda.envs.problem import USUAL_KINDS as USUAL

Place = str | os.PathLike[str] | Site
"""Name of a built-in or generated site, a TOML file, a `Site`, or a split; see `drawn_from`."""

Places = Place | Sequence[Place]
"""A place, or a sequence of sites."""

RANDOM_ALIAS = "random"
"""Alias of the split "train"."""

SPLITS = sites.SPLITS
"""Splits of the generated sites."""

MOST_PROBLEMS = 512
"""Number of problems kept in memory, because checking a site takes longer than an episode."""


MESH = "mesh"
"""The kind of barrier that only some sites offer."""

REMOVAL = "removal"
"""The kind that only sites with removable barriers offer."""

SAMPLED_KINDS = (*USUAL, MESH)
"""Default kinds of barrier if every episode draws its site: all but removal and the rigid wall."""


@dataclass(frozen=True)
class Slots:
    """A number of slots for barriers of some kinds.

    On a site without mesh options the score of mesh is ignored.
    """

    kinds: tuple[str, ...]
    count: int

    @property
    def width(self) -> int:
        """Length of a slot."""
        return slot_size(self.kinds)

    @property
    def size(self) -> int:
        """Length of all slots together."""
        return self.count * self.width

    def shared(self, site: Site) -> tuple[str, ...]:
        """Return the kinds available on a site; all kinds if none would be left."""
        return offered(site, self.kinds) or self.kinds

    def decode(self, problem: DesignProblem, numbers: Floats) -> Layout:
        """Return the layout of the first slots; the others are empty."""
        return problem.decode(self._vector(problem, numbers))

    def dropped(self, problem: DesignProblem, numbers: Floats) -> tuple[str, ...]:
        """Return the barriers that the first slots request but that are not built, with reasons."""
        return problem.dropped(self._vector(problem, numbers))

    def built(self, problem: DesignProblem, numbers: Floats) -> tuple[list[Barrier], list[str]]:
        """Return the barriers in the order of the slots, and the dropped ones with reasons."""
        vector = self._vector(problem, numbers)
        return built_and_dropped(problem.place, vector, problem.kinds)

    def _vector(self, problem: DesignProblem, numbers: Floats) -> Floats:
        """Return the vector of the problem for the first slots; the others are empty."""
        used = numbers.reshape(-1, self.width)
        vector = np.full((problem.max_barriers, slot_size(problem.kinds)), -1.0)
        vector[: len(used)] = used[:, self._columns(problem.kinds)]
        return vector.ravel()

    def encode(self, problem: DesignProblem, layout: Layout) -> Floats:
        """Return the numbers of all slots that `decode` turns into `layout`."""
        place, slots, kinds = problem.place, problem.max_barriers, problem.kinds
        vector = encode(place, layout, slots, kinds).reshape(slots, -1)
        numbers = np.full((self.count, self.width), -1.0)
        numbers[:, self._columns(problem.kinds)] = vector
        return numbers.ravel()

    def _columns(self, kinds: Sequence[str]) -> list[int]:
        """Return the columns of a slot that a problem with these kinds uses."""
        scores = [SLOT_NUMBERS + self.kinds.index(kind) for kind in kinds]
        return [*range(SLOT_NUMBERS), *(scores if len(kinds) > 1 else [])]


def offered(site: Site, kinds: Sequence[str]) -> tuple[str, ...]:
    """Return those of some kinds that a site offers."""
    lacks = {*(() if site.meshes else (MESH,)), *(() if site.removals else (REMOVAL,))}
    return tuple(kind for kind in kinds if kind not in lacks)


def check_offered(places: Sequence[Place], kinds: Sequence[str]) -> None:
    """Check that every site offers at least one of some kinds.

    Sites are only loaded if there are no other kinds than those that some sites lack.

    Raises
    ------
    BadInput
        If a site offers none of them.
    """
    if not set(kinds) <= {MESH, REMOVAL}:
        return
    for place in places:
        site = place if isinstance(place, Site) else Site.load(place)
        if not offered(site, kinds):
            hint = f"add a kind that every site offers: {site.name} offers no {' or '.join(kinds)}"
            raise BadInput("kinds", kinds, hint)


def named(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the validated names of kinds of barrier.

    Raises
    ------
    BadInput
        If they are not a sequence of distinct names of kinds.
    """
    if isinstance(kinds, str) or not isinstance(kinds, Sequence):
        raise BadInput("kinds", kinds, "give a sequence of names")
    names = tuple(check.one_of("kinds", kind, ALL) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    return names


@lru_cache
def _split(name: str) -> tuple[str, ...]:
    return tuple(sites.split(name))


def drawn_from(site: Places) -> tuple[Place, ...]:
    """Return the sites of a split or sequence, of which each episode draws one.

    The result is empty if `site` is a single site.

    Raises
    ------
    BadInput
        If it is none of these.
    """
    if isinstance(site, str) and site in (RANDOM_ALIAS, *SPLITS):
        return _split("train" if site == RANDOM_ALIAS else site)
    if isinstance(site, str | os.PathLike | Site):
        return ()
    if not isinstance(site, Sequence) or not site:
        raise BadInput("site", site, "give a site, a split, or a sequence of sites")
    for i, place in enumerate(site):
        if not isinstance(place, str | os.PathLike | Site) or drawn_from(place):
            raise BadInput(f"site[{i}]", place, "give a name, a TOML file or a rigdda.Site")
    return tuple(site)


def problem_of(
    site: Place,
    slots: int,
    kinds: Sequence[str] | None,
    fidelity: str,
    targets: Targets | None = None,
    max_cost: float | None = None,
    checks: str = "reported",
) -> DesignProblem:
    """Return the design problem of a site; problems of named sites are cached.

    Raises
    ------
    BadInput
        As `DesignProblem` does.
    """
    count = check.integer("max_barriers", slots, 1, MOST_BARRIERS)  # 3.0 would find 3 in the cache
    if isinstance(site, str) and not os.path.exists(site) and isinstance(kinds, tuple | None):
        return _named(site, count, kinds, fidelity, targets, max_cost, checks)
    return DesignProblem(site, count, kinds, targets, fidelity, None, max_cost, checks)


@lru_cache(MOST_PROBLEMS)
def _named(
    site: str,
    slots: int,
    kinds: tuple[str, ...] | None,
    fidelity: str,
    targets: Targets | None,
    max_cost: float | None,
    checks: str,
) -> DesignProblem:
    return DesignProblem(site, slots, kinds, targets, fidelity, None, max_cost, checks)


class EpisodeSites:
    """Sites of the episodes of an environment, and the slots that its actions fill.

    Parameters
    ----------
    site : Places
        A site, a split, or a sequence of sites.
    max_barriers, kinds, fidelity, targets, max_cost, checks
        As for `DesignProblem`; if every episode draws its site, the default of `kinds` is
        `SAMPLED_KINDS`.

    Attributes
    ----------
    home : DesignProblem or None
        Problem of every episode; None if each draws its own.
    first : DesignProblem
        One of the problems.
    slots : Slots
        Slots of the actions.

    Raises
    ------
    BadInput
        As `DesignProblem` does, and if a site that may be drawn offers none of the kinds.
    """

    def __init__(
        self,
        site: Places,
        max_barriers: int,
        kinds: Sequence[str] | None,
        fidelity: str,
        targets: Targets | Mapping[str, float | None] | None = None,
        max_cost: float | None = None,
        checks: str = "reported",
    ):
        self.targets, self.max_cost = read_targets(targets), checked_cost(max_cost)
        self.checks = check.one_of("checks", checks, CHECKS)
        self.fidelity = check.one_of("fidelity", fidelity, FIDELITIES)
        self.home: DesignProblem | None = None
        self._drawn = drawn_from(site)
        if self._drawn:
            self.slots = Slots(named(SAMPLED_KINDS if kinds is None else kinds), max_barriers)
            self.first = self.problem_of(self._drawn[0])
            if isinstance(site, str):
                check_offered(self._drawn, self.slots.kinds)
            else:
                self._check(self._drawn[1:])
        else:
            assert isinstance(site, str | os.PathLike | Site)
            limits = self.targets, self.max_cost, self.checks
            self.first = self.home = problem_of(site, max_barriers, kinds, fidelity, *limits)
            self.slots = Slots(self.first.kinds, max_barriers)

    def problem_of(self, site: Place) -> DesignProblem:
        """Return the problem of a site with those kinds that the site offers."""
        count = self.slots.count
        whole = problem_of(site, count, None, self.fidelity)
        kinds = self.slots.shared(whole.site)
        limits = self.targets, self.max_cost, self.checks
        return problem_of(site, count, kinds, self.fidelity, *limits)

    def _check(self, places: Sequence[Place]) -> None:
        """Raise an error if there is no problem of one of some sites."""
        for i, place in enumerate(places, 1):
            try:
                self.problem_of(place)
            except BadInput as bad:
                raise BadInput(f"site[{i}].{bad.field}", bad.value, bad.hint) from None

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any] | None) -> DesignProblem:
        """Return the problem of an episode; `options` may specify its site.

        Raises
        ------
        BadInput
            If there is no such site, one that may be drawn offers none of the kinds, or `options`
            has other keys.
        """
        if options is not None and not isinstance(options, Mapping):
            raise BadInput("options", options, "give a mapping, such as {'site': 'quick'}")
        unknown = [name for name in options or () if name != "site"]
        if unknown:
            raise BadInput("options", unknown, "the only option is site")
        site: Any = (options or {}).get("site")
        if site is None and self.home is not None:
            return self.home
        names = self._drawn if site is None else drawn_from(site)
        if site is not None:
            check_offered(names, self.slots.kinds)
        return self.problem_of(names[int(rng.integers(len(names)))] if names else site)
