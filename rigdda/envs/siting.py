"""Rules for layouts: where barriers may stand on a site, their sizes, distances and cost.

`Rules` checks layouts, and `FeasiblePlaces` finds the nearest feasible places.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Barrier, GravityWall, Layout, Mesh, Site, check
from rigdda.barriers import KINDS, Earthwork, Removal, as_layout, earthworks
from rigdda.barriers.base import LIMIT_ROUNDING, MIN_GAP, Span, meet, occupied
from rigdda.envs import design_envelope
from rigdda.envs.barrier_formulas import BarrierCheck, checks_of
from rigdda.envs.design_envelope import DesignEnvelope
from rigdda.envs.fence_checks import demand_at
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.model.existing import remaining
from rigdda.rounding import chainage


def narrow_gaps(rooms: Sequence[tuple[str, Barrier, Span]]) -> Iterator[BadInput]:
    """Yield an error for each barrier that is too close to the one uphill of it.

    Parameters
    ----------
    rooms : sequence of (str, Barrier, (start, end))
        Name in messages, barrier and occupied chainages [m] of each.
    """
    ordered = sorted(rooms, key=lambda item: item[2])
    for (_, before, one), (where, barrier, two) in pairwise(ordered):
        if meet(one, two):
            hint = (
                f"give at least {chainage(one[1] + MIN_GAP)}: {MIN_GAP:g} m clear of the "
                f"{before.words}"
            )
            yield BadInput(f"{where}.x", barrier.x, hint)


Floats = NDArray[np.float64]

MACHINE = 3.0
"""Width of the machine that builds, empties and repairs earthworks and walls [m]. Gentle ground of
this total width, uphill and downhill, must adjoin the works."""


MOST_KNOWN = 10_000
"""Number of barriers whose first failed check is remembered; a training tries many more."""


class Rules:
    """Rules for layouts on a site.

    Parameters
    ----------
    site : Site
        Provides the ground, the road, the sources and the prices.
    zone : BarrierZone
        Where barriers may stand, and how large they may be.
    max_cost : float, optional
        Largest capital cost of a layout [EUR per metre of road].
    checks : {"reported", "required"}
        Whether every barrier must satisfy the checks of `rigdda.envs.barrier_formulas`. The demand
        on a barrier is that of the slope with the existing barriers that the layout keeps, without
        the other new barriers.

    Attributes
    ----------
    parts : list of (start, end)
        Parts of the zone without loose rock [m].
    fixed : list of (str, (start, end))
        Kind and room of each existing barrier that may not be removed [m].

    Raises
    ------
    BadInput
        If there are no such parts.
    """

    def __init__(
        self,
        site: Site,
        zone: BarrierZone,
        max_cost: float | None = None,
        checks: str = "reported",
    ):
        self.site, self.zone, self.max_cost, self.checks = site, zone, max_cost, checks
        self._failed: dict[tuple[Barrier, Layout], tuple[BarrierCheck, ...]] = {}
        self._envelopes: dict[Layout, DesignEnvelope] = {}
        cut = [(max(low, zone.start), min(high, zone.end)) for low, high in site.rooms]
        self.parts = [(low, high) for low, high in cut if low < high]
        if not self.parts:
            hint = f"overlap one of {site.rooms}, which are free of loose rock"
            raise BadInput("zone", (zone.start, zone.end), hint)
        old = zip(site.existing, site.existing_barriers, strict=True)
        self.fixed = [(b.words, occupied(b, self.works(b))) for e, b in old if not e.removable]
        self._x, self._y = site.profile.points.T
        angles = {kind.steepest for kind in KINDS.values()} - {None}
        self._gentle = {angle: self._stretches(angle) for angle in angles if angle is not None}

    def _stretches(self, steepest: float) -> list[Span]:
        """Return the maximal stretches of ground that are at most `steepest` steep [deg]."""
        rise, run = np.abs(np.diff(self._y)), np.diff(self._x)
        found: list[Span] = []
        for k in np.flatnonzero(rise <= run * math.tan(math.radians(steepest)) + LIMIT_ROUNDING):
            low, high = float(self._x[k]), float(self._x[k + 1])
            if found and found[-1][1] == low:
                low = found.pop()[0]
            found.append((low, high))
        return found

    def beside(self, start: Floats, end: Floats, steepest: float) -> Floats:
        """Return the width of ground beside works that is at most `steepest` [deg], (n,) [m]."""
        low, high = np.array(self._gentle[steepest]).reshape(-1, 2).T[:, :, None]
        above = np.where((low <= start) & (start <= high), start - low, 0.0)
        below = np.where((low <= end) & (end <= high), high - end, 0.0)
        found: Floats = above.max(axis=0, initial=0.0) + below.max(axis=0, initial=0.0)
        return found

    def level(self, x: Floats) -> Floats:
        """Return the elevation of the natural ground at chainages [m]."""
        return np.interp(x, self._x, self._y)

    def works(self, barrier: Barrier) -> Span:
        """Return the chainages between which a barrier occupies the ground [m]."""
        return barrier.works(self.site.profile)

    def check_layout(self, layout: Sequence[Barrier], kinds: Sequence[str], most: int) -> Layout:
        """Return a feasible layout of given kinds and at most `most` barriers, sorted downhill.

        Raises
        ------
        BadInput
            If it is not feasible.
        """
        barriers = tuple(sorted(as_layout(layout), key=lambda barrier: barrier.x))
        for fault in self.violations(barriers, kinds, most):
            raise fault
        return barriers

    def violations(
        self, layout: Sequence[Barrier], kinds: Sequence[str], most: int
    ) -> Iterator[BadInput]:
        """Yield an error for each rule that a layout of given kinds and size violates."""
        try:
            barriers = as_layout(layout)
        except BadInput as bad:
            yield bad
        else:
            yield from self._violations(barriers, kinds, most)

    def _violations(self, barriers: Layout, kinds: Sequence[str], most: int) -> Iterator[BadInput]:
        """Yield what `violations` does of a layout in which no mesh option occurs twice."""
        if len(barriers) > most:
            yield BadInput("layout", f"{len(barriers)} barriers", f"give at most {most}")
        rooms: list[tuple[str, Barrier, Span]] = []
        for i, barrier in enumerate(barriers):
            where = f"layout[{i}]"
            try:
                check.one_of(f"{where}.kind", barrier.kind, kinds)
                if isinstance(barrier, Mesh):
                    self.check_mesh(where, barrier)
                elif isinstance(barrier, Removal):
                    self._check_removal(where, barrier, barriers[:i])
            except BadInput as bad:
                yield bad
            if not isinstance(barrier, Mesh | Removal):
                works = yield from self._faults(where, barrier, barriers)
                if works is not None:
                    rooms.append((where, barrier, occupied(barrier, works)))
        if sum(isinstance(barrier, Mesh) for barrier in barriers) > 1:
            yield BadInput("layout", "several meshes", "give at most one")
        yield from narrow_gaps(rooms)
        for where, barrier, span in rooms:
            yield from self._near_existing(where, barrier, span)
        if len(rooms) == sum(not isinstance(barrier, Mesh | Removal) for barrier in barriers):
            excess = self.too_expensive(barriers)
            if excess is not None:
                yield BadInput("layout", *excess)

    def too_expensive(self, layout: Sequence[Barrier]) -> tuple[str, str] | None:
        """Return the excessive capital cost of a layout and the remedy; None if it is affordable.

        It is also None if the layout has no price, because it is not feasible for another reason.
        """
        if self.max_cost is None:
            return None
        try:
            cost = self.site.capital(layout)
        except BadInput:
            return None
        if cost <= self.max_cost * (1.0 + LIMIT_ROUNDING):
            return None
        return f"{cost:,.0f} EUR/m", f"spend at most max_cost = {self.max_cost:,.0f} EUR/m"

    def check_mesh(self, where: str, mesh: Mesh) -> None:
        """Check that mesh is an option of the site and lies over the rock that it holds.

        Raises
        ------
        BadInput
            If it is not.
        """
        options = {option.name: option for option in self.site.meshes}
        check.one_of(f"{where}.option", mesh.option, options)
        check.number(f"{where}.x", mesh.x, *self.site.mesh_span(mesh.option))

    def _check_removal(self, where: str, removal: Removal, before: Layout) -> None:
        """Check that a removal names a removable barrier, and that none before it does."""
        known = [one.x for one in self.site.removals]
        if removal.x not in known:
            names = " or ".join(chainage(x) for x in known) or "no removal: nothing is removable"
            raise BadInput(f"{where}.x", removal.x, f"give {names}")
        if removal in before:
            raise BadInput(f"{where}.x", removal.x, "remove it only once")

    def _near_existing(self, where: str, barrier: Barrier, span: Span) -> Iterator[BadInput]:
        """Yield an error for each barrier that stands already, may not be removed and is close."""
        for words, taken in self.fixed:
            if meet(span, taken):
                hint = (
                    f"keep it, with its elongation up to {chainage(span[1])}, {MIN_GAP:g} m clear "
                    f"of the existing {words} at {chainage(taken[0])} to {chainage(taken[1])}"
                )
                yield BadInput(f"{where}.x", barrier.x, hint)

    def check(self, where: str, barrier: Barrier) -> Span:
        """Return the works of a barrier after checking that it is feasible where it stands.

        Raises
        ------
        BadInput
            If it is not feasible; the message begins with `where`.
        """
        faults = self._faults(where, barrier, (barrier,))
        try:
            fault = next(faults)
        except StopIteration as end:
            works: Span = end.value
            return works
        raise fault

    def _faults(
        self, where: str, barrier: Barrier, layout: Layout
    ) -> Generator[BadInput, None, Span | None]:
        """Yield an error for each rule that a barrier violates; return its works if it can stand.

        The barrier is not a mesh. It is one of the layout.
        """
        yield from self._wrong_sizes(where, barrier)
        try:
            start, end = self.works(barrier)
        except BadInput as bad:
            yield bad
            return None
        yield from self._misplaced(where, barrier, start, end)
        yield from self._on_steep_ground(where, barrier, start, end)
        if isinstance(barrier, Earthwork):
            try:
                earthworks(self.site.profile, (barrier,), self.site.soil)
            except BadInput as bad:
                yield BadInput(f"{where}: {bad.field}", bad.value, bad.hint)
                return None
        if self.checks == "required":
            yield from self._failed_checks(where, barrier, layout)
        return start, end

    def failed_checks(self, barrier: Barrier, layout: Layout) -> tuple[BarrierCheck, ...]:
        """Return the checks that a barrier of a layout does not meet.

        The demand is that of the slope with the existing barriers that the layout neither removes
        nor replaces, without other new barriers. It is simulated if it is not stored.

        Raises
        ------
        Diverged
            If a simulation diverges.
        """
        kept = self._kept(layout)
        known = barrier, kept
        if known not in self._failed:
            if len(self._failed) >= MOST_KNOWN:
                self._failed.clear()
            demand = demand_at(self._envelope(kept), self.site.rule, barrier.x)
            found = checks_of(self.site, barrier, demand)
            self._failed[known] = tuple(check for check in found if not check.satisfied)
        return self._failed[known]

    def _failed_checks(self, where: str, barrier: Barrier, layout: Layout) -> Iterator[BadInput]:
        """Yield an error if a barrier of a layout fails a check of its kind."""
        for failed in self.failed_checks(barrier, layout)[:1]:
            hint = (
                f"satisfy the check of {failed.check}, {failed.demand:.4g} of "
                f"{failed.capacity:.4g} {failed.unit}, or report the checks only"
            )
            yield BadInput(where, barrier.label, hint)

    def _kept(self, layout: Layout) -> Layout:
        """Return the existing barriers that a layout neither removes nor replaces, downhill.

        They are all existing barriers if the layout may not be built beside them.
        """
        try:
            kept = remaining(self.site.existing, self.site.profile, layout)
        except BadInput:
            kept = self.site.existing_barriers
        return tuple(sorted(kept, key=lambda barrier: barrier.x))

    def _envelope(self, kept: Layout) -> DesignEnvelope:
        """Return what the blocks of the design events do beside these existing barriers."""
        if kept not in self._envelopes:
            self._envelopes[kept] = design_envelope.of(self.site, self.zone, layout=kept)
        return self._envelopes[kept]

    def _on_steep_ground(
        self, where: str, barrier: Barrier, start: float, end: float
    ) -> Iterator[BadInput]:
        """Yield errors if the ground under or beside a barrier is too steep."""
        steepest = barrier.steepest
        if steepest is not None:
            angle, most = self.inclination(start, end), steepest
            if isinstance(barrier, GravityWall):
                angle, most = self.foundation(start, end, steepest)
            if angle > most + LIMIT_ROUNDING:
                hint = f"put it where the ground is at most {most:g} deg steep, not {angle:.1f}"
                yield BadInput(f"{where}.x", barrier.x, hint)
            beside = float(self.beside(np.array([start]), np.array([end]), steepest)[0])
            if beside < MACHINE - LIMIT_ROUNDING:
                hint = f"put it where a machine has {MACHINE:g} m beside it, not {beside:.1f}"
                yield BadInput(f"{where}.x", barrier.x, hint)

    def _wrong_sizes(self, where: str, barrier: Barrier) -> Iterator[BadInput]:
        """Yield an error for each size that is out of range, and for an unsuitable design."""
        for length in barrier.lengths:
            value, (low, high) = getattr(barrier, length.field), length.limits(self.zone)
            slack = LIMIT_ROUNDING * max(1.0, high)
            if not low - slack <= value <= high + slack:
                hint = f"give a number of at least {low:g} and at most {high:g}"
                yield BadInput(f"{where}.{length.field}", value, hint)
        try:
            barrier.check_design(where, self.site)
        except BadInput as bad:
            yield bad

    def _misplaced(
        self, where: str, barrier: Barrier, start: float, end: float
    ) -> Iterator[BadInput]:
        """Yield errors if a barrier is outside the zone or too close to the road."""
        slack = LIMIT_ROUNDING * max(1.0, abs(self.zone.end))
        if not any(low - slack <= start and end <= high + slack for low, high in self.parts):
            rooms = " or ".join(
                f"{chainage(low)} to {chainage(high)} m" for low, high in self.parts
            )
            hint = f"keep all of it, up to {chainage(end)} m, within {rooms}"
            yield BadInput(f"{where}.x", barrier.x, hint)
        road = self.site.road.start
        give = barrier.deflection
        if give > 0.0 and end + give > road + slack:
            most = road - give - barrier.extent
            hint = f"give at most {chainage(most)}: it deflects by up to {give:g} m"
            told = f"{hint}, and the road begins at {chainage(road)}"
            yield BadInput(f"{where}.x", barrier.x, told)

    def inclination(self, start: float, end: float) -> float:
        """Return the mean inclination of the ground between two chainages [deg]."""
        high, low = self.level(np.array([start, end])).tolist()
        return math.degrees(math.atan2(abs(high - low), end - start))

    def foundation(self, start: float, end: float, most: float) -> tuple[float, float]:
        """Return the steepest ground under a gravity wall, and the permitted inclination [deg].

        A wall with a corner on ground steeper than the friction angle would slide before any
        impact. The permitted inclination is therefore the smaller of `most` and the least friction
        angle.
        """
        under = np.flatnonzero((self._x[:-1] < end) & (start < self._x[1:]))
        rise, run = np.abs(np.diff(self._y))[under], np.diff(self._x)[under]
        names = {self.site.profile.surfaces[k] for k in under}
        friction = min(self.site.surfaces[name].friction_deg for name in names)
        steepest = float(np.degrees(np.arctan2(rise, run)).max())
        return steepest, min(most, friction)


PLACE_SPACING = 0.25
"""Spacing of the candidate places for a barrier that is not feasible where it should stand [m]."""

NEAR_ZERO = 1e-3
"""Tolerance of the slope when candidate places are preselected [-]."""


class FeasiblePlaces(Rules):
    """Rules for layouts on a site, and the search for feasible places.

    The parameters are those of `Rules`.
    """

    def mesh(self, option: int) -> Mesh:
        """Return a mesh option of the site, placed in the middle of the rock that it holds."""
        name = self.site.meshes[option].name
        low, high = self.site.mesh_span(name)
        return Mesh(0.5 * (low + high), name)

    @property
    def removals(self) -> tuple[Removal, ...]:
        """A removal of each existing barrier that may be removed."""
        return self.site.removals

    def put(self, barrier: Barrier, x: float) -> Barrier | None:
        """Return a barrier moved to `x` with the sizes required there, or None if impossible."""
        return barrier.placed(x, self.site, self.zone)

    def nearest(self, barrier: Barrier, taken: Sequence[Span]) -> tuple[Barrier, Span] | None:
        """Return a barrier moved to the nearest feasible place, and the room that it occupies.

        Parameters
        ----------
        barrier : Barrier
            The barrier at its desired place.
        taken : sequence of (start, end)
            The room of other new barriers [m].

        Returns
        -------
        (Barrier, (start, end)) or None
            None if no candidate place, spaced `PLACE_SPACING` apart, is feasible.
        """
        taken = [*taken, *(span for _, span in self.fixed)]
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
        span = occupied(there, self.works(there))
        if any(meet(span, other) for other in taken):
            return None
        try:
            self.check("barrier", there)
        except BadInput:
            return None
        return there, span

    def _places(self, barrier: Barrier, taken: Sequence[Span]) -> list[float]:
        """Return candidate places after quick checks of the room and the ground, nearest first."""
        length = barrier.extent
        give = occupied(barrier, (0.0, length))[1]  # includes the elongation downhill
        last = self.site.road.start - give if barrier.deflection > 0.0 else math.inf
        ends = [(low, min(high - length, last)) for low, high in self.parts]
        ends = [(low, high) for low, high in ends if low <= high]
        if not ends:
            return []
        edges = [x for pair in ends for x in pair] + self._x.tolist()
        edges += [x for low, high in taken for x in (low - MIN_GAP - give, high + MIN_GAP)]
        x = np.concatenate([*(np.arange(low, high, PLACE_SPACING) for low, high in ends), edges])
        x = x[np.any([(x >= low) & (x <= high) for low, high in ends], axis=0)]
        steepest = barrier.steepest
        if steepest is not None:
            rise = np.abs(self.level(x) - self.level(x + length))
            x = x[rise <= length * math.tan(math.radians(steepest)) + NEAR_ZERO]
            if not barrier.has_sides:  # its works end where its side meets the ground
                x = x[self.beside(x, x + length, steepest) >= MACHINE - LIMIT_ROUNDING]
        for low, high in taken:
            x = x[
                (x >= high + MIN_GAP - LIMIT_ROUNDING)
                | (x + give <= low - MIN_GAP + LIMIT_ROUNDING)
            ]
        return x[np.argsort(np.abs(x - barrier.x), kind="stable")].tolist()
