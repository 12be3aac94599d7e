"""What every barrier has."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import check

Floats = NDArray[np.float64]


class BarrierBase(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """What every barrier has; written as a table with its `kind`."""

    x: float

    @property
    def kind(self) -> str:
        """Name of the kind, as in layout files."""
        return str(type(self).__struct_config__.tag)

    def _check(self, *positive: str) -> None:
        check.number(f"{self.words} x", self.x)
        for name in positive:
            check.number(f"{self.words} {name}", getattr(self, name), 0.0, open_low=True)

    @property
    def words(self) -> str:
        """Name of the kind in words."""
        return self.kind.replace("_", " ")
