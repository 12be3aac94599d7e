"""Releases: simulations of a site with a layout for one seed or many.

The descent of a release is computed in one of three ways, which give the same outcomes bit for bit
(`tests/reliability/test_single_blocks.py`):

- `simulation` packs a scene of its own. `release` uses it, because it returns the frames of a run.
- `Batch` computes many releases of one site with one layout, which share everything that does not
  depend on the seed. With several blocks, it resets the arrays of a
  `rigdda.dynamics.template.Template` instead of packing a scene.
- `SingleReleases` computes releases of a single block for a `Batch`, where `can_share` allows it.
  They need no scene at all, see `rigdda.dynamics.single_block`. Most releases are of this kind and
  take less than a millisecond.

`rigdda.trajectory` and `rigdda.passages` have no way of their own: both read the motion of a
`Batch`, the first in every step (`StepRecord`) and the second at stations.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from rigdda import check, distribution
from rigdda.barriers import (
    Barrier,
    Built,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    as_layout,
    section,
    standing,
)
from rigdda.barriers.base import (
    Reach,
    sliding_angle,
    sliding_resistance,
    surfaces_below,
)
from rigdda.dynamics.monitors import chainages
from rigdda.dynamics.run import Run
from rigdda.dynamics.simulation import Simulation
from rigdda.dynamics.single_block import MOST_CORNERS, Descent, SingleBlock
from rigdda.dynamics.step_record import StepRecord
from rigdda.dynamics.template import Template
from rigdda.errors import BadInput, DoubtfulInput, Error
from rigdda.geometry import clearly_convex, polygon_properties
from rigdda.ground.terrain import Terrain
from rigdda.measurement import (
    STANDS,
    BarrierEnding,
    Ending,
    ending,
    judge,
    leave,
    log_of,
    measure,
    stations,
    steepest_deposit,
    watch,
)
from rigdda.model.interfaces import ContactProperties
from rigdda.model.outcome import Outcome
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings, site_step
from rigdda.model.site import Site
from rigdda.model.site_tables import Drawn

NEVER: NDArray[np.float64] = np.zeros(0)
"""Times of intermediate frames that are recorded: none."""


class StandingBarrier(NamedTuple):
    """Properties of a barrier that are the same in all releases."""

    reach: Reach
    """Where it holds rock, without the slope of the deposit."""
    area: float
    """Area of its outline [m2]."""
    inclination: float
    """Inclination of the ground under an embankment, else 0 [deg]."""
    base: list[tuple[int, int]]
    """Pairs of surfaces on which an embankment may slide."""
    road_area: float
    """Its area beyond the uphill edge of the road [m2]."""


def can_share(site: Site, scene: Scene) -> bool:
    """Return whether releases of single blocks can share the arrays of a scene of one of them.

    This requires that the ground is the same in all releases, that there is no gravity wall, and
    that every contact has a coefficient of restitution.
    """
    surfaces = (*site.surfaces.values(), *(pair.surface for pair in site.interfaces))
    return (
        scene.roughness is None
        and scene.smooth_ground is not None
        and not any(isinstance(barrier, GravityWall) for barrier in scene.barriers)
        and all(surface.restitution is not None for surface in surfaces)
    )


class SingleReleases:
    """Releases of a single block at a site with a layout.

    Parameters
    ----------
    site : Site
        The site.
    layout : list of Barrier
        The barriers, without mesh.
    scene : Scene
        Scene of one release with this layout, which must satisfy `can_share`.
    """

    def __init__(self, site: Site, layout: list[Built], scene: Scene):
        self._site, self._layout, self._scene = site, layout, scene
        names = list(scene.surfaces)
        self._properties = ContactProperties(site)
        self._gravity = -scene.gravity_vector[1]
        self._lines = stations(site, scene.barriers)
        self._leave = leave(site, scene)
        self._standing = [self._stand(i, names) for i in range(len(layout))]
        self._blocks: dict[float, SingleBlock] = {}  # by the step [s]

    def _stand(self, index: int, names: list[str]) -> StandingBarrier:
        """Return the fixed properties of a barrier; `names` lists the surfaces in order."""
        scene, barrier = self._scene, self._scene.barriers[index]
        outline, base, inclination = scene.outline(index), [], 0.0
        if isinstance(barrier, Embankment):
            assert scene.terrain is not None
            inclination = barrier.base_inclination(scene.terrain, outline)
            own = names.index(scene.fill)
            base = [(own, names.index(n)) for n in surfaces_below(scene.terrain, outline)]
        return StandingBarrier(
            reach=barrier.holds(outline, scene.ground, 0.0),
            area=section(outline),
            inclination=inclination,
            base=base,
            road_area=barrier.area_beyond(self._site.road.start, outline),
        )

    def ending(self, drawn: Drawn, record: StepRecord | None = None) -> Ending | None:
        """Return how a release of a single block ends, and fill a record if one is given.

        Returns None if the release must be simulated as a scene, see `SingleBlock.run`.
        """
        (block,) = drawn.blocks
        if block.fixed or len(block.vertices) > MOST_CORNERS:
            return None
        site, properties = self._site, self._properties
        properties.draw(drawn)
        area = polygon_properties(block.vertices)[0]
        dt = site_step(site.motion.dt, np.array([area]), self._gravity)
        arrays = self._blocks.get(dt)
        if arrays is None or not arrays.has_room(drawn.stems):
            if not clearly_convex(block.vertices):
                return None
            arrays = self._packed(drawn, dt)
        barriers = [barrier.for_width(drawn.width) for barrier in self._layout]
        resistances = [self._resistance(i, barrier) for i, barrier in enumerate(barriers)]
        bodies = [barriers[i] for i in self._scene.bodies]
        forces = [barrier.braking_force for barrier in bodies if isinstance(barrier, Fence)]
        limits = [
            bears if isinstance(barrier, Embankment) else math.inf
            for bears, barrier in zip(resistances, barriers, strict=True)
        ]
        steps = max(1, round(site.motion.duration / dt))
        found = arrays.run(block, properties, forces, limits, drawn.stems, steps, record)
        if found is None:
            return None
        return self._ending(found, area, block.density, barriers, resistances)

    def _packed(self, drawn: Drawn, dt: float) -> SingleBlock:
        """Return new arrays for single blocks with a step [s]."""
        scene = self._site.scene(drawn, self._site.built(self._layout, drawn.width))
        lines, settings = chainages(self._lines), Settings(dt=dt)
        found = SingleBlock(scene, settings, lines, watch(self._site), self._leave)
        self._blocks[dt] = found
        return found

    def _resistance(self, index: int, barrier: Built) -> float:
        """Return the thrust resistance of a barrier in the last drawn release [N/m]."""
        standing = self._standing[index]
        if not isinstance(barrier, Embankment):
            return barrier.resistance(self._scene, NEVER)
        friction = min(float(self._properties.friction_deg[pair]) for pair in standing.base)
        angle = sliding_angle(friction, standing.inclination)
        return sliding_resistance(self._gravity, barrier.density, standing.area, angle)

    def _ending(
        self,
        found: Descent,
        area: float,
        density: float,
        barriers: list[Built],
        resistances: list[float],
    ) -> Ending:
        """Return how a release ended, from the results of its block and the resistances."""
        log = log_of(found.events, len(barriers), 1, self._lines)
        rise = steepest_deposit([self._properties.least_friction_deg])
        moved = [0.0] * len(barriers)
        for i, way in zip(self._scene.bodies, found.moved, strict=True):
            moved[i] = way
        return Ending(
            areas=[area],
            masses=[density * area],
            starts=[found.start],
            places=[found.place],
            speeds=[math.hypot(*found.velocity)],
            log=log,
            extent=found.extent,
            road_energy=found.energy,
            time=found.time,
            barriers=[
                BarrierEnding(
                    barrier=barrier,
                    states=[(0.0, STANDS), *barrier.changes(NEVER, NEVER, log.failed[i])],
                    reach=moved_reach(barrier, standing.reach, moved[i])._replace(rise=rise),
                    absorbed=found.absorbed[i],
                    thrust=found.thrust[i],
                    resistance=resistances[i],
                    displacement=abs(moved[i]),
                    road_area=standing.road_area,
                )
                for i, (barrier, standing) in enumerate(zip(barriers, self._standing, strict=True))
            ],
        )


def moved_reach(barrier: Built, reach: Reach, moved: float) -> Reach:
    """Return where a barrier holds rock after a downhill displacement [m]."""
    if moved == 0.0:
        return reach
    sunk = barrier.height - barrier.left_height(abs(moved)) if isinstance(barrier, Fence) else 0.0
    return reach._replace(end=reach.end + moved, top=reach.top - sunk)


EVERY = 0.05
"""Interval of the frames from which the states of barriers are determined [s]."""

MOST_BLOCKS = 32
"""Maximum number of blocks of a scene whose arrays are kept for reuse. Packing a larger scene takes
little time compared with its simulation. There are about as many sets of arrays as combinations of
numbers of blocks and of corners."""

Result = TypeVar("Result")

Job = tuple[Site, Sequence[Barrier], int, str | None]
"""A site, a layout, a seed and the name of an event, or None for an event drawn by the seed."""

CheckedJob = tuple[Site, Layout, int, str | None]
"""A job whose layout was checked."""


def as_site(site: Site) -> Site:
    """Return a site.

    Raises
    ------
    BadInput
        If the argument is not a site.
    """
    if not isinstance(site, Site):
        raise BadInput("site", site, "give a site: rigdda.Site.load(name) gives one")
    return site


class Batch:
    """Successive releases of a site with a layout.

    The first release builds the ground and the barriers. Later releases of a single block need no
    scene, see `SingleReleases`. For other releases, only the blocks are checked and written into
    the existing arrays, together with the random properties of the ground. The outcomes are those
    of `rigdda.release`, in any order.

    Parameters
    ----------
    site : Site
        The site.
    layout : sequence of Barrier
        The barriers.
    more : sequence of float
        Stations that `simulation` records in addition to those that outcomes need [m].
    end : float, optional
        Chainage beyond which `simulation` ignores blocks that move downhill [m]; by default that
        of outcomes.
    """

    def __init__(
        self,
        site: Site,
        layout: Sequence[Barrier],
        more: Sequence[float] = (),
        end: float | None = None,
    ):
        self._site = as_site(site)
        self._layout = site.as_built(layout)
        self._more, self._end = more, end
        self._standing = list(standing(self._layout))
        self._watch = watch(site)
        self._base: tuple[Scene, Drawn] | None = None
        self._single: SingleReleases | None = None
        self._templates: dict[tuple[int, int, float, int], Template] = {}

    def outcome(self, seed: int, event: str | None = None) -> Outcome:
        """Return the outcome of one release. Raises the errors of `rigdda.release`."""
        (found,) = self.outcomes([(seed, event)])
        if isinstance(found, Error):
            raise found
        return found

    def outcomes(self, releases: Sequence[tuple[int, str | None]]) -> list[Outcome | Error]:
        """Return the outcomes of several releases (seed, event), or the errors that they raised.

        All are drawn, then simulated, then measured, so that the data of each stage stay in the
        processor cache; this takes a tenth off the time spent outside the steps.
        """
        drawn = [_tried(self._site.draw, seed, event) for seed, event in releases]
        ended = [d if isinstance(d, Error) else _tried(self._drawn_ending, d) for d in drawn]
        return [e if isinstance(e, Error) else judge(self._site, *e) for e in ended]

    def _drawn_ending(self, drawn: Drawn) -> tuple[Ending, str, float]:
        """Return how a release ended, the name of its event and its width [m]."""
        return self.ending(drawn), drawn.event, drawn.width

    def ending(self, drawn: Drawn, record: StepRecord | None = None) -> Ending:
        """Return how a drawn release ends, and fill a record if one is given.

        Raises the errors of `rigdda.release`.
        """
        if len(drawn.blocks) == 1 and self._single is not None:
            ended = self._single.ending(drawn, record)
            if ended is not None:
                return ended
        duration = self._site.motion.duration
        # intermediate frames are needed to see a wall that slides or overturns and stands again
        moving = any(isinstance(barrier, GravityWall) for barrier in self._standing)
        simulation, every = self.simulation(self.scene(drawn)), EVERY if moving else duration
        if record is None:
            run = simulation.run(duration, every)
        else:
            run = record.run(simulation, duration, every)
        return ending(run, stations(self._site, run.scene.barriers), self._site.road.start)

    def scene(self, drawn: Drawn) -> Scene:
        """Return the scene of a drawn release, with the ground and barriers of the first one."""
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
        return base.with_rock(
            drawn.blocks, surfaces, interfaces, barriers, drawn.roughness, drawn.stems
        )

    def simulation(self, scene: Scene) -> Simulation:
        """Return the simulation of such a scene; it invalidates the previous one."""
        settings = self._site.settings(scene)
        if len(scene.blocks) > MOST_BLOCKS:
            return Simulation(scene, settings, self.lines(scene), self._watch, self._beyond(scene))
        corners = max(len(b.vertices) for b in scene.blocks)
        ground = len(scene.ground.points) if scene.ground is not None else 0
        key = len(scene.blocks), corners, settings.dt, ground
        template = self._templates.get(key)
        if template is None or not template.fits(scene):
            lines, beyond = chainages(self.lines(scene)), self._beyond(scene)
            template = Template(scene, settings, lines, self._watch, beyond)
            self._templates[key] = template
        return Simulation(scene, settings, template=template)

    @property
    def ground(self) -> Terrain:
        """The ground with its earthworks, without pits; known after the first release."""
        assert self._base is not None and self._base[0].smooth_ground is not None
        return self._base[0].smooth_ground

    def lines(self, scene: Scene) -> tuple[float, ...]:
        """Return the ascending stations at which `simulation` records crossings [m]."""
        return tuple(sorted({*stations(self._site, scene.barriers), *self._more}))

    def _beyond(self, scene: Scene) -> float:
        """Return the chainage beyond which blocks that move downhill are ignored [m]."""
        return leave(self._site, scene) if self._end is None else self._end


def simulation(site: Site, scene: Scene) -> Simulation:
    """Return a simulation of a scene of a site that records everything its outcome needs."""
    lines = stations(site, scene.barriers)
    return Simulation(scene, site.settings(scene), lines, watch(site), leave(site, scene))


def _tried(function: Callable[..., Result], *arguments: Any) -> Result | Error:
    """Return the result of a function, or the error that it raises."""
    try:
        return function(*arguments)
    except Error as error:
        return error


def outcomes(
    jobs: Sequence[Job], parts: Iterable[Sequence[int]]
) -> list[tuple[int, Outcome | Error]]:
    """Return the outcomes of the jobs at some positions, or their errors, each with its position.

    Several threads may share `parts`, an iterator. The jobs of a part must have the same site and
    layout, and parts with the same site and layout should follow one another.
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


CUT_OFF_SHARE = 0.05
"""Fraction of releases that may be cut off without a warning; it allows for occasional late
blocks."""


MOST_PER_THREAD = 16
"""Maximum number of releases that a thread takes at a time. Releases of events with at least this
mean number of blocks are taken one by one."""


def release(
    site: Site,
    layout: Sequence[Barrier] = (),
    seed: int = 0,
    event: str | None = None,
    progress: bool = False,
) -> tuple[Run, Outcome]:
    """Simulate one release with a layout, of a given event or of one drawn by the seed.

    Events are drawn by their rates without mesh, because mesh makes them rarer but does not change
    a release: the same seed gives the same rock with every layout.

    Returns
    -------
    run : Run
        Frames every 0.05 s. The run ends when every block is at rest or moves on beyond the road.
    outcome : Outcome
        Consequences for the road and the barriers.

    Raises
    ------
    BadInput
        If the layout does not fit the slope, the event does not exist or the seed is invalid.
    Diverged
        If the simulation diverges.

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts the release off, see `Outcome.cut_off`.
    """
    drawn = as_site(site).draw(seed, event)
    scene = site.scene(drawn, site.built(site.as_built(layout), drawn.width))
    run = simulation(site, scene).run(site.motion.duration, EVERY, progress)
    outcome = measure(site, run, drawn.event, drawn.width)
    if outcome.cut_off:
        _doubt_duration(site)
    return run, outcome


def _doubt_duration(site: Site) -> None:
    warnings.warn(
        f"motion.duration = {site.motion.duration:g} of site {site.name!r}: rock above the road "
        "still moves as releases end, and counts as if it stopped there: use a longer duration",
        DoubtfulInput,
        stacklevel=3,
    )


def release_outcome(
    site: Site, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
) -> Outcome:
    """Return the outcome of `release` in less time, without intermediate frames."""
    return Batch(site, layout).outcome(seed, event)


def _job(i: int, job: Job) -> CheckedJob:
    if not isinstance(job, tuple | list) or len(job) != 4:
        raise BadInput(f"jobs[{i}]", job, "give (site, layout, seed, event)")
    site, layout, seed, event = job
    return site, as_layout(layout), seed, event


def release_many(jobs: Sequence[Job], threads: int | None = None) -> list[Outcome]:
    """Return the outcomes of many releases (site, layout, seed, event).

    They are computed in threads, or in the executor of `rigdda.distribution.using`. Each outcome
    equals that of `release`. Releases of a site with a layout that the same thread computes share
    everything that does not depend on the seed.

    Parameters
    ----------
    jobs : sequence of (Site, sequence of Barrier, int, str or None)
        The releases.
    threads : int, optional
        Number of threads; by default one per core, or the executor in use.

    Raises
    ------
    BadInput, Diverged
        As `release` does, for the first job that fails.

    Warns
    -----
    DoubtfulInput
        If `motion.duration` cuts off more than one release in twenty, see `Outcome.cut_off`.
    """
    if not isinstance(jobs, Sequence):
        raise BadInput("jobs", jobs, "give a sequence of (site, layout, seed, event)")
    each = [_job(i, job) for i, job in enumerate(jobs)]
    if threads is None and distribution.current() is not None:
        found = _distributed(each)
    else:
        usual = distribution.threads()
        count = usual if threads is None else check.integer("threads", threads, 1)
        found = _in_threads(each, count)
    for outcome in found:
        if isinstance(outcome, Error):
            raise outcome
    good = [outcome for outcome in found if isinstance(outcome, Outcome)]
    check_duration([site for site, *_ in each], good)
    return good


def check_duration(sites: Sequence[Site], outcomes: Sequence[Outcome]) -> None:
    """Warn if `motion.duration` cuts off more than one release in twenty.

    Parameters
    ----------
    sites, outcomes : sequence of Site, sequence of Outcome
        The site and the outcome of each release.

    Warns
    -----
    DoubtfulInput
        If it does, and more than one release.
    """
    cut = [site for site, outcome in zip(sites, outcomes, strict=True) if outcome.cut_off]
    if len(cut) > max(1.0, CUT_OFF_SHARE * len(outcomes)):
        _doubt_duration(cut[0])


def by_size(jobs: Sequence[CheckedJob]) -> tuple[list[int], list[int]]:
    """Return the positions of the releases of large events, and those of all others.

    A release of a mass takes up to a thousand times as long as that of a single block. Threads and
    workers compute such releases first and one by one, because all would have to wait for one that
    starts last. Those of one site and layout follow one another. Releases that will be refused
    count as small.
    """
    counts: dict[int, dict[str, float]] = {}
    large: dict[tuple[int, Layout], list[int]] = {}
    small: list[int] = []
    for place, (site, layout, seed, event) in enumerate(jobs):
        if id(site) not in counts:
            every = site.events if isinstance(site, Site) else ()
            counts[id(site)] = {e.name: e.block_count(site.source(e.source)) for e in every}
        name = _tried(site.pick, seed) if event is None and counts[id(site)] else event
        if isinstance(name, str) and counts[id(site)].get(name, 0.0) >= MOST_PER_THREAD:
            large.setdefault((id(site), layout), []).append(place)
        else:
            small.append(place)
    return [place for group in large.values() for place in group], small


def divided(jobs: Sequence[CheckedJob], most: int) -> list[list[int]]:
    """Return the positions of jobs in parts of at most `most`, see `by_size`.

    A part may contain jobs of several sites and layouts.
    """
    large, small = by_size(jobs)
    return [[place] for place in large] + [small[i : i + most] for i in range(0, len(small), most)]


def _in_threads(jobs: Sequence[CheckedJob], threads: int) -> list[Outcome | Error]:
    """Return the outcome or the error of each job, computed in threads of this process."""
    large, small = by_size(jobs)
    groups: dict[tuple[int, Layout], list[int]] = {}
    for place in small:
        site, layout, _, _ = jobs[place]
        groups.setdefault((id(site), layout), []).append(place)
    threads = max(1, min(threads, len(jobs)))
    most = max(1, min(MOST_PER_THREAD, len(jobs) // (8 * threads)))
    parts = [[place] for place in large]
    parts += [group[i : i + most] for group in groups.values() for i in range(0, len(group), most)]
    queue = iter(parts)
    with ThreadPoolExecutor(threads) as pool:
        done = list(pool.map(lambda _: outcomes(jobs, queue), range(threads)))
    found = sorted((pair for part in done for pair in part), key=lambda pair: pair[0])
    return [outcome for _, outcome in found]


SENT = 64
"""Maximum number of releases that are sent to a worker at a time."""


def _distributed(jobs: Sequence[CheckedJob]) -> list[Outcome | Error]:
    """Return the outcome or the error of each job, computed by the workers of the executor."""
    parts = divided(jobs, SENT)
    sent = [[jobs[place] for place in part] for part in parts]
    done = [outcome for found in distribution.mapped(_sent, sent) for outcome in found]
    places = [place for part in parts for place in part]
    at = dict(zip(places, done, strict=True))
    return [at[place] for place in range(len(jobs))]


def _sent(jobs: Sequence[CheckedJob]) -> list[Outcome | Error]:
    """Return the outcomes of jobs that were sent to this worker."""
    return _in_threads(jobs, distribution.threads())
