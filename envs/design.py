"""The environment in which a whole layout is designed in one step."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

import rigdda
from envs import encoding, observation
from envs.evaluation import Evaluation
from envs.observation import Observation
from envs.picture import picture
from envs.problem import KINDS, DesignProblem
from envs.recorder import Recorder, Trigger
from rigdda import BadInput, Run, Site, check

Action = NDArray[np.float32]
Info = dict[str, Any]

SCORED_SEEDS = 2**31
"""Episodes draw the seeds of their releases below this; envelopes use others."""


class BarrierDesign(gymnasium.Env[dict[str, Any], Action]):
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
        After one step. Never truncated.
    Info
        At reset without barriers, at step with the layout: `objective` and `cost` (floats),
        `layout` (tuple of Barrier), `outcomes` (tuple of Outcome, one a release).
    Randomness
        `reset` draws the seeds of the episode's releases; `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site, max_barriers, kinds, risk_weight, cost_weight, cost_limit
        See `DesignProblem`.
    releases : int
        Random releases over which an episode averages.
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

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012

    def __init__(
        self,
        site: str | os.PathLike[str] | Site = "quick",
        max_barriers: int = 3,
        kinds: Sequence[str] = KINDS,
        releases: int = 4,
        risk_weight: float = 1.0,
        cost_weight: float = 0.2,
        cost_limit: float | None = None,
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
    ):
        self.problem = DesignProblem(
            site, max_barriers, kinds, risk_weight, cost_weight, cost_limit
        )
        self.releases = check.integer("releases", releases, 1)
        if record is None and record_trigger is not None:
            raise BadInput("record_trigger", record_trigger, "name a folder in `record` as well")
        self.recorder = None if record is None else Recorder(record, record_trigger)
        if render_mode is not None:
            check.one_of("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (self.problem.size,), np.float32)
        self.observation_space = observation.space(self.problem)
        self._episode = 0
        self._start: Evaluation | None = None  # without barriers, while an episode is open
        self._now: Evaluation | None = None
        self._shown: Run | None = None

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the episode's releases, empty before the first reset."""
        return self._now.seeds if self._now else ()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Draw the releases of a new episode and simulate them without barriers."""
        super().reset(seed=seed)
        seeds = self.np_random.integers(SCORED_SEEDS, size=self.releases).tolist()
        self._start = self.problem.evaluate((), seeds)
        return self._show(self._start)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, Info]:
        """Simulate the releases with the layout that `action` stands for."""
        if self._start is None:
            raise ResetNeeded("an episode has one step: call reset() before the next")
        vector = encoding.vector("action", action, self.problem.size)
        layout = self.problem.decode(vector)
        now = self.problem.evaluate(layout, self._start.seeds)
        reward = self._start.objective - now.objective
        seen, info = self._show(now)
        self._start = None
        if self.recorder and self.recorder.wants(self._episode):
            run = self._typical_run(now)
            self.recorder.write(self._episode, self.problem.site, run, now, reward)
        self._episode += 1
        return seen, reward, True, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the end of the release nearest the mean as an image, (450, 800, 3)."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() shows nothing: make the environment with a render_mode")
            return None
        if self._now is None:
            raise ResetNeeded("call reset() before render()")
        now, site = self._now, self.problem.site
        title = f"{site.name}: objective {now.objective:.3f}, debris {now.debris:.3f}"
        road = (site.road.start, site.road.end)
        return picture(self._typical_run(now), road, f"{title}, cost {now.cost:.1f}")

    def _show(self, now: Evaluation) -> tuple[Observation, Info]:
        """Make `now` what is shown; return its observation and info."""
        self._now, self._shown = now, None
        info = {
            "objective": now.objective,
            "cost": now.cost,
            "layout": now.layout,
            "outcomes": now.outcomes,
        }
        return observation.observe(self.problem, now.layout), info

    def _typical_run(self, now: Evaluation) -> Run:
        """Return the release nearest the mean, simulated again when it is asked for first."""
        if self._shown is None:
            self._shown = rigdda.release(self.problem.site, now.layout, now.typical)[0]
        return self._shown
