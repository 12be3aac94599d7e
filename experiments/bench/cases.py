"""Cases of the benchmark: the same scenes for every engine, and the errors of their results."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.bench.penetration import penetration
from rigdda import Block, Scene, Site, Terrain
from rigdda.validation import assemblies, motion, single_block
from rigdda.validation.scenes import FLAT, box, incline, polygon, rock

Floats = NDArray[np.float64]

LONGEST = 0.1
"""Longest step [s], which is also the frame interval of rockfalls; all steps divide it. The core
refuses steps that are too long for it."""

RELEASE = 25.0
"""Simulated time of a rockfall [s]."""

PARTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 40, 50, 100)
"""Steps of all engines, as divisors of the longest one: 0.1 s to 1e-3 s."""

FINE = (*PARTS, 200, 400, 800, 1600)
"""Steps for closed forms, as divisors, down to 6.25e-5 s."""

QUICK_PARTS = (1, 2, 3, 5, 6, 8, 10, 12, 15, 20, 50, 200, 800)
"""Steps of the quick run, as divisors."""

SETTLED = 2.0
"""Time at the end over which the penetration of stacks is measured [s]."""

APART = 2e-3
"""Least interval of the poses from which an impact is detected [s]."""

STANDS = 0.1
"""Displacement above which a stack counts as collapsed [m]."""

RUN_OUT = 400.0
"""End of the extended level valley floor [m], beyond the run-out of any block."""


@dataclass(frozen=True)
class Case:
    """Scenes that every engine computes.

    Parameters
    ----------
    name, quantity : str
        Its name, and the definition of its error with the unit.
    scenes : tuple of Scene
        Variants; `total` combines their errors.
    duration : float
        Simulated time [s].
    every : float or None
        Interval of the frames [s]; None: every step.
    error : callable
        Returns the error of one scene from the times (T,) and the poses (T, N, 3) of its frames,
        including the start.
    parts : tuple of int
        Steps, as divisors of `LONGEST`.
    options : int or None
        Number of an engine's options that are used, from the first on; None: all.
    levels : tuple of float
        Errors at which engines are compared.
    must, aim : float
        Required and desired processor time of this core over that of the cheapest peer.
    sleeping : bool
        Whether blocks at rest may sleep.
    total : callable
        Combines the errors of the scenes.
    greatest : callable or None
        Returns the greatest error in any frame, which is recorded beside the error but decides
        nothing; None: not recorded.
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
    greatest: Callable[[Scene, Floats, Floats], float] | None = None


def slide_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the distance slid on 30 deg with 20 deg of friction."""
    exact = single_block.slide(30.0, 20.0, times[-1])
    return abs(math.dist(poses[-1, 0, :2], poses[0, 0, :2]) / exact - 1.0)


def creep(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the creep of a block after the first second over its size, 1 m."""
    return math.dist(poses[-1, 0, :2], poses[np.searchsorted(times, 1.0 - 1e-9), 0, :2])


def fall_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the distance of a damped fall."""
    exact = motion.fall(scene.damping, times[-1])[0]
    return abs((poses[0, 0, 1] - poses[-1, 0, 1]) / exact - 1.0)


def rocking_error(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the relative error of the time in which a tilted block falls back onto its base.

    The impact is in the first step in which the rotation does not accelerate. The time at which the
    base is flat follows from the parabola through the three poses before that step. The poses are
    `APART`, because at shorter intervals rounding errors of single precision look like impacts.
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
    exact = single_block.time_to_turn(
        single_block.DIAGONAL_ANGLE - tilt, single_block.DIAGONAL_ANGLE
    )
    return abs((times[last] + after) / exact - 1.0)


def sinking(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the greatest penetration at the end [m], infinite if the stack has collapsed."""
    moved = np.hypot(*(poses[:, :, :2] - poses[0, :, :2]).T).max()
    if not moved <= STANDS:
        return math.inf
    return float(penetration(scene, poses[times >= times[-1] - SETTLED]).max())


def deep(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the 95 % quantile over the frames of the greatest penetration in each [m]."""
    return float(np.quantile(penetration(scene, poses), 0.95))


def deepest(scene: Scene, times: Floats, poses: Floats) -> float:
    """Return the greatest penetration in all frames [m]."""
    return float(penetration(scene, poses).max())


def rockfall_scene(count: int, seed: int) -> Scene:
    """Return about `count` blocks of 2 m2 above the benched slope of the scene shu-hwa-paper.

    The source of that scene has about 120 blocks. Smaller sources have the same shape; larger ones
    are thicker at the same length.
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
    """Return the case of a rockfall, with the median over releases of the penetration.

    A single greatest penetration in a release is chaotic: rounding errors change it by half.
    """
    return Case(
        f"rockfall-{count}",
        "penetration, 95 % of the frames [m]",
        tuple(rockfall_scene(count, seed) for seed in range(1, seeds + 1)),
        RELEASE,
        LONGEST,
        deep,
        PARTS,
        3 if count < 480 else 2,  # the third takes minutes and is never the best
        (0.05, 0.02, 0.01, 0.005),
        must,
        aim,
        sleeping=True,
        total=lambda errors: float(np.median(errors)),
        greatest=deepest,
    )


def standing(name: str, blocks: tuple[Block, ...]) -> Case:
    """Return the case of a stack of blocks, without sleeping."""
    scene = Scene(Terrain(FLAT), blocks, rock())
    return Case(name, "penetration at rest [m]", (scene,), 10.0, 0.1, sinking, PARTS)


def tilted(tilt: float) -> Scene:
    """Return the scene of a block 1 m wide and 4 m high on one corner."""
    corners = [
        (0.0, 0.0),
        (single_block.ROCKING_WIDTH, 0.0),
        (single_block.ROCKING_WIDTH, single_block.ROCKING_HEIGHT),
    ]
    block = Block(polygon([*corners, (0.0, single_block.ROCKING_HEIGHT)], angle=tilt))
    return Scene(Terrain(FLAT), (block,), rock(60.0))


def single() -> tuple[Case, ...]:
    """Return the cases of one block."""
    falling = Scene(None, (box(),), rock(), damping=0.6)
    tilts = tuple(map(tilted, single_block.INITIAL_TILTS))
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
        standing("stack-10", assemblies.tower(rng(), 10)),
        standing("stack-30", assemblies.tower(rng(), 30)),
        standing("mass-1-100", assemblies.heavy_on_light(rng(), 100.0)),
        rockfall(20, 5, 0.6, 0.45),
        rockfall(120, 7, 0.55, 0.4),
        rockfall(480, 3, 0.5, 0.35),
    )


def quick_cases() -> tuple[Case, ...]:
    """Return all cases but the largest, with fewer steps and options.

    They have one scene each, except for rockfalls, whose error is a median over scenes because the
    penetration differs between releases.
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
