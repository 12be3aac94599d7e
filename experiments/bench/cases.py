"""What is computed: the same scene for every engine, and the error of what comes out."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.bench.penetration import penetration
from rigdda import Block, Scene, Site, Terrain
from rigdda.validation import free_flight, rocking, slides, stacks
from rigdda.validation.scenes import FLAT, box, incline, polygon, rock

Floats = NDArray[np.float64]

LONGEST = 0.1
"""Longest step [s]; every step is a whole part of it. The core refuses what is too long for it."""

FRAME = 0.02
"""Interval of the frames of a rockfall, and its longest step [s]."""

RELEASE = 25.0
"""Simulated time of a rockfall [s]."""

PARTS = (1, 2, 5, 6, 8, 10, 12, 15, 20, 25, 40, 50, 100)
"""Steps of all engines, as parts of the longest one: 0.1 s to 1e-3 s."""

FINE = (*PARTS, 200, 400, 800, 1600)
"""Steps where closed forms are approached, down to 6.25e-5 s."""

QUICK_PARTS = (1, 2, 5, 6, 8, 10, 12, 15, 20, 50, 200, 800)
"""Steps of the quick run."""

SETTLED = 2.0
"""Time at the end over which the penetration of what stands is taken [s]."""

APART = 2e-3
"""Least interval of the poses from which an impact is told [s]."""

STANDS = 0.1
"""Displacement beyond which a stack counts as fallen [m]."""

RUN_OUT = 400.0
"""The valley floor is drawn out level to here [m], so that no block leaves the terrain."""


@dataclass(frozen=True)
class Case:
    """Scenes that every engine computes.

    Parameters
    ----------
    name, quantity : str
        Its name, and what its error is, with the unit.
    scenes : tuple of Scene
        Variants; `total` makes one error of theirs.
    duration : float
        Simulated time [s].
    every : float or None
        Interval of the frames [s]; None: every step.
    error : callable
        Error of one scene from the times (T,) and the poses (T, N, 3) of its frames, the start
        included.
    parts : tuple of int
        Steps, as parts of `LONGEST`.
    options : int or None
        How many of an engine's options are tried, from the first on; None: all.
    levels : tuple of float
        Errors at which engines are compared.
    must, aim : float
        Processor time of this core over that of the cheapest peer: what is asked, and hoped for.
    sleeping : bool
        Whether blocks at rest may sleep.
    """

    name: str
    quantity: str
    scenes: tuple[Scene, ...]
    duration: float
    every: float | None
    error: Callable[[Scene, Floats, Floats], float]
    parts: tuple[int, ...] = FINE
    options: int | None = None
    levels: tuple[float, ...] = (1e-2, 1e-3, 1e-4)
    must: float = 1.0
    aim: float = 0.5
    sleeping: bool = False
    total: Callable[[list[float]], float] = max


def slide_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the way of a slide on 30 degrees at a friction of 20."""
    exact = slides.slide(30.0, 20.0, times[-1])
    return abs(math.dist(poses[-1, 0, :2], poses[0, 0, :2]) / exact - 1.0)


def creep(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the way that a block creeps after the first second over its size, 1 m."""
    return math.dist(poses[-1, 0, :2], poses[np.searchsorted(times, 1.0 - 1e-9), 0, :2])


def fall_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the way of a damped fall."""
    exact = free_flight.fall(scene.damping, times[-1])[0]
    return abs((poses[0, 0, 1] - poses[-1, 0, 1]) / exact - 1.0)


def rocking_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the time in which a tilted block falls back onto its base.

    The impact is in the first step in which the block does not turn faster than before; the time at
    which its base lies flat follows from the parabola through the three poses before that step.
    Poses are `APART`: closer, the rounding of single precision passes for an impact.
    """
    thin = max(1, round(APART / times[1]))
    times, poses = times[::thin], poses[::thin]
    corners = scene.blocks[0].vertices
    tilt = math.atan2(corners[1, 1] - corners[0, 1], corners[1, 0] - corners[0, 0])
    angle = tilt + poses[:, 0, 2]
    slowed = np.flatnonzero(np.diff(angle, 2) > 0.0)
    slowed = slowed[slowed > 1]
    if len(slowed) == 0:
        return math.inf
    last = slowed[0] + 1
    a, b, c = np.polyfit(times[last - 2 : last + 1] - times[last], angle[last - 2 : last + 1], 2)
    after = 2.0 * c / (-b + math.sqrt(max(b * b - 4.0 * a * c, 0.0)))
    exact = rocking.time_to_turn(rocking.HALF - tilt, rocking.HALF)
    return abs((times[last] + after) / exact - 1.0)


def sinking(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the greatest penetration once settled [m]; infinite if the blocks do not stand."""
    moved = np.hypot(*(poses[:, :, :2] - poses[0, :, :2]).T).max()
    if not moved <= STANDS:
        return math.inf
    return float(penetration(scene, poses[times >= times[-1] - SETTLED]).max())


def deepest(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the greatest penetration of all frames [m]."""
    return float(penetration(scene, poses).max())


def rockfall_scene(count: int, seed: int) -> Scene:
    """Return about `count` blocks of 2 m2 above the slope with benches of the scene shu-hwa-paper.

    Its source has about 120. A smaller one has the same shape; a larger one is thicker, as long as
    the slope below it.
    """
    site = Site.load("shu-hwa-paper")
    crest, edge = np.array(site.slope.points[1:3])
    along = (edge - crest) / np.hypot(*(edge - crest))
    out = np.array([-along[1], along[0]])
    (rock,) = site.sources
    source = np.array(rock.polygon) - crest
    share = count / 120.0
    length = min(math.sqrt(share), 1.0)
    s, n = source @ along, source @ out
    corners = crest + np.outer(s.mean() + (s - s.mean()) * length, along)
    corners += np.outer(n * share / length, out)
    valley = (RUN_OUT, site.slope.points[-1][1])
    change = msgspec.structs.replace
    return change(
        site,
        sources=(change(rock, polygon=tuple(map(tuple, corners.tolist()))),),
        slope=change(site.slope, points=(*site.slope.points, valley)),
    ).realise(seed=seed)


def rockfall(count: int, seeds: int, must: float, aim: float) -> Case:
    """Return the case of a rockfall; of its releases, the median greatest penetration counts."""
    return Case(
        f"rockfall-{count}",
        "greatest penetration [m]",
        tuple(rockfall_scene(count, seed) for seed in range(1, seeds + 1)),
        RELEASE,
        FRAME,
        deepest,
        tuple(part for part in PARTS if LONGEST / part <= FRAME),
        3 if count < 480 else 2,  # the third costs minutes and decides nothing
        (0.05,),
        must,
        aim,
        sleeping=True,
        total=lambda errors: float(np.median(errors)),
    )


def standing(name: str, blocks: tuple[Block, ...]) -> Case:
    """Return the case of blocks that stand on one another, awake."""
    scene = Scene(Terrain(FLAT), blocks, rock())
    return Case(name, "penetration at rest [m]", (scene,), 10.0, 0.1, sinking, PARTS)


def tilted(tilt: float) -> Scene:
    """Return the scene of a block 1 m wide and 4 m high that stands on one corner."""
    corners = [(0.0, 0.0), (rocking.WIDTH, 0.0), (rocking.WIDTH, rocking.HEIGHT)]
    block = Block(polygon([*corners, (0.0, rocking.HEIGHT)], angle=tilt))
    return Scene(Terrain(FLAT), (block,), rock(60.0))


def single() -> tuple[Case, ...]:
    """Return the cases of one block."""
    falling = Scene(None, (box(),), rock(), damping=0.6)
    tilts = tuple(map(tilted, rocking.TILTS))
    slide, hold = (incline(30.0, friction)[0] for friction in (20.0, 35.0))
    return (
        Case("slide", "relative error of the way [-]", (slide,), 2.0, 2.0, slide_error),
        Case("hold", "creep over block size [-]", (hold,), 10.0, 1.0, creep, PARTS),
        Case("damped-fall", "relative error of the way [-]", (falling,), 3.0, 3.0, fall_error),
        Case("rocking", "relative error of the time [-]", tilts, 0.8, None, rocking_error),
    )


def all_cases() -> tuple[Case, ...]:
    """Return all cases."""

    def rng() -> np.random.Generator:
        return np.random.default_rng(0)

    return (
        *single(),
        standing("stack-10", stacks.tower(rng(), 10)),
        standing("stack-30", stacks.tower(rng(), 30)),
        standing("mass-1-100", stacks.heavy_on_light(rng(), 100.0)),
        rockfall(20, 5, 1.0, 0.5),
        rockfall(120, 7, 0.75, 0.45),
        rockfall(480, 3, 0.7, 0.35),
    )


def quick_cases() -> tuple[Case, ...]:
    """Return all cases but the largest, with fewer steps and fewer options each.

    And with one scene, but where the error is a median over scenes: in each rockfall the greatest
    penetration is another one.
    """
    return tuple(
        replace(
            c,
            scenes=c.scenes[:1] if c.total is max else c.scenes,
            parts=tuple(p for p in c.parts if p in QUICK_PARTS),
            options=2,
        )
        for c in all_cases()[:-1]
    )
