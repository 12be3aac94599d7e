"""Adapter to Stable-Baselines3, the only module that imports it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from rigdda import BadInput
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


def sb3_vec_env(id: str, num_envs: int, **keywords: Any) -> VecEnv:
    """Return a vectorised environment for Stable-Baselines3; see `rigdda.envs.sb3_vec_env`."""
    batch = gymnasium.make_vec(
        id, num_envs=num_envs, vectorization_mode="vector_entry_point", **keywords
    )
    assert isinstance(batch, BarrierVector)
    return VecMonitor(Bridge(batch))
