"""Checks of what a design problem is posed with."""

from __future__ import annotations

import os
from collections.abc import Sequence

import msgspec

from rigdda import BadInput, Site, check
from rigdda.barriers import KINDS as ALL_KINDS
from rigdda.envs import fidelity
from rigdda.envs.targets import Targets
from rigdda.model.place import BarrierZone

MOST_BARRIERS = 100
"""Most slots of a layout; a site has room for a few."""

KINDS = ("fence", "ditch", "embankment", "gravity_wall")
"""Kinds of barrier that are designed if none are named, and mesh where a site has options. Not the
rigid wall, which nothing moves: it is for experiments."""


def site(site: object, cheaper: str) -> Site:
    """Return a site at a fidelity."""
    if isinstance(site, str | os.PathLike):
        site = Site.load(site)
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a name, a TOML file or a rigdda.Site")
    return fidelity.at(site, cheaper)


def zone(site: Site, zone: object) -> BarrierZone:
    """Return the zone of a site, or the part of it between two chainages."""
    own = site.barrier_zone
    if zone is None:
        return own
    start, end = check.interval("zone", zone, own.start, own.end)
    if start == end:
        raise BadInput("zone", zone, "give two chainages, the first one less than the other")
    return msgspec.structs.replace(own, start=start, end=end)


def kinds(site: Site, kinds: Sequence[str] | None) -> tuple[str, ...]:
    """Return the kinds of barrier to choose from."""
    if kinds is None:
        return (*KINDS, "mesh") if site.meshes else KINDS
    if not isinstance(kinds, Sequence) or isinstance(kinds, str):
        raise BadInput("kinds", kinds, "give a sequence of names")
    names = tuple(check.one_of("kinds", kind, ALL_KINDS) for kind in kinds)
    if not names or len(set(names)) < len(names):
        raise BadInput("kinds", kinds, "name each kind once")
    if "mesh" in names and not site.meshes:
        raise BadInput("kinds", kinds, f"leave mesh out: {site.name} has no options of it")
    return names


def targets(site: Site, targets: Targets | None) -> Targets:
    """Return what is asked of a layout: nothing by default."""
    if targets is None:
        return Targets()
    if not isinstance(targets, Targets):
        raise BadInput("targets", targets, "give envs.Targets(reach=..., failure=...)")
    if not any(event.design for event in site.events):
        raise BadInput("targets", targets, f"mark an event of {site.name} with design = true")
    return targets


def seeds(name: str, seeds: Sequence[int], least: int = 1) -> tuple[int, ...]:
    """Return seeds as a tuple of at least so many, all different."""
    try:
        drawn = tuple(check.integer(f"{name}[{i}]", seed, 0) for i, seed in enumerate(seeds))
    except TypeError:
        raise BadInput(name, seeds, "give a sequence of whole numbers") from None
    if len(drawn) < least:
        raise BadInput(name, drawn, "give at least one")
    if len(set(drawn)) < len(drawn):
        raise BadInput(name, drawn, "give each once: the same seed gives the same release")
    return drawn


def is_vector(layout: object) -> bool:
    """Tell whether what is to be evaluated begins with a number."""
    return isinstance(layout, Sequence) and len(layout) > 0 and isinstance(layout[0], int | float)
