"""Many releases of one site with one layout, which share what does not depend on the seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from rigdda.barriers import Barrier, GravityWall, Mesh, as_layout
from rigdda.dynamics.pack.again import Template
from rigdda.dynamics.simulation import Simulation
from rigdda.dynamics.stations import chainages
from rigdda.errors import BadInput, Error
from rigdda.model.events import Drawn
from rigdda.model.scene import Scene
from rigdda.model.site import Site
from rigdda.results.ending import Ending, ending
from rigdda.results.outcome import Outcome, judge, leave, stations, watch
from rigdda.single import SingleReleases, can_share

EVERY = 0.05
"""Interval of the frames of a run from which states of barriers are judged [s]."""

MOST_BLOCKS = 32
"""Most blocks of a scene whose arrays are kept: packing more takes little beside simulating them.
There are about as many kinds of them as numbers of blocks and of corners."""

Result = TypeVar("Result")

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

    The ground and what stands on it are built once, by the first release. Later ones of a single
    block go without a scene, see `rigdda.single`. Of others the blocks are checked and written into
    the arrays of the last one, with what is drawn of the ground. Outcomes are those of
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
        (found,) = self.outcomes([(seed, event)])
        if isinstance(found, Error):
            raise found
        return found

    def outcomes(self, releases: Sequence[tuple[int, str | None]]) -> list[Outcome | Error]:
        """Return the outcomes of some releases, seeds and events, or what went wrong with them.

        All are drawn, then all are run, then all are judged, so that what each of these needs stays
        in the processor's caches: what is done beside the steps takes a tenth less time.
        """
        drawn = [_tried(self._site.draw, seed, event) for seed, event in releases]
        ended = [d if isinstance(d, Error) else _tried(self._drawn_ending, d) for d in drawn]
        return [e if isinstance(e, Error) else judge(self._site, *e) for e in ended]

    def _drawn_ending(self, drawn: Drawn) -> tuple[Ending, str, float]:
        """Return how a release ended, the name of its event and its width [m]."""
        return self.ending(drawn), drawn.event, drawn.width

    def ending(self, drawn: Drawn) -> Ending:
        """Return how a release of what was drawn ends. Raises as `rigdda.release` does."""
        if len(drawn.blocks) == 1 and self._single is not None:
            ended = self._single.ending(drawn)
            if ended is not None:
                return ended
        duration = self._site.motion.duration
        # a wall that slid or overturned on the way may come to stand again
        moving = any(isinstance(barrier, GravityWall) for barrier in self._standing)
        run = self.simulation(self.scene(drawn)).run(duration, EVERY if moving else duration)
        return ending(run, stations(self._site, run.scene.barriers), self._site.road.start)

    def scene(self, drawn: Drawn) -> Scene:
        """Return the scene of what was drawn, on the ground and with the barriers of the first."""
        if self._base is None:
            scene = self._site.scene(drawn, self._site.built(self._layout, drawn.width))
            self._base = scene, drawn
            if can_share(self._site, scene):
                self._single = SingleReleases(self._site, self._standing, scene)
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


def _tried(function: Callable[..., Result], *arguments: Any) -> Result | Error:
    """Return what a function returns, or the error that it raises."""
    try:
        return function(*arguments)
    except Error as error:
        return error


def outcomes(
    jobs: Sequence[Job], parts: Iterable[Sequence[int]]
) -> list[tuple[int, Outcome | Error]]:
    """Return the outcomes of the jobs at some places, or what went wrong, each with its place.

    Several threads may share `parts`, an iterator. The jobs of a part have the same site and
    layout, and parts with the same ones are to follow one another.
    """
    found: list[tuple[int, Outcome | Error]] = []
    batch, of = None, None
    for places in parts:
        site, layout, _, _ = jobs[places[0]]
        try:
            if batch is None or of is None or of[0] is not site or of[1] != layout:
                batch, of = Batch(site, layout), (site, layout)
        except Error as error:
            found += [(place, error) for place in places]
            continue
        found += zip(places, batch.outcomes([jobs[place][2:] for place in places]), strict=True)
    return found
