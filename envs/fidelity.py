"""Fidelity of simulations: a site as it is, or a cheaper one that stands for it."""

from __future__ import annotations

import msgspec

from rigdda import Site, check

FIDELITIES = ("fast", "full")

COARSER = 1.5
"""How much larger the mean area of blocks cut by joints is at fidelity "fast"; so their number
is two thirds. With twice the area the debris on quick is too high by 5 % of the mass."""

FAST_DT = 1.25e-2
"""Time step at fidelity "fast", if the site's is shorter [s]."""


def at(site: Site, fidelity: str) -> Site:
    """Return the site to simulate.

    "full": as it is; "fast": with fewer, larger blocks of jointed masses and a longer step. Other
    blocks stay as they are. The bias and the gain are measured by `rigdda fidelity` and told in
    docs/fidelity.md.

    Raises
    ------
    BadInput
        If there is no such fidelity.
    """
    if check.one_of("fidelity", fidelity, FIDELITIES) == "full":
        return site
    replace, motion = msgspec.structs.replace, site.motion
    sources = tuple(
        replace(s, block_area=min(COARSER * s.block_area, s.area)) if s.polygon else s
        for s in site.sources
    )
    return replace(site, sources=sources, motion=replace(motion, dt=max(motion.dt, FAST_DT)))
