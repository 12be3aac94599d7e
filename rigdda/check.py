"""Validation of values, in addition to the declared checks of file fields (`rigdda.fields`).

Each function raises one error that names the field, the value and what to give instead.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda.errors import BadInput
from rigdda.rounding import chainage

LARGEST_NUMBER = 1e15
"""Greatest accepted magnitude of a number. No quantity of a slope in SI units comes near it, and
products of such numbers remain finite."""


def number(
    field: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
    unit: str = "",
) -> float:
    """Return `value` as a float in [low, high], or in (low, high] with `open_low`.

    The error message gives the bounds in `unit`.

    Raises
    ------
    BadInput
        If it is not a number, not finite, larger than `LARGEST_NUMBER` in magnitude or outside the
        interval. Booleans and arrays are not accepted, although Python can convert them.
    """
    if isinstance(value, bool | np.bool_ | np.ndarray):
        raise BadInput(field, value, "give a number")
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise BadInput(field, value, "give a number") from None
    except OverflowError:
        out = math.inf
    if isinstance(value, str | bytes):
        raise BadInput(field, value, "give a number, not a text")
    if not math.isfinite(out):
        raise BadInput(field, value, "give a finite number")
    if abs(out) > LARGEST_NUMBER:
        raise BadInput(field, value, f"give a number of at most {LARGEST_NUMBER:g} in magnitude")
    if out < low or out > high or (open_low and out == low):
        bounds = f"above {_bound(low)}" if open_low else f"of at least {_bound(low)}"
        if math.isfinite(high):
            bounds += f" and at most {_bound(high)}"
        hint = f"give a number {bounds}" + (f" [{unit}]" if unit else "")
        raise BadInput(field, value, hint)
    return out


def _bound(value: float) -> str:
    """Return a bound as text; one that needs more figures than six may be a large chainage."""
    short = f"{value:g}"
    return short if float(short) == value else chainage(value)


DECIMAL_NUMBER = re.compile(
    r"\s*[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?|nan|inf(inity)?)\s*", re.I
)
"""A number as tables have it. Python's float would also read 1_20, as 120, and digits of other
scripts."""


def parsed(text: str) -> float:
    """Return the number in a text, for example in a cell of a table.

    Raises
    ------
    ValueError
        If it is not a plain number: underscores between digits, which Python permits in its own
        source text, are typing errors here.
    """
    if DECIMAL_NUMBER.fullmatch(text) is None:
        raise ValueError(f"{text!r} is not a number")
    return float(text)


def distinct(field: str, names: Sequence[str]) -> None:
    """Check that no column of a table is given twice.

    Raises
    ------
    BadInput
        If one is.
    """
    for name in names:
        if names.count(name) > 1:
            hint = f"give each column a different name: {names.count(name)} have this one"
            raise BadInput(field, name, hint)


def boolean(field: str, value: Any) -> bool:
    """Return `value` as a bool.

    Raises
    ------
    BadInput
        If it is neither True nor False.
    """
    if not isinstance(value, bool | np.bool_):
        raise BadInput(field, value, "give True or False")
    return bool(value)


def sequence(field: str, value: Any, kind: Any, what: str) -> tuple[Any, ...]:
    """Return `value` as a tuple; each member must be an instance of `kind`, described by `what`.

    Raises
    ------
    BadInput
        If it is not iterable, or a member is of another type.
    """
    try:
        members = tuple(value)
    except TypeError:
        raise BadInput(field, value, f"give a sequence of {what}") from None
    for i, member in enumerate(members):
        if not isinstance(member, kind):
            raise BadInput(f"{field}[{i}]", member, f"give {what} only")
    return members


def mapping(field: str, value: Any, kind: type, what: str) -> dict[Any, Any]:
    """Return `value` as a dict; each member must be an instance of `kind`, described by `what`.

    Raises
    ------
    BadInput
        If it is not a mapping, or a member is of another type.
    """
    if not isinstance(value, Mapping):
        raise BadInput(field, value, f"give a mapping of names to {what}")
    for name, member in value.items():
        if not isinstance(member, kind):
            raise BadInput(f"{field}[{name!r}]", member, f"give {what} only")
    return dict(value)


def integer(field: str, value: Any, low: int, high: float = math.inf) -> int:
    """Return `value` as an integer in [low, high].

    Raises
    ------
    BadInput
        If it is not a whole number, or outside the interval.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or value < low or value > high:
        bounds = f"of at least {low}" + (f" and at most {high}" if high < math.inf else "")
        raise BadInput(field, value, f"give a whole number {bounds}")
    return int(value)


def interval(
    field: str,
    value: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
) -> tuple[float, float]:
    """Return `value` as two numbers in [low, high] in ascending order, which may be equal.

    With `open_low` both are above `low`, and the second is greater than the first.

    Raises
    ------
    BadInput
        If it is not two such numbers.
    """
    try:
        first, second = value
    except (TypeError, ValueError):
        raise BadInput(field, value, "give two numbers [low, high]") from None
    first = number(field, first, low, high, open_low=open_low)
    second = number(field, second, low, high, open_low=open_low)
    if second < first or (open_low and second == first):
        raise BadInput(field, value, "give the smaller number first, then the larger")
    return first, second


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


def points(field: str, value: ArrayLike, least: int) -> NDArray[np.float64]:
    """Return `value` as a read-only (n, 2) array of finite coordinates, n >= `least`.

    Raises
    ------
    BadInput
        If the shape is wrong, there are too few points or one is not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(field, value, "give a list of (x, y) pairs") from None
    if array.ndim != 2 or array.shape[1] != 2:
        raise BadInput(field, array.shape, "give a list of (x, y) pairs, shape (n, 2)")
    if len(array) < least:
        raise BadInput(field, f"{len(array)} points", f"give at least {least} points")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise BadInput(f"{field}[{bad[0]}]", array[bad[0]].tolist(), "give finite coordinates")
    far = np.flatnonzero((np.abs(array) > LARGEST_NUMBER).any(axis=1))
    if far.size:
        hint = f"give coordinates of at most {LARGEST_NUMBER:g} in magnitude"
        raise BadInput(f"{field}[{far[0]}]", array[far[0]].tolist(), hint)
    array.setflags(write=False)
    return array


def one_of(field: str, value: Any, choices: Iterable[str]) -> str:
    """Return `value` if it is one of `choices`.

    Raises
    ------
    BadInput
        If it is not.
    """
    known = sorted(choices)
    if not isinstance(value, str) or value not in known:
        raise BadInput(field, value, "choose one of " + ", ".join(known))
    return value


def set_number(
    record: object,
    name: str,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
    field: str = "",
) -> None:
    """Convert a field of a frozen dataclass or struct to a valid float, see `number`.

    `field` is its name in error messages, `name` by default. Integers and NumPy scalars are
    converted because they would be other types in files and for kernels, which would be recompiled.
    """
    value = number(field or name, getattr(record, name), low, high, open_low=open_low)
    _set(record, name, value)


def set_booleans(record: object, *names: str) -> None:
    """Convert fields of a frozen dataclass to bool.

    Raises
    ------
    BadInput
        If a value is neither True nor False.
    """
    for name in names:
        _set(record, name, boolean(name, getattr(record, name)))


def set_integers(what: str, record: object, *names: str) -> None:
    """Convert fields of a frozen dataclass to whole numbers of at least 0.

    Raises
    ------
    BadInput
        If a value is not such a number.
    """
    for name in names:
        _set(record, name, integer(f"{what}: {name}", getattr(record, name), 0))


def set_vectors(what: str, record: object, *names: str) -> None:
    """Convert fields of a frozen dataclass to pairs of finite numbers.

    Raises
    ------
    BadInput
        If a value is not two finite numbers.
    """
    for name in names:
        object.__setattr__(record, name, vector(f"{what}: {name}", getattr(record, name)))


def _set(record: object, name: str, value: Any) -> None:
    if isinstance(record, msgspec.Struct):
        msgspec.structs.force_setattr(record, name, value)
    else:
        object.__setattr__(record, name, value)
