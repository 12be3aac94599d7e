"""What may be built where on a site: rules, sizes, clear distances, nearest possible places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Barrier, GravityWall, Layout, Mesh, Site, check
from rigdda.barriers import KINDS, Earthwork, MeshOption, as_layout, earthworks
from rigdda.barriers.base import TOLERANCE
from rigdda.model.barrier_zone import BarrierZone

Span = tuple[float, float]

MIN_GAP = 0.5
"""Least distance between the works of two barriers [m]."""


def room(barrier: Barrier, works: Span) -> Span:
    """Return the chainages that a barrier needs: its works, and where it gives way to [m]."""
    start, end = works
    return start, end + barrier.elongation_path


def meet(one: Span, two: Span) -> bool:
    """Tell whether two barriers are nearer than `MIN_GAP`."""
    return one[0] < two[1] + MIN_GAP - TOLERANCE and two[0] < one[1] + MIN_GAP - TOLERANCE


def check_gaps(rooms: Sequence[tuple[str, Barrier, Span]]) -> None:
    """Check that no two barriers meet.

    Parameters
    ----------
    rooms : sequence of (str, Barrier, (start, end))
        What messages call each, each, and the room that it needs [m].

    Raises
    ------
    BadInput
        If two do.
    """
    ordered = sorted(rooms, key=lambda item: item[2])
    for (_, before, one), (where, barrier, two) in pairwise(ordered):
        if meet(one, two):
            mend = f"put it {MIN_GAP:g} m beyond {one[1]:g}, up to where the {before.words} needs"
            raise BadInput(f"{where}.x", barrier.x, mend)


Floats = NDArray[np.float64]

MACHINE = 3.0
"""Width of a machine that builds, empties and mends what is dug, filled or cast [m]: so much ground
that it can stand on lies beside the works, above and below together."""


class Rules:
    """What may be built where, on the ground of a site.

    Parameters
    ----------
    site : Site
        Its ground, road and sources.
    zone : BarrierZone
        Where barriers may stand, and how large they may be.

    Attributes
    ----------
    parts : list of (start, end)
        Parts of the zone that are free of loose rock [m].

    Raises
    ------
    BadInput
        If there are none.
    """

    def __init__(self, site: Site, zone: BarrierZone):
        self.site, self.zone = site, zone
        cut = [(max(low, zone.start), min(high, zone.end)) for low, high in site.rooms]
        self.parts = [(low, high) for low, high in cut if low < high]
        if not self.parts:
            mend = f"leave room in {site.rooms}: elsewhere loose rock lies"
            raise BadInput("zone", (zone.start, zone.end), mend)
        self._x, self._y = site.profile.points.T
        angles = {kind.steepest for kind in KINDS.values()} - {None}
        self._gentle = {angle: self._stretches(angle) for angle in angles if angle is not None}

    def _stretches(self, steepest: float) -> list[Span]:
        """Return the stretches of the ground that are at most so steep [deg], each whole."""
        rise, run = np.abs(np.diff(self._y)), np.diff(self._x)
        found: list[Span] = []
        for k in np.flatnonzero(rise <= run * math.tan(math.radians(steepest)) + TOLERANCE):
            low, high = float(self._x[k]), float(self._x[k + 1])
            if found and found[-1][1] == low:
                low = found.pop()[0]
            found.append((low, high))
        return found

    def beside(self, start: Floats, end: Floats, steepest: float) -> Floats:
        """Return how wide the ground beside works is, that is at most so steep [deg]: (n,) [m]."""
        low, high = np.array(self._gentle[steepest]).reshape(-1, 2).T[:, :, None]
        above = np.where((low <= start) & (start <= high), start - low, 0.0)
        below = np.where((low <= end) & (end <= high), high - end, 0.0)
        found: Floats = above.max(axis=0, initial=0.0) + below.max(axis=0, initial=0.0)
        return found

    def level(self, x: Floats) -> Floats:
        """Return the elevation of the natural ground at chainages [m]."""
        return np.interp(x, self._x, self._y)

    def held(self, option: MeshOption) -> Span:
        """Return the chainages of the sources whose events an option of mesh makes rarer [m]."""
        names = {
            event.source for event in self.site.events if option.factors.get(event.name, 1) < 1
        }
        rock = [source for source in self.site.sources if source.name in names or not names]
        ends = [s.band if s.band is not None else s.outline[:, 0].tolist() for s in rock]
        return min(min(x) for x in ends), max(max(x) for x in ends)

    def works(self, barrier: Barrier) -> Span:
        """Return the chainages between which a barrier takes up the ground [m]."""
        return barrier.works(self.site.profile)

    def check_layout(self, layout: Sequence[Barrier], kinds: Sequence[str], most: int) -> Layout:
        """Return a layout of some kinds and at most so many barriers, sorted downhill.

        Raises
        ------
        BadInput
            If it may not be built.
        """
        barriers = tuple(sorted(as_layout(layout), key=lambda barrier: barrier.x))
        if len(barriers) > most:
            raise BadInput("layout", f"{len(barriers)} barriers", f"give at most {most}")
        rooms = []
        for i, barrier in enumerate(barriers):
            where = f"layout[{i}]"
            check.one_of(f"{where}.kind", barrier.kind, kinds)
            if isinstance(barrier, Mesh):
                self.check_mesh(where, barrier)
            else:
                rooms.append((where, barrier, room(barrier, self.check(where, barrier))))
        if len(barriers) - len(rooms) > 1:
            raise BadInput("layout", "several meshes", "give at most one: choose another option")
        check_gaps(rooms)
        return barriers

    def check_mesh(self, where: str, mesh: Mesh) -> None:
        """Check that mesh is an option of the site, over the rock that it holds.

        Raises
        ------
        BadInput
            If it is not.
        """
        options = {option.name: option for option in self.site.meshes}
        check.one_of(f"{where}.option", mesh.option, options)
        check.number(f"{where}.x", mesh.x, *self.held(options[mesh.option]))

    def check(self, where: str, barrier: Barrier) -> Span:
        """Return the works of a barrier that may be built where it stands.

        Raises
        ------
        BadInput
            If it may not; the message begins with `where`.
        """
        self._check_size(where, barrier)
        start, end = self.works(barrier)
        self._check_place(where, barrier, start, end)
        steepest = barrier.steepest
        if steepest is not None:
            angle, most = self.inclination(start, end), steepest
            if isinstance(barrier, GravityWall):
                angle, most = self.foundation(start, end, steepest)
            if angle > most + TOLERANCE:
                mend = f"put it where the ground is at most {most:g} deg steep, not {angle:.1f}"
                raise BadInput(f"{where}.x", barrier.x, mend)
            beside = float(self.beside(np.array([start]), np.array([end]), steepest)[0])
            if beside < MACHINE - TOLERANCE:
                mend = (
                    f"put it where {MACHINE:g} m beside it are left to a machine, not {beside:.1f}"
                )
                raise BadInput(f"{where}.x", barrier.x, mend)
        if isinstance(barrier, Earthwork):
            try:
                earthworks(self.site.profile, (barrier,), self.site.soil)
            except BadInput as bad:
                raise BadInput(f"{where}: {bad.field}", bad.value, bad.mend) from None
        return start, end

    def _check_size(self, where: str, barrier: Barrier) -> None:
        for length in barrier.lengths:
            value, (low, high) = getattr(barrier, length.field), length.limits(self.zone)
            slack = TOLERANCE * max(1.0, high)
            if not low - slack <= value <= high + slack:
                mend = f"give a number of at least {low:g} and at most {high:g}"
                raise BadInput(f"{where}.{length.field}", value, mend)
        barrier.check_design(where, self.site)

    def _check_place(self, where: str, barrier: Barrier, start: float, end: float) -> None:
        """Check that it is in a part of the zone, and its distance from the road."""
        slack = TOLERANCE * max(1.0, abs(self.zone.end))
        if not any(low - slack <= start and end <= high + slack for low, high in self.parts):
            rooms = " or ".join(f"{low:g} to {high:g} m" for low, high in self.parts)
            mend = f"keep all of it, up to {end:g} m, within {rooms}"
            raise BadInput(f"{where}.x", barrier.x, mend)
        road = self.site.road.start
        give = barrier.elongation_path
        if give > 0.0 and end + give > road + slack:
            most = road - give - barrier.extent
            mend = f"put it at {most:g} or uphill: it gives way by {give:g} m"
            raise BadInput(f"{where}.x", barrier.x, f"{mend}, and the road begins at {road:g}")

    def inclination(self, start: float, end: float) -> float:
        """Return the mean inclination of the ground between two chainages [deg]."""
        high, low = self.level(np.array([start, end])).tolist()
        return math.degrees(math.atan2(abs(high - low), end - start))

    def foundation(self, start: float, end: float, most: float) -> tuple[float, float]:
        """Return the steepest ground under a gravity wall, and what it may be at most [deg].

        A wall of which a corner stands on ground that is steeper than its friction angle slides
        before any rock comes; `most` is what the ground may be beside that [deg].
        """
        under = np.flatnonzero((self._x[:-1] < end) & (start < self._x[1:]))
        rise, run = np.abs(np.diff(self._y))[under], np.diff(self._x)[under]
        names = {self.site.profile.surfaces[k] for k in under}
        friction = min(self.site.surfaces[name].friction_deg for name in names)
        steepest = float(np.degrees(np.arctan2(rise, run)).max())
        return steepest, min(most, friction)


STEP = 0.25
"""Distance of the places that are looked at for a barrier that does not fit [m]."""

NEAR_ZERO = 1e-3
"""Flatter ground than this is not looked at for its inclination [-]."""


class Room(Rules):
    """Where there is room for barriers: the rules of what may be built, and places that obey them.

    Parameters as of `Rules`.
    """

    def mesh(self, option: int) -> Mesh:
        """Return an option of the site's meshes, in the middle of the rock that it holds."""
        low, high = self.held(self.site.meshes[option])
        return Mesh(0.5 * (low + high), self.site.meshes[option].name)

    def put(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier moved to `x` with the sizes that it needs there; None if it cannot."""
        return barrier.placed(x, self.site, self.zone)

    def nearest(self, barrier: Barrier, taken: Sequence[Span]) -> tuple[Barrier, Span] | None:
        """Return a barrier moved as little as need be to where it may stand, and its works.

        Parameters
        ----------
        barrier : Barrier
            Where and what it should be.
        taken : sequence of (start, end)
            The room of what stands already [m].

        Returns
        -------
        (Barrier, (start, end)) or None
            None if there is none every `STEP`.
        """
        found = self._try(barrier, barrier.x, taken)
        if found is not None:
            return found
        for x in self._places(self.put(barrier, barrier.x) or barrier, taken):
            found = self._try(barrier, x, taken)
            if found is not None:
                return found
        return None

    def _try(
        self, barrier: Barrier, x: float, taken: Sequence[Span]
    ) -> tuple[Barrier, Span] | None:
        there = self.put(barrier, x)
        if there is None:
            return None
        span = room(there, self.works(there))
        if any(meet(span, other) for other in taken):
            return None
        try:
            self.check("barrier", there)
        except BadInput:
            return None
        return there, span

    def _places(self, barrier: Barrier, taken: Sequence[Span]) -> list[float]:
        """Return where it may stand as far as is seen without building it, the nearest first."""
        length = barrier.extent
        give = room(barrier, (0.0, length))[1]  # with what it needs downhill
        last = self.site.road.start - give if barrier.elongation_path > 0.0 else math.inf
        ends = [(low, min(high - length, last)) for low, high in self.parts]
        ends = [(low, high) for low, high in ends if low <= high]
        if not ends:
            return []
        edges = [x for pair in ends for x in pair] + self._x.tolist()
        edges += [x for low, high in taken for x in (low - MIN_GAP - give, high + MIN_GAP)]
        x = np.concatenate([*(np.arange(low, high, STEP) for low, high in ends), edges])
        x = x[np.any([(x >= low) & (x <= high) for low, high in ends], axis=0)]
        steepest = barrier.steepest
        if steepest is not None:
            rise = np.abs(self.level(x) - self.level(x + length))
            x = x[rise <= length * math.tan(math.radians(steepest)) + NEAR_ZERO]
            if not barrier.has_sides:  # its works end where its side meets the ground
                x = x[self.beside(x, x + length, steepest) >= MACHINE - TOLERANCE]
        for low, high in taken:
            x = x[(x >= high + MIN_GAP - TOLERANCE) | (x + give <= low - MIN_GAP + TOLERANCE)]
        return x[np.argsort(np.abs(x - barrier.x), kind="stable")].tolist()
