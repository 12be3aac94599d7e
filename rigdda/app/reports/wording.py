"""Texts for barriers, costs and probabilities in reports."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from rigdda import Barrier, Ditch, Mesh, Site
from rigdda.barriers import Removal
from rigdda.rounding import Rounding, rounded

HIGHER_SIDE = 1.0
"""An order gives the uphill side of a ditch if it exceeds the depth by more than this [m]."""


def order(barrier: Barrier, site: Site) -> str:
    """Return the type, sizes, place and clearance of a barrier as text."""
    if isinstance(barrier, Mesh):
        option = site.mesh(barrier.option)
        return f"mesh {option.name!r}: {option.area:g} m2 per metre, {option.price:g} EUR/m2"
    if isinstance(barrier, Removal):
        cost = f"{euros(site.removal_price(barrier.x))} EUR per metre"
        return f"remove the existing barrier at x = {barrier.x:.1f} m: {cost}"
    ground, road = site.profile, site.road
    above = ground.height(barrier.x) - ground.height(road.start)
    uphill = f"{road.start - barrier.x:.1f} m uphill of the road's edge"
    place = f"at x = {barrier.x:.1f} m{surveyed(site, barrier.x)}, {uphill}"
    if abs(above) >= 1.0:
        place += f" and {above:.0f} m above it" if above > 0.0 else f" and {-above:.0f} m below it"
    sizes, room = barrier.order(road.start)
    if isinstance(barrier, Ditch):
        cut, floor = barrier.cut(ground)
        if cut > barrier.depth + HIGHER_SIDE:
            sizes = f"with a cut of {cut:.1f} m on its uphill side and a floor {floor:.1f} m wide"
    return ", ".join(filter(None, (barrier.label, sizes, place))) + room


def surveyed(site: Site, x: float) -> str:
    """Return the chainage and the elevation of the ground on the survey at a chainage `x`.

    The text is in brackets; it is empty if the coordinates of the site are those of the survey.
    """
    if not site.origin.surveyed:
        return ""
    place = survey_place(site, x)
    chainage, elevation = place["chainage_m"], place["elevation_m"]
    return f" (survey: chainage {chainage:,.1f} m, elevation {elevation:,.1f} m)"


def survey_grid(site: Site) -> str:
    """Return in words how coordinates of the survey follow from those of the site.

    The text is empty if they are the same.
    """
    origin = site.origin
    if not origin.surveyed:
        return ""
    sign = "less" if origin.reversed else "plus"
    words = f"Chainage in the survey: {origin.chainage:,.10g} metres {sign} the chainage here."
    if origin.elevation:
        words += f" Elevation in the survey: {origin.elevation:,.10g} metres plus that here."
    return words


def survey_place(site: Site, x: float) -> dict[str, float]:
    """Return the columns with the chainage and elevation of the ground on the survey at `x`.

    There are none if the coordinates of the site are those of the survey.
    """
    origin = site.origin
    if not origin.surveyed:
        return {}
    low, high = site.slope.points[0][0], site.slope.points[-1][0]
    ground = site.profile.height(min(max(x, low), high))
    return {"chainage_m": origin.chainage_of(x), "elevation_m": origin.elevation_of(ground)}


def unchanged(site: Site) -> str:
    """Return what an empty layout is called."""
    return "as it stands" if site.existing else "no barrier"


def before(site: Site) -> str:
    """Return what the case without a layout is called in a sentence."""
    return "as it stands" if site.existing else "without barriers"


def euros(value: float, rounding: Rounding = "nearest") -> str:
    """Return an amount of money: whole euros from 100, three significant figures below."""
    return rounded(value, ",.0f" if abs(value) >= 99.95 else ".3g", rounding)


def span(interval: Sequence[float]) -> str:
    """Return an interval of amounts of money as text, its ends rounded outward."""
    low, high = interval
    return f"{euros(low, 'down')} to {euros(high, 'up')}"


def percent(share: float, rounding: Rounding = "nearest") -> str:
    """Return a probability or a share in per cent: two significant figures below 10 %."""
    if not math.isfinite(share):
        return f"{share} %"
    value = 100 * Decimal(repr(float(share)))  # exact, so that 0.07 is not above 7 %
    return f"{rounded(value, '.0f' if value >= 9.95 or not value else '.2g', rounding)} %"


def figure(value: float, rounding: Rounding = "nearest") -> str:
    """Return a number with three significant figures, and "?" if there is none."""
    return "?" if math.isnan(value) else euros(value, rounding)


def at_most(share: float) -> str:
    """Return an upper bound of a share in per cent, rounded up to the digits of `percent`."""
    return percent(share, "up")


def percentage(share: float) -> str:
    """Return a target of a probability in per cent as it was given."""
    return f"{100.0 * share:.6g} %"


def tenth(value: float, rounding: Rounding = "nearest") -> str:
    """Return a number with one decimal."""
    return rounded(value, ".1f", rounding)


def small(value: float, rounding: Rounding = "nearest") -> str:
    """Return a small number with two significant figures."""
    return rounded(value, ".2g", rounding)


def number(value: Any) -> str:
    """Return a value of a site file as text, numbers with up to six significant figures."""
    if isinstance(value, float):
        return f"{value:,.6g}" if abs(value) < 1e6 else f"{value:,.0f}"
    return str(value).lower() if isinstance(value, bool) else str(value)
