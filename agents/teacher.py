"""A pool of training sites, and the layouts that a short search finds for them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from agents.features import features
from agents.policy import KINDS, SLOTS, anchor
from agents.store import mechanics
from envs import DesignProblem, fidelity
from envs.observation import observe
from rigdda import __version__, sites

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Lesson:
    """What a search found for one site.

    Parameters
    ----------
    site : int
        Seed of the random site.
    features : (F,) array
        What a policy sees of it.
    vector : (size,) array
        The layout, encoded, the fence nearest to the rule's in the first slot.
    gain : float
        What the layout takes off the objective.
    """

    site: int
    features: NDArray[np.float32]
    vector: NDArray[np.float64]
    gain: float

    @property
    def decides(self) -> NDArray[np.float64]:
        """1 for numbers of `vector` that decide something; of an absent barrier the height only."""
        slots = self.vector.reshape(SLOTS, -1)
        out = np.ones_like(slots)
        out[slots[:, 1] <= -1.0] = (0.0, 1.0, 0.0)
        return out.ravel()


def problem(site: int) -> DesignProblem:
    """Return the problem of a training site, at fidelity "fast"."""
    return DesignProblem(fidelity.at(sites.random(site), "fast"), SLOTS, KINDS)


def teach(
    pool: Sequence[int], simulations: int, path: Path, tick: Callable[[int], None]
) -> list[Lesson]:
    """Return the lessons of a pool of sites, by CMA-ES with so many simulations a site.

    Each is appended to `path` as a line of JSON; those that are there are not searched again.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    known = _read(path)
    lessons = []
    for done, site in enumerate(pool):
        key = _key(site, simulations)
        if key not in known:
            known[key] = _lesson(site, simulations)
            row = msgspec.to_builtins(known[key], enc_hook=lambda array: array.tolist())
            with path.open("a") as file:
                file.write(json.dumps({"key": key} | row) + "\n")
        lessons.append(known[key])
        tick(done + 1)
    return lessons


def _key(site: int, simulations: int) -> str:
    """Return a hash of all that a lesson depends on."""
    asked = [__version__, mechanics(), problem(site).site, simulations]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:16]


def _lesson(site: int, simulations: int) -> Lesson:
    from agents import cma

    posed = problem(site)
    found = cma.design(posed, simulations, seed=site)
    nothing = posed.evaluate((), found.evaluation.seeds)
    gain = nothing.objective - found.evaluation.objective
    seen = features(observe(posed, ()))
    return Lesson(site, seen, nearest_first(posed.encode(found.layout), anchor(seen)), gain)


def nearest_first(vector: Floats, rule: Floats) -> Floats:
    """Return a vector with the fence whose station is nearest to that of the rule's first."""
    slots, station = vector.reshape(SLOTS, -1), rule[0]
    away = np.where(slots[:, 1] > -1.0, np.abs(slots[:, 0] - station), np.inf)
    first = int(np.argmin(away))
    return slots[[first, *(k for k in range(SLOTS) if k != first)]].ravel()


def _read(path: Path) -> dict[str, Lesson]:
    """Return the lessons of the whole lines of a file by their keys, and cut off the rest."""
    known: dict[str, Lesson] = {}
    if not path.is_file():
        return known
    text = path.read_text()
    whole = text[: text.rfind("\n") + 1]
    for line in whole.splitlines():
        row = json.loads(line)
        seen = np.array(row["features"], dtype=np.float32)
        found = Lesson(row["site"], seen, np.array(row["vector"]), row["gain"])
        known[row["key"]] = found
    path.write_text(whole)
    return known
