"""An environment's actions: the slots of a problem's vector, of one width for all its sites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Site, check
from rigdda.barriers import KINDS as ALL
from rigdda.envs import encoding
from rigdda.envs.posing import KINDS as USUAL
from rigdda.envs.problem import DesignProblem

Floats = NDArray[np.float64]

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
        return encoding.slot_size(self.kinds)

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
        used = numbers.reshape(-1, self.width)
        vector = np.full((problem.max_barriers, encoding.slot_size(problem.kinds)), -1.0)
        vector[: len(used)] = used[:, self._columns(problem.kinds)]
        return problem.decode(vector.ravel())

    def encode(self, problem: DesignProblem, layout: Layout) -> Floats:
        """Return the numbers of all slots that `decode` turns into a layout that it gave."""
        place, slots, kinds = problem.place, problem.max_barriers, problem.kinds
        vector = encoding.encode(place, layout, slots, kinds).reshape(slots, -1)
        numbers = np.full((self.count, self.width), -1.0)
        numbers[:, self._columns(problem.kinds)] = vector
        return numbers.ravel()

    def _columns(self, kinds: Sequence[str]) -> list[int]:
        """Return which numbers of a slot a problem of these kinds reads."""
        scores = [encoding.NUMBERS + self.kinds.index(kind) for kind in kinds]
        return [*range(encoding.NUMBERS), *(scores if len(kinds) > 1 else [])]


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
