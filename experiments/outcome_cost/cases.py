"""Cases: releases of three sites in a form that every engine can compute."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from msgspec.structs import replace

from experiments.bench.cases import RUN_OUT
from rigdda import Site
from rigdda.ground.surface import Surface
from rigdda.model.site_tables import Drawn

TSCHAMUT = Path(__file__).parent.parent / "tschamut" / "site.toml"

GROUND = Surface(friction_deg=38.0, restitution=0.4)
"""Ground of `tschamut` here. With `DAMPING`, its blocks travel 80 m on average; 96 m were
observed."""

DAMPING = 0.15
"""Damping of `tschamut` here [1/s], also in flight as in the other engines. The fit in
`experiments.tschamut` damps in contact only."""

OF_ALL = 0.3
"""Damping of sites whose grounds define it [1/s], also in flight."""

ROAD = 80.0
"""Chainage beyond which blocks of `tschamut` count as debris [m], which two thirds reach."""

CORNERS = (8, 8)
"""Numbers of corners of the blocks of `tschamut` here; Box2D permits at most eight."""


@dataclass(frozen=True)
class Case:
    """Releases of a site.

    Parameters
    ----------
    name : str
        Its name.
    site : Site
        The slope; rock that passes its `road.start` counts as debris.
    barrier : float
        Chainage at which the energy is measured [m].
    events : tuple of str or None
        Events of successive releases, in turn; None is the only event.
    """

    name: str
    site: Site
    barrier: float
    events: tuple[str | None, ...]

    def event(self, seed: int) -> str | None:
        """Return the event of a seed."""
        return self.events[seed % len(self.events)]

    def draw(self, seed: int) -> Drawn:
        """Return the draw of a seed."""
        return self.site.draw(seed, self.event(seed))


def everywhere(site: Site) -> Site:
    """Return a site with damping also in flight, as in all engines, and a long level valley floor.

    The road extends to its end, so that a release ends only when all of its blocks sleep.
    """
    toe, level = site.slope.toe, site.slope.points[-1][1]
    plain = {
        name: Surface(s.friction_deg, s.cohesion, s.tension, s.restitution)
        for name, s in site.surfaces.items()
    }  # the peers model neither rolling resistance nor scatter
    damping = site.motion.damping or OF_ALL
    floor = (*site.slope.points, (RUN_OUT, level))
    return replace(
        site,
        family="paper",  # other families warn of damping in flight
        surfaces=plain,
        motion=replace(site.motion, damping=damping, damping_when="always"),
        slope=replace(site.slope, points=floor),
        road=replace(site.road, end=RUN_OUT - 50.0),
        barrier_zone=replace(site.barrier_zone, start=toe - 2.0, end=toe - 1.0),  # no barriers
    )


def highway() -> Case:
    """Return the paper's highway case: about 120 blocks of 2 m2."""
    site = everywhere(Site.load("shu-hwa-paper"))
    return Case("highway", site, site.slope.toe, (None,))


def quick() -> Case:
    """Return the jointed mass of `quick`: about 20 blocks of 2 m2."""
    site = everywhere(Site.load("quick"))
    return Case("quick", site, site.slope.toe, ("mass",))


def tschamut() -> Case:
    """Return single blocks of 0.05 to 0.15 m2 that bounce down 50 m."""
    site = everywhere(Site.load(TSCHAMUT))
    site = replace(
        site,
        sources=tuple(replace(source, corners=CORNERS) for source in site.sources),
        surfaces={"rock": GROUND},
        slope=replace(site.slope, surface="rock"),
        road=replace(site.road, start=ROAD),
        motion=replace(site.motion, damping=DAMPING),
    )
    events = tuple(event.name for event in site.events)
    return Case("tschamut", site, site.slope.toe, events)


def cut(angle: int) -> Case:
    """Return a uniform road cut of 35, 60 or 80 degrees (Ritchie 1963)."""
    site = everywhere(Site.load(f"ritchie-{angle}"))
    return Case(site.name, site, site.road.start, (None,))


CASES: dict[str, Callable[[], Case]] = {"highway": highway, "quick": quick, "tschamut": tschamut}
