"""Random sites: slopes of many shapes, loose rock on the face below the crest, a road at the foot.

The ranges are chosen, not measured: rock that slides at once, slopes of 20 to 75 m, a catch area
that is the wider the higher the slope, as in Ritchie's table, 5 to 10 m, and 0.2 to 0.8 of the rock
past the edge of the unprotected road (a test keeps that).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigdda.joints import JointSet
from rigdda.scene import Surface
from rigdda.site import BarrierZone, Motion, Road, Site, Slope
from rigdda.source import Point, Source

PLATEAU = 10.0
"""Length of the ground behind the crest [m]."""

BEYOND = 40.0
"""Length of the ground beyond the road [m], which falls gently."""

MARGIN = 2.0
"""Distance from the last barrier to the road [m]."""

ROOM = 8.0
"""Least length of the zone for barriers [m], more than any barrier's; slopes are drawn until they
have it."""

CLEAR = 0.05
"""Height of the rock above its face at the start [m]: clear of it whatever the rounding."""


class Rock(NamedTuple):
    """A trapezoid of rock on a face of `dip_deg` [deg]; the crest is the origin.

    `area` [m2], `block_area` [m2], `end`: distance of its lower corner from the crest along the
    face [m].
    """

    corners: tuple[Point, ...]
    area: float
    block_area: float
    dip_deg: float
    end: float


def generate(seed: int) -> Site:
    """Return the random site of a seed, a whole number of at least 0; the same for the same seed.

    From the crest down: the upper face with the rock; one to three steeper faces of 10 to 20 m
    with benches of 1.5 to 3.5 m between them that dip outwards; the catch area; the road.
    Barriers may stand from below the rock to 2 m before the road.
    """
    rng = np.random.default_rng(seed)
    friction = rng.uniform(22.0, 28.0)
    rock = _rock(rng, friction)
    clear, road = 0.0, 0.0
    while road - MARGIN - clear < ROOM:
        chain = _faces(rng, rock)
        (_, rock_end), (toe, bottom) = chain[2], chain[-1]
        catch = 4.0 + 0.1 * (rock_end - bottom) + rng.uniform(-0.75, 0.75)
        road = toe + min(max(catch, 5.0), 10.0)
        clear = max(chain[2][0], max(x for x, _ in rock.corners) + 0.5)
    end = road + rng.uniform(7.0, 11.0)
    chain += [(road, bottom - 0.3), (end, bottom - 0.3), (end + BEYOND, bottom - 2.0)]
    return Site(
        name=f"random-{seed}",
        description=f"Random site {seed}: {-bottom:.0f} m high, {rock.area:.0f} m2 of rock.",
        slope=Slope(_lift(chain, bottom), _millimetres(toe)),
        source=Source(
            _lift(rock.corners, bottom),
            joints=_joints(rng, rock.dip_deg),
            block_area=rock.block_area,
        ),
        road=Road(_millimetres(road), _millimetres(end)),
        barrier_zone=BarrierZone(_millimetres(clear), _millimetres(road - MARGIN)),
        surfaces={"rock": Surface(friction, restitution=rng.uniform(0.05, 0.3))},
        motion=Motion(damping=rng.uniform(0.0, 0.12), duration=12.0),
    )


def _rock(rng: np.random.Generator, friction: float) -> Rock:
    """Draw 23 to 36 blocks of 1.5 to 3.5 m2 on a face at least 14 deg steeper than friction."""
    dip = rng.uniform(max(friction + 14.0, 42.0), 54.0)
    block_area = rng.uniform(1.5, 3.5)
    area = rng.integers(23, 37) * block_area
    thickness = math.sqrt(area / rng.uniform(2.5, 4.0))
    lead, tail = rng.uniform(0.0, 0.5, 2) * thickness  # how far the ends lean inwards
    start = rng.uniform(0.5, 2.0)
    end = start + area / thickness + 0.5 * (lead + tail)
    cos, sin = math.cos(math.radians(dip)), math.sin(math.radians(dip))
    top = CLEAR + thickness
    along = ((start, CLEAR), (end, CLEAR), (end - tail, top), (start + lead, top))
    corners = tuple((u * cos + v * sin, v * cos - u * sin) for u, v in along)
    return Rock(corners, area, block_area, dip, end)


def _faces(rng: np.random.Generator, rock: Rock) -> list[Point]:
    """Draw the chain from the plateau to the toe, the crest being the origin."""
    length, dip = rock.end + rng.uniform(0.5, 3.0), math.radians(rock.dip_deg)
    x, y = length * math.cos(dip), -length * math.sin(dip)
    chain = [(-PLATEAU, 0.0), (0.0, 0.0), (x, y)]
    for face in range(rng.integers(1, 4)):
        if face:
            bench = rng.uniform(1.5, 3.5)
            x, y = x + bench, y - bench * math.tan(math.radians(rng.uniform(15.0, 30.0)))
            chain.append((x, y))
        height = rng.uniform(10.0, 20.0)
        steep = math.radians(rng.uniform(max(rock.dip_deg + 2.0, 52.0), 72.0))
        x, y = x + height / math.tan(steep), y - height
        chain.append((x, y))
    return chain


def _joints(rng: np.random.Generator, dip: float) -> tuple[JointSet, JointSet]:
    """Draw one set along the face and one across it."""
    across = dip - rng.uniform(75.0, 105.0)
    return JointSet(dip, scatter=0.15), JointSet(across, scatter=0.15)


def _lift(points: list[Point] | tuple[Point, ...], bottom: float) -> tuple[Point, ...]:
    """Return points with the toe at elevation 0."""
    return tuple((_millimetres(x), _millimetres(y - bottom)) for x, y in points)


def _millimetres(value: float) -> float:
    return round(float(value), 3)
