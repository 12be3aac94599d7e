"""What is computed as it was asked for, and that an engineer should know of."""

from __future__ import annotations

from envs.building import Room
from rigdda import BadInput, Layout, Site
from rigdda.barriers import KINDS


def unbuildable(site: Site, layout: Layout) -> str:
    """Return in words why `design` would refuse a layout, nothing if it would not."""
    try:
        Room(site, site.barrier_zone).check_layout(layout, list(KINDS), len(layout))
    except BadInput as error:
        return f"is computed as given, but may not be built: {error}"
    return ""


def unfitted(site: Site) -> str:
    """Return in words which surfaces the lumped-mass model knows by its defaults only."""
    names = sorted({*site.slope.chain()[1]} - set(site.lumped))
    if not names:
        return ""
    return (
        f"points rebound from {', '.join(names)} by defaults that nothing was fitted to, see "
        "[lumped.NAME]: blocks may run out far less or far more"
    )
