"""Gymnasium environments: `BarrierDesign` (one step) and `BarrierPlacement` (one barrier per step).

Their common base `BarrierEnv` splits each step in two around the simulation: `ask` returns what
must be simulated and `tell` processes the answer, so that a batch of environments can be simulated
together. The reward is computed by `DesignProblem.reward` (`rigdda.envs.problem`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
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
from rigdda.envs.envelope import barrier_free
from rigdda.envs.outcome_cache import Sample
from rigdda.envs.problem import DesignProblem, Targets
from rigdda.envs.recorder import Recorder, Shown, Trigger
from rigdda.envs.rendering import picture
from rigdda.envs.replay_record import EpisodeRecord, Versions, as_json
from rigdda.envs.site_sampling import EpisodeSites, Places, Slots
from rigdda.seeds import OBSERVATIONS, episode_seeds


class Ask(NamedTuple):
    """A layout to evaluate on releases `seeds`, and to observe in `observed_releases` per event."""

    problem: DesignProblem
    layout: Layout
    seeds: tuple[int, ...]
    observed_releases: int


class Answer(NamedTuple):
    """Result of simulating an `Ask`.

    `evaluation` is the evaluation on the releases of the seeds, or None if there are no seeds.
    `observed` holds the outcomes of the observation releases, which are not scored and are the same
    releases for all layouts of a site.
    """

    evaluation: Evaluation | None
    observed: Sample


def simulate(asks: Sequence[Ask | None]) -> list[Answer | None]:
    """Simulate all asks together.

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
            drawn = [*zip(ask.seeds, events, strict=True), *_observation_releases(ask)]
            jobs += [(ask.problem.site, ask.layout, seed, event) for seed, event in drawn]
            ends += [len(jobs) - len(drawn) + len(ask.seeds), len(jobs)]
    parts = iter(outcome_cache.outcomes(jobs).split(ends))
    return [None if ask is None else _answer(ask, next(parts), next(parts)) for ask in asks]


def _observation_releases(ask: Ask) -> list[tuple[int, str]]:
    """Return the seed and event of each observation release."""
    seeds = range(OBSERVATIONS, OBSERVATIONS + ask.observed_releases)
    return [(seed, name) for name in ask.problem.site.event_names for seed in seeds]


def _answer(ask: Ask, scored: Sample, observed: Sample) -> Answer:
    judged = ask.problem.judge(ask.layout, scored, ask.seeds) if ask.seeds else None
    return Answer(judged, observed)


def simulate_observations(episodes: Sequence[tuple[DesignProblem, int]]) -> list[Sample]:
    """Simulate the envelopes and the barrier-free observation releases of new episodes together.

    Parameters
    ----------
    episodes : sequence of (DesignProblem, int)
        For each episode its problem and the number of observation releases per event.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    barrier_free([problem.site for problem, _ in episodes])
    answers = simulate([Ask(problem, (), (), releases) for problem, releases in episodes])
    return [answer.observed for answer in answers if answer is not None]


def plain(outcomes: Sequence[Outcome]) -> tuple[dict[str, Any], ...]:
    """Return the main results of outcomes as dicts of plain values."""
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

MOST_RELEASES = 100_000
"""Maximum number of releases of an episode; all of them are simulated in every step."""

MOST_OBSERVED_RELEASES = 4
"""Maximum number of observation releases per event; it is also limited to the number of scored
ones."""

COSTS_IN_INFO = ("objective", "capital", "harm", "repair", "debris", "debris_share", "cost")
"""Fields of the evaluation that `info` contains."""


class LayoutEnv(gymnasium.Env[Any, Action]):
    """What all environments share: their spaces, replays and pictures, and a step in two parts.

    Parameters
    ----------
    slots : Slots
        The slots of a layout.
    width : int
        Length of an action.
    space : spaces.Dict
        Space of the observations before they are flattened.
    releases, flat, record, record_trigger, render_mode
        See `BarrierDesign`.

    Raises
    ------
    BadInput
        If a keyword is invalid.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}  # noqa: RUF012

    name: ClassVar[str]
    """Registered name of the environment."""

    def __init__(
        self,
        slots: Slots,
        width: int,
        space: spaces.Dict,
        releases: int,
        flat: bool,
        record: str | os.PathLike[str] | None,
        record_trigger: Trigger | None,
        render_mode: str | None,
    ):
        self.slots, self.width = slots, width
        self.releases = check.integer("releases", releases, 1, MOST_RELEASES)
        if record is None and record_trigger is not None:
            raise BadInput("record_trigger", record_trigger, "also give a folder with `record`")
        self.recorder = None if record is None else Recorder(record, record_trigger)
        if render_mode is not None:
            check.one_of("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (width,), np.float32)
        self._space = space
        self.flat = check.boolean("flat", flat)
        self.observation_space = spaces.flatten_space(space) if flat else space
        self.open = False
        self._episode = 0

    def step(self, action: Action) -> Step:
        """Simulate the releases that `action` needs."""
        (answer,) = simulate([self.ask(action)])
        return self.tell(answer)

    def ask(self, action: Action) -> Ask | None:
        """Return the simulations that an action needs, or None if it needs none."""
        raise NotImplementedError

    def tell(self, answer: Answer | None) -> Step:
        """Finish the step with the result of its ask."""
        raise NotImplementedError

    def _packed(self, seen: dict[str, NDArray[np.float32]]) -> Observation:
        """Return an observation, flattened if requested."""
        return np.concatenate([seen[name] for name in self._space]) if self.flat else seen

    def _renders(self, started: bool) -> bool:
        """Return whether a picture is drawn; warn if the environment has no render mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() returns None: make the environment with a render_mode")
            return False
        if not started:
            raise ResetNeeded("call reset() before render()")
        return True


class BarrierEnv(LayoutEnv):
    """Base class of the environments of one site: its barriers, placed some slots per step.

    Attributes
    ----------
    problem : DesignProblem
        The problem of the current episode.
    sites : EpisodeSites
        Provides the site of each episode.
    """

    observes_layout: ClassVar[bool]
    """Whether the current layout is simulated and observed after every step."""

    def __init__(
        self,
        site: Places = "quick",
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        releases: int = 4,
        targets: Targets | Mapping[str, float | None] | None = None,
        max_cost: float | None = None,
        fidelity: str = "full",
        flat: bool = False,
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
        checks: str = "reported",
    ):
        limits = targets, max_cost, checks
        self.sites = EpisodeSites(site, max_barriers, kinds, fidelity, *limits)
        self.problem, slots = self.sites.first, self.sites.slots
        space = observation.space(slots.size, max_barriers, self.observes_layout)
        options = record, record_trigger, render_mode
        super().__init__(slots, self.width_of(slots), space, releases, flat, *options)
        self._numbers = np.zeros(0)  # all actions of this episode so far
        self._asked = self._numbers  # the same with the action being simulated
        self._seed: int | None = None  # seed given to the reset of this episode
        self.seeds: tuple[int, ...] = ()
        self._stages: list[Evaluation] = []  # without barriers, then after each step
        self._rewards: list[float] = []  # one per step
        self._observed = Sample()  # outcomes of the current layout in the observation releases
        self._wanted: bool | None = None  # whether to record the episode; None: not yet known
        self._shown: Run | None = None

    @classmethod
    def width_of(cls, slots: Slots) -> int:
        """Return the length of an action, a multiple of the slot length."""
        raise NotImplementedError

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Draw the releases of a new episode and, if there is a choice, its site.

        `options` may contain `site`, which sets the site of this episode.
        """
        self.draw(seed, options)
        return self.begin()

    def begin(self) -> tuple[Observation, Info]:
        """Simulate the observation releases of the drawn episode and start it."""
        (observed,) = simulate_observations([(self.problem, self.observed_releases)])
        return self.start(observed)

    def draw(self, seed: int | None, options: Mapping[str, Any] | None = None) -> None:
        """Draw a new episode."""
        self._cut_off()
        super().reset(seed=seed)
        self.open, self._seed = False, seed
        self.problem = self.sites.draw(self.np_random, options)
        self.seeds = episode_seeds(self.np_random, self.releases)

    def start(self, observed: Sample) -> tuple[Observation, Info]:
        """Start the drawn episode and return its first observation and info."""
        self._numbers = self._asked = np.zeros(0)
        self._stages, self.open, self._wanted = [self.problem.nothing], True, None
        self._rewards, self._observed = [], observed
        return self._show()

    def ask(self, action: Action) -> Ask | None:
        """Return the simulations that an action needs, or None if it does not change the layout.

        If the action is invalid, the episode can continue with another one.
        """
        if not self.open:
            raise ResetNeeded("the episode has ended: call reset() before the next step")
        numbers = encoding.vector("action", action, self.width)
        asked = np.concatenate([self._numbers, numbers])
        layout = self.slots.decode(self.problem, asked)
        if self.recorder and self._wanted is None:  # may raise: no state has changed yet
            self._wanted = self.recorder.wants(self._episode)
        self._asked = asked
        if layout == self._stages[-1].layout:
            return None
        return Ask(self.problem, layout, self.seeds, self.observed_releases)

    @property
    def observed_releases(self) -> int:
        """Number of observation releases per event."""
        return min(self.releases, MOST_OBSERVED_RELEASES) if self.observes_layout else 0

    def tell(self, answer: Answer | None) -> Step:
        """Finish the step with the result of its ask."""
        before = now = self._stages[-1]
        if answer is not None:
            assert answer.evaluation is not None  # every episode has releases
            now, self._observed = answer.evaluation, answer.observed
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
        """Return the observation and the info of the current layout."""
        now, self._shown = self._stages[-1], None
        seen = observation.observe(self.problem)
        if self.observes_layout:
            left = 1.0 - len(self._numbers) / self.slots.size
            stands = self.slots.encode(self.problem, observation.mesh_last(now.layout))
            seen |= observation.of_layout(
                self.problem, now, stands, self._observed, self.slots.count, left
            )
        info: Info = {
            "site": self.problem.site.name,
            "layout": now.layout,
            "dropped": self.slots.dropped(self.problem, self._numbers),
            "targets": now.targets,
            "outcomes": plain(now.outcomes),
            **{name: float(getattr(now, name)) for name in COSTS_IN_INFO},
        }
        return self._packed(seen), info

    def render(self) -> NDArray[np.uint8] | None:
        """Return an RGB image of the end of the representative release, (450, 800, 3)."""
        if not self._renders(bool(self._stages)):
            return None
        now, site = self._stages[-1], self.problem.site
        if self._shown is None:
            self._shown = rigdda.release(site, now.layout, *self.typical)[0]
        title = f"{site.name}: {now.objective:.0f} EUR per metre and year"
        title += f", to build {now.cost:.0f} EUR per metre"
        return picture(self._shown, site, now.layout, title)

    @property
    def typical(self) -> tuple[int, str]:
        """Seed and event of the representative release; without barriers, the first release."""
        now = self._stages[-1]
        return now.typical if now.outcomes else (self.seeds[0], self.problem.plan(self.seeds)[0])

    @property
    def shown(self) -> Shown:
        """The representative release, as the replay shows it."""
        return Shown(self.problem.site, *self.typical, self.releases)

    @property
    def record(self) -> EpisodeRecord:
        """The record from which this episode can be computed again, up to the current step."""
        shown = self.shown
        return EpisodeRecord(
            environment=self.name,
            max_barriers=self.slots.count,
            kinds=list(self.slots.kinds),
            releases=self.releases,
            targets=self.sites.targets,
            max_cost=self.sites.max_cost,
            checks=self.sites.checks,
            fidelity=self.sites.fidelity,
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
        """End the episode and write its replay if requested.

        A replay that cannot be written, for example because the disk is full, only causes a
        warning.
        """
        self.open = False
        if self.recorder and self._wanted:
            try:
                self._record(self.recorder)
            except OSError as error:
                gymnasium.logger.warn(f"no replay of episode {self._episode}: {error}")
        self._episode += 1

    def _cut_off(self) -> None:
        """End an episode that was truncated after at least one step."""
        if self.open and len(self._stages) > 1:
            self._end()

    def close(self) -> None:
        """End the current episode and close the environment."""
        self._cut_off()
        super().close()

    def _record(self, recorder: Recorder) -> None:
        """Write the replay of the episode that has ended."""
        raise NotImplementedError


class BarrierDesign(BarrierEnv):
    """Design all barriers of a site at once: an episode has one step.

    Action
        Box(-1, 1, (size,), float32): for each barrier presence (above 0), station, height, size or
        class, then one score for each kind if there are several, as `DesignProblem.decode` reads
        them; size is 4 max_barriers for one kind, else (4 + kinds) max_barriers.
    Observation
        Dict of 1-D float32 arrays, see `rigdda.envs.observation`, or their concatenation if `flat`.
        It describes the site, and depends neither on the releases of the episode nor on the action.
    Reward
        (Z without barriers - Z of the layout) / Z without barriers, a float. Z without barriers is
        the stored mean of the site; Z of the layout is the mean over the releases of the episode.
        With targets, a layout that misses one in these releases is worth -1 minus the excess over
        the target instead, and so is the empty layout, see `DesignProblem.reward`; the reward is
        the difference between the two.
    Termination
        After one step. Truncated by a TimeLimit only.
    Info
        At reset without barriers, at step with the layout: `site` (name), `layout` (tuple of
        Barrier), `dropped` (tuple of str: requested barriers that were not built, each with the
        reason), `targets` ("met", "missed", "undecided", or None without targets), `objective`,
        `capital`, `harm`, `repair`, `debris`, `debris_share`, `cost` (floats), `outcomes` (plain
        values for each release; empty at reset).
    Randomness
        `reset` draws the seeds of the releases of the episode and, if there is a choice, the site;
        `reset(seed=...)` makes all later draws reproducible.

    Parameters
    ----------
    site : str, path, Site or sequence of these
        As for `DesignProblem`, or a split of the generated sites (see `rigdda.sites.split`), such
        as "train" or "wide-train", from which every episode draws a site; "random" means "train".
        From a sequence of sites, every episode draws one of them.
        `reset(options={"site": ...})` takes the same values.
    max_barriers, kinds, targets, max_cost, fidelity, checks
        See `DesignProblem`. A barrier that would exceed `max_cost` is not built, and neither is one
        that fails a required check wherever it may stand. If every episode draws its site, the
        default is all kinds but `removal` and `wall`; mesh is not available on sites without mesh
        options.
    releases : int
        Number of random releases over which an episode averages.
    flat : bool
        Whether observations are one array.
    record : path, optional
        Folder for a replay of each episode, which shows a representative release.
    record_trigger : callable, optional
        Whether to record an episode, given its number from 0; by default all are recorded.
    render_mode : {"rgb_array"}, optional
        Images of the end of the representative release.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, the action is invalid.
    """

    name = "rigdda/BarrierDesign-v0"
    observes_layout = False

    @classmethod
    def width_of(cls, slots: Slots) -> int:
        """Return the length of an action: that of all slots."""
        return slots.size

    def _record(self, recorder: Recorder) -> None:
        record = as_json(self.record)
        recorder.write(self._episode, self.shown, self._stages, self._rewards, record)


class BarrierPlacement(BarrierEnv):
    """Place one barrier per step, observing the effect of those before: up to `max_barriers` steps.

    Action
        Box(-1, 1, (width,), float32): one slot, as `DesignProblem.decode` reads it: presence,
        station, height, size or class, then one score for each kind if there are several. The
        layout is the one that `BarrierDesign` would build from all actions of the episode: existing
        barriers keep their places, and a barrier that is not feasible where the action puts it
        moves to the nearest feasible place.
    Observation
        Dict of 1-D float32 arrays, see `rigdda.envs.observation`: that of `BarrierDesign`, plus
        what the existing barriers stop and let through. It depends on the site and on the layout,
        but not on the releases of the episode.
    Reward
        Reduction of Z caused by the step, divided by Z without barriers, a float. Every step is
        scored on the same releases, so that the rewards of an episode add up to that of
        `BarrierDesign`.
    Termination
        When a step adds no barrier or the last slot is used. Truncated by a TimeLimit only.
    Info
        As in `BarrierDesign`, for the current layout.
    Randomness
        `reset` draws the seeds of the releases of the episode and, if there is a choice, the site;
        `reset(seed=...)` makes all later draws reproducible.

    Parameters
    ----------
    site, max_barriers, kinds, releases, targets, max_cost, fidelity, flat, checks
        See `BarrierDesign`.
    record_trigger, render_mode
        See `BarrierDesign`.
    record : path, optional
        Folder for a replay of each episode, which shows the representative release of the final
        layout after each placement.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, the action is invalid.
    """

    name = "rigdda/BarrierPlacement-v0"
    observes_layout = True

    @classmethod
    def width_of(cls, slots: Slots) -> int:
        """Return the length of an action: that of one slot."""
        return slots.width

    def _record(self, recorder: Recorder) -> None:
        record = as_json(self.record)
        recorder.write_placements(self._episode, self.shown, self._stages, self._rewards, record)
