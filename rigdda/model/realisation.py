"""From a site to one release of it: what a seed draws, and the scene of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import msgspec
import numpy as np

from rigdda import check
from rigdda.barriers import Barrier, Built, Mesh, as_layout
from rigdda.errors import BadInput
from rigdda.model import loose_blocks
from rigdda.model.block import Block
from rigdda.model.random_streams import stream
from rigdda.model.scene import Scene
from rigdda.model.site_tables import Drawn
from rigdda.model.source import Source
from rigdda.model.surface import MOST_DAMPING, Surface, smaller
from rigdda.model.terrain import Roughness

if TYPE_CHECKING:
    from rigdda.model.site import Site

Value = TypeVar("Value")

ROUNDING = 1e-9
"""Length by which a barrier may reach into loose rock [m]: vectors lose last digits of its edge."""

STRENGTHS, PITS = 1, 2
"""Ends of the seeds of what is drawn of the ground beside the blocks."""

FARTHEST = 2.5
"""Standard deviations at which normal numbers of the ground are cut off."""

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
        rng = stream((seed, index))
        normal = rng.standard_normal()
        areas, drawn = loose_blocks.draw(rng, rock, what, loose_blocks.line(site.slope.points))
        blocks = tuple(drawn)
    shift = normal * site.scatter.friction_deg
    return Drawn(name, blocks, what.width_of(areas), shift, *_ground(site, seed, index))


def _ground(
    site: Site, seed: int, index: int
) -> tuple[tuple[tuple[float, float, float], ...], Roughness | None]:
    """Return what a seed draws of the ground: see `Drawn.strengths` and `Drawn.roughness`.

    By random numbers of their own, so that blocks do not depend on how the ground varies.
    """
    strengths: tuple[tuple[float, float, float], ...] = ()
    if any(surface.varies for surface in site.surfaces.values()):
        rng = stream((seed, index, STRENGTHS))
        drawn = rng.standard_normal((len(site.surfaces), 3)).tolist()
        strengths = tuple((_cut_off(a), _cut_off(b), _cut_off(c)) for a, b, c in drawn)
    amplitude = {name: s.roughness for name, s in site.surfaces.items() if s.roughness > 0.0}
    if not amplitude:
        return strengths, None
    event = site.events[index]
    spacing = event.block_size(site.source(event.source))
    return strengths, Roughness(spacing, amplitude, (seed, index, PITS))


def _cut_off(normal: float) -> float:
    """Return a normal number, or the nearest one that is not farther than `FARTHEST` from 0."""
    return min(max(normal, -FARTHEST), FARTHEST)


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


def strength(site: Site, drawn: Drawn) -> tuple[dict[str, Surface], dict[tuple[str, str], Surface]]:
    """Return the surfaces and how pairs meet in a release, see `Site.strength`."""
    surfaces, normals = site.surfaces, drawn.strengths
    if normals:
        each = zip(surfaces.items(), normals, strict=True)
        fallback = site.motion.damping
        surfaces = {name: _varied(s, fallback, *normal) for (name, s), normal in each}
    if drawn.friction_deg != 0.0:
        surfaces = {name: _shifted(s, drawn.friction_deg) for name, s in surfaces.items()}
    found = pairs(site, surfaces)
    for pair in site.interfaces:
        ends = pair.first, pair.second
        usual = found.pop(ends[::-1], None) or found.get(ends)
        usual = usual or smaller(surfaces[pair.first], surfaces[pair.second])
        meets = _shifted(pair.surface, drawn.friction_deg)
        if meets.damping is None:
            meets = msgspec.structs.replace(meets, damping=usual.damping)
        found[ends] = meets
    return surfaces, found


def scene(site: Site, drawn: Drawn, barriers: Sequence[Built]) -> Scene:
    """Return the scene of what was drawn, see `Site.scene`."""
    surfaces, interfaces = strength(site, drawn)
    return Scene(
        terrain=site.profile,
        blocks=drawn.blocks,
        surfaces=surfaces,
        interfaces=interfaces,
        barriers=tuple(barriers),
        damping=site.motion.damping or 0.0,
        damping_when=site.motion.damping_when,
        roughness=drawn.roughness,
    )


def pairs(site: Site, surfaces: Mapping[str, Value]) -> dict[tuple[str, str], Value]:
    """Return what counts in contacts of rock with the ground: of the two surfaces the ground's."""
    grounds = {site.slope.surface, *(s.surface for s in site.slope.surfaces)}
    if "soil" in site.surfaces:
        grounds.add("soil")  # embankments are ground
    rocks = {source.surface for source in site.sources}
    return {(r, g): surfaces[g] for r in sorted(rocks) for g in sorted(grounds) if r != g}


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
            reaches = (loose_blocks.reach(source, event) for event in site.events_of(source))
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


def _varied(
    surface: Surface, fallback: float | None, friction: float, restitution: float, damping: float
) -> Surface:
    """Return a surface whose values are off by so many of their standard deviations.

    `fallback` is the damping of the site [1/s].
    """
    if not surface.varies:
        return surface
    rebound = surface.restitution
    loss = fallback if surface.damping is None else surface.damping
    angle = surface.friction_deg + friction * surface.friction_sd_deg
    return msgspec.structs.replace(
        surface,
        friction_deg=min(max(angle, 0.0), max(surface.friction_deg, STEEPEST_DEG)),
        restitution=None
        if rebound is None
        else min(max(rebound + restitution * surface.restitution_sd, 0.0), 1.0),
        damping=None
        if loss is None
        else min(max(loss + damping * surface.damping_sd, 0.0), MOST_DAMPING),
    )


def _shifted(surface: Surface, shift: float) -> Surface:
    """Return a surface whose friction angle is shifted [deg]."""
    if shift == 0.0:
        return surface
    angle = min(surface.friction_deg + shift, max(surface.friction_deg, STEEPEST_DEG))
    return msgspec.structs.replace(surface, friction_deg=max(angle, 0.0))
