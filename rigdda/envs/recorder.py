"""Recorder that writes a replay at the end of each episode.

The replay writer is imported on first use.
"""

from __future__ import annotations

import itertools
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import rigdda
from rigdda import BadInput, Site
from rigdda.barriers import describe
from rigdda.envs.cost import Evaluation

Trigger = Callable[[int], bool]


class Shown(NamedTuple):
    """The release of an episode that its replay shows, and the number of scored releases."""

    site: Site
    seed: int
    event: str
    releases: int

    @property
    def words(self) -> str:
        """Description of the release."""
        return f"{self.seed}, event {self.event}, representative of the {self.releases} scored"


@dataclass(frozen=True, slots=True)
class Recorder:
    """Writer of replays into a folder.

    Parameters
    ----------
    folder : path
        Folder for the files `episode-NNNNNN.rrd`, or for a folder `episode-NNNNNN` of each episode;
        created when needed. No file is overwritten: if another copy of the environment or an
        earlier run has written the same number, the name is `episode-NNNNNN-2.rrd`, and so on.
    trigger : callable, optional
        Whether to record an episode, given its number from 0; by default all are recorded.

    Raises
    ------
    BadInput
        If the folder is a file or cannot be created, or the trigger is not callable.
    """

    folder: Path
    trigger: Trigger | None = None

    def __init__(self, folder: str | os.PathLike[str], trigger: Trigger | None = None):
        if not isinstance(folder, str | os.PathLike):
            raise BadInput("record", folder, "name a folder or give None")
        _check_room(Path(folder))
        if trigger is not None and not callable(trigger):
            raise BadInput("record_trigger", trigger, "give a function of the episode's number")
        object.__setattr__(self, "folder", Path(folder))
        object.__setattr__(self, "trigger", trigger)

    def wants(self, episode: int) -> bool:
        """Return whether episode number `episode` is to be recorded."""
        return self.trigger is None or bool(self.trigger(episode))

    def write(
        self,
        episode: int,
        shown: Shown,
        stages: Sequence[Evaluation],
        rewards: Sequence[float],
        record: str,
    ) -> Path:
        """Write the replay of an episode of one step, close the file and return its path.

        Parameters
        ----------
        episode : int
            Number of the episode.
        shown : Shown
            The release to show.
        stages : sequence of Evaluation
            Evaluations at the start (no barriers) and at the end.
        rewards : sequence of float
            Reward of each step.
        record : str
            The record from which the episode can be computed again, see
            `rigdda.envs.replay_record`.
        """
        from rigdda.replay.recording import Marks

        end, site = stages[-1], shown.site
        run, _ = rigdda.release(site, end.layout, shown.seed, shown.event)
        notes = {
            "seed": shown.words,
            "layout": _words(end),
            "reward": f"{sum(rewards):+.4f}",
            "objective": f"{end.objective:.4f}",
            "debris": f"{end.debris:.4f}",
            "cost": f"{end.cost:.2f}",
        }
        path = self._path(episode)
        road = site.road.start, site.road.end
        run.to_rerun(path, Marks(road, notes, _title(site, episode), record=record))
        return path

    def write_placements(
        self,
        episode: int,
        shown: Shown,
        stages: Sequence[Evaluation],
        rewards: Sequence[float],
        record: str,
    ) -> Path:
        """Write the replay of an episode of several steps and return its path.

        All stages show the same release.

        Parameters
        ----------
        episode, shown, rewards, record
            See `write`.
        stages : sequence of Evaluation
            Evaluations at the start (no barriers) and after each step.
        """
        from rigdda.replay.episode import Placement, write_episode

        site = shown.site
        placements = [
            Placement(
                run=rigdda.release(site, now.layout, shown.seed, shown.event)[0],
                layout=_words(now),
                reward=reward,
                objective=now.objective,
                debris=now.debris,
                cost=now.cost,
            )
            for now, reward in zip(stages, (0.0, *rewards), strict=True)
        ]
        path, road = self._path(episode), (site.road.start, site.road.end)
        write_episode(path, placements, road, shown.words, _title(site, episode), record)
        return path

    def new_folder(self, episode: int) -> Path:
        """Create the folder of an episode with several files, and return its path.

        Raises
        ------
        OSError
            If it cannot be created.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        names = _names(episode)
        while True:
            folder = self.folder / next(names)
            try:
                folder.mkdir()
            except FileExistsError:
                continue
            return folder

    def _path(self, episode: int) -> Path:
        """Return the path of a new file; copies of an environment may share the folder."""
        paths = (self.folder / f"{name}.rrd" for name in _names(episode))
        return next(path for path in paths if not path.exists())


def _names(episode: int) -> Iterator[str]:
    """Yield the names that an episode may have, in order of preference."""
    name = f"episode-{episode:06d}"
    yield name
    yield from (f"{name}-{number}" for number in itertools.count(2))


def _check_room(folder: Path) -> None:
    """Check that a folder can be created and written into, without creating it."""
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        tempfile.TemporaryDirectory(dir=there).cleanup()
    except OSError as error:
        hint = f"name a folder that can be created and written into ({error.strerror})"
        raise BadInput("record", str(folder), hint) from None


def _words(now: Evaluation) -> str:
    return "; ".join(describe(barrier, 2) for barrier in now.layout) or "no barrier"


def _title(site: Site, episode: int) -> str:
    return f"{site.name}, episode {episode}"
