"""Limit equilibrium of a toppling slope (Goodman and Bray 1976) and of gravity structures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import check
from rigdda.errors import BadInput


class Toppling(NamedTuple):
    """Forces and failure modes of the N blocks of a slope, from its toe upwards, per metre width.

    Parameters
    ----------
    force : (N,) array
        Force along the base that each block requires from the next lower one for equilibrium; for
        the toe block, the force required from a support [N].
    normal, shear : (N,) arrays
        Forces of the base on each block [N]; shear acts up the dip.
    mode : tuple of str
        "stable", "toppling" or "sliding" for each block.
    """

    force: NDArray[np.float64]
    normal: NDArray[np.float64]
    shear: NDArray[np.float64]
    mode: tuple[str, ...]


def toppling(
    heights: Sequence[float],
    width: float,
    step: float,
    dip_deg: float,
    friction_deg: float,
    unit_weight: float,
) -> Toppling:
    r"""Return the limit equilibrium of columns on a stepped base.

    From the top down, block n with the force P_n from the block above requires from the block below
    the greater of

    .. math::
        P_{n-1,t} = [P_n (M_n - \Delta x \tan\phi) + \tfrac12 W_n (y_n \sin\alpha
                    - \Delta x \cos\alpha)] / L_n, \qquad
        P_{n-1,s} = P_n - W_n (\cos\alpha \tan\phi - \sin\alpha) / (1 - \tan^2\phi)

    against toppling and sliding, and no force if both are negative. Friction on the sides is fully
    mobilised. Neighbours are in contact at the lower of their two tops: at M_n above the base of
    block n on its upper side, at L_n on its lower side. (Goodman and Bray 1976, Toppling of rock
    slopes, ASCE Specialty Conference on Rock Engineering, 201-234.)

    Parameters
    ----------
    heights : sequence of float
        Heights of the columns from the toe upwards [m].
    width : float
        Width of each column along the base [m].
    step : float
        Rise of the base from a column to the next higher one, normal to it [m].
    dip_deg : float
        Dip alpha of the base of each column [deg].
    friction_deg : float
        Friction angle phi of bases and sides [deg], below 45.
    unit_weight : float
        Weight of the rock [N/m3].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """
    check.number("step", step, 0.0)
    given = check.sequence("heights", heights, object, "numbers")
    y = np.array([check.number("heights", height, step, open_low=True) for height in given])
    if not len(y):
        raise BadInput("heights", heights, "give one height a column, each above the step")
    check.number("width", width, 0.0, open_low=True)
    check.number("dip_deg", dip_deg, 0.0, 89.9)
    check.number("friction_deg", friction_deg, 0.0, 44.9)
    check.number("unit_weight", unit_weight, 0.0, open_low=True)
    sin, cos = math.sin(math.radians(dip_deg)), math.cos(math.radians(dip_deg))
    tan = math.tan(math.radians(friction_deg))
    weight = unit_weight * width * y
    upper = np.minimum(y, np.append(y[1:], 0.0) + step)  # M; the last column has no upper neighbour
    lower = np.minimum(y, np.append(0.0, y[:-1] - step))  # L; 0 at the toe
    force, mode = np.zeros(len(y)), []
    above = 0.0
    for n in reversed(range(len(y))):
        turning = above * (upper[n] - width * tan) + 0.5 * weight[n] * (y[n] * sin - width * cos)
        topple = turning / lower[n] if lower[n] > 0.0 else math.copysign(math.inf, turning)
        slide = above - weight[n] * (cos * tan - sin) / (1.0 - tan * tan)
        force[n] = max(topple, slide, 0.0)
        mode.append(_mode(topple, slide))
        above = force[n]
    pushed = np.append(force[1:], 0.0) - force
    normal, shear = weight * cos + pushed * tan, weight * sin + pushed
    return Toppling(force, normal, shear, tuple(reversed(mode)))


def _mode(topple: float, slide: float) -> str:
    if max(topple, slide) <= 0.0:
        return "stable"
    return "toppling" if topple > slide else "sliding"


def columns(crest: int, above: int, rise: float, fall: float, step: float) -> list[float]:
    """Return the heights of the columns of a slope from the toe upwards [m].

    Up to number `crest`, they increase by `rise` - `step` each; the `above` columns beyond it
    decrease by `fall` + `step` each (a1, a2 and b of Goodman and Bray).
    """
    below: Sequence[float] = [n * (rise - step) for n in range(1, crest + 1)]
    return [*below, *(below[-1] - n * (fall + step) for n in range(1, above + 1))]


class Impact(NamedTuple):
    """Impact of a block on a gravity structure.

    Parameters
    ----------
    mass : float
        Mass of the block [kg].
    speed : float
        Its velocity towards the structure [m/s].
    height : float
        Height of the impact above the base [m].
    restitution : float
        Coefficient of restitution of the block on the structure [-].
    """

    mass: float
    speed: float
    height: float
    restitution: float = 0.0


class Stability(NamedTuple):
    """Stability of a gravity structure under a horizontal load.

    Parameters
    ----------
    load : float
        Horizontal load [N].
    sliding, overturning, bearing : float
        Factors of safety: resistance divided by load [-]; inf without a load, and 0 for bearing if
        the resultant lies outside the base.
    pressure : float
        Mean pressure on the compressed part of the base [Pa]; inf if there is none.
    """

    load: float
    sliding: float
    overturning: float
    bearing: float
    pressure: float


def equivalent_load(impact: Impact, mass: float, displacement: float) -> float:
    r"""Return the constant force that stops a struck structure over a displacement [N].

    The peak of the contact force lasts milliseconds and says little of stability. Momentum is
    conserved in the impact, and the force does work on what it leaves (Yong et al., Analytical
    solution for estimating sliding displacement of rigid barriers subjected to boulder impact,
    Journal of Engineering Mechanics 145 (2019) 04019006):

    .. math:: V = \frac{(1 + e)\, m}{m + M} v, \qquad F = \frac{M V^2}{2 s}

    A structure whose friction exceeds F slides less than s.

    Parameters
    ----------
    impact : Impact
        The impact.
    mass : float
        Mass M of the part of the structure that acts as a unit [kg].
    displacement : float
        Tolerated displacement s [m].
    """
    check.number("mass", mass, 0.0, open_low=True)
    check.number("displacement", displacement, 0.0, open_low=True)
    speed = (1.0 + impact.restitution) * impact.mass * impact.speed / (impact.mass + mass)
    return 0.5 * mass * speed**2 / displacement


def rock_thrust(height: float, unit_weight: float, friction_deg: float) -> float:
    r"""Return the active thrust of rock with a level surface behind a vertical face [N/m].

    .. math:: T = \tfrac12 K_a \gamma h^2, \qquad K_a = \tan^2(45^\circ - \phi / 2)

    It acts at a third of the height (Rankine 1857).

    Parameters
    ----------
    height : float
        Height of the rock [m].
    unit_weight : float
        Its weight [N/m3].
    friction_deg : float
        Its friction angle [deg].
    """
    active = math.tan(math.radians(45.0 - 0.5 * friction_deg)) ** 2
    return 0.5 * active * unit_weight * height**2


def stability(
    weight: float, width: float, friction: float, bearing: float, load: float, lever: float
) -> Stability:
    r"""Return the factors of safety of a gravity structure under a horizontal load.

    .. math::
        F_s = \frac{\mu W}{H}, \qquad F_o = \frac{W b / 2}{H h}, \qquad
        F_b = \frac{q_a (b - 2 e)}{W}, \quad e = \frac{H h}{W}

    against sliding, against overturning about the downhill edge of the base, and against bearing,
    with the pressure spread evenly over the part of the base that is centred on the resultant
    (Meyerhof 1953, 3rd ICSMFE, 440-445).

    Parameters
    ----------
    weight : float
        Weight per metre W [N/m].
    width : float
        Width of the base b [m]; the weight acts at its middle.
    friction : float
        Coefficient of friction of the base [-].
    bearing : float
        Admissible pressure on the ground q_a [Pa].
    load : float
        Horizontal load per metre H [N/m].
    lever : float
        Height of the load above the base h [m].

    Raises
    ------
    BadInput
        If a value is outside its range.
    """
    for name, value in (("weight", weight), ("width", width), ("bearing", bearing)):
        check.number(name, value, 0.0, open_low=True)
    for name, value in (("friction", friction), ("load", load), ("lever", lever)):
        check.number(name, value, 0.0)
    moment = load * lever
    compressed = max(width - 2.0 * moment / weight, 0.0)
    return Stability(
        load=load,
        sliding=friction * weight / load if load else math.inf,
        overturning=0.5 * weight * width / moment if moment else math.inf,
        bearing=bearing * compressed / weight,
        pressure=weight / compressed if compressed else math.inf,
    )
