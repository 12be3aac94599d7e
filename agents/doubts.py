"""What is computed as it was asked for, and that an engineer should know of."""

from __future__ import annotations

from rigdda import BadInput, Layout, Mesh, Site
from rigdda.barriers import KINDS
from rigdda.envs.siting import Room


def unbuildable(site: Site, layout: Layout) -> str:
    """Return in words why `design` would refuse a layout, nothing if it would not."""
    try:
        Room(site, site.barrier_zone).check_layout(layout, list(KINDS), len(layout))
    except BadInput as error:
        return f"is computed as given, but may not be built: {error}"
    return ""


def of_layout(site: Site, layout: Layout, event: str | None) -> str:
    """Return in words what is to be known of a layout in releases of an event, or by rate."""
    found = unbuildable(site, layout)
    words = [f"the layout {found}"] if found else []
    if event is None and any(isinstance(barrier, Mesh) for barrier in layout):
        words.append(
            "mesh makes events rarer, and changes no release: these are drawn by the rates "
            "without it; `design` and `study` count it"
        )
    return "; ".join(words)


def unfitted(site: Site) -> str:
    """Return in words which surfaces the lumped-mass model knows by its defaults only."""
    names = sorted({*site.slope.chain()[1]} - set(site.lumped))
    if not names:
        return ""
    return (
        f"points rebound from {', '.join(names)} by defaults that nothing was fitted to, see "
        "[lumped.NAME]: blocks may run out far less or far more"
    )
