"""Outlines of the sources of a site, for pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda import Site

Floats = NDArray[np.float64]


def sources(site: Site) -> list[Floats]:
    """Return the corners of each source [m]: a closed polygon, or the ground line of a band."""
    ground, out = site.profile, []
    for source in site.sources:
        if source.band is None:
            pieces = (np.array(piece, dtype=np.float64) for _, piece in source.pieces())
            out += [np.concatenate([piece, piece[:1]]) for piece in pieces]
        else:
            start, end = source.band
            x = [start, *(x for x, _ in site.slope.points if start < x < end), end]
            out.append(np.array([(at, ground.height(at)) for at in x]))
    return out
