"""Processor time to know an outcome: how long each engine takes until its answer is right.

Of three cases (`cases`) each engine (`engines`) computes releases with several settings. What a
designer asks of them: the share of the debris that passes the edge of the road, the run-out that
95 % of the rock stays within, and the energy that 95 % of the blocks at a barrier stay below.
With n releases an outcome is wrong by its bias, against the reference, and by its scatter; an
answer within `e` of the reference needs the n for which bias^2 + scatter^2 / n is e^2 for the worst
of the three outcomes. Its cost is n times the processor time of a release. A setting whose bias
exceeds e never gets there.

The reference is this core at 1 ms, and its scatter is common to all ratios of a case. Part of
what counts as bias of a peer is another law of impact: on `quick` the finest settings of Box2D
and pymunk settle at more debris than it. All engines compute the same scenes, MuJoCo without
restitution, which it does not know, for the duration of the site or until all blocks are at rest.
The run-out is where the rock is then. Settings take turns, some releases each, so that all meet
the same noise of the machine. A peer's setting is not computed any further when it is surely
biased by more than 3 %, or too dear to be the cheapest.

Judged by the cost of this core over that of the cheapest other block engine at 3 %, of the worst
case.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from agents.store import mechanics
from experiments.outcome_cost.cases import CASES, Case
from experiments.outcome_cost.engines import (
    CORE,
    LUMPED,
    REFERENCE,
    Setting,
    settings,
)
from experiments.outcome_cost.sample import OUTCOMES, Core, Floats, Peer, Points, Release, outcomes
from experiments.script import BLUE, GREEN, GREY, ORANGE, RED, Number, draw, say, write
from rigdda.files import atomic

LEVELS = (0.1, 0.03, 0.01)
"""How far the answer may be off, over the reference [-]."""

JUDGED = 0.03

RELEASES = {"highway": 300, "quick": 1500, "tschamut": 4500}
QUICK_RELEASES = {"highway": 4, "quick": 20, "tschamut": 60}
CHUNK = {"highway": 20, "quick": 100, "tschamut": 300}
"""Releases of a setting at a time."""

FEWEST = 3
"""Chunks after which a setting may be given up."""

SURE = 3.5
"""Standard errors by which its bias must then exceed 3 %, at every look."""

DEAR = 2.0
"""Processor time of a release, over that of this core's cheapest setting, from which a setting of a
peer is not computed further; it then counts with the least that it may cost."""

CERTAIN = 1.645
"""Standard errors of its 90 % interval, within which a bias counts as known."""

RESAMPLES = 300

WORKERS = 2
COLOURS = {CORE: BLUE, "Box2D": RED, "pymunk": GREEN, "MuJoCo": ORANGE, LUMPED: GREY}


class Sample(NamedTuple):
    """What a setting gives: means (3,), their resamples (RESAMPLES, 3), time of a release [s]."""

    means: Floats
    resampled: Floats
    cpu: float
    releases: int

    @property
    def error(self) -> Floats:
        """Standard errors of the means, (3,)."""
        return self.resampled.std(axis=0)


class Cost(NamedTuple):
    """Processor time of an answer within a level [s], and as often as resampled."""

    value: float
    resampled: Floats

    @property
    def known(self) -> bool:
        """Whether the bias is known to the level."""
        return not math.isnan(self.value)

    def ends(self) -> tuple[float, float]:
        """Return its 95 % interval [s]."""
        low, high = np.quantile(self.resampled, (0.025, 0.975), method="nearest")
        return float(low), float(high)


class Verdict(NamedTuple):
    """Bias over the reference and its standard error, scatter of one release over it; (3,) each."""

    bias: Floats
    error: Floats
    scatter: Floats


@lru_cache(maxsize=64)
def loaded(name: str, setting: Setting) -> tuple[Case, Core | Peer | Points]:
    """Return a case and what computes its releases, once a process."""
    case = CASES[name]()
    computer = setting.load(case)
    computer.release(0)  # compiles, packs
    return case, computer


def compute(name: str, setting: Setting, seeds: range) -> list[Release]:
    """Return the releases of some seeds.

    Raises
    ------
    Diverged
        If this core does: a setting that diverges has no place in the comparison.
    """
    _, computer = loaded(name, setting)
    return [computer.release(seed) for seed in seeds]


def made() -> str:
    """Return a hash of all that releases depend on: mechanics, engines, how they are judged."""
    here = Path(__file__).parent
    sources = [here / "sample.py", *sorted((here.parent / "bench" / "engines").glob("*.py"))]
    digest = hashlib.sha256(mechanics().encode())
    for path in sources:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def stored(folder: Path, name: str, setting: Setting, seeds: range) -> Path:
    """Return the file of some releases."""
    what = repr((made(), name, setting, seeds, CASES[name]()))
    return folder / f"{name}-{hashlib.sha256(what.encode()).hexdigest()[:16]}.npz"


def save(path: Path, releases: list[Release]) -> None:
    """Write releases."""
    count = [len(r.blocks) for r in releases]
    with atomic(path) as part, part.open("wb") as file:
        blocks = np.concatenate([r.blocks for r in releases])
        np.savez(file, blocks=blocks, count=count, cpu=[r.cpu for r in releases])


def read(path: Path) -> list[Release]:
    """Return releases that were written."""
    with np.load(path) as found:
        blocks = np.split(found["blocks"], np.cumsum(found["count"])[:-1])
        return [Release(b, float(c)) for b, c in zip(blocks, found["cpu"], strict=True)]


def sampled(releases: list[Release], seed: int = 0) -> Sample:
    """Return what releases give; `seed` draws the resamples."""
    rng = np.random.default_rng([seed, len(releases)])
    picks = rng.integers(len(releases), size=(RESAMPLES, len(releases)))
    resampled = np.array([outcomes([releases[i] for i in pick]) for pick in picks])
    cpu = float(np.mean([r.cpu for r in releases]))
    return Sample(outcomes(releases), resampled, cpu, len(releases))


def judge(sample: Sample, reference: Sample) -> Verdict:
    """Return bias and scatter of a sample."""
    error = np.hypot(sample.error, reference.error) / reference.means
    scatter = sample.error * math.sqrt(sample.releases) / reference.means
    return Verdict(sample.means / reference.means - 1.0, error, scatter)


def needed(bias: Floats, noise: Floats, scatter: Floats, level: float) -> Floats:
    """Return the releases that each outcome needs to be within a level; inf if it never is.

    Parameters
    ----------
    bias, noise, scatter : (..., 3) arrays
        Bias as it was found, its standard error, scatter of one release.
    """
    left = level**2 - np.maximum(bias**2 - noise**2, 0.0)
    releases = np.divide(scatter**2, left, out=np.full(left.shape, math.inf), where=left > 0.0)
    return np.maximum(releases, 1.0)


def cost(sample: Sample, reference: Sample, level: float) -> Cost:
    """Return the processor time of an answer within a level.

    It is infinite where the bias is surely greater. It is NaN where the bias is not known to the
    level; its resamples are then those of a setting without bias, the least that it may cost.
    """
    bias, error, scatter = judge(sample, reference)
    half = CERTAIN * error
    none = np.zeros(3)
    if (half > level).any() and not (np.abs(bias) - half > level).any():
        least = sample.cpu * float(needed(none, none, scatter, level).max())
        return Cost(math.nan, np.full(RESAMPLES, least))
    found = needed(bias, error, scatter, level).max()
    each = sample.resampled / reference.resampled - 1.0
    resampled = needed(each, math.sqrt(2.0) * error, scatter, level).max(axis=1)
    return Cost(sample.cpu * float(found), sample.cpu * resampled)


def surely_biased(sample: Sample, reference: Sample) -> bool:
    """Return whether a setting is biased by more than the level that is judged."""
    verdict = judge(sample, reference)
    return bool((np.abs(verdict.bias) - SURE * verdict.error > JUDGED).any())


def followed(samples: dict[Setting, Sample]) -> list[Setting]:
    """Return the settings that are computed further: this core's, peers that may be cheapest."""
    reference = samples[REFERENCE]
    cheap = DEAR * min(s.cpu for setting, s in samples.items() if setting.engine == CORE)
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


def rows(name: str, samples: dict[Setting, Sample]) -> Iterator[dict[str, Any]]:
    """Yield a row for each setting: outcomes, bias, and the cost of each level."""
    reference = samples[REFERENCE]
    for setting, sample in samples.items():
        verdict = judge(sample, reference)
        row: dict[str, Any] = {
            "case": name,
            "engine": setting.engine,
            "setting": "reference" if setting == REFERENCE else str(setting),
            "releases": sample.releases,
            "cpu_ms": 1e3 * sample.cpu,
        }
        columns = ("debris", "run_out", "energy")
        for k, what in enumerate(columns):
            row[what] = float(sample.means[k])
            row[f"{what}_bias"] = math.nan if setting == REFERENCE else float(verdict.bias[k])
            row[f"{what}_bias_95"] = math.nan if setting == REFERENCE else 1.96 * verdict.error[k]
            row[f"{what}_scatter"] = float(verdict.scatter[k])
        for level in LEVELS:
            names = [f"{what}_{level:.0%}_s" for what in ("cost", "low", "high")]
            row |= dict.fromkeys(names, math.nan)
            if setting == REFERENCE:
                continue
            found = cost(sample, reference, level)
            if found.known:
                row |= dict(zip(names, (found.value, *found.ends()), strict=True))
        yield row


def compared(samples: dict[Setting, Sample], level: float) -> dict[str, Any]:
    """Return the cheapest setting of this core and of the peers, and the ratio of their costs.

    A peer whose bias is not known counts as if it had none: the ratio is then the greatest that it
    may be, and `told` says so. The ratio is NaN where this core does not get there; it is 0 where
    no peer does.
    """
    every = {s: cost(x, samples[REFERENCE], level) for s, x in samples.items() if s != REFERENCE}
    mine = {s: c for s, c in every.items() if s.engine == CORE}
    theirs = {s: c for s, c in every.items() if s.engine not in (CORE, LUMPED)}
    ours = min((s for s in mine if mine[s].known), key=lambda s: mine[s].value, default=None)
    least = {s: c.value if c.known else float(c.resampled[0]) for s, c in theirs.items()}
    peer = min(least, key=least.__getitem__)
    row: dict[str, Any] = {
        "level": level,
        "rigdda": str(ours) if ours else "",
        "rigdda_s": mine[ours].value if ours else math.nan,
        "peer": str(peer) if math.isfinite(least[peer]) else "",
        "peer_s": least[peer],
        "told": "its cost" if theirs[peer].known else "its least cost",
        "ratio": math.nan,
        "low": math.nan,
        "high": math.nan,
    }
    if ours is not None and math.isfinite(mine[ours].value):
        row["ratio"] = mine[ours].value / least[peer]
        best = np.min([c.resampled for c in mine.values() if c.known], axis=0)
        other = np.min([c.resampled for c in theirs.values()], axis=0)
        with np.errstate(invalid="ignore"):
            each = np.where(np.isinf(best), math.inf, best / other)
        row["low"], row["high"] = np.quantile(each, (0.025, 0.975), method="nearest").tolist()
    return row


def ratios(every: dict[str, dict[Setting, Sample]]) -> list[dict[str, Any]]:
    """Return `compared` for each case and level."""
    return [{"case": n} | compared(s, level) for n, s in every.items() for level in LEVELS]


def picture(figure: Figure, every: dict[str, dict[Setting, Sample]]) -> None:
    """Draw the worst bias of each setting against the processor time of a release."""
    for axes, (name, samples) in zip(
        figure.subplots(1, len(every), squeeze=False)[0], every.items(), strict=True
    ):
        reference = samples[REFERENCE]
        for setting, sample in samples.items():
            if setting == REFERENCE:
                continue
            verdict = judge(sample, reference)
            worst = int(np.abs(verdict.bias).argmax())
            axes.errorbar(
                1e3 * sample.cpu,
                100.0 * abs(verdict.bias[worst]),
                196.0 * verdict.error[worst],
                fmt="o",
                color=COLOURS[setting.engine],
                lw=0.8,
            )
        axes.axhline(100.0 * JUDGED, color=GREY, lw=0.8, ls="--")
        axes.set(xscale="log", title=name, xlabel="processor time of a release [ms]")
        axes.set_ylim(0.0, 40.0)
    for engine, colour in COLOURS.items():
        figure.axes[0].plot([], [], "o", color=colour, label=engine)
    figure.axes[0].set_ylabel("greatest bias of the three outcomes [%]")
    figure.axes[-1].legend(*figure.axes[0].get_legend_handles_labels())


def run(quick: bool, out: Path) -> Number:
    """Compute all cases and write the tables and the picture."""
    folder = out / "outcome_cost"
    counts = QUICK_RELEASES if quick else RELEASES
    every = {name: gather(name, counts[name], folder / "samples") for name in CASES}
    write(folder / "outcome_cost.csv", [r for name, s in every.items() for r in rows(name, s)])
    found = ratios(every)
    write(folder / "ratios.csv", found)
    draw(folder / "outcome_cost.png", (12.0, 4.2), lambda figure: picture(figure, every))
    judged = {row["case"]: row["ratio"] for row in found if row["level"] == JUDGED}
    note = ", ".join(f"{name} {ratio:.2f}" for name, ratio in judged.items())
    note += f"; outcomes: {', '.join(OUTCOMES)}"
    what = f"cost over the cheapest peer's at {JUDGED:.0%}, worst case"
    return Number(what, float(np.max(list(judged.values()))), high=1.0, note=note)
