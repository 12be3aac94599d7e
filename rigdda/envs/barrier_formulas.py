"""Checks of single barriers by hand formulas, as demand and capacity.

Fences: energy, height and elongation by the rule (`rigdda.envs.fence_checks`). Gravity walls and
embankments: height, sliding under the design impact and, for walls, overturning and bearing, under
the impact and with rock at rest up to the crest (`rigdda.limit_equilibrium`). Ditches: the width
and the depth of Ritchie.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rigdda import Barrier, Ditch, Embankment, Fence, GravityWall, Scene, Site, limit_equilibrium
from rigdda.barriers import section
from rigdda.barriers.base import ELEMENT, sliding_angle, surfaces_below
from rigdda.barriers.gravity_wall import SLID
from rigdda.envs.fence_checks import USE_ROUNDING, Action, Demand, FenceCheck
from rigdda.envs.ritchie_ditch import RitchieDitch
from rigdda.limit_equilibrium import Impact

PRESSURE_ON_ROCK, PRESSURE_ON_SOIL = 1e6, 2e5
"""Admissible pressure on rock and on other ground [Pa]; presumed values of BS 8004:1986, from
memory."""

LOOSE, REPOSE = 18e3, 38.0
"""Weight [N/m3] and friction angle [deg] of the rock that lies behind a wall."""

PUSHED = 0.5
"""Displacement that an embankment may suffer in the design impact [m]. In full-scale tests,
embankments of reinforced soil held impacts that displaced them by more (Peila et al. 2007,
Landslides 4, 255-265, from memory)."""

SLIDING_SAFETY, OVERTURNING_SAFETY = 1.5, 2.0
"""Factors of safety that are customary under permanent loads [-]. Under the design impact, which
has its own partial factors and is accidental, 1 is enough."""


class BarrierCheck(NamedTuple):
    """A check of a barrier.

    Parameters
    ----------
    barrier : str
        The barrier in words.
    x : float
        Its chainage [m].
    check : str
        What is checked.
    demand, capacity : float
        Demand and capacity in `unit`.
    unit : str
        Their unit.
    limit : float
        Largest acceptable utilisation [-].
    note : str
        Event, load or doubt.
    existing : bool
        Whether the barrier stands already.
    """

    barrier: str
    x: float
    check: str
    demand: float
    capacity: float
    unit: str
    limit: float
    note: str
    existing: bool = False

    @property
    def use(self) -> float:
        """Demand divided by capacity [-]."""
        return self.demand / self.capacity if self.capacity > 0.0 else float("inf")

    @property
    def satisfied(self) -> bool:
        """Whether the utilisation is acceptable."""
        return self.use <= self.limit + USE_ROUNDING


def checks_of(site: Site, barrier: Barrier, demand: Demand | None) -> Iterator[BarrierCheck]:
    """Yield the checks of a barrier.

    Parameters
    ----------
    site : Site
        The site.
    barrier : Barrier
        The barrier. Mesh, removals and rigid walls have no checks.
    demand : Demand or None
        What the blocks of the design events do where it stands; None if none arrives, in which case
        only ditches have checks.
    """
    if isinstance(barrier, Ditch):
        yield from _ditch(site, barrier)
    elif demand is None:
        return
    elif isinstance(barrier, Fence):
        yield from _fence(FenceCheck.of(site, barrier, demand))
    elif isinstance(barrier, GravityWall | Embankment):
        yield from _structure(site, barrier, demand)


def _fence(check: FenceCheck) -> Iterator[BarrierCheck]:
    """Yield the checks of a fence by the rule."""
    fence, hard, high = check.fence, check.demand.hard, check.demand.high
    head = fence.label, fence.x
    note = f"{_who(hard)}; design energy {1e-3 * hard.energy():,.0f} kJ"
    demand = check.factors.energy * hard.energy()
    yield BarrierCheck(*head, "energy", 1e-3 * demand, 1e-3 * check.energy, "kJ", 1.0,
                       note)  # fmt: skip
    yield BarrierCheck(*head, "height", high.needed_height(), fence.height, "m", 1.0,
                       _who(high))  # fmt: skip
    yield BarrierCheck(*head, "elongation", check.design_elongation, check.clearance, "m", 1.0,
                       f"{check.factors.elongation:g} times {fence.deflection:g} m")  # fmt: skip


def _who(action: Action) -> str:
    """Return in words which blocks arrive."""
    event = action.event
    few = "" if action.enough else ", too few for a quantile"
    return f"{event.name}, {action.passing:,.0f} of {event.blocks:,} blocks arrive{few}"


def _structure(
    site: Site, barrier: GravityWall | Embankment, demand: Demand
) -> Iterator[BarrierCheck]:
    """Yield the checks of a gravity wall or an embankment."""
    high, head = demand.high, (barrier.label, barrier.x)
    yield BarrierCheck(*head, "height", high.needed_height(), barrier.height, "m", 1.0,
                       _who(high))  # fmt: skip
    base = Base.of(site, barrier)
    hard = demand.hard
    length, way = ELEMENT, SLID
    if isinstance(barrier, Embankment):  # the load spreads at 45 degrees
        length, way = 2.0 * (hard.event.radius + barrier.height), PUSHED
    impact = design_impact(hard, barrier.height, base.restitution)
    mass = base.weight / base.gravity * length
    load = limit_equilibrium.equivalent_load(impact, mass, way) / length
    note = f"impact of {_who(hard)}; {impact.mass:,.0f} kg at {impact.speed:.1f} m/s"
    yield from _stands(head, base, "impact", load, impact.height, 1.0, 1.0, note)
    if isinstance(barrier, GravityWall):
        thrust = limit_equilibrium.rock_thrust(barrier.height, LOOSE, REPOSE)
        lever, note = barrier.height / 3.0, "rock at rest up to its crest"
        yield from _stands(
            head, base, "rock", thrust, lever, SLIDING_SAFETY, OVERTURNING_SAFETY, note
        )


class Base(NamedTuple):
    """How a gravity structure stands.

    Parameters
    ----------
    weight : float
        Weight per metre [N/m].
    width : float
        Width of its base [m]; 0 for an embankment, which slides but does not overturn.
    friction : float
        Horizontal resistance to sliding over the weight [-]: tan(phi - b), see
        `rigdda.barriers.base.sliding_angle`.
    bearing : float
        Admissible pressure on the ground [Pa].
    restitution : float
        Coefficient of restitution of rock on it [-].
    gravity : float
        Acceleration of gravity [m/s2].
    """

    weight: float
    width: float
    friction: float
    bearing: float
    restitution: float
    gravity: float

    @classmethod
    def of(cls, site: Site, barrier: GravityWall | Embankment) -> Base:
        """Return how a barrier stands on the ground of a site."""
        scene = mean_scene(site, (barrier,))
        outline, gravity = scene.outline(0), -scene.gravity_vector[1]
        wall = isinstance(barrier, GravityWall)
        own = scene.barrier_surface if wall else scene.fill
        assert scene.terrain is not None
        below = surfaces_below(scene.terrain, outline)
        weight = gravity * barrier.density * section(outline)
        touched = "rock" if "rock" in scene.surfaces else next(iter(scene.surfaces))
        angle = min(scene.friction_deg(own, name) for name in below)
        angle = sliding_angle(angle, barrier.base_inclination(scene.terrain, outline))
        return cls(
            weight=weight,
            width=barrier.thickness if isinstance(barrier, GravityWall) else 0.0,
            friction=math.tan(math.radians(angle)),
            bearing=PRESSURE_ON_ROCK if set(below) == {"rock"} else PRESSURE_ON_SOIL,
            restitution=scene.interface(touched, own).restitution or 0.0,
            gravity=gravity,
        )


def mean_scene(site: Site, layout: Sequence[Barrier] = ()) -> Scene:
    """Return a scene of a site in which the ground has its mean properties and no pits.

    Checks use it, because those of a release vary at random.
    """
    drawn = site.draw(0, site.event_names[0])
    drawn = drawn._replace(strengths=(), friction_deg=0.0, roughness=None)
    return site.scene(drawn, site.built(site.as_built(layout), drawn.width))


def design_impact(action: Action, height: float, restitution: float) -> Impact:
    """Return the design impact of an event on a structure of a height [m], taken as horizontal."""
    at = min(action.design_height(), height)
    return Impact(action.design_mass, action.design_speed(), at, restitution)


def _stands(
    head: tuple[str, float],
    base: Base,
    case: str,
    load: float,
    lever: float,
    sliding: float,
    overturning: float,
    note: str,
) -> Iterator[BarrierCheck]:
    """Yield the checks of stability under a load [N/m] with the wanted factors of safety."""
    found = limit_equilibrium.stability(
        base.weight, max(base.width, 1e-3), base.friction, base.bearing, load, lever
    )

    def check(
        name: str, demand: float, capacity: float, unit: str, factor: float, least: float
    ) -> BarrierCheck:
        words = f"{note}; factor of safety {factor:.2f}, at least {least:g}"
        ends = 1e-3 * demand, 1e-3 * capacity
        return BarrierCheck(*head, f"{name}, {case}", *ends, unit, 1.0 / least, words)

    resists = base.friction * base.weight
    yield check("sliding", load, resists, "kN/m", found.sliding, sliding)
    if base.width > 0.0:
        rights = 0.5 * base.weight * base.width
        moment = load * lever
        yield check("overturning", moment, rights, "kNm/m", found.overturning, overturning)
        yield check("bearing", found.pressure, base.bearing, "kPa", found.bearing, 1.0)


def _ditch(site: Site, ditch: Ditch) -> Iterator[BarrierCheck]:
    """Yield the comparison of a ditch with that of Ritchie."""
    ritchie = RitchieDitch.of(site)
    note = f"Ritchie, cut {ritchie.height:.0f} m high at {ritchie.inclination:.0f} deg"
    note += f"; {ritchie.caveat}" if ritchie.caveat else ""
    head = ditch.label, ditch.x
    yield BarrierCheck(*head, "width", ritchie.width, ditch.width, "m", 1.0, note)
    yield BarrierCheck(*head, "depth", ritchie.depth, ditch.depth, "m", 1.0, note)
