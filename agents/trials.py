"""Decision vectors as parameters of Optuna: numbers in [-1, 1] and, of several kinds, a choice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import NUMBERS, slot_size

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

NAMES = ("presence", "station", "height", "size")
"""Numbers of a slot, as in `rigdda.envs.encoding`."""


def space(problem: DesignProblem) -> dict[str, BaseDistribution]:
    """Return the distributions of a problem's parameters, those of slot i named with its number."""
    from optuna.distributions import CategoricalDistribution, FloatDistribution

    out: dict[str, BaseDistribution] = {}
    for i in range(problem.max_barriers):
        out |= {f"{name} {i}": FloatDistribution(-1.0, 1.0) for name in NAMES}
        if len(problem.kinds) > 1:
            out[f"kind {i}"] = CategoricalDistribution(problem.kinds)
    return out


def vector(problem: DesignProblem, parameters: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the (size,) vector that parameters stand for."""
    slots = np.full((problem.max_barriers, slot_size(problem.kinds)), -1.0)
    for i, slot in enumerate(slots):
        slot[:NUMBERS] = [parameters[f"{name} {i}"] for name in NAMES]
        if len(problem.kinds) > 1:
            slot[NUMBERS + problem.kinds.index(parameters[f"kind {i}"])] = 1.0
    return slots.ravel()


def parameters(problem: DesignProblem, layout: Layout) -> dict[str, Any]:
    """Return the parameters of a layout; `vector` and `decode` give it back."""
    out: dict[str, Any] = {}
    slots = problem.encode(layout).reshape(problem.max_barriers, -1)
    for i, slot in enumerate(slots):
        out |= {f"{name} {i}": float(slot[j]) for j, name in enumerate(NAMES)}
        if len(problem.kinds) > 1:
            out[f"kind {i}"] = problem.kinds[int(np.argmax(slot[NUMBERS:]))]
    return out
