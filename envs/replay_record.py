"""Records in replays: what it takes to compute an episode or a release again.

A record has the whole site, so that it needs no other file, and what was computed, to the last bit.
"""

from __future__ import annotations

import os
import platform
from typing import Any

import msgspec
import numba
import numpy as np

from rigdda import BadInput, Layout, Outcome, Site, __version__
from rigdda.barriers import to_tables
from rigdda.envs.problem import Targets
from rigdda.kernel import source_hash


class Versions(msgspec.Struct, frozen=True):
    """Programs that computed a record, and a hash of the kernels' sources."""

    rigdda: str
    kernels: str
    numba: str
    numpy: str
    python: str
    machine: str

    @classmethod
    def of_today(cls) -> Versions:
        """Return those of this process."""
        return cls(
            rigdda=__version__,
            kernels=source_hash(),
            numba=numba.__version__,
            numpy=np.__version__,
            python=platform.python_version(),
            machine=f"{platform.system()} {platform.machine()}",
        )


class EpisodeRecord(msgspec.Struct, frozen=True, tag="episode", forbid_unknown_fields=True):
    """An episode of an environment.

    Parameters
    ----------
    environment : str
        Its registered name.
    max_barriers, kinds, releases, targets
        Keywords of the environment.
    fidelity : str
        That of the site, which is kept as it was simulated.
    site : Site
        Where the episode played.
    episode, seed : int
        Its number in the environment, and the seed of its `reset`, None if it went on with the
        random numbers of the episode before.
    release_seeds : list of int
        Of the scored releases.
    shown_seed, shown_event : int, str
        The release that the replay shows.
    actions : list of list of float
        Of every step, clipped to [-1, 1].
    rewards : list of float
        Of every step.
    versions : Versions
        Of what computed it.
    """

    environment: str
    max_barriers: int
    kinds: list[str]
    releases: int
    targets: Targets
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


class ReleaseRecord(msgspec.Struct, frozen=True, tag="release", forbid_unknown_fields=True):
    """A release of a site with a layout.

    Parameters
    ----------
    site, seed, event
        As `rigdda.release` takes them.
    barriers : list of dict
        What stands, a table each as in layout files.
    outcome : str
        Its outcome as JSON.
    versions : Versions
        Of what computed it.
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
    """Return the record of a release that gave an outcome, for a replay of it."""
    tables, found = to_tables(layout), as_json(outcome)
    made = ReleaseRecord(site, tables, seed, event, found, Versions.of_today())
    return as_json(made)


def load(path: str | os.PathLike[str]) -> EpisodeRecord | ReleaseRecord:
    """Return the record that a replay holds.

    Raises
    ------
    BadInput
        If the file is missing, is not a replay, or holds no record of this version.
    """
    from rigdda.replay.recording import read_record

    try:
        return msgspec.json.decode(read_record(path), type=EpisodeRecord | ReleaseRecord)
    except msgspec.MsgspecError as error:
        mend = f"name one that this version of rigdda recorded ({error})"
        raise BadInput("replay file", str(path), mend) from None
