"""The environment in which barriers are placed one by one."""

from __future__ import annotations

from gymnasium import spaces

from envs import encoding, observation
from envs.base import BarrierEnv
from envs.observation import Observation
from envs.recorder import Recorder
from envs.trial import Answer


class BarrierPlacement(BarrierEnv):
    """Place one barrier a step, seeing what came down before: up to `max_barriers` steps.

    Action
        Box(-1, 1, (width,), float32): one slot, as `DesignProblem.decode` reads it: station,
        height, and thickness, capacity or width, then one score for each kind if there are
        several. What stands is what `BarrierDesign` would build of all the episode's actions: a
        barrier closer than 2 m to another moves both, and where there is no room the lower one
        is dropped.
    Observation
        Dict of 1-D float32 arrays, see `envs.observation`: that of `BarrierDesign`, and what
        passes and is left with the barriers that stand. It depends on the site and on what
        stands, not on the episode's releases.
    Reward
        The fall of the objective that the step caused on the episode's releases, a float. An
        episode's rewards add up to objective(no barrier) - objective(layout).
    Termination
        When an absent barrier is placed or the last slot is used. Truncated by a TimeLimit only.
    Info
        At reset and step, for what stands: `objective` and `cost` (floats), `layout` (tuple of
        Barrier), `outcomes` (tuple of Outcome, one a release).
    Randomness
        `reset` draws the seeds of the episode's releases and, for the site "random", the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site, max_barriers, kinds, releases, risk_weight, cost_weight, cost_limit, fidelity
        See `BarrierDesign`.
    record : path, optional
        Folder for a replay of each episode: the release whose debris is nearest the mean in the
        end, after each placement.
    record_trigger : callable, optional
        Whether to record an episode, by its number from 0; None: every one.
    render_mode : {"rgb_array"}, optional
        Pictures of the end of the release that is nearest the mean with what stands.

    Raises
    ------
    BadInput
        If a keyword is unsound or, in `step`, the action.
    """

    looks = True

    @property
    def width(self) -> int:
        """Numbers in an action."""
        return encoding.slot_size(self.problem.kinds)

    def _space(self) -> spaces.Dict:
        return observation.placement_space(self.problem)

    def _observe(self, answer: Answer) -> Observation:
        assert answer.envelope is not None
        left = 1.0 - len(self._slots) / self.problem.size
        layout = answer.evaluation.layout
        return observation.observe_placement(self.problem, layout, answer.envelope, left)

    def _record(self, recorder: Recorder) -> None:
        recorder.write_placements(self._episode, self.problem.site, self._stages)
