"""Pictures of releases and replays of episodes.

Matplotlib and the replay writer are imported when they are used.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

import rigdda
from rigdda import BadInput, Run, Site
from rigdda.barriers import Earthwork, describe
from rigdda.envs.cost import Evaluation

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (8.0, 4.5)
"""Width and height of a picture [inch], 100 pixels each."""
GROUND, ROCK, BARRIER, ROAD = "#c9bca5", "#68584a", "#1c5aa0", "#e85d04"
BROKEN = "#b0b6bc"


def draw(axes: Axes, run: Run, road: tuple[float, float], frame: int = -1) -> None:
    """Draw one frame of a run into axes, in metres and to scale.

    Parameters
    ----------
    axes : matplotlib axes
        Where to draw.
    run : Run
        A release on a slope.
    road : (float, float)
        Chainages of the road's uphill and downhill edge [m].
    frame : int
        Index of the frame, the last by default.
    """
    terrain = run.ground
    assert terrain is not None
    x, y = terrain.points.T
    for i, barrier in enumerate(run.scene.barriers):
        colour = BARRIER if run.times[frame] < run.failure(i) else BROKEN
        axes.fill(
            *run.outline(i, frame).T,
            facecolor="none" if barrier.drawn == "line" else colour,
            edgecolor=colour,
            linewidth=1.0 if barrier.drawn == "line" else 0.0,
            zorder=3.0 if isinstance(barrier, Earthwork) else 1.0,
        )
    axes.fill_between(x, y, y.min() - 0.05 * np.ptp(y), color=GROUND, linewidth=0)
    inner = x[(x > road[0]) & (x < road[1])]
    lane = [road[0], *inner, road[1]]
    axes.plot(lane, [terrain.height(at) for at in lane], color=ROAD, linewidth=4)
    for i in range(len(run.scene.blocks)):
        axes.fill(*_corners(run, frame, i).T, color=ROCK, edgecolor="white", linewidth=0.2)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def picture(run: Run, road: tuple[float, float], title: str) -> NDArray[np.uint8]:
    """Return the last frame of a run as an RGB image, (450, 800, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(SIZE, dpi=100, layout="constrained")  # unknown to pyplot: nothing to close
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw(axes, run, road)
    axes.set_title(title)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _corners(run: Run, frame: int, block: int) -> NDArray[np.float64]:
    """Return the (n, 2) corners of a block in a frame; the first frame is turned by 0."""
    x, y, theta = run.poses[frame, block]
    cos, sin = np.cos(theta), np.sin(theta)
    turn = np.array([[cos, -sin], [sin, cos]])
    return (run.scene.blocks[block].vertices - run.poses[0, block, :2]) @ turn.T + [x, y]


Trigger = Callable[[int], bool]


class Shown(NamedTuple):
    """The release of an episode that its replay shows, of so many."""

    site: Site
    seed: int
    event: str
    releases: int

    @property
    def words(self) -> str:
        """Say which it is."""
        return f"{self.seed}, event {self.event}, which stands for the {self.releases} scored"


@dataclass(frozen=True, slots=True)
class Recorder:
    """Writes replays into a folder.

    Parameters
    ----------
    folder : path
        Where `episode-NNNNNN.rrd` goes; made when it is needed. No file is overwritten: the
        second of the same number, of another copy of the environment or of a former run, is
        `episode-NNNNNN-2.rrd`.
    trigger : callable, optional
        Whether to record an episode, by its number from 0; None: every one.

    Raises
    ------
    BadInput
        If the folder is a file or cannot be made, or the trigger cannot be called.
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
        self, episode: int, shown: Shown, stages: Sequence[Evaluation], rewards: Sequence[float]
    ) -> Path:
        """Write the replay of an episode of one step and return its path; no stream stays open.

        Parameters
        ----------
        episode : int
            Its number.
        shown : Shown
            The release to show.
        stages : sequence of Evaluation
            What stood at the start, nothing, and in the end.
        rewards : sequence of float
            Of each step.
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
        run.to_rerun(path, Marks((site.road.start, site.road.end), notes, _title(site, episode)))
        return path

    def write_placements(
        self, episode: int, shown: Shown, stages: Sequence[Evaluation], rewards: Sequence[float]
    ) -> Path:
        """Write the replay of an episode of several steps and return its path.

        All stages show one release.

        Parameters
        ----------
        episode, shown, rewards
            See `write`.
        stages : sequence of Evaluation
            What stood at the start, nothing, and after each step.
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
        write_episode(path, placements, road, shown.words, _title(site, episode))
        return path

    def _path(self, episode: int) -> Path:
        """Return the name of a new file: copies of an environment may share the folder."""
        path, number = self.folder / f"episode-{episode:06d}.rrd", 2
        while path.exists():
            path = path.with_name(f"episode-{episode:06d}-{number}.rrd")
            number += 1
        return path


def _check_room(folder: Path) -> None:
    """Check that a folder can be made and written into; it is made when it is needed."""
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
        tempfile.TemporaryDirectory(dir=there).cleanup()
    except OSError as error:
        mend = f"name a folder that can be made and written into ({error.strerror})"
        raise BadInput("record", str(folder), mend) from None


def _words(now: Evaluation) -> str:
    return "; ".join(describe(barrier, 2) for barrier in now.layout) or "no barrier"


def _title(site: Site, episode: int) -> str:
    return f"{site.name}, episode {episode}"
