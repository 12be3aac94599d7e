"""What every barrier has."""

from __future__ import annotations

import math
from typing import Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import check

Floats = NDArray[np.float64]

THINNEST, LARGEST = 1e-3, 1e3
"""Least and greatest length of a barrier [m]: beyond them it is a slip of the pen, and a face that
thin is lost in rounding."""


class BarrierBase(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """What every barrier has; written as a table with its `kind`."""

    x: float

    @property
    def kind(self) -> str:
        """Name of the kind, as in layout files."""
        return str(type(self).__struct_config__.tag)

    def for_width(self, width: float) -> Self:
        """Return it as it resists, per metre, an event of this width [m]."""
        return self

    def _check(self, *lengths: str) -> None:
        """Check and set where it is and its lengths."""
        check.set_number(self, "x", field=f"{self.words} x")
        for name in lengths:
            self._check_number(name, THINNEST, LARGEST)

    def _check_number(self, name: str, low: float, high: float = math.inf) -> None:
        """Check and set a field."""
        check.set_number(self, name, low, high, open_low=low == 0.0, field=f"{self.words} {name}")

    @property
    def words(self) -> str:
        """Name of the kind in words."""
        return self.kind.replace("_", " ")
