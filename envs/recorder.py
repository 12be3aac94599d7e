"""Replays of episodes, one .rrd file each. The replay writer is imported when it is used."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import rigdda
from envs.evaluation import Evaluation
from rigdda import BadInput, Site
from rigdda.barriers import describe

Trigger = Callable[[int], bool]


@dataclass(frozen=True, slots=True)
class Recorder:
    """Writes replays into a folder.

    Parameters
    ----------
    folder : path
        Where `episode-NNNNNN.rrd` goes; made when it is needed. Copies of an environment that
        run side by side need folders of their own.
    trigger : callable, optional
        Whether to record an episode, by its number from 0; None: every one.

    Raises
    ------
    BadInput
        If the folder is a file or the trigger cannot be called.
    """

    folder: Path
    trigger: Trigger | None = None

    def __init__(self, folder: str | os.PathLike[str], trigger: Trigger | None = None):
        if not isinstance(folder, str | os.PathLike):
            raise BadInput("record", folder, "name a folder or give None")
        if Path(folder).exists() and not Path(folder).is_dir():
            raise BadInput("record", str(folder), "name a folder, not a file")
        if trigger is not None and not callable(trigger):
            raise BadInput("record_trigger", trigger, "give a function of the episode's number")
        object.__setattr__(self, "folder", Path(folder))
        object.__setattr__(self, "trigger", trigger)

    def wants(self, episode: int) -> bool:
        """Return whether episode number `episode` is to be recorded."""
        return self.trigger is None or bool(self.trigger(episode))

    def write(self, episode: int, site: Site, stages: Sequence[Evaluation]) -> Path:
        """Write the replay of an episode and return its path; no stream stays open.

        Parameters
        ----------
        episode : int
            Its number.
        site : Site
            Where it was.
        stages : sequence of Evaluation
            What stood at the start, nothing, and after each step, on the same releases.
        """
        from rigdda.replay import Marks

        start, end = stages[0], stages[-1]
        run, _ = rigdda.release(site, end.layout, end.typical)
        barriers = [describe(barrier, 2) for barrier in end.layout]
        notes = {
            "seed": f"{end.typical}, the nearest to the mean of {len(end.seeds)}",
            "layout": "; ".join(barriers) or "no barrier",
            "reward": f"{start.objective - end.objective:+.4f}",
            "objective": f"{end.objective:.4f}",
            "debris": f"{end.debris:.4f}",
            "cost": f"{end.cost:.2f}",
        }
        path = self.folder / f"episode-{episode:06d}.rrd"
        road = (site.road.start, site.road.end)
        run.to_rerun(path, Marks(road=road, notes=notes, title=f"{site.name}, episode {episode}"))
        return path
