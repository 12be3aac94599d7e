"""From a site to one release of it: what a seed draws, and the scene of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from rigdda import check
from rigdda.barriers import Barrier, Built, Mesh, as_layout
from rigdda.errors import BadInput
from rigdda.model import boulders
from rigdda.model.block import Block
from rigdda.model.events import Drawn
from rigdda.model.scene import Scene
from rigdda.model.source import Source
from rigdda.model.surface import Surface

if TYPE_CHECKING:
    from rigdda.model.site import Site

ROUNDING = 1e-9
"""Length by which a barrier may reach into loose rock [m]: vectors lose last digits of its edge."""

STEEPEST_DEG = 85.0
"""Friction angle up to which scatter may raise that of a surface [deg]."""


def pick(site: Site, seed: int) -> str:
    """Return the name of the event that a seed draws by rate."""
    rates = np.array([event.rate for event in site.events])
    rng = np.random.default_rng([check.integer("seed", seed, 0), len(rates)])
    return site.events[rng.choice(len(rates), p=rates / rates.sum())].name


def draw(site: Site, seed: int, event: str | None) -> Drawn:
    """Return what a seed draws of an event, see `Site.draw`."""
    seed = check.integer("seed", seed, 0)
    name = pick(site, seed) if event is None else event
    index = site.index(name)
    what = site.events[index]
    rock = site.source(what.source)
    areas: list[float] = []
    if rock.band is None:
        normal, blocks = _cut(msgspec.json.encode(rock), seed, index)
    else:
        rng = np.random.Generator(np.random.PCG64([seed, index]))  # that of default_rng
        normal = rng.standard_normal()
        areas, drawn = boulders.draw(rng, rock, what, boulders.line(site.slope.points))
        blocks = tuple(drawn)
    return Drawn(name, blocks, what.width_of(areas), normal * site.scatter.friction_deg)


def built(site: Site, layout: Sequence[Barrier], width: float) -> tuple[Built, ...]:
    """Return what stands of a layout, see `Site.built`."""
    standing: list[Built] = []
    taken = _taken(site)
    for i, barrier in enumerate(as_layout(layout)):
        if isinstance(barrier, Mesh):
            site.mesh(barrier)
            continue
        for low, high in taken:
            if barrier.x < high - ROUNDING and barrier.x + barrier.extent > low + ROUNDING:
                mend = f"put it outside x = {low:.2f} to {high:.2f}, where loose rock lies"
                raise BadInput(f"barriers[{i}].x", barrier.x, mend)
        standing.append(barrier.for_width(width))
    return tuple(standing)


def strength(site: Site, shift: float) -> tuple[dict[str, Surface], dict[tuple[str, str], Surface]]:
    """Return the surfaces and how pairs meet, with friction shifted, see `Site.strength`."""
    surfaces = {name: _shifted(s, shift) for name, s in site.surfaces.items()}
    return surfaces, {pair: _shifted(s, shift) for pair, s in pairs(site).items()}


def scene(site: Site, drawn: Drawn, barriers: Sequence[Built]) -> Scene:
    """Return the scene of what was drawn, see `Site.scene`."""
    surfaces, interfaces = strength(site, drawn.friction_deg)
    return Scene(
        terrain=site.profile,
        blocks=drawn.blocks,
        surfaces=surfaces,
        interfaces=interfaces,
        barriers=tuple(barriers),
        damping=site.motion.damping,
        damping_when=site.motion.damping_when,
    )


def pairs(site: Site) -> dict[tuple[str, str], Surface]:
    """Return the surfaces of contacts: of rock with the ground the ground's, unless said."""
    grounds = {site.slope.surface, *(s.surface for s in site.slope.surfaces)}
    if "soil" in site.surfaces:
        grounds.add("soil")  # embankments are ground
    rocks = {source.surface for source in site.sources}
    found = {(r, g): site.surfaces[g] for r in sorted(rocks) for g in sorted(grounds) if r != g}
    for pair in site.interfaces:
        found.pop((pair.second, pair.first), None)
        found[pair.first, pair.second] = pair.surface
    return found


def rooms(site: Site) -> tuple[tuple[float, float], ...]:
    """Return the intervals in which barriers may stand, see `Site.rooms`."""
    start, end = site.barrier_zone.start, site.barrier_zone.end
    found = []
    for low, high in sorted(_taken(site)):
        if start < min(low, end):
            found.append((start, min(low, end)))
        start = max(start, high)
    return (*found, (start, end)) if start < end else tuple(found)


def _taken(site: Site) -> list[tuple[float, float]]:
    """Return the intervals that loose blocks of bands may take up [m]."""
    found = []
    for source in site.sources:
        if source.band is not None:
            reaches = (boulders.reach(source, event) for event in site.events_of(source))
            reach = max(reaches, default=0.0)
            found.append((source.band[0] - reach, source.band[1] + reach))
    return found


@lru_cache(maxsize=4096)
def _cut(source: bytes, seed: int, event: int) -> tuple[float, tuple[Block, ...]]:
    """Return what a seed draws of a mass, as JSON: a standard normal number and its blocks.

    Cutting takes as long as simulating a small release, and a search asks for the same releases
    again and again; one takes about 10 kB.
    """
    rng, rock = np.random.default_rng([seed, event]), msgspec.json.decode(source, type=Source)
    normal = rng.standard_normal()
    outlines = rock.cut(rng)
    starts = rock.disturbed(rng, len(outlines))
    return normal, tuple(
        Block(corners, rock.density, rock.surface, velocity)
        for corners, velocity in zip(outlines, starts, strict=True)
    )


def _shifted(surface: Surface, shift: float) -> Surface:
    """Return a surface whose friction angle is shifted [deg]."""
    if shift == 0.0:
        return surface
    angle = min(surface.friction_deg + shift, max(surface.friction_deg, STEEPEST_DEG))
    return msgspec.structs.replace(surface, friction_deg=max(angle, 0.0))
