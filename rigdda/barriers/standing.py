"""What barriers share that stand on the ground."""

from __future__ import annotations

import numpy as np

from rigdda.barriers.base import BarrierBase, Floats
from rigdda.errors import BadInput
from rigdda.model.terrain import Terrain

FOUNDATION = 1.0
"""Depth to which walls and fences reach below the lowest ground under them [m]."""


class Standing(BarrierBase, frozen=True):
    """A barrier that stands on the ground: two vertical faces and a level top."""

    height: float

    @property
    def thickness(self) -> float:
        """Extent downhill of `x` [m], a field of every kind."""
        raise NotImplementedError

    @property
    def end(self) -> float:
        """Chainage beyond which a block has passed it where it stood at the start [m]."""
        return self.x + self.thickness

    @property
    def extent(self) -> float:
        """Length that it takes up along the slope, on level ground [m]."""
        return self.thickness

    def left_height(self, displacement: float) -> float:
        """Return its height [m]."""
        return self.height

    def outline(self, ground: Terrain) -> Floats:
        """Return the (4, 2) corners, the foot in `ground`.

        Raises
        ------
        BadInput
            If it does not stand on the ground.
        """
        x, y = self._under(ground)
        foot, top = float(y.min()) - FOUNDATION, float(y.max()) + self.height
        return np.array([[x[0], foot], [x[-1], foot], [x[-1], top], [x[0], top]])

    def _under(self, ground: Terrain) -> tuple[Floats, Floats]:
        """Return chainages and elevations of the ground's corners under it, its faces included."""
        inner = {float(x) for x in ground.points[:, 0] if self.x < x < self.end}
        x = np.array([self.x, *sorted(inner), self.end])
        try:
            return x, np.array([ground.height(at) for at in x])
        except BadInput as bad:
            raise BadInput(f"{self.words} x", self.x, bad.mend) from None
