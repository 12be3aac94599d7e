"""Gymnasium environment `CorridorDesign`: the sections of a corridor one by one, with one budget.

A good agent has to estimate the value of money in the remaining sections.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

import rigdda
from rigdda import BadInput, Barrier, Corridor, Layout, Site, check
from rigdda.barriers import describe
from rigdda.envs import encoding, observation
from rigdda.envs.cost import Evaluation
from rigdda.envs.environments import (
    COSTS_IN_INFO,
    Action,
    Answer,
    Ask,
    Info,
    LayoutEnv,
    Observation,
    Step,
    plain,
    simulate_observations,
)
from rigdda.envs.outcome_cache import Sample
from rigdda.envs.problem import DesignProblem
from rigdda.envs.recorder import Trigger
from rigdda.envs.rendering import picture
from rigdda.envs.replay_record import release_record
from rigdda.envs.site_sampling import EpisodeSites, Place, Places, check_offered, drawn_from
from rigdda.model.corridor import is_corridor
from rigdda.model.corridor import names as corridor_names
from rigdda.seeds import episode_seeds

DEFAULT_SECTIONS = 12
"""Default number of sections of an episode."""

BUDGET_ROUNDING = 1e-6
"""Relative excess of a budget that is attributed to rounding [-]. Actions are rounded to float32. A
layout which costs what is left may therefore decode to one that is dearer by some parts in 10^7."""

MOST_SECTIONS = 1_000
"""Maximum number of sections of an episode."""

BUDGETS = (30.0, 1600.0)
"""Range of the budget of an episode, per metre of road [EUR/m]."""

LENGTHS = (50.0, 300.0)
"""Range of the lengths of sections [m]."""

LEAST_LENGTH = 0.1
"""Least length of a section, to which lengths are rounded [m]."""

CORRIDOR_FIELDS: dict[str, observation.Field] = {
    "length": observation.Field(1, 2.1, 0.25, "log10 of the length of the section [m]"),
    "metres": observation.Field(
        1, 0.5, 0.3, "share of the road of the corridor that is left, with this section"
    ),
    "money": observation.Field(
        2, 2.0, 0.8,
        "log10(1 + money left per metre of road left [EUR/m]), and the same for the whole budget "
        "and road",
    ),
    "ahead": observation.Field(
        5, 2.7, 0.4,
        "0, 25, 50, 75 and 100 % quantiles of log10(0.001 + Z without barriers) of the sections to "
        "come, weighted by length; 0 if there is none",
    ),
    "risk_ahead": observation.Field(
        2, 0.5, 0.3,
        "share of the risk of the corridor without barriers [EUR/year] that is in this section, "
        "and in the sections to come",
    ),
}  # fmt: skip
"""Observation of the corridor, in addition to that of the section (`observation.FIELDS`)."""


@dataclass(frozen=True, slots=True)
class PlacedSection:
    """A section of an episode: its problem, its length [m] and its name."""

    problem: DesignProblem
    length: float
    name: str


class CorridorDesign(LayoutEnv):
    """Design the barriers of a corridor, one section per step, within one budget.

    Action
        Box(-1, 1, (size,), float32): the layout of the current section, as in `BarrierDesign`.
        Barriers are built in the order of the slots. One that costs more than the money that is
        left is not built.
    Observation
        Dict of 1-D float32 arrays, or their concatenation if `flat`: that of `BarrierDesign` for
        the current section, and `CORRIDOR_FIELDS` for the corridor. It depends neither on the
        releases of the episode nor on a simulation with barriers.
    Reward
        Length x (Z without barriers - Z of the layout) of the section, divided by the sum of
        length x Z without barriers of the corridor. The rewards of an episode add up to the
        relative reduction of the annual cost of the corridor. Z without barriers is the stored
        mean of the site; Z of the layout is the mean over the releases of the section.
    Termination
        After the last section. Truncated by a TimeLimit only.
    Info
        As in `BarrierDesign`, for the section that was designed (at reset, for the first one
        without barriers), but without `targets`, because there are none; and `section` (name),
        `length` [m], `money` [EUR] and `metres` [m] that are left, and `spent` [EUR] and `gain`
        [EUR/year] so far.
    Randomness
        `reset` draws the sections and their order, their lengths, the budget, and the seeds of the
        releases.

    Parameters
    ----------
    site : str, path, Site, Corridor or sequence of sites
        Where sections come from: a split of the generated sites (see `rigdda.sites.split`), a
        site or a sequence of sites, from which `sections` are drawn without repetition, or a
        corridor (also its name or file), whose sections are all taken. Targets of its sections
        are not used.
    sections : int, optional
        Number of sections of an episode; by default 12, or all sites if there are fewer.
    budget : float or (float, float), optional
        Budget per metre of road [EUR/m], or the range from which its logarithm is drawn. By default
        `BUDGETS`, or, for a corridor, one of its budgets.
    lengths : (float, float)
        Range of the lengths of sections, at least 0.1 m [m]. Lengths are rounded to 0.1 m.
    max_barriers, kinds, releases, fidelity, flat, render_mode
        See `BarrierDesign`; `releases` is the number in each section.
    record : path, optional
        Folder for replays of each episode: one for each section with barriers, in a folder of the
        episode. A truncated episode is written when the next one begins, or at `close`.
    record_trigger : callable, optional
        Whether to record an episode, given its number from 0.

    Raises
    ------
    BadInput
        If a keyword or, in `step`, the action is invalid.

    Attributes
    ----------
    placed : tuple of PlacedSection
        The sections of the episode, in order.
    evaluations : list of Evaluation
        Evaluations of the sections that were designed.
    budget : float
        Budget of the episode [EUR].
    """

    name = "rigdda/Corridor-v0"

    def __init__(
        self,
        site: Places | Corridor = "train",
        sections: int | None = None,
        budget: float | tuple[float, float] | None = None,
        lengths: tuple[float, float] = LENGTHS,
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        releases: int = 4,
        fidelity: str = "full",
        flat: bool = False,
        record: str | os.PathLike[str] | None = None,
        record_trigger: Trigger | None = None,
        render_mode: str | None = None,
    ):
        self._corridor, self._names = _places(site)
        first = self._corridor.sections[0].site if self._corridor else self._names[0]
        self._sites = EpisodeSites([first], max_barriers, kinds, fidelity)
        places = [s.site for s in self._corridor.sections] if self._corridor else self._names
        check_offered(places, self._sites.slots.kinds)
        most = len(self._corridor.sections) if self._corridor else len(self._names)
        usual = most if self._corridor else min(DEFAULT_SECTIONS, most)
        self.sections = check.integer(
            "sections", usual if sections is None else sections, 1, min(most, MOST_SECTIONS)
        )
        if self._corridor and self.sections < most:
            raise BadInput("sections", sections, f"leave it out: the corridor has {most} sections")
        given = BUDGETS if budget is None and self._corridor is None else budget
        self._budget = None if given is None else _range("budget", given, zero=True)
        self._lengths = _lengths(lengths)
        slots = self._sites.slots
        own = {
            name: spaces.Box(-observation.BOUND, observation.BOUND, (f.size,), np.float32)
            for name, f in CORRIDOR_FIELDS.items()
        }
        space = spaces.Dict({**observation.space(slots.size, max_barriers, False).spaces, **own})
        options = record, record_trigger, render_mode
        super().__init__(slots, slots.size, space, releases, flat, *options)
        self.placed: tuple[PlacedSection, ...] = ()
        self.budget = 0.0
        self.evaluations: list[Evaluation] = []
        self._gains: list[float] = []  # [EUR/year]
        self._wanted: bool | None = None  # whether to record the episode; None: not yet known
        self._dropped: tuple[str, ...] = ()

    @property
    def problem(self) -> DesignProblem:
        """The problem of the current section, or of the last one after the end."""
        return self.placed[min(len(self.evaluations), len(self.placed) - 1)].problem

    observed_releases = 0
    """Number of observation releases per event, as the vectorised environment needs it."""

    @property
    def spent(self) -> float:
        """Construction cost of all sections so far [EUR]."""
        lengths = (section.length for section in self.placed)
        return math.fsum(
            length * e.cost for length, e in zip(lengths, self.evaluations, strict=False)
        )

    @property
    def gain(self) -> float:
        """Reduction of the annual cost of the corridor so far [EUR/year]."""
        return math.fsum(self._gains)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Draw a new corridor, its budget and its releases.

        `options` may contain `budget` [EUR/m], which sets the budget of this episode.
        """
        self.draw(seed, options)
        simulate_observations([(section.problem, 0) for section in self.placed])
        return self.start(Sample())

    def draw(self, seed: int | None, options: Mapping[str, Any] | None = None) -> None:
        """Draw a new episode."""
        self._cut_off()
        if options is not None and not isinstance(options, Mapping):
            raise BadInput("options", options, "give a mapping, such as {'budget': 200.0}")
        unknown = [name for name in options or () if name != "budget"]
        if unknown:
            raise BadInput("options", unknown, "the only option is budget")
        super().reset(seed=seed)
        self.open, self.evaluations, self._gains, self._dropped = False, [], [], ()
        rng = self.np_random
        self.placed = self._drawn(rng)
        total = math.fsum(section.length for section in self.placed)
        given: Any = (options or {}).get("budget")
        if given is not None:
            low, high = _range("budget", given, zero=True)
        elif self._budget is None:
            assert self._corridor is not None
            low = high = self._corridor.budgets[int(rng.integers(len(self._corridor.budgets)))]
            low, high = low / total, high / total
        else:
            low, high = self._budget
        share = rng.random()
        each = (
            math.exp((1.0 - share) * math.log(low) + share * math.log(high)) if low > 0.0 else low
        )
        self.budget = each * total
        self._seeds = [episode_seeds(rng, self.releases) for _ in self.placed]

    def _drawn(self, rng: np.random.Generator) -> tuple[PlacedSection, ...]:
        """Return the sections of an episode in random order."""
        if self._corridor is not None:
            order = rng.permutation(len(self._corridor.sections)).tolist()
            rows = [self._corridor.sections[i] for i in order]
            return tuple(
                PlacedSection(self._sites.problem_of(r.site), r.length, r.name) for r in rows
            )
        chosen = rng.choice(len(self._names), self.sections, replace=False).tolist()
        drawn = rng.uniform(*self._lengths, size=self.sections)
        lengths = np.round(drawn, 1).tolist()
        problems = [self._sites.problem_of(self._names[i]) for i in chosen]
        return tuple(
            PlacedSection(problem, length, problem.site.name)
            for problem, length in zip(problems, lengths, strict=True)
        )

    def start(self, _: Sample) -> tuple[Observation, Info]:
        """Start the drawn episode and return its first observation and info."""
        self.open, self._wanted = True, None
        without = [s.length * s.problem.nothing.objective for s in self.placed]
        self._risk = np.array(without)
        self._scale = math.fsum(without) or 1.0
        first = self.placed[0].problem.nothing
        return self._seen(), self._info(0, first)

    def ask(self, action: Action) -> Ask | None:
        """Return the simulations that an action needs, or None if nothing is built."""
        if not self.open:
            raise ResetNeeded("the episode has ended: call reset() before the next step")
        numbers = encoding.vector("action", action, self.width)
        if self.recorder and self._wanted is None:  # may raise: no state has changed yet
            self._wanted = self.recorder.wants(self._episode)
        place = len(self.evaluations)
        built, dropped = self.slots.built(self.problem, numbers)
        layout, refused = self._affordable(built)
        self._dropped = (*dropped, *refused)
        if not layout:
            return None
        return Ask(self.problem, layout, self._seeds[place], 0)

    def _affordable(self, built: Sequence[Barrier]) -> tuple[Layout, list[str]]:
        """Return the barriers that the money left allows, and the refused ones with the reason."""
        section, left = self.placed[len(self.evaluations)], self.budget - self.spent
        kept: list[Barrier] = []
        refused = []
        for barrier in built:
            site = section.problem.site
            cost = section.length * site.capital(_downhill([*kept, barrier]))
            if cost <= left + BUDGET_ROUNDING * self.budget:
                kept.append(barrier)
            else:
                more = cost - section.length * site.capital(_downhill(kept))
                rest = left - section.length * site.capital(_downhill(kept))
                refused.append(f"{barrier.label}: costs {more:,.0f} EUR, {rest:,.0f} EUR are left")
        return _downhill(kept), refused

    def tell(self, answer: Answer | None) -> Step:
        """Finish the step with the result of its ask."""
        place = len(self.evaluations)
        section = self.placed[place]
        nothing = now = section.problem.nothing
        if answer is not None:
            assert answer.evaluation is not None
            now = answer.evaluation
        gain = section.length * (nothing.objective - now.objective)
        self.evaluations.append(now)
        self._gains.append(gain)
        terminated = len(self.evaluations) == len(self.placed)
        seen, info = self._seen(), self._info(place, now)
        if terminated:
            self._end()
        return seen, gain / self._scale, terminated, False, info

    def _seen(self) -> Observation:
        """Return the observation of the current section and of what is left."""
        place = min(len(self.evaluations), len(self.placed) - 1)
        section = self.placed[place]
        lengths = np.array([s.length for s in self.placed])
        metres = float(lengths[place:].sum())
        left = max(self.budget - self.spent, 0.0)
        values = {
            "length": [math.log10(section.length)],
            "metres": [metres / float(lengths.sum())],
            "money": [
                math.log10(1.0 + left / metres),
                math.log10(1.0 + self.budget / float(lengths.sum())),
            ],
            "ahead": _ahead(self.placed[place + 1 :]),
            "risk_ahead": [
                self._risk[place] / self._scale,
                float(self._risk[place + 1 :].sum()) / self._scale,
            ],
        }
        seen = observation.observe(section.problem)
        for name, value in values.items():
            field = CORRIDOR_FIELDS[name]
            scaled = (np.asarray(value, dtype=np.float64) - field.centre) / field.spread
            bound = observation.BOUND
            seen[name] = np.clip(scaled, -bound, bound).astype(np.float32)
        return self._packed(seen)

    def _info(self, place: int, now: Evaluation) -> Info:
        """Return the info of the section that was designed last."""
        section, done = self.placed[place], len(self.evaluations)
        return {
            "site": section.problem.site.name,
            "section": section.name,
            "length": section.length,
            "layout": now.layout,
            "dropped": self._dropped,
            "outcomes": plain(now.outcomes),
            "money": self.budget - self.spent,
            "metres": math.fsum(s.length for s in self.placed[done:]),
            "spent": self.spent,
            "gain": self.gain,
            **{name: float(getattr(now, name)) for name in COSTS_IN_INFO},
        }

    def _end(self) -> None:
        """End the episode and write its replays if requested."""
        self.open = False
        if self.recorder and self._wanted:
            try:
                self._record(self.recorder.new_folder(self._episode))
            except OSError as error:
                gymnasium.logger.warn(f"no replay of episode {self._episode}: {error}")
        self._episode += 1

    def _cut_off(self) -> None:
        """End an episode that was truncated after at least one section."""
        if self.open and self.evaluations:
            self._end()

    def close(self) -> None:
        """End the current episode and close the environment."""
        self._cut_off()
        super().close()

    def _record(self, folder: Path) -> None:
        """Write a replay of the representative release of each designed section with barriers."""
        from rigdda.replay.recording import Marks

        for i, now in enumerate(self.evaluations):
            section = self.placed[i]
            if not now.layout:
                continue
            site, (seed, event) = section.problem.site, now.typical
            run, outcome = rigdda.release(site, now.layout, seed, event)
            notes = {
                "section": f"{section.name}, {section.length:g} m",
                "release": f"{seed}, event {event}, representative of {self.releases} scored",
                "layout": "; ".join(describe(barrier, 2) for barrier in now.layout),
                "objective": f"{now.objective:.4f}",
                "cost": f"{section.length * now.cost:,.0f} EUR",
                "gain": f"{self._gains[i]:,.0f} EUR a year",
            }
            title = f"{section.name}, section {i + 1} of {len(self.placed)}"
            record = release_record(site, now.layout, seed, event, outcome)
            road = site.road.start, site.road.end
            path = folder / f"section-{i + 1:04d}.rrd"
            run.to_rerun(path, Marks(road, notes, title, record=record))

    def render(self) -> NDArray[np.uint8] | None:
        """Return an RGB image of the section that was designed last, (450, 800, 3)."""
        if not self._renders(bool(self.placed)):
            return None
        place = max(len(self.evaluations) - 1, 0)
        section = self.placed[place]
        now = self.evaluations[place] if self.evaluations else section.problem.nothing
        problem, site = section.problem, section.problem.site
        seed, event = self._seeds[place][0], problem.plan(self._seeds[place])[0]
        if now.outcomes:
            seed, event = now.typical
        run, _ = rigdda.release(site, now.layout, seed, event)
        title = f"{section.name}, section {place + 1} of {len(self.placed)}: "
        title += f"{section.length * now.cost:,.0f} EUR, gain {self.gain:,.0f} EUR a year so far"
        return picture(run, site, now.layout, title)


def _downhill(barriers: Sequence[Barrier]) -> Layout:
    """Return barriers as a layout, sorted downhill."""
    return tuple(sorted(barriers, key=lambda barrier: barrier.x))


def _places(site: Any) -> tuple[Corridor | None, tuple[Place, ...]]:
    """Return the corridor, or the sites, from which episodes draw."""
    if isinstance(site, Corridor):
        return site, ()
    if isinstance(site, str) and site in corridor_names():
        return Corridor.load(site), ()
    if isinstance(site, str | os.PathLike):
        try:
            if is_corridor(site):
                return Corridor.load(site), ()
        except BadInput as bad:
            field = "site" if bad.field == "corridor" else bad.field
            raise BadInput(field, bad.value, bad.hint) from None
    drawn = drawn_from(site)
    if drawn and isinstance(site, str):
        return None, drawn
    for place in drawn or (site,):
        if not isinstance(place, Site):
            Site.load(place)
    return None, drawn or (site,)


def _lengths(value: Any) -> tuple[float, float]:
    """Return the range of the lengths of sections [m]."""
    low, high = _range("lengths", value)
    if low < LEAST_LENGTH:
        hint = f"give a number, or two numbers [low, high], of at least {LEAST_LENGTH:g} m"
        raise BadInput("lengths", value, hint)
    return low, high


def _range(field: str, value: Any, zero: bool = False) -> tuple[float, float]:
    """Return a range of positive numbers given as a pair or as one number.

    With `zero`, a single number may be 0.
    """
    if isinstance(value, int | float | np.number):
        number = check.number(field, value, 0.0, 1e9, open_low=not zero)
        return number, number
    try:
        low, high = check.interval(field, value, 0.0, 1e9)
    except BadInput:
        low = 0.0
    if low <= 0.0:
        raise BadInput(field, value, "give a number, or two numbers [low, high] above 0")
    return low, high


def _ahead(sections: Sequence[PlacedSection]) -> list[float]:
    """Return quantiles of log10 of Z without barriers of sections, weighted by length."""
    if not sections:
        return [0.0] * 5
    risk = np.array([math.log10(1e-3 + s.problem.nothing.objective) for s in sections])
    length = np.array([s.length for s in sections])
    order = np.argsort(risk)
    share = (np.cumsum(length[order]) - 0.5 * length[order]) / length.sum()
    return [float(np.interp(q, share, risk[order])) for q in (0.0, 0.25, 0.5, 0.75, 1.0)]
