"""What a batch is given and gives: seeds, options and actions of all copies, and observations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from rigdda import BadInput, check

MASK = "reset_mask"
"""Option of `reset` that says which copies start anew."""

Options = Mapping[str, Any] | None


def mode(given: AutoresetMode | str) -> AutoresetMode:
    """Return the mode of a name.

    Raises
    ------
    BadInput
        If there is none.
    """
    try:
        return AutoresetMode(given)
    except ValueError:
        names = ", ".join(mode.value for mode in AutoresetMode)
        raise BadInput("autoreset_mode", given, f"choose one of {names}") from None


def mask(options: Options, copies: int) -> tuple[NDArray[np.bool_] | None, Options]:
    """Return which copies start anew, None for all, and the other options.

    Raises
    ------
    BadInput
        If the option `reset_mask` is not one boolean a copy, or none is true.
    """
    if not isinstance(options, Mapping) or MASK not in options:  # others are checked by each copy
        return None, options
    chosen = np.asarray(options[MASK])
    if chosen.shape != (copies,) or chosen.dtype != np.bool_ or not chosen.any():
        mend = f"give {copies} booleans, one of them true at least"
        raise BadInput(MASK, options[MASK], mend)
    return chosen, {name: value for name, value in options.items() if name != MASK}


def seeds(seed: int | Sequence[int | None] | None, copies: int) -> list[int | None]:
    """Return the seed of every copy, None for one that goes on with its random numbers.

    Raises
    ------
    BadInput
        If they are not whole numbers >= 0, one a copy.
    """
    if seed is None:
        return [None] * copies
    if isinstance(seed, int | np.integer):
        first = check.integer("seed", seed, 0)
        return [first + i for i in range(copies)]
    if rows(seed) != copies:
        raise BadInput("seed", seed, f"give one number, or {copies}, one a copy")
    return [
        None if one is None else check.integer(f"seed[{i}]", one, 0) for i, one in enumerate(seed)
    ]


def rows(values: Any) -> int | None:
    """Return the length of what should have one entry a copy, None if it has none."""
    try:
        return len(values)
    except TypeError:
        return None


def stack(seen: Sequence[Any]) -> Any:
    """Return the observations of all copies, each array with the copies as its first axis."""
    if isinstance(seen[0], np.ndarray):
        return np.stack(seen)
    return {name: np.stack([one[name] for one in seen]) for name in seen[0]}
