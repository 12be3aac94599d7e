"""Portions of releases, after each of which a thread checks whether it has something else to do.

They are apart from `rates`, whose imports would delay the opening of the page.
"""

from __future__ import annotations

FIRST, PATIENCE = 4, 0.15
"""Number of releases of the first portion, and the time that those of one portion may take [s]: a
change on the page waits for them."""


def next_size(size: int, seconds: float) -> int:
    """Return the number of releases of the portion after one of `size` that took `seconds`."""
    return 2 * size if seconds < PATIENCE else max(1, size // 2)
