"""Generator of sites: random variations of the built-in site of each family.

The ground of the built-in site is stretched: heights and lengths by common factors and each segment
by its own factors. All chainages move with the ground, so that bands, zone and surfaces keep their
places on it. Block sizes, rates, friction, closure costs and prices vary as well, and so do forest,
existing barriers and traffic where the built-in site has them. The ranges are assumptions. The
narrow ones are those of the first version of the splits. The wide ones, of the second version, let
the best layouts of two instances of a family differ more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import msgspec
import numpy as np

from rigdda import BadInput, check
from rigdda.barriers import MeshOption
from rigdda.ground.grounds import GROUNDS, Span
from rigdda.ground.prices import Consequences, Prices
from rigdda.ground.surface import Surface
from rigdda.model.existing import Existing
from rigdda.model.forest import Forest
from rigdda.model.site_names import FAMILIES, WIDE_FAMILIES
from rigdda.model.site_tables import BarrierZone, Event, Road, SiteTables, Slope, Stretch
from rigdda.model.source import Point, Source
from rigdda.model.traffic import Traffic

S = TypeVar("S", bound=SiteTables)

replace = msgspec.structs.replace

LEAST_FALL, LEAST_FALL_SHARE = 10.0, 1.0 / 3.0
"""Barriers may stand where rock has fallen by this height [m], or by this share of the height to
the toe."""

ZONE_MARGIN = 0.05
"""Distance downhill of that point at which a zone begins [m]."""


Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Variation:
    """Ranges of the numbers by which the instances of a family differ.

    Parameters
    ----------
    height, incline : (float, float)
        Factor on the height of the slope, and on its length over its height [-].
    room : (float, float)
        Factor on the lengths between the toe and the road [-].
    segment_length, segment_height : (float, float)
        Further factors on the length and the height of each segment [-].
    size, rate, price : float
        Greatest deviations of the logarithms of the block areas, of the rate of each event and of
        the prices of each kind of barrier [-].
    closure : (float, float)
        Deviation of the logarithm of the cost of a day of closure [-].
    friction : float
        Greatest change of the friction angles [deg].
    restitution : (float, float)
        Factors on restitution and on rolling resistance [-].
    access : (float, float)
        Price factor of access at 60 m above the road [-].
    size_of_event : float
        Greatest further deviation of the logarithm of the block areas of each event [-].
    stems, condition, sag : (float, float)
        Factors on the stems of a forest per area, on the strength of existing fences and on the
        height of existing barriers [-].
    traffic : (float, float)
        Deviation of the logarithm of the number of vehicles [-].
    plausible : bool
        Whether properties of surfaces are limited to the ranges of their grounds in the library.
    """

    height: Range = (0.8, 1.25)
    incline: Range = (0.93, 1.07)
    room: Range = (0.85, 1.2)
    segment_length: Range = (0.94, 1.06)
    segment_height: Range = (0.96, 1.04)
    size: float = 0.35
    rate: float = 0.5
    closure: Range = (-0.4, 0.4)
    price: float = 0.25
    friction: float = 2.0
    restitution: Range = (0.75, 1.25)
    access: Range = (1.0, 2.5)
    size_of_event: float = 0.0
    stems: Range = (0.7, 1.3)
    condition: Range = (0.7, 1.3)
    sag: Range = (0.9, 1.1)
    traffic: Range = (-0.4, 0.4)
    plausible: bool = False


NARROW = Variation()
"""Ranges of the generated sites of the first version of the splits."""

WIDE = Variation(
    height=(0.55, 1.7),
    incline=(0.85, 1.18),
    room=(0.5, 1.6),
    segment_length=(0.7, 1.4),
    segment_height=(0.85, 1.18),
    size=1.0,
    rate=0.8,
    closure=(-1.8, 0.5),
    price=0.6,
    friction=4.0,
    restitution=(0.5, 1.5),
    access=(1.0, 3.0),
    size_of_event=0.5,
    stems=(0.3, 1.8),
    condition=(0.4, 2.2),
    sag=(0.7, 1.4),
    traffic=(-1.8, 0.5),
    plausible=True,
)
"""Ranges of the second version of the splits, with which the best layouts of two instances of a
family differ more."""

SEEDS = tuple(dict.fromkeys((*FAMILIES, *WIDE_FAMILIES)))
"""Families in the order that determines the random numbers of their instances."""

ATTEMPTS = 20
"""Largest number of draws for an instance; wide ranges give some sites that are refused."""


class StretchedGround:
    """The stretched ground of a built-in site.

    Parameters
    ----------
    site : Site
        The built-in site.
    rng : numpy.random.Generator
        Generator for the factors.
    by : Variation
        Ranges of the factors.
    """

    def __init__(self, site: SiteTables, rng: np.random.Generator, by: Variation = NARROW):
        points = np.array(site.slope.points)
        high = rng.uniform(*by.height)
        wide = high * rng.uniform(*by.incline)
        runs, drops = np.diff(points[:, 0]), np.diff(points[:, 1])
        on_slope = points[1:, 0] <= site.slope.toe
        wide_of = np.where(on_slope, wide, rng.uniform(*by.room))
        high_of = np.where(on_slope, high, 1.0)
        self.x_factor = wide_of * rng.uniform(*by.segment_length, len(runs))
        self.y_factor = high_of * rng.uniform(*by.segment_height, len(runs))
        road = (points[:-1, 0] >= site.road.start) & (points[1:, 0] <= site.road.end)
        self.x_factor[road] = rng.uniform(7.0, 11.0) / (site.road.end - site.road.start)
        # the ground beyond the road is not stretched because it must remain long enough
        self.x_factor[points[:-1, 0] >= site.road.end] = 1.0
        x = points[0, 0] + np.concatenate([[0.0], np.cumsum(runs * self.x_factor)])
        y = np.concatenate([[0.0], np.cumsum(drops * self.y_factor)])
        foot = int(np.searchsorted(points[:, 0], site.slope.toe))
        self.old = points
        self.new = np.column_stack([x, y - y[foot]])

    def x(self, at: float) -> float:
        """Return the new position of a chainage of the built-in site [m]."""
        return millimetres(np.interp(at, self.old[:, 0], self.new[:, 0]))

    def points(self) -> tuple[Point, ...]:
        """Return the corners of the ground."""
        return tuple((millimetres(x), millimetres(y)) for x, y in self.new)

    def mass(self, source: Source) -> Source:
        """Return a jointed mass, stretched like the ground segment under its middle.

        Its base therefore remains on the face, and its joints keep their relative positions.
        """
        corners = np.array(source.polygon)
        piece = int(np.searchsorted(self.old[:, 0], corners[:, 0].mean())) - 1
        factor = np.array([self.x_factor[piece], self.y_factor[piece]])
        moved = self.new[piece] + (corners - self.old[piece]) * factor
        steeper = factor[1] / factor[0]
        joints = tuple(
            replace(
                joint,
                dip_deg=math.degrees(math.atan(math.tan(math.radians(joint.dip_deg)) * steeper)),
            )
            for joint in source.joints
        )
        moved[:, 1] += 2e-3  # clear of the face despite rounding to millimetres
        polygon = tuple((millimetres(x), millimetres(y)) for x, y in moved)
        return replace(source, polygon=polygon, joints=joints)


def generate(base: S, name: str, number: int, by: Variation = NARROW) -> S:
    """Return an instance of the family of a built-in site.

    It depends on `number` and the ranges only. A draw that gives an invalid site is repeated.

    Raises
    ------
    BadInput
        If no draw gives a valid site.
    """
    seed = [SEEDS.index(base.name), number]
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([*seed, attempt] if attempt else seed)
        try:
            return _instance(base, name, number, by, rng)
        except BadInput:
            if attempt == ATTEMPTS - 1:
                raise
    raise AssertionError("the last attempt returns or raises")


def _instance(base: S, name: str, number: int, by: Variation, rng: np.random.Generator) -> S:
    """Return an instance from one series of draws."""
    ground = StretchedGround(base, rng, by)
    size = float(np.exp(rng.uniform(-by.size, by.size)))
    sources = tuple(_source(source, ground) for source in base.sources)
    stretches = tuple(
        Stretch(ground.x(s.start), ground.x(s.end), s.surface) for s in base.slope.surfaces
    )
    slope = Slope(ground.points(), ground.x(base.slope.toe), base.slope.surface, stretches)
    return replace(
        base,
        name=name,
        description=f"Instance {number} of the family {base.name}. {base.description}",
        slope=slope,
        sources=sources,
        events=tuple(_event(event, size, by, rng) for event in base.events),
        road=Road(ground.x(base.road.start), ground.x(base.road.end)),
        barrier_zone=_zone(base, slope, sources, ground),
        surfaces=_surfaces(base, by, rng),
        prices=_prices(base.prices, by, rng),
        consequences=_consequences(base.consequences, by, rng),
        meshes=tuple(_mesh(option, ground, rng) for option in base.meshes),
        forest=tuple(_forest(forest, ground, by, rng) for forest in base.forest),
        existing=tuple(_existing(old, ground, by, rng) for old in base.existing),
        traffic=_traffic(base.traffic, by, rng),
    )


def fallen(slope: Slope, sources: tuple[Source, ...]) -> float:
    """Return the chainage from which rock has fallen by at least 10 m or a third of the height [m].

    The height is measured from the top of the highest source to the toe.
    """
    x, y = np.array(slope.points).T
    tops = [float(np.interp(s.band[0], x, y)) for s in sources if s.band is not None]
    tops += [float(np.interp(min(s.polygon)[0], x, y)) for s in sources if s.polygon]
    top = max(tops)
    level = top - min(LEAST_FALL, LEAST_FALL_SHARE * (top - float(np.interp(slope.toe, x, y))))
    for (ax, ay), (bx, by) in pairwise(slope.points):
        if by <= level < ay:
            return ax + (bx - ax) * (ay - level) / (ay - by)
    return slope.toe


def _source(source: Source, ground: StretchedGround) -> Source:
    if source.band is None:
        return ground.mass(source)
    return replace(source, band=(ground.x(source.band[0]), ground.x(source.band[1])))


def _event(event: Event, size: float, by: Variation, rng: np.random.Generator) -> Event:
    """Return an event with another rate and another block size."""
    rate = round(event.rate * float(np.exp(rng.uniform(-by.rate, by.rate))), 4)
    if event.area is None:
        return replace(event, rate=rate)
    if by.size_of_event:
        size *= float(np.exp(rng.uniform(-by.size_of_event, by.size_of_event)))
    low, high = (round(area * size, 4) for area in event.area)
    return replace(event, rate=rate, area=(low, high))


def _zone(
    base: SiteTables, slope: Slope, sources: tuple[Source, ...], ground: StretchedGround
) -> BarrierZone:
    """Return the zone, moved with the ground and limited to where rock has fallen far enough."""
    zone = base.barrier_zone
    start = max(ground.x(zone.start), fallen(slope, sources) + ZONE_MARGIN)
    return replace(zone, start=millimetres(start), end=ground.x(zone.end))


def _surfaces(base: SiteTables, by: Variation, rng: np.random.Generator) -> dict[str, Surface]:
    shift, factor, loss = rng.uniform(-by.friction, by.friction), *rng.uniform(*by.restitution, 2)
    found = {
        name: replace(
            surface,
            friction_deg=round(surface.friction_deg + shift, 2),
            restitution=round((surface.restitution or 0.0) * factor, 3),
            rolling=min(round(surface.rolling * loss, 3), 1.0),
        )
        for name, surface in base.surfaces.items()
    }
    return {name: _plausible(one) for name, one in found.items()} if by.plausible else found


def _plausible(surface: Surface) -> Surface:
    """Return a surface with properties in the ranges of its ground."""
    ground = GROUNDS.get(surface.ground or "")
    if ground is None:
        return surface
    return replace(
        surface,
        friction_deg=_within(surface.friction_deg, ground.friction_deg),
        restitution=_within(surface.restitution or 0.0, ground.restitution),
        rolling=_within(surface.rolling, ground.rolling),
    )


def _within(value: float, span: Span) -> float:
    return min(max(value, span.low), span.high)


def _prices(prices: Prices, by: Variation, rng: np.random.Generator) -> Prices:
    """Return prices that vary independently by kind of barrier."""
    fence, ditch, fill, concrete = np.exp(rng.uniform(-by.price, by.price, 4)).tolist()
    return replace(
        prices,
        fence={name: round(price * fence, 1) for name, price in prices.fence.items()},
        ditch={name: round(price * ditch, 1) for name, price in prices.ditch.items()},
        embankment=round(prices.embankment * fill, 1),
        concrete=round(prices.concrete * concrete, 1),
        access=round(rng.uniform(*by.access), 2),
    )


def _consequences(what: Consequences, by: Variation, rng: np.random.Generator) -> Consequences:
    """Return consequences with another cost per day of closure, as for another traffic volume."""
    factor = float(np.exp(rng.uniform(*by.closure)))
    return replace(what, closure=round(what.closure * factor, -2))


def _mesh(option: MeshOption, ground: StretchedGround, rng: np.random.Generator) -> MeshOption:
    """Return a mesh option scaled to the height of the face, with another price."""
    high = float(ground.new[:, 1].max() / (ground.old[:, 1].max() or 1.0))
    price = check.number("mesh price", option.price * rng.uniform(0.85, 1.2), 0.0)
    return replace(option, area=round(option.area * high, 2), price=round(price, 1))


def _forest(
    forest: Forest, ground: StretchedGround, by: Variation, rng: np.random.Generator
) -> Forest:
    """Return a forest moved with the ground, with another number of stems."""
    stems = round(forest.stems * rng.uniform(*by.stems), 0)
    return replace(forest, start=ground.x(forest.start), end=ground.x(forest.end), stems=stems)


def _existing(
    old: Existing, ground: StretchedGround, by: Variation, rng: np.random.Generator
) -> Existing:
    """Return an existing barrier moved with the ground, of another height and strength."""
    condition = min(max(round(old.condition * rng.uniform(*by.condition), 2), 0.05), 1.0)
    height = None if old.height is None else round(old.height * rng.uniform(*by.sag), 2)
    weak = condition if old.kind == "fence" else old.condition
    return replace(old, x=ground.x(old.x), height=height, condition=weak)


def _traffic(traffic: Traffic | None, by: Variation, rng: np.random.Generator) -> Traffic | None:
    """Return the traffic with another number of vehicles."""
    if traffic is None:
        return None
    factor = float(np.exp(rng.uniform(*by.traffic)))
    return replace(traffic, vehicles_per_day=round(traffic.vehicles_per_day * factor, -1))


def millimetres(value: float) -> float:
    """Return a length rounded to millimetres [m]."""
    return round(float(value), 3)
