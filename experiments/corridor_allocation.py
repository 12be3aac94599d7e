"""Allocation of releases to the layouts of a corridor: at the margin, or evenly to all.

`python -m experiments.corridor_allocation [--quick] [--out DIR]` replays the choice of layouts for
corridors of test sites. The stored outcomes of each layout are the population, from which releases
are drawn with replacement, so that the best choice is known. A corridor has eight sections of
random lengths. `rigdda.agents.corridor.planning.Planner` evaluates the layouts with some releases
per section, at the margin or evenly, and chooses for budgets of 100, 200 and 400 EUR per metre of
road. The table has the gain as a share of that of the best choice, with 95 % intervals over
corridors, and the differences from an even spread of the same number of releases and of twice as
many.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from experiments.corridor_pools import FOLDER, Pool, pools
from experiments.script import Number, interval, main, say, write
from rigdda import Corridor, CorridorSection, Layout
from rigdda.agents.corridor import programme
from rigdda.agents.corridor.planning import CHOICE_SHARE, Option, Planner
from rigdda.agents.corridor.programme import Options
from rigdda.envs import CorridorProblem, Evaluation

BUDGETS = (100.0, 200.0, 400.0)
"""Budgets per metre of road [EUR/m]."""

SITES, RELEASES = 10, 400
"""Number of test sites, and of stored releases of each layout."""

SECTIONS = 8
"""Number of sections of a corridor."""

SPREAD = (120, 240, 480, 960, 1_920)
"""Numbers of releases per section for the choice."""

CORRIDORS, REPEATS = 10, 8
"""Number of corridors, and of repetitions of each."""


class Population:
    """A corridor whose layouts are known from stored outcomes."""

    def __init__(self, available: Sequence[Pool], sections: int, seed: int):
        rng = np.random.default_rng(seed)
        chosen = rng.choice(len(available), sections, replace=False).tolist()
        self.pools = [available[i] for i in chosen]
        lengths = np.round(rng.uniform(50.0, 300.0, sections), 1).tolist()
        rows = [
            CorridorSection(own.problem.site, length, own.problem.site.name)
            for own, length in zip(self.pools, lengths, strict=True)
        ]
        budgets = tuple(each * sum(lengths) for each in BUDGETS)
        self.problem = CorridorProblem(Corridor(f"corridor {seed}", tuple(rows), budgets))
        self.layouts = [own.front() for own in self.pools]

    @cached_property
    def truth(self) -> Options:
        """The options with the costs of the population."""
        planner = Replay(self, 1_000, 0, False)
        planner.start()
        for s, options in enumerate(planner.fronts):
            problem = self.problem.problems[s]
            for option in options[1:]:
                option.add(problem, self.pools[s].outcomes(option.layout))
            options[0].known = problem.nothing
        return planner.options()

    def share(self, estimated: Options) -> float:
        """Return the gain of the choices from estimates as a share of that of the best choices."""
        gained = best = 0.0
        for budget in self.problem.corridor.budgets:
            gained += self.truth.gain(programme.optimum(estimated, budget))
            best += self.truth.gain(programme.optimum(self.truth, budget))
        return gained / best


class Replay(Planner):
    """A planner whose releases are drawn from a population with replacement."""

    def __init__(self, population: Population, releases: int, seed: int, margin: bool):
        super().__init__(population.problem, int(releases / CHOICE_SHARE), seed, margin=margin)
        self._population, self._repeat = population, seed
        self._drawn: dict[tuple[int, str], list[int]] = {}

    def start(self) -> None:
        """Take the layouts of the population as the fronts."""
        for own, layouts in zip(self._population.pools, self._population.layouts, strict=True):
            site = own.problem.site
            self.fronts.append([Option(k, site.capital(k), site.annual(k)) for k in layouts])

    def estimated(self) -> Options:
        """Return the options with their estimated costs after the evaluations for the choice."""
        self.start()
        self.compare()
        return self.options()

    def evaluate(self, stream: str, wanted: Sequence[tuple[int, int, int]]) -> list[Evaluation]:
        """Evaluate options on drawn releases; the layouts of a section share them."""
        return [self._evaluation(s, self.fronts[s][k], count) for s, k, count in wanted]

    def _evaluation(self, s: int, option: Option, count: int) -> Evaluation:
        own, problem = self._population.pools[s], self.problem.problems[s]
        outcomes = own.outcomes(option.layout)
        seen = dict.fromkeys(problem.site.event_names, 0)
        if option.known is not None:
            seen = {event: chance.releases for event, chance in option.known.reach.items()}
        found = []
        for event in problem.plan(range(count)):
            found.append(outcomes[self._draw(s, event, seen[event], own, option.layout)])
            seen[event] += 1
        return problem.judge(option.layout, found)

    def _draw(self, s: int, event: str, place: int, own: Pool, layout: Layout) -> int:
        """Return the index of the release that is drawn at a place of the order of an event."""
        if (s, event) not in self._drawn:
            there = [i for i, o in enumerate(own.outcomes(layout)) if o.event == event]
            number = self.problem.problems[s].site.event_names.index(event)
            rng = np.random.default_rng([self._repeat, s, number])
            self._drawn[s, event] = rng.choice(there, 20_000).tolist()
        return self._drawn[s, event][place]


def run(quick: bool, out: Path) -> Number:
    """Replay all corridors and write the table."""
    sites, releases, corridors, repeats = (4, 60, 2, 2) if quick else (
        SITES, RELEASES, CORRIDORS, REPEATS,
    )  # fmt: skip
    spread = SPREAD[:2] if quick else SPREAD
    folder = out / "pools" if quick else FOLDER
    available = pools("test", sites, releases, folder)
    found: dict[tuple[str, int], list[float]] = {}
    for number in range(corridors):
        population = Population(available, min(SECTIONS, sites), number)
        for each in spread:
            for name, margin in (("evenly", False), ("at the margin", True)):
                shares = [
                    population.share(Replay(population, each, 1 + r, margin).estimated())
                    for r in range(repeats)
                ]
                found.setdefault((name, each), []).append(float(np.mean(shares)))
        say(f"corridor {number + 1} of {corridors}")
    rows = table(found, corridors)
    write(out / "corridor_allocation.csv", rows)
    last = [row for row in rows if not np.isnan(row["ahead_of_twice"])][-1]
    return Number(
        f"upper limit of the share gained with {last['releases_per_section']} releases per section "
        "at the margin, less that of an even spread of twice as many [-]",
        last["ahead_of_twice"] + last["ahead_of_twice_half_width"], low=0.0,
    )  # fmt: skip


def table(found: dict[tuple[str, int], list[float]], corridors: int) -> list[dict[str, Any]]:
    """Return a row for each way and number of releases."""
    rows = []
    for (name, each), shares in found.items():
        mean, half = interval(shares)
        row: dict[str, Any] = {
            "releases_per_section": each, "allocation": name, "share": mean,
            "half_width": half, "corridors": corridors,
            "ahead_of_same": np.nan, "ahead_of_same_half_width": np.nan,
            "ahead_of_twice": np.nan, "ahead_of_twice_half_width": np.nan,
        }  # fmt: skip
        for title, number in (("same", each), ("twice", 2 * each)):
            even = found.get(("evenly", number))
            if name != "evenly" and even is not None:
                ahead = interval(np.subtract(shares, even))
                row[f"ahead_of_{title}"], row[f"ahead_of_{title}_half_width"] = ahead
        rows.append(row)
    return rows


if __name__ == "__main__":
    main(run)
