"""Modes of rockfall on uniform slopes, and ditches at their toes (Ritchie 1963).

Ritchie (1963, Evaluation of rockfall and its control, Highway Research Record 17) filmed rocks that
were pushed off crests: below 45 deg they roll, from 45 to 75 deg they bounce, above 75 deg they
fall. Here single blocks of random shape are pushed off the crests of the sites `ritchie-35`,
`ritchie-60` and `ritchie-80`, which differ only in their slope angle.

Closed contacts do not distinguish the modes: impacts of rigid blocks are instantaneous, and an
angular block that rolls faster than sqrt(g r cos) leaves the ground between its corners. The modes
are distinguished by the distance from the slope over block size and by the number of hits.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rigdda.barriers import Ditch, Layout
from rigdda.model.scene import Block, Scene
from rigdda.model.site import Site
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import Floats, polygon, rough

SOURCE = "Ritchie (1963)"

ROLLING, BOUNCING, FALLING = 35, 60, 80
"""Slope angles for each mode [deg]."""

RELEASES, DITCHED = 64, 200
"""Number of blocks pushed off each crest to observe their descent, and above each ditch."""

LONGEST = 15.0
"""Time after which a block that has not reached the foot counts as stopped on the slope [s]."""

RUN_OUT = 10.0
"""Time in which a block comes to rest at the foot [s]."""

DITCHES = {60: (1.8, 4.6), 80: (1.2, 4.6)}
"""Depth and width [m] of Ritchie's ditches below slopes of 0.5:1 and near vertical, 10 to 20 m
high. They are quoted from memory and serve as input only, not for comparison."""


PUSH = 1e-6
"""Change of velocity in a step, other than by gravity, that indicates contact [m/s]. The contacts
that are closed at the end of a step would miss impacts that are over by then."""


class RitchieDescent(NamedTuple):
    """Descent of a block down a slope, until its height above the foot equals its size.

    `aloft` is the fraction of time in which its lowest corner is higher above the slope than its
    size, and `contact` the fraction in which it touches the slope. `touches` counts contacts
    separated by a flight, however short. `turns` is the distance over the circumference of its
    circumcircle.
    """

    aloft: float
    contact: float
    touches: int
    turns: float


def pushed(site: Site, rng: np.random.Generator) -> tuple[Block, float]:
    """Return a block that leaves the crest at 0.5 to 1.5 m/s, and its diameter [m]."""
    crest = max(site.slope.points, key=lambda point: (point[1], point[0]))
    radius = rng.uniform(0.3, 0.6)
    corners = polygon(
        rough(rng, int(rng.integers(7, 12)), radius), angle=rng.uniform(0.0, 2.0 * math.pi)
    )
    corners += np.array(crest) - corners.min(axis=0) + 0.05
    velocity = (rng.uniform(0.5, 1.5), 0.0, 0.0)
    return Block(corners, site.sources[0].density, velocity=velocity), 2.0 * radius


def descend(lab: Lab, site: Site, rng: np.random.Generator) -> RitchieDescent:
    """Push a block off the crest of a site and follow it down to the foot."""
    block, size = pushed(site, rng)
    sim = lab.simulate(Scene(site.profile, (block,), site.surfaces))
    foot = site.profile.height(site.slope.toe)
    ground = np.array(site.slope.points).T
    start = sim.poses[0, :2]
    aloft, touching = [], []
    while sim.poses[0, 1] > foot + size and sim.time < LONGEST:
        before = sim.velocities[0, :2]
        sim.step()
        corners = sim.vertices(0)
        height = corners[:, 1] - np.interp(corners[:, 0], *ground)
        aloft.append(height.min() > size)
        change = sim.velocities[0, :2] - before - np.multiply(sim.scene.gravity_vector, lab.dt)
        touching.append(np.hypot(*change) > PUSH)
    way = float(np.hypot(*(sim.poses[0, :2] - start)))
    touches = int((np.diff(touching, prepend=False) & touching).sum())
    return RitchieDescent(
        float(np.mean(aloft)), float(np.mean(touching)), touches, way / (math.pi * size)
    )


def descents(lab: Lab, slope_deg: int) -> Floats:
    """Return all descents of a slope, one row each with the fields of `RitchieDescent`."""
    site = Site.load(f"ritchie-{slope_deg}")
    return np.array([descend(lab, site, lab.random(slope_deg, i)) for i in range(RELEASES)])


def interval(values: Floats) -> Floats:
    """Return the lower and upper limits of the 95 % confidence interval of the mean."""
    half = 1.96 * values.std(ddof=1) / math.sqrt(len(values))
    return values.mean() + np.array([-half, half])


def overlaps(*intervals: Floats) -> list[float]:
    """Return the overlap of each interval with the next higher one, negative if disjoint."""
    return [float(a[1] - b[0]) for a, b in pairwise(intervals)]


def measure_modes(lab: Lab) -> tuple[Measured, ...]:
    """Compare the descents on the three slopes."""
    roll, bounce, fall = (descents(lab, deg) for deg in (ROLLING, BOUNCING, FALLING))
    aloft, _, touches, turns = range(len(RitchieDescent._fields))
    return (
        Measured(roll[:, turns].sum() / roll[:, touches].sum()),
        Measured(roll[:, aloft].mean()),
        Measured(bounce[:, touches].sum() / bounce[:, turns].sum()),
        Measured(fall[:, touches].mean()),
        Measured(1.0 - fall[:, aloft].mean()),
        Measured(overlaps(*(interval(mode[:, aloft]) for mode in (roll, bounce, fall)))),
        Measured(overlaps(*(interval(mode[:, touches]) for mode in (fall, bounce, roll)))),
    )


def passing(lab: Lab, site: Site, layout: Layout, station: float) -> float:
    """Return the fraction of blocks that come to rest beyond a chainage."""
    past = 0
    for i in range(DITCHED):
        block, _ = pushed(site, lab.random(i))
        sim = lab.simulate(Scene(site.profile, (block,), site.surfaces, layout))
        sim.step(lab.steps(RUN_OUT))
        past += bool(sim.poses[0, 0] > station)
    return past / DITCHED


def measure_ditch(lab: Lab, slope_deg: int) -> tuple[Measured, Measured]:
    """Push the same blocks off a crest with and without a ditch at the toe."""
    site = Site.load(f"ritchie-{slope_deg}")
    depth, width = DITCHES[slope_deg]
    ditch = Ditch(site.slope.toe, depth, width)
    dug, level = (passing(lab, site, layout, ditch.end) for layout in ((ditch,), ()))
    return Measured(dug), Measured(dug - level)


MODES = Case(
    "ritchie-modes",
    (
        # a rolling block touches at least once per turn and is mostly near the slope
        Check("turns a touch at 35 deg", f"at most 1: it rolls, {SOURCE}", "-", 1.0, "bound"),
        Check("time aloft at 35 deg", f"none: it rolls, {SOURCE}", "-", 0.5, "bound"),
        # a bouncing block makes more than a turn between touches
        Check("touches a turn at 60 deg", f"under 1: it bounces, {SOURCE}", "-", 1.0, "bound"),
        # a block pushed off at v meets the face after a fall of 2 v^2 tan^2/g, 6.6 m at 1 m/s,
        # three times on a face of 20 m
        Check("touches at 80 deg", f"few: it falls, {SOURCE}", "-", 3.0, "bound"),
        Check("time not aloft at 80 deg", f"none: it falls, {SOURCE}", "-", 0.5, "bound"),
        Check("overlap of time aloft", "none: 35 < 60 < 80 deg", "-", 0.0, "bound"),
        Check("overlap of touches", "none: 35 > 60 > 80 deg", "-", 0.0, "bound"),
    ),
    measure_modes,
    slow=True,
)


def ditch_case(slope_deg: int) -> Case:
    """Return the case of a ditch; its retention is reported, but it only has to be effective."""
    return Case(
        f"ritchie-ditch-{slope_deg}",
        (
            Check("past the ditch", f"none: it keeps them, {SOURCE}", "-", 0.5, "bound"),
            Check("past it less past level ground", "below 0: it helps", "-", 0.0, "bound"),
        ),
        lambda lab: measure_ditch(lab, slope_deg),
    )


CASES = (MODES, *(ditch_case(slope_deg) for slope_deg in DITCHES))
