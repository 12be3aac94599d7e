"""The environment in which a whole layout is designed in one step."""

from __future__ import annotations

from gymnasium import spaces

from envs import observation
from envs.base import BarrierEnv
from envs.observation import Observation
from envs.recorder import Recorder
from envs.trial import Answer


class BarrierDesign(BarrierEnv):
    """Design all barriers of a site at once: an episode is one step.

    Action
        Box(-1, 1, (size,), float32): station, height, and thickness, capacity or width of each
        barrier, then one score for each kind if there are several, as `DesignProblem.decode`
        reads them; size is 3 max_barriers for one kind, else (3 + kinds) max_barriers.
    Observation
        Dict of 1-D float32 arrays, see `envs.observation`. It depends on the site and on what
        stands, not on the episode's releases.
    Reward
        objective(no barrier) - objective(layout) on the same releases, a float.
    Termination
        After one step. Truncated by a TimeLimit only.
    Info
        At reset without barriers, at step with the layout: `objective` and `cost` (floats),
        `layout` (tuple of Barrier), `outcomes` (tuple of Outcome, one a release).
    Randomness
        `reset` draws the seeds of the episode's releases and, for the site "random", the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site : str, path or Site
        As `DesignProblem` takes it, or "random": another of the random training sites in every
        episode.
    max_barriers, kinds, risk_weight, cost_weight, cost_limit
        See `DesignProblem`.
    releases : int
        Random releases over which an episode averages.
    fidelity : {"full", "fast"}
        See `envs.fidelity`.
    record : path, optional
        Folder for a replay of each episode: its release whose debris is nearest the mean.
    record_trigger : callable, optional
        Whether to record an episode, by its number from 0; None: every one.
    render_mode : {"rgb_array"}, optional
        Pictures of the end of that release.

    Raises
    ------
    BadInput
        If a keyword is unsound or, in `step`, the action.
    """

    looks = False

    @property
    def width(self) -> int:
        """Numbers in an action."""
        return self.problem.size

    def _space(self) -> spaces.Dict:
        return observation.space(self.problem)

    def _observe(self, answer: Answer) -> Observation:
        return observation.observe(self.problem, answer.evaluation.layout)

    def _record(self, recorder: Recorder) -> None:
        recorder.write(self._episode, self.problem.site, self._stages)
