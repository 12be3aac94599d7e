"""What all environments share: an episode, in halves around each simulation.

`ask_reset` and `ask_step` say what to simulate, `tell_reset` and `tell_step` take what it gave. So
one environment simulates its own releases and a batched one those of all copies together.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

import rigdda
from envs import encoding, fidelity
from envs.evaluation import Evaluation
from envs.observation import Observation
from envs.picture import picture
from envs.problem import KINDS, DesignProblem
from envs.recorder import Recorder, Trigger
from envs.trial import Answer, Ask, simulate
from rigdda import BadInput, Run, Site, check, sites

Action = NDArray[np.floating[Any]]
Info = dict[str, Any]
Step = tuple[Observation, float, bool, bool, Info]

SCORED_SEEDS = 2**31
"""Episodes draw the seeds of their releases below this; envelopes use others."""

MOST_RELEASES = 100_000
"""Most releases of an episode, all of which are simulated in a step."""

RANDOM = "random"
"""Name of a site that is another random one in every episode."""


class BarrierEnv(gymnasium.Env[dict[str, Any], Action]):
    """Barriers of a site, placed some slots a step; see the environments made of it."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012

    looks: ClassVar[bool]
    """Whether what stands is looked at after every step, to be seen before the next."""

    def __init__(
        self,
        site: str | os.PathLike[str] | Site = "quick",
        max_barriers: int = 3,
        kinds: Sequence[str] = KINDS,
        releases: int = 4,
        risk_weight: float = 1.0,
        cost_weight: float = 0.2,
        cost_limit: float | None = None,
        fidelity: str = "full",
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
    ):
        self.fidelity = fidelity
        self._random = isinstance(site, str) and site == RANDOM
        self._terms = (max_barriers, kinds, risk_weight, cost_weight, cost_limit)
        self.problem = self._pose(sites.random(sites.TRAIN_SEEDS[0]) if self._random else site)
        self.releases = check.integer("releases", releases, 1, MOST_RELEASES)
        if record is None and record_trigger is not None:
            raise BadInput("record_trigger", record_trigger, "name a folder in `record` as well")
        self.recorder = None if record is None else Recorder(record, record_trigger)
        if render_mode is not None:
            check.one_of("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (self.width,), np.float32)
        self.observation_space = self._space()
        self._episode = 0
        self._slots = np.zeros(0)  # the numbers of this episode's actions
        self._asked = self._slots  # and of the one that is being simulated
        self._answer: Answer | None = None  # the last one
        self._stages: list[Evaluation] = []  # without barriers, then after each step
        self.open = False
        self._wanted: bool | None = None  # whether the episode is to be recorded, once asked
        self._shown: Run | None = None

    def _pose(self, site: str | os.PathLike[str] | Site) -> DesignProblem:
        """Return the problem of a site, at the environment's fidelity and terms."""
        problem = DesignProblem(site, *self._terms)
        cheaper = fidelity.at(problem.site, self.fidelity)
        return problem if cheaper is problem.site else DesignProblem(cheaper, *self._terms)

    @property
    def width(self) -> int:
        """Numbers in an action, of whole slots."""
        raise NotImplementedError

    def _space(self) -> spaces.Dict:
        """Return the space of observations."""
        raise NotImplementedError

    def _observe(self, answer: Answer) -> Observation:
        """Return what is seen of what was simulated last."""
        raise NotImplementedError

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the episode's releases, empty before the first reset."""
        return self._stages[0].seeds if self._stages else ()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Draw the releases of a new episode, and its site if that is random; simulate them."""
        (answer,) = simulate([self.ask_reset(seed)])
        assert answer is not None
        return self.tell_reset(answer)

    def step(self, action: Action) -> Step:
        """Simulate the episode's releases with what `action` adds."""
        (answer,) = simulate([self.ask_step(action)])
        return self.tell_step(answer)

    def ask_reset(self, seed: int | None) -> Ask:
        """Draw a new episode and return what to simulate for it."""
        self._cut_off()
        super().reset(seed=seed)
        if self._random:
            number = int(self.np_random.integers(len(sites.TRAIN_SEEDS)))
            self.problem = self._pose(sites.random(sites.TRAIN_SEEDS[number]))
        drawn = self.np_random.integers(SCORED_SEEDS, size=self.releases).tolist()
        return Ask(self.problem, (), tuple(drawn), looks=True)

    def tell_reset(self, answer: Answer) -> tuple[Observation, Info]:
        """Start the episode; return its first observation and info."""
        self._slots = self._asked = np.zeros(0)
        self._stages, self.open, self._wanted = [answer.evaluation], True, None
        return self._show(answer)

    def ask_step(self, action: Action) -> Ask | None:
        """Return what to simulate for an action, None if it changes nothing.

        If the action is refused, the episode can go on with another.
        """
        if not self.open:
            raise ResetNeeded("the episode has ended: call reset() before the next step")
        numbers = encoding.vector("action", action, self.width)
        slots = np.concatenate([self._slots, numbers])
        layout = self._layout(slots)
        if self.recorder and self._wanted is None:  # if that raises, nothing is lost
            self._wanted = self.recorder.wants(self._episode)
        self._asked = slots
        if layout == self._stages[-1].layout:
            return None
        return Ask(self.problem, layout, self.seeds, self.looks)

    def _layout(self, slots: NDArray[np.float64]) -> rigdda.Layout:
        """Return the layout of the first slots of an episode, the others being empty."""
        vector = np.full(self.problem.size, -1.0)
        vector[: len(slots)] = slots
        return self.problem.decode(vector)

    def tell_step(self, answer: Answer | None) -> Step:
        """Finish the step whose ask gave `answer`."""
        answer = answer or self._answer
        assert answer is not None
        now = answer.evaluation
        self._slots = self._asked
        self._stages.append(now)
        reward = self._stages[-2].objective - now.objective
        added = self._slots[-self.width :]
        terminated = len(self._slots) == self.problem.size or not self._layout(added)
        seen, info = self._show(answer)
        if terminated:
            self._end()
        return seen, reward, terminated, False, info

    def _end(self) -> None:
        """End the episode; write its replay if that is wanted.

        A replay that cannot be written, to a full disk for example, does not cost the step.
        """
        self.open = False
        if self.recorder and self._wanted:
            try:
                self._record(self.recorder)
            except OSError as error:
                gymnasium.logger.warn(f"no replay of episode {self._episode}: {error}")
        self._episode += 1

    def _cut_off(self) -> None:
        """End an episode that was truncated on its way, if there is one."""
        if self.open and len(self._stages) > 1:
            self._end()

    def close(self) -> None:
        """End what is open."""
        self._cut_off()
        super().close()

    def _record(self, recorder: Recorder) -> None:
        """Write the replay of the episode that has ended."""
        raise NotImplementedError

    def render(self) -> NDArray[np.uint8] | None:
        """Return the end of the release nearest the mean as an image, (450, 800, 3)."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() shows nothing: make the environment with a render_mode")
            return None
        if not self._stages:
            raise ResetNeeded("call reset() before render()")
        now, site = self._stages[-1], self.problem.site
        if self._shown is None:
            self._shown = rigdda.release(site, now.layout, now.typical)[0]
        title = f"{site.name}: objective {now.objective:.3f}, debris {now.debris:.3f}"
        road = (site.road.start, site.road.end)
        return picture(self._shown, road, f"{title}, cost {now.cost:.1f}")

    def _show(self, answer: Answer) -> tuple[Observation, Info]:
        """Make an answer what is shown; return its observation and info."""
        now, self._answer, self._shown = answer.evaluation, answer, None
        info = {
            "objective": now.objective,
            "cost": now.cost,
            "layout": now.layout,
            "outcomes": now.outcomes,
        }
        return self._observe(answer), info
