"""Pareto front of cost and error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

Item = TypeVar("Item")


def front(items: Iterable[Item], point: Callable[[Item], tuple[float, float]]) -> list[Item]:
    """Return the items that no other item beats in both cost and error, cheapest first.

    `point` returns cost and error of an item; items without a finite error are left out.
    """
    best: list[Item] = []
    for item in sorted(items, key=point):
        error = point(item)[1]
        if math.isfinite(error) and (not best or error < point(best[-1])[1]):
            best.append(item)
    return best
