"""Texts for barriers, costs and probabilities in reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rigdda import Barrier, Mesh, Site


def order(barrier: Barrier, site: Site) -> str:
    """Return the type, sizes, place and clearance of a barrier as text."""
    if isinstance(barrier, Mesh):
        option = site.mesh(barrier.option)
        return f"mesh {option.name!r}: {option.area:g} m2 per metre, {option.price:g} EUR/m2"
    ground, road = site.profile, site.road
    above = ground.height(barrier.x) - ground.height(road.start)
    place = f"at x = {barrier.x:.1f} m, {road.start - barrier.x:.1f} m uphill of the road's edge"
    if abs(above) >= 1.0:
        place += f" and {above:.0f} m above it" if above > 0.0 else f" and {-above:.0f} m below it"
    sizes, room = barrier.order(road.start)
    return ", ".join(filter(None, (barrier.label, sizes, place))) + room


def euros(value: float) -> str:
    """Return an amount of money: whole euros from 100, three significant figures below."""
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def span(interval: Sequence[float]) -> str:
    """Return an interval of amounts of money as text."""
    low, high = interval
    return f"{euros(low)} to {euros(high)}"


def percent(share: float) -> str:
    """Return a probability or a share in per cent: two significant figures below 10 %."""
    value = 100.0 * share
    return f"{value:.0f} %" if value >= 9.95 or value == 0.0 else f"{value:.2g} %"


def figure(value: float) -> str:
    """Return a number with three significant figures, and "?" if there is none."""
    if math.isnan(value):
        return "?"
    return f"{value:,.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def at_most(share: float) -> str:
    """Return an upper bound of a share in per cent, rounded up to the digits of `percent`."""
    value = 100.0 * share
    if value <= 0.0:
        return "0 %"
    step = 1.0 if value > 9.9 else 10.0 ** (math.floor(math.log10(value)) - 1)
    up = step * math.ceil(value / step - 1e-9)
    return percent(up / 100.0)


def number(value: Any) -> str:
    """Return a value of a site file as text, numbers with up to six significant figures."""
    if isinstance(value, float):
        return f"{value:,.6g}" if abs(value) < 1e6 else f"{value:,.0f}"
    return str(value).lower() if isinstance(value, bool) else str(value)
