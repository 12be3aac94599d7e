"""Small checks shared by the dataclasses that describe a scene."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda.errors import BadInput


def number(
    field: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
) -> float:
    """Return `value` as a finite float in [low, high], or (low, high] with `open_low`.

    Raises
    ------
    BadInput
        If it is not a number, not finite or outside the interval.
    """
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise BadInput(field, value, "give a number") from None
    if isinstance(value, str | bytes):
        raise BadInput(field, value, "give a number, not a text")
    if not math.isfinite(out):
        raise BadInput(field, value, "give a finite number")
    if out < low or out > high or (open_low and out == low):
        bounds = f"above {low:g}" if open_low else f"of at least {low:g}"
        if math.isfinite(high):
            bounds += f" and at most {high:g}"
        raise BadInput(field, value, f"give a number {bounds}")
    return out


def integer(field: str, value: Any, low: int) -> int:
    """Return `value` as an integer of at least `low`.

    Raises
    ------
    BadInput
        If it is not a whole number or too small.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < low:
        raise BadInput(field, value, f"give a whole number of at least {low}")
    return int(value)


def vector(field: str, value: Sequence[float]) -> tuple[float, float]:
    """Return `value` as two finite numbers.

    Raises
    ------
    BadInput
        If it is not two finite numbers.
    """
    try:
        x, y = value
    except (TypeError, ValueError):
        raise BadInput(field, value, "give two numbers (x, y)") from None
    return number(field, x), number(field, y)


def set_vectors(what: str, record: object, *names: str) -> None:
    """Set fields of a frozen dataclass, each to its value as two finite numbers.

    Raises
    ------
    BadInput
        If one is not two finite numbers.
    """
    for name in names:
        object.__setattr__(record, name, vector(f"{what}: {name}", getattr(record, name)))


def points(field: str, value: ArrayLike, least: int) -> NDArray[np.float64]:
    """Return `value` as a read-only (n, 2) array of finite coordinates, n >= `least`.

    Raises
    ------
    BadInput
        If the shape is wrong, there are too few points or one is not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(field, value, "give a list of (x, y) pairs") from None
    if array.ndim != 2 or array.shape[1] != 2:
        raise BadInput(field, array.shape, "give a list of (x, y) pairs, shape (n, 2)")
    if len(array) < least:
        raise BadInput(field, f"{len(array)} points", f"give at least {least} points")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise BadInput(f"{field}[{bad[0]}]", array[bad[0]].tolist(), "give finite coordinates")
    array.setflags(write=False)
    return array


def one_of(field: str, value: Any, choices: Iterable[str]) -> str:
    """Return `value` if it is one of `choices`.

    Raises
    ------
    BadInput
        If it is none of them.
    """
    known = sorted(choices)
    if value not in known:
        raise BadInput(field, value, "choose one of " + ", ".join(known))
    return value
