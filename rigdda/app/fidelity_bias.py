"""Bias and speed-up of the fidelity "fast" relative to "full" on a site."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigdda import Layout, Site
from rigdda.agents.designers import constant, rule
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import euros, span, unchanged
from rigdda.envs import DesignProblem, Evaluation, problem
from rigdda.envs.intervals import Mean
from rigdda.seeds import release_seeds

if TYPE_CHECKING:
    from rich.table import Table

RULE_RELEASES = 512
"""Number of releases that the rule may simulate."""


@dataclass(frozen=True, slots=True)
class Bias:
    """One layout at both fidelities.

    Parameters
    ----------
    name : str
        Name of the layout.
    full, fast : Evaluation
        Its evaluation at each fidelity, on releases with the same seeds.
    """

    name: str
    full: Evaluation
    fast: Evaluation

    @property
    def bias(self) -> Mean:
        """Z at "fast" minus Z at "full" [EUR per metre of road and year].

        Its interval does not make use of the common seeds, since the two fidelities soon differ in
        the course of a release.
        """
        fast, full = (Mean(e.objective, *e.ci) for e in (self.fast, self.full))
        return fast.minus(full)

    @property
    def gain(self) -> float:
        """Processor time of a release at "full" divided by that at "fast" [-]."""
        return _each(self.full) / _each(self.fast)


def _each(evaluation: Evaluation) -> float:
    """Return the processor time of a simulated release [s], or NaN if none was simulated."""
    return evaluation.seconds / evaluation.simulated if evaluation.simulated else math.nan


def layouts(site: Site, seed: int) -> dict[str, Layout]:
    """Return the layouts for the comparison: no barrier, the constant and the rule."""
    problem = DesignProblem(site)
    return {
        "nothing": (),
        "constant": constant.design(problem, 2 * len(site.events), seed).layout,
        "rule": rule.design(problem, RULE_RELEASES, seed).layout,
    }


def compare(site: Site, releases: int, seed: int, tick: Callable[[int, str], None]) -> list[Bias]:
    """Evaluate every layout at both fidelities, on `releases` releases each.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    seeds = release_seeds("verification", seed, releases)
    out, done = [], 0
    for name, layout in layouts(site, seed).items():
        found = {}
        for level in problem.FIDELITIES:
            tick(done, f"{level}: {name}")
            found[level] = DesignProblem(site, fidelity=level).evaluate(layout, seeds)
            done += releases
        out.append(Bias(name, found["full"], found["fast"]))
    return out


def write(path: Path, site: Site, found: Sequence[Bias]) -> None:
    """Write a CSV file with one row per layout; costs are in EUR per metre of road and year."""
    rows = []
    for c in found:
        row: dict[str, Any] = {"site": site.name, "case": c.name, "releases": c.full.releases}
        row["layout"] = "; ".join(b.label for b in c.full.layout) or unchanged(site)
        for name, e in (("full", c.full), ("fast", c.fast)):
            row |= {f"z_{name}": e.objective, f"{name}_low": e.ci[0], f"{name}_high": e.ci[1]}
        row |= {"bias": c.bias.value, "bias_low": c.bias.low, "bias_high": c.bias.high}
        row |= {"seconds_full": _each(c.full), "seconds_fast": _each(c.fast), "gain": c.gain}
        rows.append(row)
    write_rows(path, rows)


def table(found: Sequence[Bias]) -> Table:
    """Return the table of the comparison, at most 80 characters wide."""
    out = empty_table(("layout", "Z full", "Z fast", "fast - full (95 %)", "CPU [ms]", "gain"))
    for c in found:
        out.add_row(
            c.name,
            euros(c.full.objective),
            euros(c.fast.objective),
            f"{c.bias.value:+.3g} ({span(c.bias.interval)})",
            f"{1e3 * _each(c.full):.2f} / {1e3 * _each(c.fast):.2f}",
            f"{c.gain:.1f}",
        )
    return out
