"""Simple methods in the environment `rigdda/Corridor-v0`.

`python -m experiments.corridor_baselines [--quick] [--out DIR]` plays corridors of eight sections,
drawn from ten test sites, with random lengths. Layouts are scored on one half of their stored
outcomes (`experiments.corridor_pools`); all methods play the same corridors.

Without a search, a method chooses the layout of a section from its site alone:

- nothing; the best constant; the best constant of the family, chosen on ten training sites; the
  engineering rule. Money is either shared (a section may spend the money left per metre of road
  left, for each of its metres) or spent in the order of the sections until it ends;
- threshold: the layout with the greatest predicted benefit less threshold x cost, in order. The
  threshold of each budget is tuned on training corridors. The layouts are either constants, whose
  benefit is predicted by the mean share of the harm that they prevent on the training sites of the
  family, or those on offer to the agent, whose benefit is forecast by the value network;
- the agent that ships with the package.

With a search, the layouts of a section are those of a front (1,000 releases), each evaluated on
40 more releases, the same number in every section: the integer programme, and the worst section
first. The reference is the offline optimum, the integer programme with all layouts on the other
half of the outcomes.

The table has the mean relative reduction of the annual cost by budget and its share of that of the
offline optimum, with 95 % intervals over corridors, and by how much the agent is ahead of each
method in the same corridors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from experiments.corridor_pools import FOLDER, Pool, family, pools
from experiments.script import Number, interval, main, say, write
from rigdda import Layout, Outcome
from rigdda.agents.corridor import programme
from rigdda.agents.corridor.agent import CorridorAgent
from rigdda.agents.corridor.programme import Options
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.envs import Evaluation
from rigdda.envs.corridor_environment import CorridorDesign
from rigdda.envs.environments import Answer
from rigdda.envs.outcome_cache import Sample

BUDGETS = (50.0, 200.0, 800.0)
"""Budgets per metre of road [EUR/m]."""

SITES, RELEASES = 10, 400
"""Number of sites of each split, and of stored releases of each layout."""

TRAINING, CORRIDORS, SECTIONS = 8, 24, 8
"""Numbers of training and test corridors for each budget, and of their sections."""

SEEN = 40
"""Number of releases of each layout of a front in the track with search."""

THRESHOLDS = (0.0, *np.geomspace(0.02, 3.0, 14).tolist())
"""Thresholds that are tried [1/year]."""

CHOICE, REPORT = 0, 1
"""Halves of the outcomes: for choices, and for the scores."""

Policy = Callable[[CorridorDesign, Pool], Layout]
"""Returns the layout of the current section."""


class Known:
    """Evaluations of the layouts of a site on each half of their outcomes."""

    def __init__(self, pool: Pool):
        self.pool, self.problem = pool, pool.problem
        self.constants = pool.constants()
        self._found: dict[tuple[Layout, int, int | None], Evaluation] = {}

    @cached_property
    def best_constant(self) -> Layout:
        """The constant of the designer `constant`."""
        return constant(self.problem, Menu(self.problem))

    @cached_property
    def rule(self) -> Layout:
        """The layout of the engineering rule."""
        return self.pool.rule()

    @cached_property
    def front(self) -> tuple[Layout, ...]:
        """The layouts that the search found."""
        return self.pool.front()

    @cached_property
    def layouts(self) -> tuple[Layout, ...]:
        """All layouts, the first one without barriers."""
        more = (*self.front, *self.constants.values(), self.rule, self.best_constant)
        return tuple(dict.fromkeys(((), *more)))

    def evaluation(self, layout: Layout, half: int, most: int | None = None) -> Evaluation:
        """Return the evaluation of a layout on (the first of) a half of its outcomes."""
        if not layout:
            return self.problem.nothing
        if (layout, half, most) not in self._found:
            seen = every_second(self.pool.outcomes(layout), half)[:most]
            self._found[layout, half, most] = self.problem.judge(layout, seen)
        return self._found[layout, half, most]

    def harm(self, layout: Layout) -> float:
        """Return the harm and repair with a layout as a share of the cost without barriers."""
        found = self.evaluation(layout, CHOICE)
        return (found.harm + found.repair) / self.problem.nothing.objective


def every_second(outcomes: Sequence[Outcome], half: int) -> list[Outcome]:
    """Return every second outcome of each event."""
    seen: dict[str, int] = {}
    out = []
    for outcome in outcomes:
        place = seen[outcome.event] = seen.get(outcome.event, -1) + 1
        if place % 2 == half:
            out.append(outcome)
    return out


class Course:
    """Corridors that are drawn from some sites, and the layouts that are known there."""

    def __init__(self, available: Sequence[Pool], sections: int):
        self.known = {own.problem.site.name: Known(own) for own in available}
        self.env = CorridorDesign(list(self.known), sections=sections, releases=1)
        self.agent = CorridorAgent()

    def play(self, seed: int, budget: float, policy: Policy) -> float:
        """Return the sum of the rewards of an episode."""
        self.env.reset(seed=seed, options={"budget": budget})
        total, ended = 0.0, False
        while not ended:
            known = self.here
            ask = self.env.ask(self.env.slots.encode(known.problem, policy(self.env, known.pool)))
            answer = None
            if ask is not None:
                answer = Answer(known.evaluation(ask.layout, REPORT), Sample())
            _, reward, ended, _, _ = self.env.tell(answer)
            total += reward
        return total

    @property
    def here(self) -> Known:
        """What is known of the current section."""
        return self.known[self.env.problem.site.name]

    def options(self, choose: Callable[[Known], Sequence[Layout]], most: int | None) -> Options:
        """Return the options of the sections of the episode with estimates of their costs."""
        lengths, costs, annual, values = [], [], [], []
        for section in self.env.placed:
            known = self.known[section.problem.site.name]
            found = [known.evaluation(own, CHOICE, most) for own in choose(known)]
            lengths.append(section.length)
            costs.append(section.length * np.array([e.cost for e in found]))
            annual.append(section.length * np.array([e.capital for e in found]))
            values.append(section.length * np.array([e.objective for e in found]))
        missed = [np.zeros(len(own)) for own in values]
        return Options(np.array(lengths), costs, annual, values, missed)

    def planned(
        self,
        seed: int,
        budget: float,
        choose: Callable[[Known], Sequence[Layout]],
        most: int | None,
        method: Callable[[Options, float], programme.Choice],
    ) -> float:
        """Return the sum of the rewards if the layouts of all sections are chosen together."""
        self.env.reset(seed=seed, options={"budget": budget})
        choice = method(self.options(choose, most), self.env.budget)
        names = [section.problem.site.name for section in self.env.placed]
        layouts = {name: choose(self.known[name])[k] for name, k in zip(names, choice, strict=True)}
        return self.play(seed, budget, lambda env, pool: layouts[pool.problem.site.name])


def affordable(env: CorridorDesign, layout: Layout) -> Layout:
    """Return a layout if it costs at most the money left per metre of road left."""
    metres = sum(section.length for section in env.placed[len(env.evaluations) :])
    dear = env.problem.site.capital(layout) > (env.budget - env.spent) / metres
    return () if dear else layout


def of_families(course: Course) -> tuple[dict[str, str], dict[tuple[str, str], float]]:
    """Return the best constant of each family, and the share of the harm left by each constant."""
    left: dict[tuple[str, str], list[float]] = {}
    cost: dict[tuple[str, str], list[float]] = {}
    for name, known in course.known.items():
        for title, layout in known.constants.items():
            key = family(name), title
            left.setdefault(key, []).append(known.harm(layout))
            found = known.evaluation(layout, CHOICE)
            cost.setdefault(key, []).append(found.objective / known.problem.nothing.objective)
    mean = {key: float(np.mean(own)) for key, own in cost.items()}
    names = {key[0] for key in mean}
    best = {
        name: min((k for k in mean if k[0] == name), key=lambda k: mean[k])[1] for name in names
    }
    return best, {key: float(np.mean(own)) for key, own in left.items()}


def by_threshold(course: Course, left: dict[tuple[str, str], float], threshold: float) -> Policy:
    """Return the policy that builds the constant with the greatest benefit less its price."""

    def policy(env: CorridorDesign, pool: Pool) -> Layout:
        known, site = course.here, pool.problem.site
        without = pool.problem.nothing.objective
        best: tuple[float, Layout] = 0.0, ()
        for title, layout in known.constants.items():
            prevented = without * (1.0 - left.get((family(site.name), title), 1.0))
            worth = prevented - site.annual(layout) - threshold * site.capital(layout)
            if layout and worth > best[0]:
                best = worth, layout
        return best[1]

    return policy


def by_forecast(course: Course, threshold: float) -> Policy:
    """Return the policy that builds the layout with the greatest forecast less its price."""

    def policy(env: CorridorDesign, pool: Pool) -> Layout:
        own = course.agent.offer(env.problem)
        return own.layouts[int(np.argmax(own.gain - threshold * own.cost))]

    return policy


def layout_policies(course: Course, best: dict[str, str]) -> dict[str, Policy]:
    """Return the policies that do not consider money."""
    return {
        "nothing": lambda env, pool: (),
        "constant": lambda env, pool: course.here.best_constant,
        "constant of the family": lambda env, pool: course.here.constants[
            best[family(pool.problem.site.name)]
        ],
        "rule": lambda env, pool: course.here.rule,
    }


def shared(policy: Policy) -> Policy:
    """Return a policy that builds nothing if a section would take more than its share of money."""
    return lambda env, pool: affordable(env, policy(env, pool))


def run(quick: bool, out: Path) -> Number:
    """Play all methods and write the table."""
    sites, releases, training, corridors = (6, 60, 2, 3) if quick else (
        SITES, RELEASES, TRAINING, CORRIDORS,
    )  # fmt: skip
    folder = out / "pools" if quick else FOLDER
    sections = min(SECTIONS, sites)
    school = Course(pools("train", sites, releases, folder), sections)
    course = Course(pools("test", sites, releases, folder), sections)
    best, left = of_families(school)
    rows: list[dict[str, Any]] = []
    for budget in BUDGETS[: 1 if quick else None]:

        def tuned(kind: Callable[[float], Policy], budget: float = budget) -> float:
            """Return the threshold that is best on training corridors."""
            rewards = {
                threshold: np.mean(
                    [school.play(seed, budget, kind(threshold)) for seed in range(training)]
                )
                for threshold in THRESHOLDS
            }
            return max(rewards, key=lambda threshold: float(rewards[threshold]))

        constants = tuned(lambda threshold: by_threshold(school, left, threshold))
        forecasts = tuned(lambda threshold: by_forecast(school, threshold))
        say(f"{budget:g} EUR/m: thresholds {constants:.3g} and {forecasts:.3g} a year")
        thresholds = {
            "threshold": by_threshold(course, left, constants),
            "threshold on forecasts": by_forecast(course, forecasts),
        }
        found: dict[tuple[str, str, str], list[float]] = {}
        for seed in range(corridors):
            reward = scores(course, seed, budget, best, thresholds)
            for key, value in reward.items():
                found.setdefault(key, []).append(value)
        optimum = np.mean(found[OPTIMUM])
        for (track, method, money), values in found.items():
            mean, half = interval(values)
            behind, behind_half = interval(np.subtract(found[OPTIMUM], values))
            ahead, ahead_half = interval(np.subtract(found[AGENT], values))
            rows.append(
                {
                    "budget": budget, "track": track, "method": method, "money": money,
                    "reduction": mean, "half_width": half,
                    "share_of_optimum": float(mean / optimum), "behind_optimum": behind,
                    "behind_half_width": behind_half, "agent_ahead": ahead,
                    "agent_ahead_half_width": ahead_half, "corridors": corridors,
                }
            )  # fmt: skip
            say(f"{budget:g} EUR/m, {track}: {method}, {money}: {mean:.3f} +- {half:.3f}")
    write(out / "corridor_baselines.csv", rows)
    simple = [row["share_of_optimum"] for row in rows if row["track"] == "no search"]
    return Number("greatest share of the offline optimum of a method without search [-]",
                  float(max(simple)))  # fmt: skip


OPTIMUM = "reference", "offline optimum", ""
"""Track, method and use of money of the reference."""

AGENT = "no search", "agent", "in order"
"""The same of the agent that ships with the package."""


def scores(
    course: Course,
    seed: int,
    budget: float,
    best: dict[str, str],
    thresholds: Mapping[str, Policy],
) -> dict[tuple[str, str, str], float]:
    """Return the reward of an episode of each method, by track, method and use of money."""
    out = {}
    for name, policy in layout_policies(course, best).items():
        out["no search", name, "in order"] = course.play(seed, budget, policy)
        if name != "nothing":
            out["no search", name, "shared"] = course.play(seed, budget, shared(policy))
    for name, policy in thresholds.items():
        out["no search", name, "in order"] = course.play(seed, budget, policy)
    out[AGENT] = course.play(seed, budget, lambda env, pool: course.agent.layout(env))
    for name, method in (
        ("integer programme", programme.optimum),
        ("worst section first", programme.worst_first),
    ):
        reward = course.planned(seed, budget, lambda known: known.front, SEEN, method)
        out["search", name, ""] = reward
    out[OPTIMUM] = course.planned(
        seed, budget, lambda known: known.layouts, None, programme.optimum
    )
    return out


if __name__ == "__main__":
    main(run)
