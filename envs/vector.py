"""Batched environments: copies of one environment whose releases are simulated together."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from envs import encoding
from envs.base import BarrierEnv, Info, Step
from envs.crew import Crew
from envs.design import BarrierDesign
from envs.observation import Observation
from envs.placement import BarrierPlacement
from envs.recorder import Recorder
from envs.trial import simulate
from rigdda import BadInput, check

MOST_COPIES = 100_000
"""Most copies; what is above is taken for a slip of the pen."""

Start = tuple[Observation, Info]
Batch = tuple[
    Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
]


class BarrierVector(VectorEnv[dict[str, Any], NDArray[np.float32], Any]):
    """Copies of one environment that step together, in threads over all cores or in processes.

    Each copy gives exactly what it would give alone: copy i of `reset(seed=s)` is the environment
    after `reset(seed=s + i)`. A copy whose episode ends starts the next in the same step; the last
    observation and info of the old one are `final_obs` and `final_info` of the infos.

    Parameters
    ----------
    num_envs : int
        Number of copies.
    max_episode_steps : int, optional
        Steps after which an episode is truncated, as by a TimeLimit.
    processes : int, optional
        Processes that simulate instead of threads, which share one interpreter's lock: one a core
        pays from some 8 copies on. A script that asks for them guards its main part with
        `if __name__ == "__main__"`.
    record : path, optional
        Folder for replays; copy i writes into its folder `copy-i`.
    **keywords
        Of each copy, see `BarrierDesign` and `BarrierPlacement`.

    Raises
    ------
    BadInput
        If a keyword is unsound or, in `step`, an action; nothing has changed then.
    """

    metadata: dict[str, Any] = BarrierEnv.metadata | {"autoreset_mode": AutoresetMode.SAME_STEP}
    single: ClassVar[type[BarrierEnv]]

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        processes: int | None = None,
        record: str | os.PathLike[str] | None = None,
        **keywords: Any,
    ):
        self.num_envs = check.integer("num_envs", num_envs, 1, MOST_COPIES)
        if max_episode_steps is not None:
            check.integer("max_episode_steps", max_episode_steps, 1)
        self.limit = max_episode_steps
        self._crew = None if processes is None else Crew(processes)
        folder = None if record is None else Recorder(record).folder
        folders = [folder and folder / f"copy-{i}" for i in range(num_envs)]
        self.copies = [self.single(record=folder, **keywords) for folder in folders]
        first = self.copies[0]
        self.render_mode = first.render_mode
        self.single_action_space, self.single_observation_space = (
            first.action_space,
            first.observation_space,
        )
        self.action_space = batch_space(first.action_space, num_envs)
        self.observation_space = batch_space(first.observation_space, num_envs)
        self._elapsed = np.zeros(num_envs, dtype=np.int64)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode in every copy; see the class for seeds."""
        infos: dict[str, Any] = {}
        starts = self.start(seed)
        for i, (_, info) in enumerate(starts):
            infos = self._add_info(infos, info, i)
        return stack([seen for seen, _ in starts]), infos

    def step(self, actions: NDArray[np.float32]) -> Batch:
        """Take a step in every copy, (num_envs, width) actions."""
        infos: dict[str, Any] = {}
        steps = self.advance(actions)
        shown = []
        for i, ((seen, _, _, _, info), start) in enumerate(steps):
            if start is not None:
                infos = self._add_info(infos, {"final_obs": seen, "final_info": info}, i)
                seen, info = start
            infos = self._add_info(infos, info, i)
            shown.append(seen)
        _, rewards, terminated, truncated, _ = zip(*(step for step, _ in steps), strict=True)
        flags = np.array(terminated), np.array(truncated)
        return stack(shown), np.array(rewards, dtype=np.float64), *flags, infos

    def start(self, seed: int | Sequence[int | None] | None = None) -> list[Start]:
        """Start an episode in every copy; return what each says."""
        seeds = self._seeds(seed)
        self._elapsed[:] = 0
        return self._restart(self.copies, seeds)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        """Return the seed of every copy, None for one that goes on with its random numbers."""
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            first = check.integer("seed", seed, 0)
            return [first + i for i in range(self.num_envs)]
        if _rows(seed) != self.num_envs:
            raise BadInput("seed", seed, f"give one number, or {self.num_envs}, one a copy")
        return [
            None if one is None else check.integer(f"seed[{i}]", one, 0)
            for i, one in enumerate(seed)
        ]

    def advance(self, actions: NDArray[np.float32]) -> list[tuple[Step, Start | None]]:
        """Take a step in every copy; return what each says, and the start of its next episode.

        The second is None where the episode goes on.
        """
        given = _rows(actions)
        if given != self.num_envs:
            found = actions if given is None else f"{given} rows"
            raise BadInput("actions", found, f"give {self.num_envs} rows, one a copy")
        if not all(copy.open for copy in self.copies):
            raise ResetNeeded("call reset() before the first step")
        width = self.copies[0].width
        rows = [encoding.vector(f"actions[{i}]", row, width) for i, row in enumerate(actions)]
        asks = [copy.ask_step(row) for copy, row in zip(self.copies, rows, strict=True)]
        told = [
            copy.tell_step(a)
            for copy, a in zip(self.copies, simulate(asks, self._crew), strict=True)
        ]
        self._elapsed += 1
        cut = self._elapsed == self.limit
        steps = [(*step[:3], bool(late), step[4]) for step, late in zip(told, cut, strict=True)]
        ended = [i for i, step in enumerate(steps) if step[2] or step[3]]
        self._elapsed[ended] = 0
        starts = self._restart([self.copies[i] for i in ended], [None] * len(ended))
        following = dict(zip(ended, starts, strict=True))
        return [(step, following.get(i)) for i, step in enumerate(steps)]

    def _restart(self, copies: Sequence[BarrierEnv], seeds: Sequence[int | None]) -> list[Start]:
        """Start an episode in some copies; return what each says."""
        asks = [copy.ask_reset(seed) for copy, seed in zip(copies, seeds, strict=True)]
        starts = []
        for copy, answer in zip(copies, simulate(asks, self._crew), strict=True):
            assert answer is not None
            starts.append(copy.tell_reset(answer))
        return starts

    def close_extras(self, **_: Any) -> None:
        """Close every copy, and end the processes."""
        if self._crew is not None:
            self._crew.close()
        for copy in self.copies:
            copy.close()

    def render(self) -> tuple[Any, ...]:
        """Return the picture of every copy."""
        return tuple(copy.render() for copy in self.copies)


class BarrierDesignVector(BarrierVector):
    """Copies of `BarrierDesign`."""

    single = BarrierDesign


class BarrierPlacementVector(BarrierVector):
    """Copies of `BarrierPlacement`."""

    single = BarrierPlacement


def _rows(values: Any) -> int | None:
    """Return the length of what should have one entry a copy, None if it has none."""
    try:
        return len(values)
    except TypeError:
        return None


def stack(seen: Sequence[Observation]) -> Observation:
    """Return the observations of all copies, each array with the copies as its first axis."""
    return {name: np.stack([one[name] for one in seen]) for name in seen[0]}
