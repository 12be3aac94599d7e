"""What all environments share: an episode, in halves around each simulation.

`draw` and `ask` say what an episode is about and what to simulate, `start` and `tell` take what
that gave. So one environment simulates its own releases and a batched one those of all copies
together.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

import rigdda
from rigdda import BadInput, Run, check
from rigdda.envs import encoding, observation
from rigdda.envs.evaluation import Evaluation
from rigdda.envs.picture import picture
from rigdda.envs.places import Place, Venue
from rigdda.envs.recorder import Recorder, Shown, Trigger
from rigdda.envs.reuse import Sample
from rigdda.envs.trial import Answer, Ask, look_ahead, plain, simulate

Action = NDArray[np.floating[Any]]
Observation = dict[str, NDArray[np.float32]] | NDArray[np.float32]
Info = dict[str, Any]
Step = tuple[Observation, float, bool, bool, Info]

SCORED_SEEDS = 2**31
"""Episodes draw the seeds of their releases below this; envelopes use others."""

MOST_RELEASES = 100_000
"""Most releases of an episode, all of which are simulated in a step."""

MOST_LOOKS = 4
"""Releases of every event in which what stands is looked at, if as many are scored."""

TOLD = ("objective", "capital", "harm", "repair", "debris", "debris_share", "cost")
"""What `info` tells of an evaluation."""


class BarrierEnv(gymnasium.Env[Any, Action]):
    """Barriers of a site, placed some slots a step; see the environments made of it.

    Attributes
    ----------
    problem : DesignProblem
        That of this episode.
    venue : Venue
        Where episodes play.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012

    looks: ClassVar[bool]
    """Whether what stands is looked at after every step, to be seen before the next."""

    def __init__(
        self,
        site: Place = "quick",
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        releases: int = 4,
        fidelity: str = "full",
        flat: bool = False,
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
    ):
        self.venue = Venue(site, max_barriers, kinds, fidelity)
        self.problem, self.slots = self.venue.first, self.venue.slots
        self.releases = check.integer("releases", releases, 1, MOST_RELEASES)
        if record is None and record_trigger is not None:
            raise BadInput("record_trigger", record_trigger, "name a folder in `record` as well")
        self.recorder = None if record is None else Recorder(record, record_trigger)
        if render_mode is not None:
            check.one_of("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (self.width,), np.float32)
        self._space = observation.space(self.slots.size, max_barriers, self.looks)
        self.flat = check.boolean("flat", flat)
        self.observation_space = spaces.flatten_space(self._space) if flat else self._space
        self._episode = 0
        self._numbers = np.zeros(0)  # of this episode's actions
        self._asked = self._numbers  # and those of the one that is being simulated
        self.seeds: tuple[int, ...] = ()
        self._stages: list[Evaluation] = []  # without barriers, then after each step
        self._rewards: list[float] = []  # of each step
        self._looked = Sample()  # what was seen of what stands
        self.open = False
        self._wanted: bool | None = None  # whether the episode is to be recorded, once asked
        self._shown: Run | None = None

    @property
    def width(self) -> int:
        """Numbers in an action, of whole slots."""
        raise NotImplementedError

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Draw the releases of a new episode, and its site if there is a choice.

        `options`: `site`, as the keyword, for this episode.
        """
        self.draw(seed, options)
        (looked,) = look_ahead([(self.problem, self.sights)])
        return self.start(looked)

    def step(self, action: Action) -> Step:
        """Simulate the episode's releases with what `action` adds."""
        (answer,) = simulate([self.ask(action)])
        return self.tell(answer)

    def draw(self, seed: int | None, options: Mapping[str, Any] | None = None) -> None:
        """Draw a new episode."""
        self._cut_off()
        super().reset(seed=seed)
        self.open = False
        self.problem = self.venue.draw(self.np_random, options)
        self.seeds = tuple(self.np_random.integers(SCORED_SEEDS, size=self.releases).tolist())

    def start(self, looked: Sample) -> tuple[Observation, Info]:
        """Start the episode that was drawn and looked at; return its first observation and info."""
        self._numbers = self._asked = np.zeros(0)
        self._stages, self.open, self._wanted = [self.problem.nothing], True, None
        self._rewards, self._looked = [], looked
        return self._show()

    def ask(self, action: Action) -> Ask | None:
        """Return what to simulate for an action, None if it changes nothing.

        If the action is refused, the episode can go on with another.
        """
        if not self.open:
            raise ResetNeeded("the episode has ended: call reset() before the next step")
        numbers = encoding.vector("action", action, self.width)
        asked = np.concatenate([self._numbers, numbers])
        layout = self.slots.decode(self.problem, asked)
        if self.recorder and self._wanted is None:  # if that raises, nothing is lost
            self._wanted = self.recorder.wants(self._episode)
        self._asked = asked
        if layout == self._stages[-1].layout:
            return None
        return Ask(self.problem, layout, self.seeds, self.sights)

    @property
    def sights(self) -> int:
        """Releases of every event in which what stands is looked at."""
        return min(self.releases, MOST_LOOKS) if self.looks else 0

    def tell(self, answer: Answer | None) -> Step:
        """Finish the step whose ask gave `answer`."""
        before = now = self._stages[-1]
        if answer is not None:
            assert answer.evaluation is not None  # an episode has releases
            now, self._looked = answer.evaluation, answer.looked
        self._numbers = self._asked
        self._stages.append(now)
        reward = self.problem.reward(now) - self.problem.reward(before)
        self._rewards.append(float(reward))
        terminated = len(self._numbers) == self.slots.size or answer is None
        seen, info = self._show()
        if terminated:
            self._end()
        return seen, float(reward), terminated, False, info

    def _show(self) -> tuple[Observation, Info]:
        """Return the observation and the info of what stands."""
        now, self._shown = self._stages[-1], None
        left = 1.0 - len(self._numbers) / self.slots.size
        stands = self.slots.encode(self.problem, now.layout)
        seen = observation.observe(self.problem, now, stands)
        if self.looks:
            count = self.slots.count
            seen |= observation.looked(self.problem, now.layout, self._looked, count, left)
        info: Info = {
            "site": self.problem.site.name,
            "layout": now.layout,
            "outcomes": plain(now.outcomes),
            **{name: float(getattr(now, name)) for name in TOLD},
        }
        if self.flat:
            return np.concatenate([seen[name] for name in self._space]), info
        return seen, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the end of the release that stands for the others as an image, (450, 800, 3)."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() shows nothing: make the environment with a render_mode")
            return None
        if not self._stages:
            raise ResetNeeded("call reset() before render()")
        now, site = self._stages[-1], self.problem.site
        if self._shown is None:
            self._shown = rigdda.release(site, now.layout, *self.typical)[0]
        road = (site.road.start, site.road.end)
        title = f"{site.name}: {now.objective:.0f} EUR per metre and year"
        return picture(self._shown, road, f"{title}, to build {now.cost:.0f} EUR per metre")

    @property
    def typical(self) -> tuple[int, str]:
        """Seed and event of the release that stands for the others; of nothing, the first."""
        now = self._stages[-1]
        return now.typical if now.outcomes else (self.seeds[0], self.problem.plan(self.seeds)[0])

    @property
    def shown(self) -> Shown:
        """That release, for a replay."""
        return Shown(self.problem.site, *self.typical, self.releases)

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
