"""Samples of all settings of a case, computed in turns and stored on disk."""

from __future__ import annotations

import hashlib
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from experiments.outcome_cost.cases import CASES, Case
from experiments.outcome_cost.cost import Sample, judge, sampled
from experiments.outcome_cost.engines import CORE, REFERENCE, Setting, settings
from experiments.outcome_cost.sample import Core, Peer, Points, Release
from experiments.script import say
from rigdda import MECHANICS
from rigdda.files import atomic

JUDGED = 0.03
"""Level that is judged; settings that are certainly biased by more are dropped."""

CHUNK = {"highway": 20, "quick": 100, "tschamut": 300}
"""Releases per setting and turn."""

FEWEST = 3
"""Number of turns before a setting may be dropped."""

SURE = 3.5
"""Standard errors by which a bias must exceed 3 % for its setting to be dropped."""

MOST_COST = 2.0
"""Processor time per release over that of this core's cheapest setting above which a peer's setting
is dropped; it then counts with its lower bound."""

WORKERS = 2


@lru_cache(maxsize=64)
def loaded(name: str, setting: Setting) -> tuple[Case, Core | Peer | Points]:
    """Return a case and the object that computes its releases, once per process."""
    case = CASES[name]()
    computer = setting.load(case)
    computer.release(0)  # compile and pack
    return case, computer


def compute(name: str, setting: Setting, seeds: range) -> list[Release]:
    """Return the releases of some seeds.

    Raises
    ------
    Diverged
        If this core diverges, since such a setting must not be compared.
    """
    _, computer = loaded(name, setting)
    return [computer.release(seed) for seed in seeds]


def made() -> str:
    """Return a hash of everything that releases depend on: mechanics, engines, measurement."""
    here = Path(__file__).parent
    sources = [here / "sample.py", *sorted((here.parent / "bench" / "engines").glob("*.py"))]
    digest = hashlib.sha256(MECHANICS.encode())
    for path in sources:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def stored(folder: Path, name: str, setting: Setting, seeds: range) -> Path:
    """Return the file of some releases."""
    what = repr((made(), name, setting, seeds, CASES[name]()))
    return folder / f"{name}-{hashlib.sha256(what.encode()).hexdigest()[:16]}.npz"


def save(path: Path, releases: list[Release]) -> None:
    """Write releases to a file."""
    count = [len(r.blocks) for r in releases]
    with atomic(path) as part, part.open("wb") as file:
        blocks = np.concatenate([r.blocks for r in releases])
        np.savez(file, blocks=blocks, count=count, cpu=[r.cpu for r in releases])


def read(path: Path) -> list[Release]:
    """Read releases from a file."""
    with np.load(path) as found:
        blocks = np.split(found["blocks"], np.cumsum(found["count"])[:-1])
        return [Release(b, float(c)) for b, c in zip(blocks, found["cpu"], strict=True)]


def surely_biased(sample: Sample, reference: Sample) -> bool:
    """Return whether a setting is certainly biased by more than the judged level."""
    verdict = judge(sample, reference)
    return bool((np.abs(verdict.bias) - SURE * verdict.error > JUDGED).any())


def followed(samples: dict[Setting, Sample]) -> list[Setting]:
    """Return the settings to be continued: this core's, and peers' that may be the cheapest."""
    reference = samples[REFERENCE]
    cheap = MOST_COST * min(s.cpu for setting, s in samples.items() if setting.engine == CORE)
    return [
        setting
        for setting, sample in samples.items()
        if setting.engine == CORE or (sample.cpu < cheap and not surely_biased(sample, reference))
    ]


def gather(name: str, releases: int, folder: Path) -> dict[Setting, Sample]:
    """Return the samples of all settings of a case, computed in turns."""
    folder.mkdir(parents=True, exist_ok=True)
    chunk = min(CHUNK[name], releases)
    going, found = list(settings(name)), dict[Setting, list[Release]]()
    with ProcessPoolExecutor(WORKERS, get_context("spawn")) as pool:
        for first in range(0, releases, chunk):
            seeds = range(first, min(first + chunk, releases))
            paths = {s: stored(folder, name, s, seeds) for s in going}
            jobs = {s: pool.submit(compute, name, s, seeds) for s in going if not paths[s].exists()}
            for setting in going:
                if setting in jobs:
                    save(paths[setting], jobs[setting].result())
                found.setdefault(setting, []).extend(read(paths[setting]))
            if first >= (FEWEST - 1) * chunk:
                going = followed({s: sampled(found[s], int(s == REFERENCE)) for s in going})
            say(f"{name}: {seeds.stop} of {releases} releases, {len(going)} settings")
    return {s: sampled(each, int(s == REFERENCE)) for s, each in found.items()}
