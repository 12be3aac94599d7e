"""The environment in which barriers are placed one by one."""

from __future__ import annotations

from rigdda.envs.base import BarrierEnv
from rigdda.envs.recorder import Recorder


class BarrierPlacement(BarrierEnv):
    """Place one barrier a step, seeing what came down before: up to `max_barriers` steps.

    Action
        Box(-1, 1, (width,), float32): one slot, as `DesignProblem.decode` reads it: presence,
        station, height, size or class, then one score for each kind if there are several. What
        stands is what `BarrierDesign` would build of all the episode's actions: what stands stays
        where it is, a barrier that may not stand where the action says goes to the nearest
        place where it may.
    Observation
        Dict of 1-D float32 arrays, see `rigdda.envs.observation`: that of `BarrierDesign`, and what
        the barriers that stand take and let past. It depends on the site and on what stands, not on
        the episode's releases.
    Reward
        The fall of Z that the step caused over Z of nothing, a float. Every step is scored on the
        same releases, those of the episode, so that its rewards add up to
        (Z of nothing - Z of the layout) / Z of nothing.
    Termination
        When a step adds no barrier or the last slot is used. Truncated by a TimeLimit only.
    Info
        As of `BarrierDesign`, for what stands.
    Randomness
        `reset` draws the seeds of the episode's releases and, if there is a choice, the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site, max_barriers, kinds, releases, fidelity, flat, record_trigger, render_mode
        See `BarrierDesign`.
    record : path, optional
        Folder for a replay of each episode: the release that stands for the others in the end,
        after each placement.

    Raises
    ------
    BadInput
        If a keyword is unsound or, in `step`, the action.
    """

    looks = True

    @property
    def width(self) -> int:
        """Numbers in an action."""
        return self.slots.width

    def _record(self, recorder: Recorder) -> None:
        recorder.write_placements(self._episode, self.shown, self._stages, self._rewards)
