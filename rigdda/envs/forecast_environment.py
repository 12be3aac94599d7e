"""Gymnasium environment `BarrierForecast`: the design problem on forecasts, without simulation.

Both the single environment and the batch read a `rigdda.envs.forecast_table.ForecastTable`. A step
is an index into arrays, so that a batch makes hundreds of thousands of steps per second.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from rigdda import BadInput, check
from rigdda.envs.forecast_table import NAMES, ForecastTable, load
from rigdda.envs.observation import BOUND, FIELDS
from rigdda.envs.vector import MASK, MOST_COPIES, Batch, copy_seeds, reset_mask, reset_mode

Place = str | Sequence[str]
Table = ForecastTable | str | os.PathLike[str] | None
Options = Mapping[str, Any] | None
Observation = dict[str, NDArray[np.float32]] | NDArray[np.float32]

LAYOUTS = "layouts"
"""Name of the array of the observation that describes the layouts of the catalogue."""
AHEAD = 1024
"""Number of sites that are drawn at once for the next episodes of a copy."""


class Episodes:
    """Sites of the episodes of one copy, drawn uniformly from some rows of a table.

    Parameters
    ----------
    rows : (n,) array of int
        Rows of the table to draw from.
    """

    def __init__(self, rows: NDArray[np.int64]):
        self._rows = rows
        self._drawn, self._next = np.zeros(0, dtype=np.int64), 0

    def restart(self) -> None:
        """Forget what was drawn ahead, because the generator was seeded again."""
        self._next = len(self._drawn)

    def draw(self, rng: np.random.Generator) -> int:
        """Return the row of the next episode."""
        if self._next == len(self._drawn):
            self._drawn, self._next = rng.choice(self._rows, AHEAD), 0
        self._next += 1
        return int(self._drawn[self._next - 1])


class Catalogue:
    """Spaces and content of the environment, common to the single environment and the batch."""

    def __init__(self, site: Place, table: Table, flat: bool, layout_features: bool):
        self.table = table if isinstance(table, ForecastTable) else _from_file(table)
        self.rows = self.table.rows(site)
        self.flat = check.boolean("flat", flat)
        self.reward, self.mask = self.table.reward, self.table.mask
        self.layouts = np.array(self.table.layouts, dtype=object)
        self.actions = spaces.Discrete(len(self.table.layouts))
        ends = np.cumsum([FIELDS[name].size for name in NAMES])
        arrays = dict(zip(NAMES, np.split(self.table.observation, ends[:-1], axis=1), strict=True))
        if check.boolean("layout_features", layout_features):
            arrays[LAYOUTS] = self.table.features.reshape(len(self.table.names), -1)
        self.arrays = {name: arrays[name] for name in sorted(arrays)}
        self.space = spaces.Dict(
            {
                name: spaces.Box(-BOUND, BOUND, array.shape[1:], np.float32)
                for name, array in self.arrays.items()
            }
        )
        if self.flat:
            self.arrays = {"": np.hstack([*self.arrays.values()])}
        self.observations = spaces.flatten_space(self.space) if self.flat else self.space

    def observe(self, rows: Any) -> Any:
        """Return the observation of a row, or those of (n,) rows along a new first axis."""
        if self.flat:
            return self.arrays[""][rows].copy()
        return {name: array[rows].copy() for name, array in self.arrays.items()}

    def built(self, rows: Any, actions: Any) -> Any:
        """Return the layout that each action builds as JSON: none if it cannot be built."""
        return self.layouts[np.where(self.mask[rows, actions], actions, 0)]

    def chosen_rows(self, options: Options) -> NDArray[np.int64] | None:
        """Return the rows of the option `site`, or None without options.

        Raises
        ------
        BadInput
            If there is another option, or the table lacks the site.
        """
        if not options:
            return None
        if not isinstance(options, Mapping) or {*options} != {"site"}:
            raise BadInput("options", options, 'give {"site": ...} or None')
        return self.table.rows(options["site"])


def _from_file(path: str | os.PathLike[str] | None) -> ForecastTable:
    """Return the table in a file, or the one that ships.

    Raises
    ------
    BadInput
        If it is not a path of such a file.
    """
    if path is None:
        return load()
    name = os.fspath(path) if isinstance(path, str | os.PathLike) else path
    if not isinstance(name, str):
        hint = "give a ForecastTable or the path of its file, or leave it out"
        raise BadInput("table", path, hint)
    return load(name)


class BarrierForecast(gymnasium.Env[Any, Any]):
    """Choose a layout from a catalogue for a site, rewarded by the forecast of the value network.

    Action
        Discrete(A): the number of a layout of the catalogue; 0 builds nothing. A layout is relative
        to the barrier zone, so that the same number means the same type and relative place of
        barriers on every site.
    Observation
        Dict of 1-D float32 arrays: that of `BarrierDesign`, and `layouts` if `layout_features`; or
        their concatenation in alphabetical order if `flat`. It depends only on the site.
    Reward
        Forecast of (Z without barriers - Z of the layout) / Z without barriers, a float; 0 for a
        layout that cannot be built on the site, in place of which nothing is built.
    Termination
        After one step. Truncated by a TimeLimit only.
    Info
        `site` (name), `action_mask` ((A,) int8, 1 for layouts that can be built) and, after a step,
        `layout` (the relative layout that was built, as JSON).
    Randomness
        `reset` draws the site; `reset(seed=...)` makes all later draws reproducible.

    Parameters
    ----------
    site : str or sequence of str
        A site of the table, several sites, or a split, from which every episode draws one.
        `reset(options={"site": ...})` takes the same values, for one episode.
    table : path or ForecastTable, optional
        Table of forecasts; by default the one that ships with the package.
    flat : bool
        Whether observations are one array.
    layout_features : bool
        Whether observations contain the features of the layouts of the catalogue, for policies that
        score each layout.
    render_mode : None
        There are no pictures.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, the action is invalid.
    TypeError
        If a render mode is given. Stable-Baselines3 then makes the environment without one.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        site: Place = "train",
        table: Table = None,
        flat: bool = False,
        layout_features: bool = False,
        render_mode: None = None,
    ):
        if render_mode is not None:
            raise TypeError(f"render_mode = {render_mode!r}: leave it out: there are no pictures")
        self.catalogue = Catalogue(site, table, flat, layout_features)
        self.action_space = self.catalogue.actions
        self.observation_space = self.catalogue.observations
        self._episodes = Episodes(self.catalogue.rows)
        self._row: int | None = None
        self._open = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Draw the site of a new episode, or take the one of the option `site`."""
        rows = self.catalogue.chosen_rows(options)
        super().reset(seed=seed)
        if seed is not None:
            self._episodes.restart()
        episodes = self._episodes if rows is None else Episodes(rows)
        self._row, self._open = episodes.draw(self.np_random), True
        return self.catalogue.observe(self._row), self._info()

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Return the forecast for a layout and end the episode."""
        if not self._open or self._row is None:
            raise ResetNeeded("the episode has ended: call reset() before the next step")
        if isinstance(action, bool) or not self.action_space.contains(action):
            hint = f"give a whole number from 0 to {len(self.catalogue.table.layouts) - 1}"
            raise BadInput("action", action, hint)
        self._open = False
        reward = float(self.catalogue.reward[self._row, action])
        told = self._info() | {"layout": self.catalogue.built(self._row, action)}
        return self.catalogue.observe(self._row), reward, True, False, told

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which layouts can be built on the site of the episode, (A,)."""
        if self._row is None:
            raise ResetNeeded("call reset() before action_masks()")
        return self.catalogue.mask[self._row].copy()

    def render(self) -> None:
        """Warn that there are no pictures."""
        gymnasium.logger.warn("render() returns None: this environment has no pictures")

    def _info(self) -> dict[str, Any]:
        assert self._row is not None
        name = self.catalogue.table.names[self._row]
        return {"site": name, "action_mask": self.action_masks().astype(np.int8)}


class BarrierForecastVector(VectorEnv[Any, NDArray[np.int64], Any]):
    """Batch of `BarrierForecast`, stepped with array operations.

    Copy i returns what the single environment returns after `reset(seed=seed + i)`.

    Parameters
    ----------
    num_envs : int
        Number of copies.
    max_episode_steps : int, optional
        Number of steps after which an episode is truncated, as by a TimeLimit. An episode has one
        step, so that only 1 has an effect.
    autoreset_mode : AutoresetMode or its value
        What happens after the end of an episode, see `rigdda.envs.vector.BarrierVector`.
    site, table, flat, layout_features, render_mode
        See `BarrierForecast`.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, an action is invalid; the environment is then unchanged.
    TypeError
        If a render mode is given.

    Attributes
    ----------
    shared : BarrierForecast
        A single environment, which holds what all copies have in common.
    """

    metadata: dict[str, Any] = BarrierForecast.metadata | {
        "autoreset_mode": AutoresetMode.SAME_STEP
    }

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        **keywords: Any,
    ):
        self.num_envs = check.integer("num_envs", num_envs, 1, MOST_COPIES)
        if max_episode_steps is not None:
            check.integer("max_episode_steps", max_episode_steps, 1)
        self.limit = max_episode_steps
        self.mode = reset_mode(autoreset_mode)
        self.metadata = type(self).metadata | {"autoreset_mode": self.mode}
        self.shared = one = BarrierForecast(**keywords)
        self.catalogue, self.render_mode = one.catalogue, None
        self.single_action_space = one.action_space
        self.single_observation_space = one.observation_space
        self.action_space = batch_space(one.action_space, num_envs)
        self.observation_space = batch_space(one.observation_space, num_envs)
        self._random = [np.random.default_rng() for _ in range(num_envs)]
        self._episodes = [Episodes(self.catalogue.rows) for _ in range(num_envs)]
        self._row = np.full(num_envs, -1)
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._names = np.array(self.catalogue.table.names, dtype=object)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode in every copy, or in those selected by the option `reset_mask`."""
        mask, own = reset_mask(options, self.num_envs)
        return self.start(seed, [own] * self.num_envs, mask)

    def start(
        self,
        seed: int | Sequence[int | None] | None,
        options: Sequence[Options],
        mask: NDArray[np.bool_] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode in every copy, or in those of a mask, each with its own options."""
        chosen = range(self.num_envs) if mask is None else np.flatnonzero(mask).tolist()
        rows = {i: self.catalogue.chosen_rows(options[i]) for i in chosen}
        seeds = copy_seeds(seed, self.num_envs)
        if len(rows) < self.num_envs and (self._row < 0).any():
            raise ResetNeeded("call reset() for all copies before resetting some of them")
        for i, own in rows.items():
            if seeds[i] is not None:
                self._random[i], _ = gymnasium.utils.seeding.np_random(seeds[i])
                self._episodes[i].restart()
            episodes = self._episodes[i] if own is None else Episodes(own)
            self._row[i] = episodes.draw(self._random[i])
            self._ended[i] = False
        return self.catalogue.observe(self._row), self._infos(self._row)

    def step(self, actions: NDArray[np.int64]) -> Batch:
        """Take a step in every copy; `actions` has shape (num_envs,)."""
        given = self._checked(actions)
        resting = self._ended.copy()
        terminated = ~resting
        rewards = np.where(resting, 0.0, self.catalogue.reward[self._row, given])
        built = np.where(resting, None, self.catalogue.built(self._row, given))
        told = {"layout": built, "_layout": terminated} if terminated.any() else {}
        if self.mode is AutoresetMode.SAME_STEP:
            infos = self._final(told)
            self._draw(np.arange(self.num_envs))
        else:
            infos = told
            self._draw(np.flatnonzero(resting))
            self._ended = terminated.copy()
        infos |= self._infos(self._row)
        truncated = terminated & (self.limit == 1)
        return self.catalogue.observe(self._row), rewards, terminated, truncated, infos

    def render(self) -> None:
        """Warn that there are no pictures."""
        self.shared.render()

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which layouts can be built on the site of each copy, (num_envs, A)."""
        if (self._row < 0).any():
            raise ResetNeeded("call reset() before action_masks()")
        return self.catalogue.mask[self._row]

    def _draw(self, copies: NDArray[np.int64]) -> None:
        for i in copies.tolist():
            self._row[i] = self._episodes[i].draw(self._random[i])

    def _checked(self, actions: Any) -> NDArray[np.int64]:
        """Return the validated actions; 0 for copies whose next episode begins in this step."""
        if (self._row < 0).any():
            raise ResetNeeded("call reset() before the first step")
        if self.mode is AutoresetMode.DISABLED and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(f"copies {ended} have ended: reset them with the option {MASK}")
        most = self.catalogue.actions.n - 1
        hint = f"give {self.num_envs} whole numbers from 0 to {most}, one per copy"
        try:
            given = np.asarray(actions)
        except ValueError:  # lists of different lengths
            raise BadInput("actions", actions, hint) from None
        whole = given.shape == (self.num_envs,) and np.issubdtype(given.dtype, np.integer)
        if not whole:
            raise BadInput("actions", actions, hint)
        used = np.where(self._ended, 0, given)
        if used.min() < 0 or used.max() > most:
            raise BadInput("actions", actions, hint)
        return used.astype(np.int64)

    def _infos(self, rows: NDArray[np.int64]) -> dict[str, Any]:
        """Return the infos of all copies; a name with an underscore marks where there is one."""
        every = np.ones(self.num_envs, dtype=np.bool_)
        masks = self.catalogue.mask[rows].astype(np.int8)
        named = {"site": self._names[rows], "action_mask": masks}
        return {key: value for name, own in named.items() for key, value in
                ((name, own), (f"_{name}", every))}  # fmt: skip

    def _final(self, told: dict[str, Any]) -> dict[str, Any]:
        """Return the last observations and infos of the episodes that end in this step.

        `told` is what the infos contain in addition to those of `reset`.
        """
        seen, every = self.catalogue.observe(self._row), np.ones(self.num_envs, dtype=np.bool_)
        last = np.empty(self.num_envs, dtype=object)
        if self.catalogue.flat:
            last[:] = [*seen]
        else:
            last[:] = [
                dict(zip(seen, own, strict=True)) for own in zip(*seen.values(), strict=True)
            ]
        final = self._infos(self._row) | told
        return {"final_obs": last, "_final_obs": every, "final_info": final, "_final_info": every}
