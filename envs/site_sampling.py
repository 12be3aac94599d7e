"""Where episodes play and what their actions are: sites of a split, and slots for barriers.

The slots of a problem's vector are of one width for all sites of an environment.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rigdda import BadInput, Layout, Site, check, sites
from rigdda.barriers import KINDS as ALL
from rigdda.envs.encoding import NUMBERS, Floats, encode, slot_size
from rigdda.envs.problem import FIDELITIES, DesignProblem, Targets, read_targets
from rigdda.envs.problem import USUAL_KINDS as USUAL

Place = str | os.PathLike[str] | Site
"""Name of a built-in or generated site, a TOML file, a site, or what `drawn_from` knows."""

RANDOM = "random"
"""Another name of the split "train"."""

SPLITS = ("train", "validation", "test")
"""Splits of the generated sites."""

MOST_POSED = 512
"""Problems that are kept: checking a site takes longer than an episode."""


MESH = "mesh"
"""The kind that only some sites offer."""

KINDS = (*USUAL, MESH)
"""Kinds to choose from where every episode draws its site and none are named."""


@dataclass(frozen=True)
class Slots:
    """So many slots for barriers of these kinds.

    A site without mesh has no use for its score, which is left out there.
    """

    kinds: tuple[str, ...]
    count: int

    @property
    def width(self) -> int:
        """Numbers in a slot."""
        return slot_size(self.kinds)

    @property
    def size(self) -> int:
        """Numbers in all slots."""
        return self.count * self.width

    def shared(self, site: Site) -> tuple[str, ...]:
        """Return the kinds that a site offers, all where that leaves none."""
        offered = tuple(kind for kind in self.kinds if kind != MESH or site.meshes)
        return offered or self.kinds

    def decode(self, problem: DesignProblem, numbers: Floats) -> Layout:
        """Return the layout of the first slots, the others being empty."""
        return problem.decode(self._vector(problem, numbers))

    def dropped(self, problem: DesignProblem, numbers: Floats) -> tuple[str, ...]:
        """Return which barriers that the first slots ask for are not built, and why."""
        return problem.dropped(self._vector(problem, numbers))

    def _vector(self, problem: DesignProblem, numbers: Floats) -> Floats:
        """Return the problem's vector of the first slots, the others being empty."""
        used = numbers.reshape(-1, self.width)
        vector = np.full((problem.max_barriers, slot_size(problem.kinds)), -1.0)
        vector[: len(used)] = used[:, self._columns(problem.kinds)]
        return vector.ravel()

    def encode(self, problem: DesignProblem, layout: Layout) -> Floats:
        """Return the numbers of all slots that `decode` turns into a layout that it gave."""
        place, slots, kinds = problem.place, problem.max_barriers, problem.kinds
        vector = encode(place, layout, slots, kinds).reshape(slots, -1)
        numbers = np.full((self.count, self.width), -1.0)
        numbers[:, self._columns(problem.kinds)] = vector
        return numbers.ravel()

    def _columns(self, kinds: Sequence[str]) -> list[int]:
        """Return which numbers of a slot a problem of these kinds reads."""
        scores = [NUMBERS + self.kinds.index(kind) for kind in kinds]
        return [*range(NUMBERS), *(scores if len(kinds) > 1 else [])]


def named(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the names of kinds of barrier.

    Raises
    ------
    BadInput
        If they are not a sequence of different ones.
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


def drawn_from(site: Place) -> tuple[str, ...]:
    """Return the names of the sites of which every episode draws one, none if `site` is one."""
    if not isinstance(site, str) or site not in (RANDOM, *SPLITS):
        return ()
    return _split("train" if site == RANDOM else site)


def pose(
    site: Place,
    slots: int,
    kinds: Sequence[str] | None,
    fidelity: str,
    targets: Targets | None = None,
) -> DesignProblem:
    """Return the problem of a site; that of a name is made once a process.

    Raises
    ------
    BadInput
        As `DesignProblem` does.
    """
    if isinstance(site, str) and not os.path.exists(site) and isinstance(kinds, tuple | None):
        return _named(site, slots, kinds, fidelity, targets)
    return DesignProblem(site, slots, kinds, targets, fidelity)


@lru_cache(MOST_POSED)
def _named(
    site: str, slots: int, kinds: tuple[str, ...] | None, fidelity: str, targets: Targets | None
) -> DesignProblem:
    return DesignProblem(site, slots, kinds, targets, fidelity)


class Venue:
    """Where an environment's episodes play, and the slots that its actions fill.

    Parameters
    ----------
    site : Place
        Where.
    max_barriers, kinds, fidelity, targets
        As of `DesignProblem`; where every episode draws its site, all kinds by default.

    Attributes
    ----------
    home : DesignProblem or None
        That of every episode, None where each draws its own.
    first : DesignProblem
        One of them.
    slots : Slots
        Of every action.

    Raises
    ------
    BadInput
        As `DesignProblem` does.
    """

    def __init__(
        self,
        site: Place,
        max_barriers: int,
        kinds: Sequence[str] | None,
        fidelity: str,
        targets: Targets | Mapping[str, float | None] | None = None,
    ):
        self.targets = read_targets(targets)
        self.fidelity = check.one_of("fidelity", fidelity, FIDELITIES)
        self.home: DesignProblem | None = None
        self._drawn = drawn_from(site)
        if self._drawn:
            self.slots = Slots(named(KINDS if kinds is None else kinds), max_barriers)
            self.first = self.pose(self._drawn[0])
        else:
            self.first = self.home = pose(site, max_barriers, kinds, fidelity, self.targets)
            self.slots = Slots(self.first.kinds, max_barriers)

    def pose(self, site: Place) -> DesignProblem:
        """Return the problem of a site, of the kinds that it offers."""
        count = self.slots.count
        whole = pose(site, count, None, self.fidelity)
        kinds = self.slots.shared(whole.site)
        return pose(site, count, kinds, self.fidelity, self.targets)

    def settle(self, site: Place) -> None:
        """Play here from the next episode on."""
        self._drawn = drawn_from(site)
        self.home = None if self._drawn else self.pose(site)

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any] | None) -> DesignProblem:
        """Return the problem of an episode; `options` may name its site.

        Raises
        ------
        BadInput
            If there is no such site, or there are other options.
        """
        if options is not None and not isinstance(options, Mapping):
            raise BadInput("options", options, "give a mapping, such as {'site': 'quick'}")
        unknown = [name for name in options or () if name != "site"]
        if unknown:
            raise BadInput("options", unknown, "give nothing but site")
        site: Any = (options or {}).get("site")
        if site is None and self.home is not None:
            return self.home
        names = self._drawn if site is None else drawn_from(site)
        return self.pose(names[int(rng.integers(len(names)))] if names else site)
