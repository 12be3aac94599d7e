"""Outcome of the highway case: bias from a converged reference, over many releases."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.bench.cases import RUN_OUT
from experiments.bench.engines import core as engine
from experiments.speed_error.knobs import DEFAULT, STEP, Choice, choices
from experiments.speed_error.store import Outcomes, kept
from rigdda import Scene, Site
from rigdda.errors import Diverged
from rigdda.validation.scenes import masses

Floats = NDArray[np.float64]

SITE = Site.load("shu-hwa-paper")
(ROCK,) = SITE.sources
assert ROCK.block_area is not None
BARRIER = SITE.slope.toe
"""Chainage of the barrier, at the toe [m]."""

OUTCOMES = ("debris fraction [-]", "95 % run-out [m]", "energy at the barrier [kJ]")

FINEST = {"dt": 1e-3, "tolerance": 1e-9, "sweep_tolerance": 2e-5, "open_close_iterations": 50}
"""Settings of the reference."""

FRAME = 0.02
"""Frame interval [s], a multiple of every step."""

BLOCKS = "block area"

TOGETHER = 25
"""Number of releases in a stored part of a sample."""


class Budget(NamedTuple):
    """Number of releases of reference and default, of every other choice, and of each peer.

    `area` is the mean area of a block [m2], `factors` multiply it for fewer or more blocks, and
    `duration` is the simulated time [s].
    """

    reference: int
    others: int
    peers: int
    area: float
    factors: tuple[float, ...]
    duration: float


FULL = Budget(300, 50, 30, ROCK.block_area, (4.0, 2.0, 0.5), SITE.motion.duration)
QUICK = Budget(12, 6, 4, 8.0, (2.0,), 20.0)


@dataclass(frozen=True)
class Sample:
    """Outcomes of the releases of one choice, (R, 3), and processor time per release [s]."""

    engine: str
    knob: str
    value: float
    default: bool
    outcomes: Floats
    cpu: float

    @property
    def mean(self) -> Floats:
        """Mean outcomes, (3,)."""
        return self.outcomes.mean(axis=0)

    def half(self, releases: int | None = None) -> Floats:
        """Return half the 95 % interval of the means, (3,).

        It is that of this sample, or of `releases` such releases.
        """
        return 1.96 * self.outcomes.std(axis=0, ddof=1) / math.sqrt(releases or len(self.outcomes))


@lru_cache(maxsize=512)
def scene(area: float, seed: int) -> Scene:
    """Return a release with this mean block area [m2] and an extended level valley floor."""
    change = msgspec.structs.replace
    valley = (RUN_OUT, SITE.slope.points[-1][1])
    return change(
        SITE,
        sources=(change(ROCK, block_area=area),),
        slope=change(SITE.slope, points=(*SITE.slope.points, valley)),
    ).realise(seed=seed)


def outcome(scene: Scene, poses: Floats) -> tuple[float, float, float]:
    """Return debris fraction, 95 % run-out [m] and energy at the barrier [kJ] from the frames.

    The energy is the 95 % quantile over the blocks that cross the barrier's chainage, of their
    kinetic energy in the frame of the crossing.

    Parameters
    ----------
    poses : (T, N, 3) array
        x, y of the centroids [m] and rotation [rad], one frame every `FRAME` seconds.
    """
    mass, inertia = masses(scene)
    x = poses[:, :, 0]
    past = (x >= SITE.road.start).any(axis=0)
    order = np.argsort(x[-1])
    reached = np.cumsum(mass[order]) / mass.sum()
    poses = poses.copy()
    poses[:, :, 2] = np.unwrap(poses[:, :, 2], axis=0)  # Box2D wraps angles to half a turn
    speed = np.diff(poses, axis=0) / FRAME
    energy = 0.5 * (mass * (speed[..., 0] ** 2 + speed[..., 1] ** 2) + inertia * speed[..., 2] ** 2)
    crossed = np.flatnonzero((x >= BARRIER).any(axis=0))
    first = (x[:, crossed] >= BARRIER).argmax(axis=0) - 1
    kinetic = 1e-3 * energy[first, crossed]
    return (
        float(mass[past].sum() / mass.sum()),
        float(x[-1][order][np.searchsorted(reached, 0.95)]),
        float(np.quantile(kinetic, 0.95)) if len(kinetic) else 0.0,
    )


def release(
    module: Any, area: float, duration: float, seed: int, dt: float, options: dict[str, Any]
) -> tuple[tuple[float, float, float], float]:
    """Return the outcome of one release, NaN if it diverges, and its processor time [s]."""
    one = scene(area, seed)
    run = module.Engine(one, dt, True, **options)
    stride = round(FRAME / dt)
    poses, cpu = [run.poses()], 0.0
    try:
        for _ in range(round(duration / FRAME)):
            before = time.thread_time()
            run.advance(stride)
            cpu += time.thread_time() - before
            poses.append(run.poses())
    except Diverged:
        return (math.nan, math.nan, math.nan), cpu
    return outcome(one, np.array(poses)), cpu


def sample(
    choice: Choice,
    releases: int,
    area: float,
    duration: float,
    folder: Path,
    module: Any = engine,
) -> Sample:
    """Return the releases of a choice, computed on all cores and stored in `folder`.

    Their seeds start at 0.
    """
    options = dict(choice.settings)
    dt = options.pop("dt", DEFAULT.dt)
    name = f"{module.NAME}-{choice.knob}-{choice.value:g}".replace(" ", "-")
    adapter = Path(module.__file__).read_text(encoding="utf-8")
    what = (dt, options, area, duration, BARRIER, SITE, adapter)

    def compute(seeds: range) -> Outcomes:
        with ThreadPoolExecutor() as pool:
            done = list(
                pool.map(lambda seed: release(module, area, duration, seed, dt, options), seeds)
            )
        outcomes, cpu = zip(*done, strict=True)
        return np.array(outcomes), float(np.mean(cpu))

    parts = []
    for first in range(0, releases, TOGETHER):
        seeds = range(first, min(first + TOGETHER, releases))
        parts.append(kept(folder, f"{name}-{first}", (what, seeds), partial(compute, seeds)))
    outcomes, cpu = zip(*parts, strict=True)
    mean = float(np.average(cpu, weights=[len(part) for part in outcomes]))
    values = choice.knob, choice.value, choice.default, np.concatenate(outcomes), mean
    return Sample(module.NAME, *values)


def reference(budget: Budget, folder: Path) -> Sample:
    """Return the converged reference."""
    finest = Choice("reference", FINEST["dt"], dict(FINEST))
    return sample(finest, budget.reference, budget.area, budget.duration, folder)


def samples(budget: Budget, folder: Path, say: Callable[[str], None]) -> Iterator[Sample]:
    """Yield the releases of all choices, then those of other block sizes."""
    for choice in choices(math.sqrt(budget.area)):
        say(f"highway: {choice.knob} {choice.value:g}")
        releases = budget.reference if choice.default else budget.others
        yield sample(choice, releases, budget.area, budget.duration, folder)
    for factor in budget.factors:
        area = budget.area * factor
        say(f"highway: blocks of {area:g} m2")
        other = Choice(BLOCKS, area, {"dt": DEFAULT.dt})
        yield sample(other, budget.others, area, budget.duration, folder)


def peer_samples(
    budget: Budget, peers: Sequence[ModuleType], folder: Path, say: Callable[[str], None]
) -> Iterator[Sample]:
    """Yield the releases of the peers at two steps, each with its first options."""
    for module in peers:
        for dt in (1e-2, 5e-3):
            say(f"highway: {module.NAME} {1e3 * dt:g} ms")
            choice = Choice(STEP, dt, {"dt": dt, **module.OPTIONS[0]})
            yield sample(choice, budget.peers, budget.area, budget.duration, folder, module)
