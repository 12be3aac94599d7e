"""Releases of a single block of a site with a layout, by how they end.

Most releases are of a single block, and it comes down in less than a millisecond. What all of them
share is prepared once: the ground, where barriers stand, how surfaces meet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.barriers import Built, Embankment, Fence, GravityWall, section
from rigdda.barriers.base import Reach, sliding_resistance, surfaces_below
from rigdda.dynamics.pack.single import MOST_CORNERS
from rigdda.dynamics.single_block import Descent, SingleBlock
from rigdda.dynamics.stations import chainages
from rigdda.geometry import clearly_convex, polygon_properties
from rigdda.model.events import Drawn
from rigdda.model.meetings import Meetings
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings, longest_step_of_single
from rigdda.model.site import Site
from rigdda.results.ending import BarrierEnding, Ending, steepest_deposit
from rigdda.results.log import log_of
from rigdda.results.outcome import leave, stations, watch
from rigdda.results.states import STANDS

NEVER: NDArray[np.float64] = np.zeros(0)
"""Times of the frames that are kept on the way: none."""


class Standing(NamedTuple):
    """A barrier where it stands, as it is for all releases."""

    reach: Reach
    """Where it holds rock, but for how steeply a deposit rises."""
    area: float
    """Area of its outline [m2]."""
    base: list[tuple[int, int]]
    """Pairs of surfaces on which an embankment may slide."""
    road_area: float
    """Its area beyond the uphill edge of the road [m2]."""


def can_share(site: Site, scene: Scene) -> bool:
    """Return whether releases of single blocks can share what a scene of one of them has.

    Its ground must be the same in all, no gravity wall may stand in it, and contacts must rebound
    as their restitution says.
    """
    surfaces = (*site.surfaces.values(), *(pair.surface for pair in site.interfaces))
    return (
        scene.roughness is None
        and scene.smooth_ground is not None
        and not any(isinstance(barrier, GravityWall) for barrier in scene.barriers)
        and all(surface.restitution is not None for surface in surfaces)
    )


class SingleReleases:
    """Releases of a single block of a site with a layout.

    Parameters
    ----------
    site : Site
        The site.
    layout : list of Barrier
        What stands, without mesh.
    scene : Scene
        That of one release with this layout, for which `can_share` holds.
    """

    def __init__(self, site: Site, layout: list[Built], scene: Scene):
        self._site, self._layout, self._scene = site, layout, scene
        names = list(scene.surfaces)
        fences = any(isinstance(barrier, Fence) for barrier in layout)
        self._meetings = Meetings(site, scene.barrier_surface if fences else None)
        self._gravity = -scene.gravity_vector[1]
        self._lines = stations(site, scene.barriers)
        self._leave = leave(site, scene)
        self._standing = [self._stand(i, names) for i in range(len(layout))]
        self._blocks: dict[float, SingleBlock] = {}  # by the step [s]

    def _stand(self, index: int, names: list[str]) -> Standing:
        """Return how a barrier stands; `names` are those of the surfaces in their order."""
        scene, barrier = self._scene, self._scene.barriers[index]
        outline, base = scene.outline(index), []
        if isinstance(barrier, Embankment):
            assert scene.terrain is not None
            own = names.index(scene.fill)
            base = [(own, names.index(n)) for n in surfaces_below(scene.terrain, outline)]
        return Standing(
            reach=barrier.holds(outline, scene.ground, 0.0),
            area=section(outline),
            base=base,
            road_area=barrier.area_beyond(self._site.road.start, outline),
        )

    def ending(self, drawn: Drawn) -> Ending | None:
        """Return how a release of a single block ends.

        None where it takes a scene to tell, see `SingleBlock.run`.
        """
        (block,) = drawn.blocks
        if block.fixed or len(block.vertices) > MOST_CORNERS:
            return None
        site, meetings = self._site, self._meetings
        meetings.draw(drawn)
        area = polygon_properties(block.vertices)[0]
        most = longest_step_of_single(area, self._gravity)
        dt = site.motion.dt / max(1, math.ceil(site.motion.dt / most))
        arrays = self._blocks.get(dt)
        if arrays is None:
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
        found = arrays.run(block, meetings, forces, limits, steps)
        if found is None:
            return None
        return self._ending(found, area, block.density, barriers, resistances)

    def _packed(self, drawn: Drawn, dt: float) -> SingleBlock:
        """Return new arrays for single blocks that are computed in a step [s]."""
        scene = self._site.scene(drawn, self._site.built(self._layout, drawn.width))
        lines, settings = chainages(self._lines), Settings(dt=dt)
        found = SingleBlock(scene, settings, lines, watch(self._site), self._leave)
        self._blocks[dt] = found
        return found

    def _resistance(self, index: int, barrier: Built) -> float:
        """Return the thrust that a barrier bears in the last release that was drawn [N/m]."""
        standing = self._standing[index]
        if not isinstance(barrier, Embankment):
            return barrier.resistance(self._scene, NEVER)
        friction = min(float(self._meetings.friction_deg[pair]) for pair in standing.base)
        return sliding_resistance(self._gravity, barrier.density, standing.area, friction)

    def _ending(
        self,
        found: Descent,
        area: float,
        density: float,
        barriers: list[Built],
        resistances: list[float],
    ) -> Ending:
        """Return how a release ended, by what came of its block and what barriers bear."""
        log = log_of(found.events, len(barriers), 1, self._lines)
        rise = steepest_deposit([self._meetings.least_friction_deg])
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
    """Return where a barrier holds rock after it has given way so far downhill [m]."""
    if moved == 0.0:
        return reach
    sunk = barrier.height - barrier.left_height(abs(moved)) if isinstance(barrier, Fence) else 0.0
    return reach._replace(end=reach.end + moved, top=reach.top - sunk)
