"""The environment in which a whole layout is designed in one step."""

from __future__ import annotations

from rigdda.envs.base import BarrierEnv
from rigdda.envs.recorder import Recorder


class BarrierDesign(BarrierEnv):
    """Design all barriers of a site at once: an episode is one step.

    Action
        Box(-1, 1, (size,), float32): for each barrier presence (above 0), station, height, size
        or class, then one score for each kind if there are several, as `DesignProblem.decode`
        reads them; size is 4 max_barriers for one kind, else (4 + kinds) max_barriers.
    Observation
        Dict of 1-D float32 arrays, see `rigdda.envs.observation`, or these as one array if `flat`.
        It depends on the site and on what stands, not on the episode's releases.
    Reward
        (Z of nothing - Z of the layout) / Z of nothing, a float. Z of nothing is the site's cached
        mean, Z of the layout that of the episode's releases.
    Termination
        After one step. Truncated by a TimeLimit only.
    Info
        At reset without barriers, at step with the layout: `site` (name), `layout` (tuple of
        Barrier), `objective`, `capital`, `harm`, `repair`, `debris`, `debris_share`, `cost`
        (floats), `outcomes`: plain numbers of each release, none at reset.
    Randomness
        `reset` draws the seeds of the episode's releases and, if there is a choice, the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site : str, path or Site
        As `DesignProblem` takes it; "train", "validation" or "test": another site of the split in
        every episode; "random" is "train". `reset(options={"site": ...})` takes the same.
    max_barriers, kinds, fidelity
        See `DesignProblem`. Where every episode draws its site, all kinds by default; mesh is
        not offered where a site has none.
    releases : int
        Random releases over which an episode averages.
    flat : bool
        Whether observations are one array.
    record : path, optional
        Folder for a replay of each episode: the release that stands for the others.
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
        return self.slots.size

    def _record(self, recorder: Recorder) -> None:
        recorder.write(self._episode, self.shown, self._stages, self._rewards)
