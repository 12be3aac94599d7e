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

    "full": as it is; "fast": with fewer, larger blocks and a longer step. Blocks that a site
    gives one by one stay as they are. The bias and the gain are measured by `rigdda calibrate` and
    told in docs/fidelity.md.

    Raises
    ------
    BadInput
        If there is no such fidelity.
    """
    if check.one_of("fidelity", fidelity, FIDELITIES) == "full":
        return site
    replace, source, motion = msgspec.structs.replace, site.source, site.motion
    if not source.blocks:
        source = replace(source, block_area=COARSER * source.block_area)
    return replace(site, source=source, motion=replace(motion, dt=max(motion.dt, FAST_DT)))
