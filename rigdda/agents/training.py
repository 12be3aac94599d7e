"""Training of a policy with PPO on a pool of generated sites.

A training writes its files into one folder and continues from them: `training.json` (the terms),
`checkpoint.zip` (the trainer), `ppo_0/` (TensorBoard) and `policy.safetensors`.
"""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS, BadInput, __version__, check, sites
from rigdda.agents import designers, limits
from rigdda.agents.designers.protocol import release_seeds
from rigdda.agents.policy import SLOTS, Network, decide, features
from rigdda.agents.run_record import check_terms
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import barrier_free
from rigdda.envs.observation import observe
from rigdda.envs.site_sampling import problem_of
from rigdda.files import atomic

Tick = Callable[[int], None]

COMPARISON_RELEASES = 64
"""Number of releases of each site for comparing the trained policy with the initial one."""

FIDELITY = "fast"
"""Fidelity of the releases for training."""

SPLIT = "train"
"""Split with the sites for training and for the comparison."""

TRAINING_FILES = ("training.json", "checkpoint.zip", "policy.safetensors")
"""Files that a training writes into its folder besides the logs."""

ANEW = "this is damaged: remove the training in its folder, or name another folder with --out"
"""Remedy for a training that cannot be continued."""


@dataclass(frozen=True, slots=True)
class Terms:
    """Terms of a training.

    Parameters
    ----------
    sites : int
        Number of training sites, at least 2.
    episodes : int
        Number of episodes of PPO.
    seed : int
        Seed of all random numbers.
    """

    sites: int
    episodes: int
    seed: int

    def __post_init__(self) -> None:
        check.integer("sites", self.sites, 2, len(sites.split(SPLIT)) // 2)
        check.integer("episodes", self.episodes, 0, limits.JOB_RELEASES)
        check.integer("seed", self.seed, 0, limits.SEED)

    @property
    def beside(self) -> int:
        """Number of further sites on which the policy is evaluated before and after training."""
        return max(2, self.sites // 8)


@dataclass(frozen=True, slots=True)
class Trained:
    """A trained policy and the relative reduction of Z by its layouts before and after training.

    The reductions are means over sites that were not used in the training.
    """

    network: Network
    before: float
    after: float


def train(terms: Terms, out: Path, tick: Tick) -> Trained:
    """Train a policy, or continue a training that was interrupted or had fewer episodes.

    An interrupted training gives the same result as an uninterrupted one. The learning rate
    decreases to zero over the requested episodes. Therefore a training that is extended later ends
    with another policy than one that was started with all the episodes.

    Raises
    ------
    BadInput
        If the folder contains a damaged training, a training on other terms or one with more
        episodes, or if torch is not installed.
    Diverged
        If a simulation diverges.
    """
    ppo = designers.module("ppo")
    stages = _stages(terms, out)
    names = sites.split(SPLIT)
    pool = [problem(name) for name in names[: terms.sites]]
    barrier_free([problem.site for problem in pool])
    mean, scale = scaling(np.stack([observed_features(problem) for problem in pool]))
    copies = ppo.Featured(ppo.pool(names[: terms.sites], FIDELITY), mean, scale)
    with closing(copies):
        model = ppo.learner(copies, terms.seed, out)
        notes = _notes(terms, stages)
        start = ppo.export(model, mean, scale, notes)
        if (out / "checkpoint.zip").is_file():
            model = ppo.resume(out / "checkpoint.zip", copies)
        ppo.learn(model, terms.episodes, out / "checkpoint.zip", tick)
    network = ppo.export(model, mean, scale, notes)
    network.save(out / "policy.safetensors")
    others = [problem(name) for name in names[terms.sites : terms.sites + terms.beside]]
    return Trained(network, examine(start, others), examine(network, others))


def problem(name: str) -> DesignProblem:
    """Return the problem of a training site."""
    return problem_of(name, SLOTS.count, None, FIDELITY)


def observed_features(problem: DesignProblem) -> NDArray[np.float32]:
    """Return the features of a problem."""
    return features(observe(problem))


def scaling(
    seen: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the mean and the standard deviation of (n, F) features.

    The standard deviation of a feature that does not vary is replaced by 1.
    """
    scale = seen.std(axis=0)
    return seen.mean(axis=0), np.where(scale > 1e-6, scale, 1.0).astype(np.float32)


def examine(network: Network, problems: list[DesignProblem]) -> float:
    """Return the relative reduction of Z by the layouts of a policy, as a mean over problems."""
    seeds = release_seeds("final", 0, COMPARISON_RELEASES)
    built = [problem.evaluate(decide(network, problem), seeds) for problem in problems]
    return float(np.mean([p.reward(e) for p, e in zip(problems, built, strict=True)]))


def _notes(terms: Terms, stages: list[int]) -> dict[str, str]:
    """Return the notes in the file of a policy, with the command for each number of episodes."""
    commands = [
        f"rigdda train --sites {terms.sites} --episodes {episodes} --seed {terms.seed}"
        for episodes in stages
    ]
    return {"command": "; ".join(commands), "version": __version__} | {
        name: str(value) for name, value in asdict(terms).items()
    }


def _stages(terms: Terms, out: Path) -> list[int]:
    """Return the successive numbers of episodes that were requested for a training.

    The terms are written into the folder. If it contains a training already, check first that it
    is undamaged and has the same terms.
    """
    file = out / "training.json"
    asked: dict[str, Any] = asdict(terms) | {"version": __version__, "mechanics": MECHANICS}
    _whole(out / "checkpoint.zip")
    stages = [asked.pop("episodes")]
    if file.is_file():
        try:
            found = msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
            before = msgspec.convert(found.pop("episodes"), list[int])
        except (msgspec.MsgspecError, KeyError, RecursionError) as error:
            raise BadInput("terms", str(file), f"{ANEW} ({error})") from None
        check_terms(asked, found, f"the training in {out}")
        if terms.episodes < before[-1]:
            mend = f"give at least {before[-1]}, as for the training in {out}, or another folder"
            raise BadInput("episodes", terms.episodes, mend)
        stages = sorted({*before, *stages})
    elif (out / "checkpoint.zip").is_file():
        raise BadInput("terms", str(file), f"{ANEW} (it is missing beside checkpoint.zip)")
    with atomic(file) as part:
        part.write_bytes(msgspec.json.encode(asked | {"episodes": stages}))
    return stages


def _whole(checkpoint: Path) -> None:
    """Check that the checkpoint of a training is undamaged, if there is one."""
    try:
        with zipfile.ZipFile(checkpoint) as archive:
            lost = archive.testzip() or min(
                {"data", "policy.pth"} - {*archive.namelist()}, default=""
            )
    except FileNotFoundError:
        return
    except (OSError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise BadInput("checkpoint", str(checkpoint), f"{ANEW} ({error})") from None
    if lost:
        raise BadInput("checkpoint", str(checkpoint), f"{ANEW} ({lost} in it is damaged)")
