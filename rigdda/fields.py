"""Fields of frozen records, set to what they are once they are checked."""

from __future__ import annotations

import math
from typing import Any

import msgspec

from rigdda import check


def set_number(
    record: object,
    name: str,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    open_low: bool = False,
    field: str = "",
) -> None:
    """Set a field of a frozen dataclass or struct to its value as a float, see `check.number`.

    `field` is what an error calls it, `name` by default. A whole number or one of numpy's in its
    place would be another type to the kernels, which would be compiled again, and to files.
    """
    value = check.number(field or name, getattr(record, name), low, high, open_low=open_low)
    _set(record, name, value)


def set_booleans(record: object, *names: str) -> None:
    """Set fields of a frozen dataclass, each to its value as a bool.

    Raises
    ------
    BadInput
        If one is neither True nor False.
    """
    for name in names:
        _set(record, name, check.boolean(name, getattr(record, name)))


def set_integers(what: str, record: object, *names: str) -> None:
    """Set fields of a frozen dataclass, each to its value as a whole number of at least 0.

    Raises
    ------
    BadInput
        If one is not such a number.
    """
    for name in names:
        _set(record, name, check.integer(f"{what}: {name}", getattr(record, name), 0))


def set_vectors(what: str, record: object, *names: str) -> None:
    """Set fields of a frozen dataclass, each to its value as two finite numbers.

    Raises
    ------
    BadInput
        If one is not two finite numbers.
    """
    for name in names:
        object.__setattr__(record, name, check.vector(f"{what}: {name}", getattr(record, name)))


def _set(record: object, name: str, value: Any) -> None:
    if isinstance(record, msgspec.Struct):
        msgspec.structs.force_setattr(record, name, value)
    else:
        object.__setattr__(record, name, value)
