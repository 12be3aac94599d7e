"""Records in replays, from which an episode or a release can be computed again.

A record contains the whole site, so that no other file is needed, and the exact results.
"""

from __future__ import annotations

import os
import platform
from typing import Any

import msgspec
import numba
import numpy as np

from rigdda import MECHANICS, BadInput, Layout, Outcome, Site, __version__
from rigdda.barriers import to_tables
from rigdda.envs.problem import Targets


class Versions(msgspec.Struct, frozen=True):
    """Versions of the programs and of the mechanics that computed a record."""

    rigdda: str
    mechanics: str
    numba: str
    numpy: str
    python: str
    machine: str

    @classmethod
    def of_today(cls) -> Versions:
        """Return the versions of this process."""
        return cls(
            rigdda=__version__,
            mechanics=MECHANICS,
            numba=numba.__version__,
            numpy=np.__version__,
            python=platform.python_version(),
            machine=f"{platform.system()} {platform.machine()}",
        )


class EpisodeRecord(msgspec.Struct, frozen=True, tag="episode", forbid_unknown_fields=True):
    """Record of an episode of an environment.

    Parameters
    ----------
    environment : str
        Registered name of the environment.
    max_barriers, kinds, releases, targets, max_cost, checks
        Keywords of the environment.
    fidelity : str
        Fidelity at which `site` was derived.
    site : Site
        The site as it was simulated.
    episode, seed : int
        Number of the episode in the environment, and the seed of its `reset`; None if the random
        numbers continued from the previous episode.
    release_seeds : list of int
        Seeds of the scored releases.
    shown_seed, shown_event : int, str
        The release that the replay shows.
    actions : list of list of float
        Action of each step, clipped to [-1, 1].
    rewards : list of float
        Reward of each step.
    versions : Versions
        Versions of the programs that computed it.
    """

    environment: str
    max_barriers: int
    kinds: list[str]
    releases: int
    targets: Targets
    max_cost: float | None
    fidelity: str
    site: Site
    episode: int
    seed: int | None
    release_seeds: list[int]
    shown_seed: int
    shown_event: str
    actions: list[list[float]]
    rewards: list[float]
    versions: Versions
    checks: str = "reported"


class ReleaseRecord(msgspec.Struct, frozen=True, tag="release", forbid_unknown_fields=True):
    """Record of a release on a site with a layout.

    Parameters
    ----------
    site, seed, event
        As `rigdda.release` takes them.
    barriers : list of dict
        The layout, one table per barrier as in layout files.
    outcome : str
        The outcome as JSON.
    versions : Versions
        Versions of the programs that computed it.
    """

    site: Site
    barriers: list[dict[str, Any]]
    seed: int
    event: str | None
    outcome: str
    versions: Versions


def as_json(value: Outcome | EpisodeRecord | ReleaseRecord) -> str:
    """Return a record or an outcome as JSON, in which numbers are exact."""
    return msgspec.json.encode(value).decode()


def release_record(
    site: Site, layout: Layout, seed: int, event: str | None, outcome: Outcome
) -> str:
    """Return the record of a release and its outcome as JSON, for a replay."""
    tables, found = to_tables(layout), as_json(outcome)
    made = ReleaseRecord(site, tables, seed, event, found, Versions.of_today())
    return as_json(made)


def load(path: str | os.PathLike[str]) -> EpisodeRecord | ReleaseRecord:
    """Return the record in a replay.

    Raises
    ------
    BadInput
        If the file is missing, is not a replay, or contains no record of this version.
    """
    from rigdda.replay.recording import read_record

    try:
        return msgspec.json.decode(read_record(path), type=EpisodeRecord | ReleaseRecord)
    except msgspec.MsgspecError as error:
        hint = f"name one that this version of rigdda recorded ({error})"
        raise BadInput("replay file", str(path), hint) from None
