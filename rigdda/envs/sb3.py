"""Adapter to Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from rigdda import BadInput
from rigdda.envs.forecast_environment import BarrierForecastVector
from rigdda.envs.registration import ENVIRONMENTS, FORECAST
from rigdda.envs.vector import BarrierVector, stacked


class Bridge(VecEnv):
    """Adapter of a vectorised environment to the `VecEnv` interface of Stable-Baselines3.

    Parameters
    ----------
    batch : BarrierVector
        The environment.

    Raises
    ------
    BadInput
        If its autoreset mode is not SAME_STEP.
    """

    def __init__(self, batch: BarrierVector):
        if batch.mode is not AutoresetMode.SAME_STEP:
            hint = f"give {AutoresetMode.SAME_STEP.value}, which Stable-Baselines3 needs"
            raise BadInput("autoreset_mode", batch.mode.value, hint)
        self.batch = batch
        self.render_mode = batch.render_mode
        super().__init__(batch.num_envs, batch.single_observation_space, batch.single_action_space)
        self._actions: NDArray[np.float32] | None = None

    def reset(self) -> Any:
        """Start an episode in every copy, with the pending seeds and options."""
        starts = self.batch.start(self._seeds, self._options).values()
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [info for _, info in starts]
        return stacked([seen for seen, _ in starts])

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Store the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step every copy; finished copies restart, with the last observation in the info."""
        assert self._actions is not None
        shown, rewards, dones, infos = [], [], [], []
        for i, (step, start) in enumerate(self.batch.advance(self._actions)):
            assert step is not None
            seen, reward, terminated, truncated, info = step
            if start is not None:
                limited = truncated and not terminated
                info |= {"terminal_observation": seen, "TimeLimit.truncated": limited}
                seen, self.reset_infos[i] = start
            shown.append(seen)
            rewards.append(reward)
            dones.append(start is not None)
            infos.append(info)
        return stacked(shown), np.array(rewards, dtype=np.float32), np.array(dones), infos

    def close(self) -> None:
        """Close the environment."""
        self.batch.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return the image of every copy."""
        return list(self.batch.render())

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute of the selected copies."""
        return [getattr(copy, attr_name) for copy in self._some(indices)]

    def set_attr(
        self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None
    ) -> None:
        """Set an attribute of the selected copies."""
        for copy in self._some(indices):
            setattr(copy, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: int | Iterable[int] | None = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Call a method of the selected copies."""
        return [
            getattr(copy, method_name)(*method_args, **method_kwargs)
            for copy in self._some(indices)
        ]

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],
        indices: int | Iterable[int] | None = None,
    ) -> list[bool]:
        """Return False for each selected copy: copies are never wrapped."""
        return [False for _ in self._some(indices)]

    def _some(self, indices: int | Iterable[int] | None) -> list[Any]:
        return [self.batch.copies[i] for i in self._get_indices(indices)]


class ForecastBridge(VecEnv):
    """Adapter of a batch of `BarrierForecast`, which has no separate copies.

    Parameters
    ----------
    batch : BarrierForecastVector
        The environment.

    Raises
    ------
    BadInput
        If its autoreset mode is not SAME_STEP.
    """

    def __init__(self, batch: BarrierForecastVector):
        if batch.mode is not AutoresetMode.SAME_STEP:
            hint = f"give {AutoresetMode.SAME_STEP.value}, which Stable-Baselines3 needs"
            raise BadInput("autoreset_mode", batch.mode.value, hint)
        self.batch, self.render_mode = batch, None
        super().__init__(batch.num_envs, batch.single_observation_space, batch.single_action_space)
        self._actions: NDArray[np.int64] = np.zeros(batch.num_envs, dtype=np.int64)

    def reset(self) -> Any:
        """Start an episode in every copy, with the pending seeds and options."""
        seen, infos = self.batch.start(self._seeds, self._options)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = _of_each(infos, self.num_envs)
        return seen

    def step_async(self, actions: NDArray[np.int64]) -> None:
        """Store the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step every copy; all of them restart, with the last observation in the info."""
        seen, rewards, dones, _, infos = self.batch.step(self._actions)
        told = _of_each(infos.pop("final_info"), self.num_envs)
        for info, last in zip(told, infos.pop("final_obs"), strict=True):
            info |= {"terminal_observation": last, "TimeLimit.truncated": False}
        self.reset_infos = _of_each(infos, self.num_envs)
        return seen, rewards.astype(np.float32), dones, told

    def close(self) -> None:
        """Close the environment."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Return an attribute that all copies share for each selected copy."""
        return [getattr(self.batch.shared, attr_name) for _ in self._get_indices(indices)]

    def set_attr(
        self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None
    ) -> None:
        """Refuse: the copies have no attributes of their own."""
        raise BadInput("attribute", attr_name, "copies of this environment share all attributes")

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: int | Iterable[int] | None = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Return the rows of a method of the batch, such as `action_masks`, for some copies."""
        rows = getattr(self.batch, method_name)(*method_args, **method_kwargs)
        return [rows[i] for i in self._get_indices(indices)]

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],
        indices: int | Iterable[int] | None = None,
    ) -> list[bool]:
        """Return False for each selected copy: copies are never wrapped."""
        return [False for _ in self._get_indices(indices)]


def _of_each(infos: dict[str, Any], copies: int) -> list[dict[str, Any]]:
    """Return the info of each copy, given the infos of a batch that all copies have."""
    names = [name for name in infos if f"_{name}" in infos]
    return [{name: infos[name][i] for name in names} for i in range(copies)]


def sb3_vec_env(id: str, num_envs: int, **keywords: Any) -> VecEnv:
    """Return a vectorised environment for Stable-Baselines3; see `rigdda.envs.sb3_vec_env`."""
    batch = gymnasium.make_vec(
        id, num_envs=num_envs, vectorization_mode="vector_entry_point", **keywords
    )
    if isinstance(batch, BarrierForecastVector):
        return VecMonitor(ForecastBridge(batch))
    if not isinstance(batch, BarrierVector):
        batch.close()
        names = ", ".join((*ENVIRONMENTS, *FORECAST))
        raise BadInput("id", id, f"name an environment of this package: {names}")
    return VecMonitor(Bridge(batch))
