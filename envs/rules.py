"""What may be built where on a site."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigdda import (
    BadInput,
    Barrier,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    Site,
    check,
)
from rigdda.barriers import MeshOption, as_layout, earthworks
from rigdda.envs.gaps import Span, check_gaps, room
from rigdda.envs.sizes import SLENDER, TOLERANCE, limits
from rigdda.model.place import BarrierZone

Floats = NDArray[np.float64]

STEEPEST = {"ditch": 30.0, "embankment": 25.0, "gravity_wall": 30.0, "wall": 30.0}
"""Greatest mean inclination of the ground under a barrier [deg], of a gravity wall of all of it. On
steeper ground fill slides, and what is dug or founded there starts a fall itself. Fences stand on
posts, anywhere."""

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
        self._gentle = {angle: self._stretches(angle) for angle in set(STEEPEST.values())}

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
        """Return the chainages between which a barrier takes up the ground [m].

        Of an embankment up to where its downhill side meets the ground; to the end of the ground if
        it does not.
        """
        if not isinstance(barrier, Embankment):
            return barrier.x, barrier.x + barrier.extent
        top = float(self.level(np.array([barrier.x]))[0]) + barrier.height
        ahead = self._x > barrier.end
        x = np.concatenate([[barrier.end], self._x[ahead]])
        ground = np.concatenate([self.level(x[:1]), self._y[ahead]])
        over = top - (x - barrier.end) / barrier.side_slope - ground
        k = int(np.argmax(over <= 0.0))  # the first corner below which the side is
        if over[k] > 0.0:
            return barrier.x, float(x[-1])
        if k == 0:
            return barrier.x, barrier.end
        share = over[k - 1] / (over[k - 1] - over[k])
        return barrier.x, float(x[k - 1] + share * (x[k] - x[k - 1]))

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
        steepest = STEEPEST.get(barrier.kind)
        if steepest is not None:
            angle, most = self.inclination(start, end), steepest
            if isinstance(barrier, GravityWall):
                angle, most = self.foundation(start, end)
            if angle > most + TOLERANCE:
                mend = f"put it where the ground is at most {most:g} deg steep, not {angle:.1f}"
                raise BadInput(f"{where}.x", barrier.x, mend)
            beside = float(self.beside(np.array([start]), np.array([end]), steepest)[0])
            if beside < MACHINE - TOLERANCE:
                mend = (
                    f"put it where {MACHINE:g} m beside it are left to a machine, not {beside:.1f}"
                )
                raise BadInput(f"{where}.x", barrier.x, mend)
        if isinstance(barrier, Ditch | Embankment):
            try:
                earthworks(self.site.profile, (barrier,), self.site.soil)
            except BadInput as bad:
                raise BadInput(f"{where}: {bad.field}", bad.value, bad.mend) from None
        return start, end

    def _check_size(self, where: str, barrier: Barrier) -> None:
        for name, (low, high) in limits(self.zone, barrier).items():
            value = getattr(barrier, name)
            slack = TOLERANCE * max(1.0, high)
            if not low - slack <= value <= high + slack:
                mend = f"give a number of at least {low:g} and at most {high:g}"
                raise BadInput(f"{where}.{name}", value, mend)
        if isinstance(barrier, Fence) and barrier.energy_class is None:
            mend = "give its energy class instead of a capacity"
            raise BadInput(f"{where}.capacity", barrier.capacity, mend)
        if isinstance(barrier, GravityWall):
            least = SLENDER * barrier.height
            if barrier.thickness < least - TOLERANCE:
                mend = f"give at least {least:g}: a gravity wall stands by its weight"
                raise BadInput(f"{where}.thickness", barrier.thickness, mend)
        if isinstance(barrier, Ditch):
            least = self.site.ditch_side(barrier.x, barrier.width)
            if barrier.side_slope < least - TOLERANCE:
                mend = f"give at least {least:g}, at which a cut in this ground stands"
                raise BadInput(f"{where}.side_slope", barrier.side_slope, mend)

    def _check_place(self, where: str, barrier: Barrier, start: float, end: float) -> None:
        """Check that it is in a part of the zone, and its distance from the road."""
        slack = TOLERANCE * max(1.0, abs(self.zone.end))
        if not any(low - slack <= start and end <= high + slack for low, high in self.parts):
            rooms = " or ".join(f"{low:g} to {high:g} m" for low, high in self.parts)
            mend = f"keep all of it, up to {end:g} m, within {rooms}"
            raise BadInput(f"{where}.x", barrier.x, mend)
        road = self.site.road.start
        give = room(barrier, (0.0, 0.0))[1]
        if isinstance(barrier, Fence) and end + give > road + slack:
            most = road - give - barrier.thickness
            mend = f"put it at {most:g} or uphill: it gives way by {give:g} m"
            raise BadInput(f"{where}.x", barrier.x, f"{mend}, and the road begins at {road:g}")

    def inclination(self, start: float, end: float) -> float:
        """Return the mean inclination of the ground between two chainages [deg]."""
        high, low = self.level(np.array([start, end])).tolist()
        return math.degrees(math.atan2(abs(high - low), end - start))

    def foundation(self, start: float, end: float) -> tuple[float, float]:
        """Return the steepest ground under a gravity wall, and what it may be at most [deg].

        A wall of which a corner stands on ground that is steeper than its friction angle slides
        before any rock comes.
        """
        under = np.flatnonzero((self._x[:-1] < end) & (start < self._x[1:]))
        rise, run = np.abs(np.diff(self._y))[under], np.diff(self._x)[under]
        names = {self.site.profile.surfaces[k] for k in under}
        friction = min(self.site.surfaces[name].friction_deg for name in names)
        steepest = float(np.degrees(np.arctan2(rise, run)).max())
        return steepest, min(STEEPEST["gravity_wall"], friction)
