"""Where episodes play: on one site, or on one that is drawn of a split."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rigdda import BadInput, Site, check, sites
from rigdda.envs.fidelity import FIDELITIES
from rigdda.envs.problem import DesignProblem
from rigdda.envs.slots import KINDS, Slots, named

Place = str | os.PathLike[str] | Site
"""Name of a built-in or generated site, a TOML file, a site, or what `drawn_from` knows."""

RANDOM = "random"
"""Another name of the split "train"."""

SPLITS = ("train", "validation", "test")
"""Splits of the generated sites."""

MOST_POSED = 512
"""Problems that are kept: checking a site takes longer than an episode."""


@lru_cache
def _split(name: str) -> tuple[str, ...]:
    return tuple(sites.split(name))


def drawn_from(site: Place) -> tuple[str, ...]:
    """Return the names of the sites of which every episode draws one, none if `site` is one."""
    if not isinstance(site, str) or site not in (RANDOM, *SPLITS):
        return ()
    return _split("train" if site == RANDOM else site)


def pose(site: Place, slots: int, kinds: Sequence[str] | None, fidelity: str) -> DesignProblem:
    """Return the problem of a site; that of a name is made once a process.

    Raises
    ------
    BadInput
        As `DesignProblem` does.
    """
    if isinstance(site, str) and not os.path.exists(site) and isinstance(kinds, tuple | None):
        return _named(site, slots, kinds, fidelity)
    return DesignProblem(site, slots, kinds, fidelity=fidelity)


@lru_cache(MOST_POSED)
def _named(site: str, slots: int, kinds: tuple[str, ...] | None, fidelity: str) -> DesignProblem:
    return DesignProblem(site, slots, kinds, fidelity=fidelity)


class Venue:
    """Where an environment's episodes play, and the slots that its actions fill.

    Parameters
    ----------
    site : Place
        Where.
    max_barriers, kinds, fidelity
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

    def __init__(self, site: Place, max_barriers: int, kinds: Sequence[str] | None, fidelity: str):
        self.fidelity = check.one_of("fidelity", fidelity, FIDELITIES)
        self.home: DesignProblem | None = None
        self._drawn = drawn_from(site)
        if self._drawn:
            self.slots = Slots(named(KINDS if kinds is None else kinds), max_barriers)
            self.first = self.pose(self._drawn[0])
        else:
            self.first = self.home = pose(site, max_barriers, kinds, fidelity)
            self.slots = Slots(self.first.kinds, max_barriers)

    def pose(self, site: Place) -> DesignProblem:
        """Return the problem of a site, of the kinds that it offers."""
        count = self.slots.count
        whole = pose(site, count, None, self.fidelity)
        return pose(site, count, self.slots.shared(whole.site), self.fidelity)

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
