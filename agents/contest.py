"""Designers on many sites, what each found verified on releases that none of them has seen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda import check, sites
from rigdda.agents.designers.protocol import Designer, verify
from rigdda.agents.designers.store import Store
from rigdda.agents.reports.tables import empty_table
from rigdda.agents.reports.wording import euros, percent, span
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.intervals import student_interval

if TYPE_CHECKING:
    from rich.table import Table

Tick = Callable[[int, str], None]


@dataclass(frozen=True, slots=True)
class Score:
    """What a designer found for a site.

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
        """What the layout takes off Z [EUR per metre of road and year]."""
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


def pose(split: str, count: int) -> list[str]:
    """Return the names of the first sites of a split.

    Raises
    ------
    BadInput
        If there is no such split, or it has fewer sites.
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
    """Return the score of every designer on every site, each with so many releases.

    Raises
    ------
    BadInput, Diverged
        As the designers do.
    """
    scores: list[Score] = []
    for site in names:
        posed = DesignProblem(site)
        nothing = verify(posed, (), releases, seed, store)
        for name, design in designers.items():
            tick(len(scores), f"{site}: {name}")
            found = design(posed, simulations, seed, None, store)
            built = verify(posed, found.layout, releases, seed, store)
            scores.append(Score(site, name, found.simulations, nothing, built))
    return scores


def table(scores: Sequence[Score]) -> Table:
    """Return the table of designers: means over sites [EUR per metre of road and year].

    Behind: of the best of them on each site. Share: of the gain of these best, all sites together.
    """
    head = ("designer", "releases", "Z", "fall of Z (95 %)", "behind the best (95 %)", "share")
    out = empty_table(head)
    names = list(dict.fromkeys(score.designer for score in scores))
    gains = {n: np.array([s.gain for s in scores if s.designer == n]) for n in names}
    best = np.maximum.reduce([*gains.values(), np.zeros(len(gains[names[0]]))])
    nothing = np.mean([s.nothing.objective for s in scores if s.designer == names[0]])
    out.add_row("nothing", "0", euros(float(nothing)), "-", *_behind(best), "0 %")
    for name in names:
        own = [score for score in scores if score.designer == name]
        used = round(float(np.mean([score.simulations for score in own])))
        z = float(np.mean([score.built.objective for score in own]))
        share = gains[name].sum() / best.sum() if best.sum() > 0.0 else 0.0
        fall, behind = _behind(gains[name]), _behind(best - gains[name])
        out.add_row(name, f"{used:,}", euros(z), *fall, *behind, percent(float(share)))
    return out


def _behind(values: np.ndarray) -> tuple[str]:
    """Return a mean over sites and its interval in words."""
    interval = student_interval(values)
    words = f" ({span(interval)})" if np.isfinite(interval).all() else ""
    return (f"{euros(float(values.mean()))}{words}",)
