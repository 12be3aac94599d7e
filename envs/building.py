"""Where on a site a barrier may stand that is nearest to where it should."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from rigdda import BadInput, Barrier, Ditch, Embankment, Fence, GravityWall, Mesh
from rigdda.envs.gaps import MIN_GAP, Span, meet, room
from rigdda.envs.rules import MACHINE, STEEPEST, Rules
from rigdda.envs.sizes import MIN_HEIGHT, SLENDER, TOLERANCE

MIN_FLOOR = 1.0
"""Least width of the floor of a ditch that is designed [m]: a machine empties it, and what falls
into a notch stops it up."""

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
        """Return a barrier moved to `x`; a ditch with the sides that it needs there.

        It is as deep as these sides allow; None if that is less than `MIN_HEIGHT`. A gravity wall
        is as thick as its height needs, as high as the greatest thickness allows.
        """
        if isinstance(barrier, GravityWall):
            tall = min(barrier.height, self.zone.max_thickness / SLENDER)
            thick = max(barrier.thickness, SLENDER * tall)
            return msgspec.structs.replace(barrier, x=x, height=tall, thickness=thick)
        if not isinstance(barrier, Ditch):
            return msgspec.structs.replace(barrier, x=x)
        end = x + barrier.width
        high, low = self.level(np.array([x, end])).tolist()
        side = self.site.ditch_side(x, barrier.width)
        deepest = 0.5 * ((barrier.width - MIN_FLOOR) / side - abs(high - low))
        depth = min(barrier.depth, deepest)
        if depth < MIN_HEIGHT - TOLERANCE:
            return None
        return msgspec.structs.replace(barrier, x=x, depth=depth, side_slope=side)

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
        last = self.site.road.start - give if isinstance(barrier, Fence) else math.inf
        ends = [(low, min(high - length, last)) for low, high in self.parts]
        ends = [(low, high) for low, high in ends if low <= high]
        if not ends:
            return []
        edges = [x for pair in ends for x in pair] + self._x.tolist()
        edges += [x for low, high in taken for x in (low - MIN_GAP - give, high + MIN_GAP)]
        x = np.concatenate([*(np.arange(low, high, STEP) for low, high in ends), edges])
        x = x[np.any([(x >= low) & (x <= high) for low, high in ends], axis=0)]
        steepest = STEEPEST.get(barrier.kind)
        if steepest is not None:
            rise = np.abs(self.level(x) - self.level(x + length))
            x = x[rise <= length * math.tan(math.radians(steepest)) + NEAR_ZERO]
            if not isinstance(barrier, Embankment):  # whose works end farther down
                x = x[self.beside(x, x + length, steepest) >= MACHINE - TOLERANCE]
        for low, high in taken:
            x = x[(x >= high + MIN_GAP - TOLERANCE) | (x + give <= low - MIN_GAP + TOLERANCE)]
        return x[np.argsort(np.abs(x - barrier.x), kind="stable")].tolist()
