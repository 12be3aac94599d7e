"""Vectorised environments: copies of one environment whose releases are simulated together."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from rigdda import BadInput, check
from rigdda.envs import encoding
from rigdda.envs.corridor_environment import CorridorDesign
from rigdda.envs.environments import (
    BarrierDesign,
    BarrierEnv,
    BarrierPlacement,
    Info,
    Observation,
    Step,
    simulate,
    simulate_observations,
)
from rigdda.envs.recorder import Recorder

MASK = "reset_mask"
"""Option of `reset` that selects the copies to restart."""

Options = Mapping[str, Any] | None


def reset_mode(given: AutoresetMode | str) -> AutoresetMode:
    """Return the autoreset mode of a name.

    Raises
    ------
    BadInput
        If there is no such mode.
    """
    try:
        return AutoresetMode(given)
    except ValueError:
        names = ", ".join(mode.value for mode in AutoresetMode)
        raise BadInput("autoreset_mode", given, f"choose one of {names}") from None


def reset_mask(options: Options, copies: int) -> tuple[NDArray[np.bool_] | None, Options]:
    """Return the mask of copies to restart, or None for all, and the other options.

    Raises
    ------
    BadInput
        If the option `reset_mask` is not one boolean per copy with at least one True.
    """
    if not isinstance(options, Mapping) or MASK not in options:  # each copy checks the others
        return None, options
    chosen = np.asarray(options[MASK])
    if chosen.shape != (copies,) or chosen.dtype != np.bool_ or not chosen.any():
        hint = f"give {copies} booleans, at least one of them True"
        raise BadInput(MASK, options[MASK], hint)
    return chosen, {name: value for name, value in options.items() if name != MASK}


def copy_seeds(seed: int | Sequence[int | None] | None, copies: int) -> list[int | None]:
    """Return the seed of every copy; None if its random numbers continue.

    Raises
    ------
    BadInput
        If they are not whole numbers >= 0, one per copy.
    """
    if seed is None:
        return [None] * copies
    if isinstance(seed, int | np.integer):
        first = check.integer("seed", seed, 0)
        return [first + i for i in range(copies)]
    if number_of_rows(seed) != copies:
        raise BadInput("seed", seed, f"give one number, or {copies}, one per copy")
    return [
        None if one is None else check.integer(f"seed[{i}]", one, 0) for i, one in enumerate(seed)
    ]


def number_of_rows(values: Any) -> int | None:
    """Return the length of values that should have one entry per copy; None without a length."""
    try:
        return len(values)
    except TypeError:
        return None


def stacked(seen: Sequence[Any]) -> Any:
    """Return the observations of all copies, stacked along a new first axis."""
    if isinstance(seen[0], np.ndarray):
        return np.stack(seen)
    return {name: np.stack([one[name] for one in seen]) for name in seen[0]}


MOST_COPIES = 100_000
"""Maximum number of copies; a larger number is taken for a typing error."""

Start = tuple[Observation, Info]
Turn = tuple[Step | None, Start | None]
"""Step of a copy, and start of its next episode; one of them may be None."""
Batch = tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class BarrierVector(VectorEnv[Any, NDArray[np.float32], Any]):
    """Copies of one environment that step together, in threads on all cores.

    Each copy returns exactly what it would return alone: after `reset(seed=s)` copy i is identical
    to the environment after `reset(seed=s + i)`. `reset(options={"site": ...})` applies to every
    copy.

    Parameters
    ----------
    num_envs : int
        Number of copies.
    max_episode_steps : int, optional
        Number of steps after which an episode is truncated, as by a TimeLimit.
    autoreset_mode : AutoresetMode or its value
        What happens after the end of an episode of a copy. SAME_STEP: the next episode begins in
        the same step, and the last observation and info are `final_obs` and `final_info` of the
        infos. NEXT_STEP: it begins in the next step, which ignores the action for that copy.
        DISABLED: it begins on `reset(options={"reset_mask": mask})`.
    record : path, optional
        Folder for replays; copy i writes into its subfolder `copy-i`.
    **keywords
        Keywords of each copy, see `BarrierDesign` and `BarrierPlacement`.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, an action is invalid; the environment is then unchanged.
    """

    metadata: dict[str, Any] = BarrierEnv.metadata | {"autoreset_mode": AutoresetMode.SAME_STEP}
    single: ClassVar[type[BarrierEnv] | type[CorridorDesign]]

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        record: str | os.PathLike[str] | None = None,
        **keywords: Any,
    ):
        self.num_envs = check.integer("num_envs", num_envs, 1, MOST_COPIES)
        if max_episode_steps is not None:
            check.integer("max_episode_steps", max_episode_steps, 1)
        self.limit = max_episode_steps
        self.mode = reset_mode(autoreset_mode)
        self.metadata = type(self).metadata | {"autoreset_mode": self.mode}
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
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._seen: list[Observation] = []  # latest of every copy; empty until all have started

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode in every copy, or in those selected by the option `reset_mask`.

        Options: `site` as the keyword, for these episodes; `reset_mask`: (num_envs,) booleans.
        """
        mask, own = reset_mask(options, self.num_envs)
        infos: dict[str, Any] = {}
        for i, (_, info) in self.start(seed, [own] * self.num_envs, mask).items():
            infos = self._add_info(infos, info, i)
        return stacked(self._seen), infos

    def step(self, actions: NDArray[np.float32]) -> Batch:
        """Take a step in every copy; `actions` has shape (num_envs, width)."""
        infos: dict[str, Any] = {}
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), dtype=np.bool_)
        for i, (step, start) in enumerate(self.advance(actions)):
            if step is not None:
                seen, rewards[i], terminated[i], truncated[i], info = step
                if start is not None:
                    infos = self._add_info(infos, {"final_obs": seen, "final_info": info}, i)
            if start is not None:
                _, info = start
            infos = self._add_info(infos, info, i)
        return stacked(self._seen), rewards, terminated, truncated, infos

    def start(
        self,
        seed: int | Sequence[int | None] | None = None,
        options: Sequence[Options] | None = None,
        mask: NDArray[np.bool_] | None = None,
    ) -> dict[int, Start]:
        """Start an episode in every copy, or in those of a mask; return observations and infos."""
        seeds = copy_seeds(seed, self.num_envs)
        given = [None] * self.num_envs if options is None else options
        chosen = np.arange(self.num_envs) if mask is None else np.flatnonzero(mask)
        if len(chosen) < self.num_envs and not self._seen:
            raise ResetNeeded("call reset() for all copies before resetting some of them")
        return self._restart(chosen.tolist(), seeds, given)

    def advance(self, actions: NDArray[np.float32]) -> list[Turn]:
        """Take a step in every copy; return the results, see `Turn`.

        The step of a copy is None if its episode had ended in the previous step (NEXT_STEP). Its
        start is None if its episode continues, or no new one begins immediately.
        """
        rows = self._checked(actions)
        resting = self._ended.copy()
        live = np.flatnonzero(~resting).tolist()
        answers = simulate([self.copies[i].ask(rows[i]) for i in live])
        told = {i: self.copies[i].tell(a) for i, a in zip(live, answers, strict=True)}
        self._elapsed[live] += 1
        cut = self._elapsed == self.limit
        steps: dict[int, Step] = {i: (*s[:3], bool(cut[i]), s[4]) for i, s in told.items()}
        for i, step in steps.items():
            self._seen[i], self._ended[i] = step[0], step[2] or step[3]
        anew = self._ended if self.mode is AutoresetMode.SAME_STEP else resting
        free: list[None] = [None] * self.num_envs
        starts = self._restart(np.flatnonzero(anew).tolist(), free, free)
        return [(steps.get(i), starts.get(i)) for i in range(self.num_envs)]

    def _checked(self, actions: NDArray[np.float32]) -> dict[int, NDArray[np.float64]]:
        """Return the validated actions of the copies whose episode continues."""
        given = number_of_rows(actions)
        if given != self.num_envs:
            found = actions if given is None else f"{given} rows"
            raise BadInput("actions", found, f"give {self.num_envs} rows, one per copy")
        if not self._seen:
            raise ResetNeeded("call reset() before the first step")
        if self.mode is AutoresetMode.DISABLED and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(f"copies {ended} have ended: reset them with the option {MASK}")
        width = self.copies[0].width
        return {
            i: encoding.vector(f"actions[{i}]", row, width)
            for i, row in enumerate(actions)
            if not self._ended[i]
        }

    def _restart(
        self, chosen: Sequence[int], seeds: Sequence[int | None], options: Sequence[Options]
    ) -> dict[int, Start]:
        """Start an episode in the chosen copies; return their observations and infos."""
        for i in chosen:
            self.copies[i].draw(seeds[i], options[i])
        episodes = [(self.copies[i].problem, self.copies[i].observed_releases) for i in chosen]
        observed = simulate_observations(episodes)
        starts = {i: self.copies[i].start(seen) for i, seen in zip(chosen, observed, strict=True)}
        self._seen = self._seen or [seen for seen, _ in starts.values()]
        for i, (seen, _) in starts.items():
            self._seen[i], self._elapsed[i], self._ended[i] = seen, 0, False
        return starts

    def close_extras(self, **_: Any) -> None:
        """Close every copy."""
        for copy in self.copies:
            copy.close()

    def render(self) -> tuple[Any, ...]:
        """Return the image of every copy."""
        return tuple(copy.render() for copy in self.copies)


class BarrierDesignVector(BarrierVector):
    """Vectorised `BarrierDesign`."""

    single = BarrierDesign


class BarrierPlacementVector(BarrierVector):
    """Vectorised `BarrierPlacement`."""

    single = BarrierPlacement


class CorridorDesignVector(BarrierVector):
    """Vectorised `CorridorDesign`."""

    single = CorridorDesign
