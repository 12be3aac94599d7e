"""Simple methods in the environment `rigdda/Corridor-v0`, without a search.

`python -m experiments.corridor_baselines [--quick] [--out DIR]` plays corridors of the test split.
The layout of a section is nothing, the best constant or the engineering rule. Money is either
shared (a section may spend the money left per metre of road left, for each of its metres) or spent
in the order of the sections until it ends. All methods play the same corridors with the same
releases. The table has the mean relative reduction of the annual cost by budget, with 95 %
intervals over corridors.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.script import Number, interval, main, say, write
from rigdda import Layout
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.rule import answer
from rigdda.envs import DesignProblem
from rigdda.envs.corridor_environment import CorridorDesign

BUDGETS = (50.0, 200.0, 800.0)
"""Budgets per metre of road [EUR/m]."""

CORRIDORS, SECTIONS, RELEASES = 8, 12, 400
"""Number of corridors for each budget, of their sections, and of releases in each section."""


def _nothing(problem: DesignProblem) -> Layout:
    return ()


def _constant(problem: DesignProblem) -> Layout:
    return constant(problem, Menu(problem))


def _rule(problem: DesignProblem) -> Layout:
    return answer(problem).layout


LAYOUTS: dict[str, Callable[[DesignProblem], Layout]] = {
    "nothing": _nothing,
    "constant": _constant,
    "rule": _rule,
}


def play(env: CorridorDesign, seed: int, budget: float, method: str, shared: bool) -> float:
    """Return the sum of rewards of an episode."""
    env.reset(seed=seed, options={"budget": budget})
    total, ended = 0.0, False
    while not ended:
        problem = env.problem
        layout = LAYOUTS[method](problem)
        if shared:
            place = len(env.evaluations)
            metres = sum(section.length for section in env.placed[place:])
            if problem.site.capital(layout) > (env.budget - env.spent) / metres:
                layout = ()
        action = env.slots.encode(problem, layout)
        _, reward, ended, _, _ = env.step(action)
        total += reward
    return total


def run(quick: bool, out: Path) -> Number:
    """Play all methods and write the table."""
    corridors, sections, releases = (2, 3, 20) if quick else (CORRIDORS, SECTIONS, RELEASES)
    env = CorridorDesign("test", sections=sections, releases=releases)
    rows = []
    for budget in BUDGETS[: 1 if quick else None]:
        for method in LAYOUTS:
            for shared in (True, False) if method != "nothing" else (True,):
                found = [play(env, seed, budget, method, shared) for seed in range(corridors)]
                mean, half = interval(found)
                money = "shared" if shared else "in order"
                rows.append(
                    {
                        "budget": budget,
                        "method": method,
                        "money": money,
                        "reduction": mean,
                        "half_width": half,
                        "corridors": corridors,
                    }
                )
                say(f"{budget:g} EUR/m, {method}, {money}: {mean:.3f} +- {half:.3f}")
    write(out / "corridor_baselines.csv", rows)
    best = float(np.max([row["reduction"] for row in rows]))
    return Number("greatest mean reduction of a simple method [-]", best)


if __name__ == "__main__":
    main(run)
