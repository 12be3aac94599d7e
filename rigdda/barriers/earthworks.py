"""Barriers that change the ground: ditches and embankments."""

from __future__ import annotations

from typing import Self

import msgspec
import numpy as np

from rigdda.barriers.base import BarrierBase, Floats
from rigdda.barriers.grading import regrade, span
from rigdda.errors import BadInput
from rigdda.terrain import Terrain

LEAST_SLOPE, FLATTEST_SLOPE = 0.02, 5.0
"""Steepest and flattest side of an earthwork, run over rise [-]."""


class Ditch(BarrierBase, frozen=True, tag="ditch"):
    """A ditch with a level floor, cut into the terrain. Its surface is that of the terrain.

    Parameters
    ----------
    x : float
        Chainage of its uphill edge [m].
    depth : float
        Depth of the floor below the lower of its edges [m].
    width : float
        Distance of its edges along x [m].
    side_slope : float
        Run over rise of its sides [-]; 0.25 is usual for a cut in rock.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    depth: float
    width: float
    side_slope: float = 0.25

    def __post_init__(self) -> None:
        self._check("depth", "width")
        self._check_number("side_slope", LEAST_SLOPE, FLATTEST_SLOPE)

    @property
    def end(self) -> float:
        """Chainage of its downhill edge, beyond which a block has passed it [m]."""
        return self.x + self.width

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope [m]."""
        return self.width

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of what is dug out of `ground`, and the ground with it.

        `surface`, that of a fill, is not used.

        Raises
        ------
        BadInput
            If the ditch does not fit.
        """
        old = span("ditch x", ground, self.x, self.end)
        (left, high), (right, low) = old[0], old[-1]
        floor = min(high, low) - self.depth
        first = left + self.side_slope * (high - floor)
        last = right - self.side_slope * (low - floor)
        if last - first < 1e-6:
            least = first - left + right - last
            raise BadInput(
                "ditch width",
                self.width,
                f"give more than {least:g}, or less depth: its sides meet above its floor",
            )
        line = np.array([[left, high], [first, floor], [last, floor], [right, low]])
        return regrade("ditch x", ground, line, np.minimum, None)


class Embankment(BarrierBase, frozen=True, tag="embankment"):
    """A dam of earth with a level crest, raised on the terrain.

    Its surface is "soil" where the scene defines it, else that of the other barriers. If the thrust
    of what lies and strikes on it, as a mean over a second, exceeds its weight times the friction
    of its base, it is pushed away, and gone.

    Parameters
    ----------
    x : float
        Chainage of its uphill toe [m].
    height : float
        Height of the crest above the ground at `x` [m].
    width : float
        Width of the crest [m].
    side_slope : float
        Run over rise of its sides [-]; 0.5 is usual for reinforced earth. The downhill side goes
        on until it meets the ground.
    density : float
        Density [kg/m3]; 1900 is compacted soil.

    Raises
    ------
    BadInput
        If a value is not finite or outside its range.
    """

    height: float
    width: float = 1.0
    side_slope: float = 0.5
    density: float = 1900.0

    def __post_init__(self) -> None:
        self._check("height", "width")
        self._check_number("side_slope", LEAST_SLOPE, FLATTEST_SLOPE)
        self._check_number("density", 0.0)

    def for_width(self, width: float) -> Self:
        """Return the embankment that resists what is so wide [m].

        It resists over the width and its height on either side, into which the load spreads at 45
        degrees.
        """
        factor = (width + 2.0 * self.height) / width
        return msgspec.structs.replace(self, density=self.density * factor)

    @property
    def end(self) -> float:
        """Chainage of the downhill edge of its crest, beyond which a block has passed it [m]."""
        return self.x + self.side_slope * self.height + self.width

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return 2.0 * self.side_slope * self.height + self.width

    def build(self, ground: Terrain, surface: str) -> tuple[Floats, Terrain]:
        """Return the (n, 2) corners of what is filled in on `ground`, and the ground with it.

        `surface` names that of the fill.

        Raises
        ------
        BadInput
            If the embankment does not fit.
        """
        base = span("embankment x", ground, self.x, self.end)[0, 1]
        top, toe = base + self.height, self._toe(ground, base + self.height)
        line = np.array(
            [
                [self.x, base],
                [self.x + self.side_slope * self.height, top],
                [self.end, top],
                [toe, top - (toe - self.end) / self.side_slope],
            ]
        )
        return regrade("embankment x", ground, line, np.maximum, surface)

    def _toe(self, ground: Terrain, top: float) -> float:
        """Return the chainage where the downhill side meets the ground [m]."""
        corners = ground.points
        ahead = corners[corners[:, 0] > self.end, 0]
        for x in ahead:
            # ordered along the chain: span refuses what turns back before the side meets it
            piece = span("embankment x", ground, self.end, float(x))
            over = top - (piece[:, 0] - self.end) / self.side_slope - piece[:, 1]
            if over[-1] <= 0.0:
                before, after = max(over[-2], 0.0), over[-1]
                share = before / (before - after) if before > 0.0 else 0.0
                toe = piece[-2, 0] + share * (piece[-1, 0] - piece[-2, 0])
                return max(float(toe), self.end + 1e-6)
        raise BadInput(
            "embankment x",
            self.x,
            "put it where the ground is flatter than its side, which does not meet the ground",
        )


Earthwork = Ditch | Embankment
