"""Designers on many problems, what each found verified on releases that none of them has seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents import limits
from agents.protocol import Designer
from agents.store import Store
from agents.tables import empty_table
from agents.verify import verify
from envs import DesignProblem, Evaluation, fidelity
from envs.evaluation import Interval, student_interval
from rigdda import check, sites

if TYPE_CHECKING:
    from rich.table import Table

Tick = Callable[[int, str], None]


@dataclass(frozen=True, slots=True)
class Score:
    """What a designer found for a problem.

    Parameters
    ----------
    site, designer : str
        Names.
    simulations : int
        Releases that the designer used.
    nothing, built : Evaluation
        No barrier and the found layout, verified on the same unseen releases.
    """

    site: str
    designer: str
    simulations: int
    nothing: Evaluation
    built: Evaluation

    @property
    def gain(self) -> float:
        """What the layout takes off the objective."""
        return self.nothing.objective - self.built.objective

    def row(self) -> dict[str, Any]:
        """Return the score as a row of a CSV file."""
        e = self.built
        return {
            "site": self.site,
            "designer": self.designer,
            "simulations": self.simulations,
            "releases": len(e.seeds),
            "nothing": self.nothing.objective,
            "objective": e.objective,
            "objective_low": e.ci[0],
            "objective_high": e.ci[1],
            "gain": self.gain,
            "debris": e.debris,
            "cost": e.cost,
            "barriers": len(e.layout),
        }


def unseen(count: int) -> list[DesignProblem]:
    """Return the problems of random sites that no training sees, at fidelity "fast".

    The first 20 are the list of test sites; from there on their seeds go on.

    Raises
    ------
    BadInput
        If the number is below 1 or above `limits.SITES`.
    """
    first = sites.TEST_SEEDS.start
    seeds = range(first, first + check.integer("sites", count, 1, limits.SITES))
    return [DesignProblem(fidelity.at(sites.random(seed), "fast")) for seed in seeds]


def sit(
    problems: Sequence[DesignProblem],
    designers: Mapping[str, Designer],
    simulations: int,
    releases: int,
    seed: int,
    store: Store,
    tick: Tick,
) -> list[Score]:
    """Return the score of every designer on every problem, each with so many simulations.

    Raises
    ------
    BadInput, Diverged
        As the designers do.
    """
    scores: list[Score] = []
    for posed in problems:
        nothing = verify(posed, (), releases, seed, store)
        for name, design in designers.items():
            tick(len(scores), f"{posed.site.name}: {name}")
            found = design(posed, simulations, seed, None, store)
            built = verify(posed, found.layout, releases, seed, store)
            scores.append(Score(posed.site.name, name, found.simulations, nothing, built))
    return scores


def gains(scores: Sequence[Score], designer: str) -> list[float]:
    """Return what a designer took off the objective, site by site."""
    return [score.gain for score in scores if score.designer == designer]


def debris(scores: Sequence[Score], designer: str) -> NDArray[np.float64]:
    """Return the debris fractions behind a designer's layouts, (sites, releases)."""
    own = [score.built.outcomes for score in scores if score.designer == designer]
    return np.array([[outcome.debris_fraction for outcome in outcomes] for outcomes in own])


def ahead(scores: Sequence[Score], designer: str, other: str) -> tuple[float, Interval, Interval]:
    """Return how much more a designer takes off the objective than another, and two intervals.

    Over sites: what holds for any site like these. Over releases: what holds for these very sites,
    of which each was verified on so many releases; sites weigh alike.
    """
    more = np.subtract(gains(scores, designer), gains(scores, other))
    apart = (debris(scores, other) - debris(scores, designer)).mean(axis=0)
    these = student_interval(more.mean() + apart - apart.mean())
    return float(more.mean()), student_interval(more), these


def table(scores: Sequence[Score]) -> Table:
    """Return the table of designers: means over sites with their 95 % intervals."""
    names = list(dict.fromkeys(score.designer for score in scores))
    beyond = f"beyond {names[0]}"
    out = empty_table(
        ("designer", "releases", "objective", "fall (95 %)", f"{beyond} (any site)",
         f"{beyond} (these sites)")
    )  # fmt: skip
    nothing = float(np.mean([s.nothing.objective for s in scores if s.designer == names[0]]))
    out.add_row("no barrier", "0", f"{nothing:.3f}", "-", "-", "-")
    for name in names:
        own = [score for score in scores if score.designer == name]
        used = round(float(np.mean([score.simulations for score in own])))
        objective = float(np.mean([score.built.objective for score in own]))
        fall = gains(scores, name)
        more, any_site, these = ahead(scores, name, names[0])
        words = [_words(more, any_site), _words(more, these)] if name != names[0] else ["-", "-"]
        fallen = _words(float(np.mean(fall)), student_interval(fall))
        out.add_row(name, f"{used}", f"{objective:.3f}", fallen, *words)
    return out


def _words(mean: float, interval: Interval) -> str:
    low, high = interval
    half = 0.5 * (high - low)
    return f"{mean:.3f} ± {half:.3f}" if np.isfinite(half) else f"{mean:.3f}"
