"""Places of a site that are dragged along the section, and what dragging one of them changes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigdda import Site

Path = tuple[str | int, ...]

DIGITS = 2
"""Decimals of chainages and elevations that are dragged [m]."""

BELOW = 0.05
"""Depth of the handles of ground stretches, as a share of the height of the slope: the ends of the
road, of the barrier zone and of stretches often lie at the same chainage."""


class Handle(NamedTuple):
    """A place on the slope that is dragged along the ground."""

    words: str
    x: float
    y: float
    """Where it is drawn [m]."""
    paths: tuple[Path, ...]
    """The values of the site file that are its chainage."""

    def moved(self, x: float) -> dict[Path, Any]:
        """Return the values of the site file after it has been dragged to a chainage [m]."""
        return dict.fromkeys(self.paths, round(x, DIGITS))


def handles(site: Site) -> list[Handle]:
    """Return what can be dragged on a site: ends of bands, zone, road and grounds, and the toe."""
    height = site.profile.height
    found = []

    def add(words: str, x: float, *paths: Path, down: float = 0.0) -> None:
        found.append(Handle(words, x, height(x) - down, paths))

    for i, source in enumerate(site.sources):
        if source.band is not None:
            for k, end in enumerate(("upper", "lower")):
                add(f"{end} end of {source.name}", source.band[k], ("sources", i, "band", k))
    for table, words, place in (
        ("road", "of the road", site.road),
        ("barrier_zone", "of the barrier zone", site.barrier_zone),
    ):
        add(f"uphill edge {words}", place.start, (table, "start"))
        add(f"downhill edge {words}", place.end, (table, "end"))
    add("toe of the slope", site.slope.toe, ("slope", "toe"))
    down = BELOW * float(np.ptp(np.array(site.slope.points)[:, 1]))
    for words, x, paths in _stretch_ends(site):
        add(words, x, *paths, down=down)
    return found


def _stretch_ends(site: Site) -> list[tuple[str, float, tuple[Path, ...]]]:
    """Return the ends of the ground stretches; two that touch have one end in common."""
    stretches = site.slope.surfaces
    order = sorted(range(len(stretches)), key=lambda i: stretches[i].start)
    found: list[tuple[str, float, tuple[Path, ...]]] = []
    for place, i in enumerate(order):
        own, path = stretches[i], ("slope", "surfaces", i)
        before = stretches[order[place - 1]] if place else None
        if before is None or before.end != own.start:
            found.append((f"start of {surface_words(own.surface)}", own.start, ((*path, "start"),)))
        after = stretches[order[place + 1]] if place + 1 < len(order) else None
        if after is not None and after.start == own.end:
            both = ((*path, "end"), ("slope", "surfaces", order[place + 1], "start"))
            words = f"{surface_words(own.surface)} to {surface_words(after.surface)}"
            found.append((words, own.end, both))
        else:
            found.append((f"end of {surface_words(own.surface)}", own.end, ((*path, "end"),)))
    return found


def surface_words(surface: str) -> str:
    """Return the name of a surface in words, such as "hard rock" for "hard_rock"."""
    return surface.replace("_", " ")
