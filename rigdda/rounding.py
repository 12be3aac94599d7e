"""Rounding of numbers in texts: bounds are rounded outward, so that they remain bounds."""

from __future__ import annotations

import math
import re
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Literal, Protocol

Rounding = Literal["nearest", "down", "up"]
"""Direction of rounding: to the nearest number, as for estimates, or to the number below or above,
as for lower and upper bounds."""

FORM = re.compile(r"\+?,?\.(?P<digits>\d+)(?P<kind>[fg])$")
"""Form of a number as in format strings: fixed digits (f) or significant figures (g)."""

GRID = 1e4
"""Chainage from which six figures are less than two decimals [m]."""

EXACT = Context(prec=800)
"""Context with more digits than any floating-point number has."""


class NumberForm(Protocol):
    """A function that returns a number as text, rounded in a given direction."""

    def __call__(self, value: float, rounding: Rounding = "nearest", /) -> str:
        """Return the text of a number."""


def rounded(value: float | Decimal, form: str, rounding: Rounding = "nearest") -> str:
    """Return a number as text, rounded in a given direction.

    Parameters
    ----------
    value : float or Decimal
        The number.
    form : str
        Its form as in format strings, such as ".3g" or ",.0f".
    rounding : {"nearest", "down", "up"}
        Direction. The number in the text is at most `value` if it is "down" and at least `value` if
        it is "up", and it is the nearest such number of this form.
    """
    parts = FORM.match(form)
    if rounding == "nearest" or not math.isfinite(value) or not value or not parts:
        return f"{value:{form}}" if isinstance(value, float) else f"{float(value):{form}}"
    exact = value if isinstance(value, Decimal) else Decimal(repr(float(value)))
    digits = int(parts["digits"])
    last = -digits if parts["kind"] == "f" else exact.adjusted() - max(digits, 1) + 1
    way = ROUND_FLOOR if rounding == "down" else ROUND_CEILING
    found = exact.quantize(Decimal((0, (1,), last)), rounding=way, context=EXACT)
    return f"{float(found) + 0.0:{form}}"


def chainage(value: float) -> str:
    """Return a chainage [m] as text: with six figures, or with two decimals if it is large."""
    return f"{value:g}" if abs(value) < GRID else f"{value:.2f}".rstrip("0").removesuffix(".")


def between(low: float, high: float, form: str) -> str:
    """Return an interval as text, its ends rounded outward to a form such as ".3g"."""
    return f"{rounded(low, form, 'down')} to {rounded(high, form, 'up')}"
