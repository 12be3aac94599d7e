"""Training of a policy: PPO on a pool of generated sites, from one barrier of any kind on.

What is made lands in one folder and is taken up again from there: `training.json` (the terms),
`checkpoint.zip` (the trainer), `ppo_0/` (TensorBoard), `policy.safetensors`.
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

from rigdda import BadInput, __version__, check, sites
from rigdda.agents import designers, limits
from rigdda.agents.designers.protocol import release_seeds
from rigdda.agents.policy import SLOTS, Network, decide, features
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import barrier_free
from rigdda.envs.observation import observe
from rigdda.envs.outcome_cache import mechanics
from rigdda.envs.site_sampling import pose
from rigdda.files import atomic

Tick = Callable[[int], None]

RELEASES = 64
"""Releases of each site on which the policy is compared with the one that it started from."""

FIDELITY = "fast"
"""Fidelity of the releases that are learnt from."""

SPLIT = "train"
"""Sites that are learnt from, and those beside them."""

FILES = ("training.json", "checkpoint.zip", "policy.safetensors")
"""What a training leaves in its folder, beside the logs."""

ANEW = "this is damaged: remove the training in its folder, or name another folder with --out"
"""What to do with a training that cannot go on."""


@dataclass(frozen=True, slots=True)
class Terms:
    """What a training is asked for.

    Parameters
    ----------
    sites : int
        Training sites, at least 2.
    episodes : int
        Episodes of PPO.
    seed : int
        Seed of all that is random.
    """

    sites: int
    episodes: int
    seed: int

    def __post_init__(self) -> None:
        check.integer("sites", self.sites, 2, len(sites.split(SPLIT)) // 2)
        check.integer("episodes", self.episodes, 0, limits.RELEASES)
        check.integer("seed", self.seed, 0, limits.SEED)

    @property
    def beside(self) -> int:
        """Sites beside those to train on, on which the policy is tried before and after."""
        return max(2, self.sites // 8)


@dataclass(frozen=True, slots=True)
class Trained:
    """A policy and what its layouts took off before and after its training, over Z of nothing.

    Means over sites beside the training sites.
    """

    network: Network
    before: float
    after: float


def train(terms: Terms, out: Path, tick: Tick) -> Trained:
    """Train a policy, or go on with a training that was stopped, or was of fewer episodes.

    One that was stopped ends as if it had not been. Steps shrink to nothing over the episodes asked
    for, so that one that was given more ends elsewhere than one that was asked for all at once.

    Raises
    ------
    BadInput
        If the folder holds a damaged training, one on other terms or of more episodes, or torch is
        not installed.
    Diverged
        If a simulation diverges.
    """
    ppo = designers.module("ppo")
    stages = _stages(terms, out)
    names = sites.split(SPLIT)
    pool = [problem(name) for name in names[: terms.sites]]
    barrier_free([posed.site for posed in pool])
    mean, scale = scaling(np.stack([see(posed) for posed in pool]))
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
    posed = [problem(name) for name in names[terms.sites : terms.sites + terms.beside]]
    return Trained(network, examine(start, posed), examine(network, posed))


def problem(name: str) -> DesignProblem:
    """Return the problem of a training site."""
    return pose(name, SLOTS.count, None, FIDELITY)


def see(posed: DesignProblem) -> NDArray[np.float32]:
    """Return the features of a problem."""
    return features(observe(posed))


def scaling(
    seen: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return mean and standard deviation of (n, F) features; 1 for those that do not vary."""
    scale = seen.std(axis=0)
    return seen.mean(axis=0), np.where(scale > 1e-6, scale, 1.0).astype(np.float32)


def examine(network: Network, problems: list[DesignProblem]) -> float:
    """Return the share of Z of nothing that a policy takes off, the mean over problems."""
    seeds = release_seeds("final", 0, RELEASES)
    built = [posed.evaluate(decide(network, posed), seeds) for posed in problems]
    return float(np.mean([p.reward(e) for p, e in zip(problems, built, strict=True)]))


def _notes(terms: Terms, stages: list[int]) -> dict[str, str]:
    """Return what a policy's file says of its making: a command for each number of episodes."""
    commands = [
        f"rigdda train --sites {terms.sites} --episodes {episodes} --seed {terms.seed}"
        for episodes in stages
    ]
    return {"command": "; ".join(commands), "version": __version__} | {
        name: str(value) for name, value in asdict(terms).items()
    }


def _stages(terms: Terms, out: Path) -> list[int]:
    """Return the numbers of episodes that a training was asked for, one after the other.

    Writes the terms into the folder, or checks that a sound training on them is in it.
    """
    file = out / "training.json"
    asked: dict[str, Any] = asdict(terms) | {"version": __version__, "mechanics": mechanics()}
    _whole(out / "checkpoint.zip")
    stages = [asked.pop("episodes")]
    if file.is_file():
        try:
            found = msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
            before = msgspec.convert(found.pop("episodes"), list[int])
        except (msgspec.MsgspecError, KeyError, RecursionError) as error:
            raise BadInput("terms", str(file), f"{ANEW} ({error})") from None
        if found != asked:
            mend = f"give the terms of the training in {out} ({found}), or another folder"
            raise BadInput("terms", asked, mend)
        if terms.episodes < before[-1]:
            mend = f"give at least the {before[-1]} of the training in {out}, or another folder"
            raise BadInput("episodes", terms.episodes, mend)
        stages = sorted({*before, *stages})
    elif (out / "checkpoint.zip").is_file():
        raise BadInput("terms", str(file), f"{ANEW} (it is missing beside checkpoint.zip)")
    with atomic(file) as part:
        part.write_bytes(msgspec.json.encode(asked | {"episodes": stages}))
    return stages


def _whole(checkpoint: Path) -> None:
    """Check that a trainer's file, if there is one, is not damaged."""
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
