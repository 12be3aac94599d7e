"""Many releases of one site with one layout, which share what does not depend on the seed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rigdda.barriers import Barrier, GravityWall, Mesh, as_layout
from rigdda.dynamics.pack.again import Template
from rigdda.dynamics.simulation import Simulation
from rigdda.dynamics.stations import chainages
from rigdda.errors import BadInput, Error
from rigdda.model.events import Drawn
from rigdda.model.scene import Scene
from rigdda.model.site import Site
from rigdda.results.ending import Ending
from rigdda.results.outcome import Outcome, judge, leave, measure, stations, watch
from rigdda.single import SingleReleases, can_share

EVERY = 0.05
"""Interval of the frames of a run from which states of barriers are judged [s]."""

MOST_BLOCKS = 32
"""Most blocks of a scene whose arrays are kept: packing more takes little beside simulating them.
There are about as many kinds of them as numbers of blocks and of corners."""

Job = tuple[Site, Sequence[Barrier], int, str | None]
"""A site, a layout, a seed and the name of an event, None for one that the seed draws."""


def as_site(site: Site) -> Site:
    """Return a site.

    Raises
    ------
    BadInput
        If it is none.
    """
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a site: rigdda.Site.load(name) gives one")
    return site


class Batch:
    """Releases of a site with a layout, one after the other.

    The ground and what stands on it are built once. For a release its blocks are checked and
    written into the arrays of the last one, with what it draws of the ground. Outcomes are those of
    `rigdda.release`, whatever the order.

    Parameters
    ----------
    site : Site
        Where.
    layout : sequence of Barrier
        What stands.
    """

    def __init__(self, site: Site, layout: Sequence[Barrier]):
        self._site, self._layout = as_site(site), as_layout(layout)
        self._standing = [b for b in self._layout if not isinstance(b, Mesh)]
        self._watch = watch(site)
        self._base: tuple[Scene, Drawn] | None = None
        self._single: SingleReleases | None = None
        self._templates: dict[tuple[int, int, float, int], Template] = {}

    def outcome(self, seed: int, event: str | None = None) -> Outcome:
        """Return the outcome of one release. Raises as `rigdda.release` does."""
        drawn = self._site.draw(seed, event)
        ended = self._ending(drawn)
        if ended is not None:
            return judge(self._site, ended, drawn.event, drawn.width)
        duration = self._site.motion.duration
        # a wall that slid or overturned on the way may come to stand again
        moving = any(isinstance(barrier, GravityWall) for barrier in self._standing)
        run = self.simulation(self.scene(drawn)).run(duration, EVERY if moving else duration)
        return measure(self._site, run, drawn.event, drawn.width)

    def _ending(self, drawn: Drawn) -> Ending | None:
        """Return how a release of a single block ends, None where it takes a scene to tell."""
        if len(drawn.blocks) > 1 or self._base is None:
            return None
        if self._single is None:
            scene = self._base[0]
            if not can_share(self._site, scene):
                return None
            self._single = SingleReleases(self._site, self._standing, scene)
        return self._single.ending(drawn)

    def scene(self, drawn: Drawn) -> Scene:
        """Return the scene of what was drawn, on the ground and with the barriers of the first."""
        if self._base is None:
            scene = self._site.scene(drawn, self._site.built(self._layout, drawn.width))
            self._base = scene, drawn
            return scene
        base, first = self._base
        surfaces, interfaces = base.surfaces, base.interfaces
        if (drawn.friction_deg, drawn.strengths) != (first.friction_deg, first.strengths):
            surfaces, interfaces = self._site.strength(drawn)
        barriers = [b.for_width(drawn.width) for b in self._standing]
        return base.with_rock(drawn.blocks, surfaces, interfaces, barriers, drawn.roughness)

    def simulation(self, scene: Scene) -> Simulation:
        """Return the simulation of such a scene; that of the one before is of no more use."""
        if len(scene.blocks) > MOST_BLOCKS:
            return simulation(self._site, scene)
        settings = self._site.settings(scene)
        corners = max(len(b.vertices) for b in scene.blocks)
        ground = len(scene.ground.points) if scene.ground is not None else 0
        key = len(scene.blocks), corners, settings.dt, ground
        template = self._templates.get(key)
        if template is None or not template.fits(scene):
            lines = chainages(stations(self._site, scene.barriers))
            beyond = leave(self._site, scene)
            template = Template(scene, settings, lines, self._watch, beyond)
            self._templates[key] = template
        return Simulation(scene, settings, template=template)


def simulation(site: Site, scene: Scene) -> Simulation:
    """Return a simulation of a scene of a site that watches what its outcome needs."""
    lines = stations(site, scene.barriers)
    return Simulation(scene, site.settings(scene), lines, watch(site), leave(site, scene))


def outcomes(jobs: Sequence[Job], places: Iterable[int]) -> list[tuple[int, Outcome | Error]]:
    """Return the outcomes of the jobs at some places, or what went wrong, each with its place.

    Several threads may share `places`, an iterator. Jobs with the same site and layout are to
    follow one another.
    """
    found: list[tuple[int, Outcome | Error]] = []
    batch, of = None, None
    for place in places:
        site, layout, seed, event = jobs[place]
        try:
            if batch is None or of is None or of[0] is not site or of[1] != layout:
                batch, of = Batch(site, layout), (site, layout)
            found.append((place, batch.outcome(seed, event)))
        except Error as error:
            found.append((place, error))
    return found
