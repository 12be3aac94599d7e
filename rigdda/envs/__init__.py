"""Gymnasium environments for barrier design, and the same problem without Gymnasium.

Importing this package registers the environments;
`gymnasium.make("rigdda.envs:rigdda/BarrierDesign-v0")` imports it automatically.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rigdda.envs.arrivals import with_release_rates
from rigdda.envs.comparison import Difference, compare
from rigdda.envs.corridor_problem import CorridorEvaluation, CorridorProblem
from rigdda.envs.cost import Evaluation
from rigdda.envs.problem import DesignProblem, Targets
from rigdda.envs.registration import register

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

__all__ = [
    "CorridorEvaluation",
    "CorridorProblem",
    "DesignProblem",
    "Difference",
    "Evaluation",
    "Targets",
    "compare",
    "sb3_vec_env",
    "with_release_rates",
]


def sb3_vec_env(id: str, num_envs: int, **keywords: Any) -> VecEnv:
    """Return a vectorised environment for Stable-Baselines3.

    It wraps the copies that `gymnasium.make_vec(id, num_envs, ...)` creates. Releases are simulated
    in threads on all cores, and SB3's `VecMonitor` records the episodes. Requires the extra `rl`.

    Parameters
    ----------
    id : str
        A registered environment, such as "rigdda/BarrierPlacement-v0".
    num_envs : int
        Number of copies.
    **keywords
        Keywords of each copy, and `max_episode_steps`.

    Raises
    ------
    BadInput
        If a keyword is invalid, or the environment is not one of this package.
    """
    from rigdda.envs import sb3

    return sb3.sb3_vec_env(id, num_envs, **keywords)


register()
