"""Training of a policy: lessons of a short search on a pool of sites, cloned, then PPO on them.

What is made lands in one folder and is taken up again from there: `training.json` (the terms),
`lessons.jsonl`, `checkpoint.zip` (the trainer), `ppo_0/` (TensorBoard), `policy.safetensors`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from agents import extra, teacher
from agents.network import Network
from agents.policy import decide
from agents.seeds import release_seeds
from envs import DesignProblem
from rigdda import BadInput, __version__, check, sites
from rigdda.files import atomic

Tick = Callable[[int, str], None]

RELEASES = 8
"""Releases of each site on which the cloned and the tuned policy are compared."""


@dataclass(frozen=True, slots=True)
class Terms:
    """What a training is asked for.

    Parameters
    ----------
    sites : int
        Training sites, at least 2.
    lessons : int
        Simulations of the search that makes the lesson of a site, at least 16.
    episodes : int
        Episodes of PPO after that; 0: cloning only.
    seed : int
        Seed of all that is random.
    """

    sites: int
    lessons: int
    episodes: int
    seed: int

    def __post_init__(self) -> None:
        check.integer("sites", self.sites, 2)
        if self.sites > len(sites.TRAIN_SEEDS) // 2:
            mend = f"give a whole number of at most {len(sites.TRAIN_SEEDS) // 2}"
            raise BadInput("sites", self.sites, mend)
        check.integer("lessons", self.lessons, 16)
        check.integer("episodes", self.episodes, 0)
        check.integer("seed", self.seed, 0)

    @property
    def beside(self) -> int:
        """Sites beside those to train on, on which the cloned and the tuned policy are compared."""
        return max(2, self.sites // 16)


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained policy and what cloning alone and all of the training took off the objective.

    Means over sites beside the training sites.
    """

    network: Network
    cloned: float
    tuned: float


def train(terms: Terms, out: Path, tick: Tick) -> Trained:
    """Train a policy, or go on with a training that was stopped; the better half is kept.

    Raises
    ------
    BadInput
        If the folder holds a training on other terms, or torch is not installed.
    Diverged
        If a simulation diverges.
    """
    ppo = extra.module("ppo")
    _same(terms, out)
    pool = sites.TRAIN_SEEDS[: terms.sites]
    beside = sites.TRAIN_SEEDS[terms.sites : terms.sites + terms.beside]
    lessons = teacher.teach(
        pool, terms.lessons, out / "lessons.jsonl", lambda n: tick(n, "lessons")
    )
    mean, scale = scaling(np.stack([lesson.features for lesson in lessons]))
    copies = ppo.Featured(ppo.pool([teacher.problem(site) for site in pool]), mean, scale)
    model = ppo.learner(copies, terms.seed, out)
    ppo.clone(model, lessons, mean, scale, terms.seed)
    halves = [ppo.export(model, mean, scale, _notes(terms, "cloned"))]
    if (out / "checkpoint.zip").is_file():
        model = ppo.resume(out / "checkpoint.zip", copies)
    ppo.fine_tune(
        model, terms.episodes, out / "checkpoint.zip", lambda n: tick(terms.sites + n, "PPO")
    )
    halves.append(ppo.export(model, mean, scale, _notes(terms, "cloned, then PPO")))
    posed = [teacher.problem(site) for site in beside]
    cloned, tuned = (examine(network, posed) for network in halves)
    better = halves[tuned > cloned]
    better.save(out / "policy.safetensors")
    return Trained(better, cloned, tuned)


def scaling(
    seen: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return mean and standard deviation of (n, F) features; 1 for those that do not vary."""
    scale = seen.std(axis=0)
    return seen.mean(axis=0), np.where(scale > 1e-6, scale, 1.0).astype(np.float32)


def examine(network: Network, problems: list[DesignProblem]) -> float:
    """Return what a policy takes off the objective, the mean over problems."""
    seeds = release_seeds("final", 0, RELEASES)
    gains = []
    for posed in problems:
        nothing, built = posed.evaluate((), seeds), posed.evaluate(decide(network, posed), seeds)
        gains.append(nothing.objective - built.objective)
    return float(np.mean(gains))


def _notes(terms: Terms, how: str) -> dict[str, str]:
    """Return what a policy's file says of its making."""
    options = " ".join(f"--{name} {value}" for name, value in asdict(terms).items())
    return {"command": f"rigdda train {options}", "how": how, "version": __version__} | {
        name: str(value) for name, value in asdict(terms).items()
    }


def _same(terms: Terms, out: Path) -> None:
    """Write the terms into a folder, or check that they are those of the training in it."""
    file, asked = out / "training.json", asdict(terms) | {"version": __version__}
    if file.is_file():
        found = msgspec.json.decode(file.read_bytes())
        if found != asked:
            mend = f"give the terms of the training in {out} ({found}), or another folder"
            raise BadInput("terms", asked, mend)
        return
    with atomic(file) as part:
        part.write_bytes(msgspec.json.encode(asked))
