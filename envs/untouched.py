"""Outcomes of layouts that no block of a release comes near: they follow from those without.

A block that came to rest uphill of a barrier counts as held by it where it lies below the line that
rises from the top of the barrier, see `rigdda.Outcome`. Where it lies is known of a single block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigdda import BarrierOutcome, Ditch, Embankment, Fence, GravityWall, Outcome, Site
from rigdda.barriers import Built, Earthwork, earthworks
from rigdda.envs.memory import Memory
from rigdda.model.roughness import REACH
from rigdda.model.settings import EARTH

MARGIN = 0.1
"""Distance from a barrier beyond which blocks are sure not to touch it, at ends of steps [m]."""

LARGEST = 1.5
"""Upper bound of the radius of a block over the root of its area [-]."""

UNIT = 1.0
"""Width of an event for which resistances are kept [m]."""


@dataclass(frozen=True, slots=True)
class Standing:
    """A barrier of a layout where it stands.

    Parameters
    ----------
    start, end : float
        Chainages between which blocks may touch it that do so within a step and go back [m]: the
        reach of a release is taken at the ends of steps.
    face, top : float
        Where the line begins below which it holds what lies uphill [m]; -inf of what holds nothing
        there.
    bears : float
        Thrust that it bears in an event of `UNIT` width, without scatter of friction [N/m].
    """

    start: float
    end: float
    face: float
    top: float
    bears: float


memory: Memory[tuple[bytes, tuple[Built, ...]], tuple[Standing, ...]] = Memory(1 << 12)
"""What stands of a layout on a site."""


def misses(site: Site, key: bytes, layout: tuple[Built, ...], outcome: Outcome) -> bool:
    """Tell whether the blocks of a release stay clear of a layout.

    Parameters
    ----------
    site, key : Site, bytes
        The site and its `fingerprint`.
    layout : tuple of Built
        What stands.
    outcome : Outcome
        Of the release, with or without the layout.
    """
    low, high = outcome.reach
    stands = _standing(site, key, layout) if layout else ()
    return all(high < b.start or low > b.end for b in stands)


def outcome(site: Site, key: bytes, layout: tuple[Built, ...], without: Outcome) -> Outcome | None:
    """Return the outcome of a layout that follows from one without barriers.

    None if it does not, or is not known without simulating it; see `misses`.
    """
    if not layout:
        return without
    if not misses(site, key, layout, without):
        return None
    stands = _standing(site, key, layout)
    holds = [_holds(site, barrier, without) for barrier in stands]
    if None in holds or (site.friction_varies and not _known_to_bear(layout)):
        return None
    share = 1.0 if any(holds) else 0.0
    return replace(
        without,
        held_fraction=share * without.slope_fraction,
        slope_fraction=(1.0 - share) * without.slope_fraction,
        barriers=tuple(
            _idle(barrier.for_width(without.width), barrier, there, bool(held))
            for barrier, there, held in zip(layout, stands, holds, strict=True)
        ),
    )


def _holds(site: Site, barrier: Standing, without: Outcome) -> bool | None:
    """Tell whether a barrier holds a block that came to rest uphill of it; None if in doubt."""
    low, high = without.reach
    if without.slope_fraction == 0.0 or low > barrier.face or barrier.face == -math.inf:
        return False
    rise = math.tan(math.radians(min(s.friction_deg for s in site.surfaces.values())))
    points, at = site.profile.points, without.run_out
    alone = at[0] == at[2] and without.slope_fraction == 1.0
    inner = points[(points[:, 0] > low) & (points[:, 0] < high), 0]
    x = np.array([at[0]] if alone else [low, *inner, high])
    over = barrier.top + rise * (barrier.face - x) - np.interp(x, *points.T)
    if site.pit_spacing > 0.0:
        return None  # it may lie in a pit
    if not site.friction_varies and (over <= 0.0).all():
        return False
    radius = LARGEST * math.sqrt(without.released_volume / without.width)
    if not site.friction_varies and alone and over[0] > 2.0 * radius:
        return True
    return None


def _known_to_bear(layout: Sequence[Built]) -> bool:
    """Tell whether what a layout bears does not depend on friction."""
    return all(isinstance(barrier, Fence | Ditch) for barrier in layout)


def _standing(site: Site, key: bytes, layout: tuple[Built, ...]) -> tuple[Standing, ...]:
    """Return what stands of a layout."""
    known = memory.recall([(key, layout)]).get((key, layout))
    if known is None:
        drawn = site.draw(0, site.event_names[0])
        built = site.built(layout, UNIT)
        usual = drawn._replace(
            blocks=drawn.blocks[:1], friction_deg=0.0, strengths=(), roughness=None
        )
        scene = site.scene(usual, built)
        _, moved = earthworks(site.profile, layout, site.soil)
        known = tuple(
            _stands(site, barrier, moved.get(barrier), scene.resistance(i))
            for i, barrier in enumerate(layout)
        )
        memory.remember({(key, layout): known})
    return known


def _stands(site: Site, barrier: Built, moved: np.ndarray | None, bears: float) -> Standing:
    """Return where a barrier stands, with the corners of the earth moved for it."""
    if moved is None:
        assert not isinstance(barrier, Earthwork)
        moved = barrier.outline(site.profile)
    (start, _), (end, top) = moved.min(axis=0).tolist(), moved.max(axis=0).tolist()
    face = start
    if isinstance(barrier, Embankment):
        face += barrier.side_slope * barrier.height
    face = -math.inf if isinstance(barrier, Ditch) else face
    # half of what a corner moves in a step that has all the energy of a fall from the top: its
    # speed is at most twice that of the fall
    drop = float(np.ptp(site.profile.points[:, 1]))
    near = MARGIN + site.motion.dt * math.sqrt(2.0 * EARTH * drop) + REACH * site.pit_spacing
    return Standing(start - near, end + near, face, top, bears)


def _idle(built: Built, barrier: Built, there: Standing, holds: bool) -> BarrierOutcome:
    """Return what happens to a barrier that no block comes near."""
    bears = there.bears
    if isinstance(built, Fence):
        bears = built.braking_force
    elif isinstance(built, GravityWall | Embankment):
        unit = barrier.for_width(UNIT)
        assert isinstance(unit, GravityWall | Embankment)
        bears *= built.density / unit.density
    return BarrierOutcome(
        hits=0,
        max_energy=0.0,
        total_energy=0.0,
        absorbed_energy=0.0,
        impact_heights=(),
        overtopped=0,
        failed=False,
        caught=1.0 if holds else 0.0,
        state="stands",
        displacement=0.0,
        road_area=0.0,
        thrust=0.0,
        resistance=bears,
        left_height=0.0 if isinstance(built, Ditch) else built.height,
    )
