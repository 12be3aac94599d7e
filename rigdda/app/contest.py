"""Comparison of designers on many sites, with layouts verified on releases that no search used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda import check, sites
from rigdda.agents.designers.protocol import Designer, verify
from rigdda.agents.designers.store import Store
from rigdda.app.reports.tables import empty_table
from rigdda.app.reports.wording import euros, percent, span
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.intervals import student_interval

if TYPE_CHECKING:
    from rich.table import Table

Tick = Callable[[int, str], None]


@dataclass(frozen=True, slots=True)
class Score:
    """The result of a designer on a site.

    Parameters
    ----------
    site, designer : str
        Their names.
    simulations : int
        Number of releases that the designer used.
    nothing, built : Evaluation
        Evaluations of no barrier and of the layout found, verified on the same new releases.
    """

    site: str
    designer: str
    simulations: int
    nothing: Evaluation
    built: Evaluation

    @property
    def gain(self) -> float:
        """Reduction of Z by the layout [EUR per metre of road and year]."""
        return self.nothing.objective - self.built.objective

    def row(self) -> dict[str, Any]:
        """Return the score as a row of a CSV file; money in EUR per metre of road and year."""
        e = self.built
        return {
            "site": self.site,
            "designer": self.designer,
            "simulations": self.simulations,
            "releases": e.releases,
            "nothing": self.nothing.objective,
            "objective": e.objective,
            "objective_low": e.ci[0],
            "objective_high": e.ci[1],
            "gain": self.gain,
            "capital": e.capital,
            "harm": e.harm,
            "repair": e.repair,
            "debris_share": e.debris_share,
            "barriers": len(e.layout),
        }


def site_names(split: str, count: int) -> list[str]:
    """Return the names of the first sites of a split.

    Raises
    ------
    BadInput
        If there is no such split, or if it has fewer sites.
    """
    names = sites.split(split)
    return names[: check.integer("sites", count, 1, len(names))]


def hold(
    names: Sequence[str],
    designers: Mapping[str, Designer],
    simulations: int,
    releases: int,
    seed: int,
    store: Store,
    tick: Tick,
) -> list[Score]:
    """Return the score of every designer on every site.

    Parameters
    ----------
    names : sequence of str
        Names of the sites.
    designers : mapping of str to Designer
        The designers by name.
    simulations : int
        Number of releases that each designer may simulate on a site.
    releases : int
        Number of releases for the verification of each layout.
    seed : int
        Seed of the searches and of the verification.
    store : Store
        Store of evaluations, from which an interrupted run continues.
    tick : callable
        Called with the number of completed searches and a description.

    Raises
    ------
    BadInput, Diverged
        The same errors as the designers.
    """
    scores: list[Score] = []
    for site in names:
        problem = DesignProblem(site)
        nothing = verify(problem, (), releases, seed, store)
        for name, design in designers.items():
            tick(len(scores), f"{site}: {name}")
            found = design(problem, simulations, seed, None, store)
            built = verify(problem, found.layout, releases, seed, store)
            scores.append(Score(site, name, found.simulations, nothing, built))
    return scores


def table(scores: Sequence[Score]) -> Table:
    """Return the table of designers with means over sites [EUR per metre of road and year].

    "behind the best" is the difference of Z from the best designer of each site, or from no barrier
    if that is better. "share" is the total gain of a designer divided by the total gain of the best
    designers; it is not defined if no designer gains.
    """
    head = ("designer", "releases", "Z", "fall of Z (95 %)", "behind the best (95 %)", "share")
    out = empty_table(head)
    names = list(dict.fromkeys(score.designer for score in scores))
    gains = {n: np.array([s.gain for s in scores if s.designer == n]) for n in names}
    best = np.maximum.reduce([*gains.values(), np.zeros(len(gains[names[0]]))])
    nothing = np.mean([s.nothing.objective for s in scores if s.designer == names[0]])
    out.add_row(
        "nothing", "0", euros(float(nothing)), "-", *_behind(best), "0 %" if best.any() else "-"
    )
    for name in names:
        own = [score for score in scores if score.designer == name]
        used = round(float(np.mean([score.simulations for score in own])))
        z = float(np.mean([score.built.objective for score in own]))
        share = percent(float(gains[name].sum() / best.sum())) if best.any() else "-"
        fall, behind = _behind(gains[name]), _behind(best - gains[name])
        out.add_row(name, f"{used:,}", euros(z), *fall, *behind, share)
    return out


def _behind(values: np.ndarray) -> tuple[str]:
    """Return the mean over sites and its interval as text."""
    interval = student_interval(values)
    words = f" ({span(interval)})" if np.isfinite(interval).all() else ""
    return (f"{euros(float(values.mean()))}{words}",)
