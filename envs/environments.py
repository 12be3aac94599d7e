"""The environments: a layout designed in one step, or barriers placed one by one.

What both share is an episode, in halves around each simulation: what an environment asks to be
simulated, all of a batch at once, and what it makes of the answer.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, ClassVar, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

import rigdda
from rigdda import BadInput, Layout, Outcome, Run, check
from rigdda.envs import encoding, observation, outcome_cache
from rigdda.envs.cost import Evaluation
from rigdda.envs.envelope import FIRST, barrier_free
from rigdda.envs.outcome_cache import Sample
from rigdda.envs.problem import DesignProblem, Targets
from rigdda.envs.recorder import Recorder, Shown, Trigger
from rigdda.envs.rendering import picture
from rigdda.envs.replay_record import EpisodeRecord, Versions, as_json
from rigdda.envs.site_sampling import Place, Venue


class Ask(NamedTuple):
    """A layout to evaluate on the releases of `seeds`, and to look at in `looks` of every event."""

    problem: DesignProblem
    layout: Layout
    seeds: tuple[int, ...]
    looks: int


class Answer(NamedTuple):
    """What an ask gave.

    `evaluation`: of the releases of the seeds, None without seeds. `looked`: outcomes of others,
    that are never scored, the same for all layouts of a site.
    """

    evaluation: Evaluation | None
    looked: Sample


def simulate(asks: Sequence[Ask | None], executor: Executor | None = None) -> list[Answer | None]:
    """Simulate every ask, their releases together over all cores, or in `executor`.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    jobs: list[outcome_cache.Job] = []
    ends = [0]
    for ask in asks:
        if ask is not None:
            events = ask.problem.plan(ask.seeds) if ask.seeds else ()
            drawn = [*zip(ask.seeds, events, strict=True), *_looks(ask)]
            jobs += [(ask.problem.site, ask.layout, seed, event) for seed, event in drawn]
            ends += [len(jobs) - len(drawn) + len(ask.seeds), len(jobs)]
    parts = iter(outcome_cache.outcomes(jobs, executor).split(ends))
    return [None if ask is None else _answer(ask, next(parts), next(parts)) for ask in asks]


def _looks(ask: Ask) -> list[tuple[int, str]]:
    """Return seed and event of the releases in which a layout is looked at."""
    seeds = range(FIRST, FIRST + ask.looks)
    return [(seed, name) for name in ask.problem.site.event_names for seed in seeds]


def _answer(ask: Ask, scored: Sample, looked: Sample) -> Answer:
    judged = ask.problem.judge(ask.layout, scored, ask.seeds) if ask.seeds else None
    return Answer(judged, looked)


def look_ahead(
    sights: Sequence[tuple[DesignProblem, int]], executor: Executor | None = None
) -> list[Sample]:
    """Look at the sites of new episodes, all together: at their envelopes, and in releases.

    Parameters
    ----------
    sights : sequence of (DesignProblem, int)
        Of each episode its problem, and the releases of every event to look at without barriers.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    barrier_free([problem.site for problem, _ in sights], executor)
    answers = simulate([Ask(problem, (), (), looks) for problem, looks in sights], executor)
    return [answer.looked for answer in answers if answer is not None]


def plain(outcomes: Sequence[Outcome]) -> tuple[dict[str, Any], ...]:
    """Return what outcomes say of the road and of the barriers, as plain numbers."""
    return tuple(
        {
            "event": outcome.event,
            "reached": outcome.reached,
            "road_volume": outcome.road_volume,
            "released_volume": outcome.released_volume,
            "debris_fraction": outcome.debris_fraction,
            "max_energy_on_road": outcome.max_energy_on_road,
            "failed": sum(barrier.failed for barrier in outcome.barriers),
        }
        for outcome in outcomes
    )


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

    name: ClassVar[str]
    """Under which it is registered."""

    looks: ClassVar[bool]
    """Whether what stands is looked at after every step, to be seen before the next."""

    def __init__(
        self,
        site: Place = "quick",
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        releases: int = 4,
        targets: Targets | Mapping[str, float | None] | None = None,
        fidelity: str = "full",
        flat: bool = False,
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
    ):
        self.venue = Venue(site, max_barriers, kinds, fidelity, targets)
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
        self._seed: int | None = None  # of the reset that began the episode
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
        return self.begin()

    def begin(self) -> tuple[Observation, Info]:
        """Look at the site of the episode that was drawn, and start it."""
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
        self.open, self._seed = False, seed
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
        seen = observation.observe(self.problem)
        if self.looks:
            left = 1.0 - len(self._numbers) / self.slots.size
            stands = self.slots.encode(self.problem, observation.mesh_last(now.layout))
            seen |= observation.looked(
                self.problem, now, stands, self._looked, self.slots.count, left
            )
        info: Info = {
            "site": self.problem.site.name,
            "layout": now.layout,
            "dropped": self.slots.dropped(self.problem, self._numbers),
            "targets": now.targets,
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
        title = f"{site.name}: {now.objective:.0f} EUR per metre and year"
        title += f", to build {now.cost:.0f} EUR per metre"
        return picture(self._shown, site, now.layout, title)

    @property
    def typical(self) -> tuple[int, str]:
        """Seed and event of the release that stands for the others; of nothing, the first."""
        now = self._stages[-1]
        return now.typical if now.outcomes else (self.seeds[0], self.problem.plan(self.seeds)[0])

    @property
    def shown(self) -> Shown:
        """That release, for a replay."""
        return Shown(self.problem.site, *self.typical, self.releases)

    @property
    def record(self) -> EpisodeRecord:
        """What it takes to compute this episode again as far as it has come."""
        shown = self.shown
        return EpisodeRecord(
            environment=self.name,
            max_barriers=self.slots.count,
            kinds=list(self.slots.kinds),
            releases=self.releases,
            targets=self.venue.targets,
            fidelity=self.venue.fidelity,
            site=self.problem.site,
            episode=self._episode,
            seed=self._seed,
            release_seeds=list(self.seeds),
            shown_seed=shown.seed,
            shown_event=shown.event,
            actions=self._numbers.reshape(-1, self.width).tolist(),
            rewards=self._rewards,
            versions=Versions.of_today(),
        )

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


class BarrierDesign(BarrierEnv):
    """Design all barriers of a site at once: an episode is one step.

    Action
        Box(-1, 1, (size,), float32): for each barrier presence (above 0), station, height, size
        or class, then one score for each kind if there are several, as `DesignProblem.decode`
        reads them; size is 4 max_barriers for one kind, else (4 + kinds) max_barriers.
    Observation
        Dict of 1-D float32 arrays, see `rigdda.envs.observation`, or these as one array if `flat`.
        It describes the site, and depends neither on the episode's releases nor on the action.
    Reward
        (Z of nothing - Z of the layout) / Z of nothing, a float. Z of nothing is the site's cached
        mean, Z of the layout that of the episode's releases. With targets, a layout that misses
        one in the episode's releases counts -1 less its excess in place of that, and so does
        nothing, see `DesignProblem.reward`: the reward is the difference from nothing.
    Termination
        After one step. Truncated by a TimeLimit only.
    Info
        At reset without barriers, at step with the layout: `site` (name), `layout` (tuple of
        Barrier), `dropped` (tuple of str: barriers that were asked for and are not built, each
        with the reason), `targets` ("met", "missed", "undecided", None if nothing is asked),
        `objective`, `capital`, `harm`, `repair`, `debris`, `debris_share`, `cost`
        (floats), `outcomes`: plain numbers of each release, none at reset.
    Randomness
        `reset` draws the seeds of the episode's releases and, if there is a choice, the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site : str, path or Site
        As `DesignProblem` takes it; "train", "validation" or "test": another site of the split in
        every episode; "random" is "train". `reset(options={"site": ...})` takes the same.
    max_barriers, kinds, targets, fidelity
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

    name = "rigdda/BarrierDesign-v0"
    looks = False

    @property
    def width(self) -> int:
        """Numbers in an action."""
        return self.slots.size

    def _record(self, recorder: Recorder) -> None:
        record = as_json(self.record)
        recorder.write(self._episode, self.shown, self._stages, self._rewards, record)


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
        same releases, those of the episode, so that its rewards add up to that of `BarrierDesign`.
    Termination
        When a step adds no barrier or the last slot is used. Truncated by a TimeLimit only.
    Info
        As of `BarrierDesign`, for what stands.
    Randomness
        `reset` draws the seeds of the episode's releases and, if there is a choice, the site;
        `reset(seed=...)` fixes all that follows.

    Parameters
    ----------
    site, max_barriers, kinds, releases, targets, fidelity, flat, record_trigger, render_mode
        See `BarrierDesign`.
    record : path, optional
        Folder for a replay of each episode: the release that stands for the others in the end,
        after each placement.

    Raises
    ------
    BadInput
        If a keyword is unsound or, in `step`, the action.
    """

    name = "rigdda/BarrierPlacement-v0"
    looks = True

    @property
    def width(self) -> int:
        """Numbers in an action."""
        return self.slots.width

    def _record(self, recorder: Recorder) -> None:
        record = as_json(self.record)
        recorder.write_placements(self._episode, self.shown, self._stages, self._rewards, record)
