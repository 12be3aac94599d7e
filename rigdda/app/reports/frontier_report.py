"""The frontier of a missed target as a table, a CSV file and a picture."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigdda import Layout, Site
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.app.reports import pictures
from rigdda.app.reports.tables import bounded, empty_table, write_rows
from rigdda.app.reports.wording import euros, percent, percentage, unchanged
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem

if TYPE_CHECKING:
    from rich.table import Table

FILES = ("frontier.csv", "frontier.png")


def write(folder: Path, problem: DesignProblem, front: Sequence[TriedLayout]) -> None:
    """Write the CSV file and the picture of a frontier, or remove old ones if it is empty."""
    if front:
        write_rows(folder / FILES[0], rows(front))
        draw(folder / FILES[1], problem, front)
        return
    for name in FILES:
        (folder / name).unlink(missing_ok=True)


def rows(front: Sequence[TriedLayout]) -> list[dict[str, Any]]:
    """Return the rows of the CSV file: costs in EUR per metre, Z in EUR per metre and year.

    `reach_bound` is the one-sided 95 % upper bound. Z is empty for a layout that is not verified.
    """
    found = []
    for one in front:
        z = one.verified
        found.append(
            {
                "cost": one.cost,
                "reach": one.reach.probability,
                "reach_bound": one.level,
                "failure": one.failure.probability,
                "failure_bound": one.failure.bound,
                "releases": one.reach.releases,
                "verified": z is not None,
                "objective": z.objective if z else "",
                "objective_low": z.ci[0] if z else "",
                "objective_high": z.ci[1] if z else "",
                "barriers": json.dumps(to_tables(one.layout)),
            }
        )
    return found


def table(site: Site, front: Sequence[TriedLayout]) -> Table:
    """Return the table of a frontier, at most 80 characters wide."""
    out = empty_table(("layout", "to build", "reaches road", "fails", "Z", "of"))
    for one in front:
        z = euros(one.verified.objective) if one.verified else "not verified"
        known = site.standing(one.layout) and one.failure.releases
        fails = percent(one.failure.probability) if known else "-"
        count = f"{one.reach.releases:,}"
        out.add_row(brief(site, one.layout), euros(one.cost), bounded(one.reach), fails, z, count)
    return out


def brief(site: Site, layout: Layout) -> str:
    """Return the kinds and chainages of a layout in words."""
    return " + ".join(f"{b.label} at {b.x:.1f}" for b in layout) or unchanged(site)


def draw(path: Path, problem: DesignProblem, front: Sequence[TriedLayout]) -> None:
    """Write a PNG diagram of P(reach) against the capital cost of the layouts of a frontier."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(pictures.FONT):
        figure = Figure((9.0, 5.4), dpi=pictures.DPI, layout="constrained")
        axes = figure.subplots()
        cost = [one.cost for one in front]
        axes.step(
            cost, [100.0 * one.level for one in front], where="post", color="#0072b2",
            linewidth=1.4, label="95 % upper bound: no layout that was tried is cheaper and lower",
        )  # fmt: skip
        for verified, colour, words in (
            (True, "#0072b2", "P(reach) on the releases of the verification"),
            (False, "#9aa5b1", "P(reach) in the search, not verified"),
        ):
            own = [one for one in front if (one.verified is not None) == verified]
            if own:
                axes.plot([one.cost for one in own],
                          [100.0 * one.reach.probability for one in own], "o", color=colour,
                          label=words)  # fmt: skip
        if problem.targets.reach is not None:
            axes.axhline(100.0 * problem.targets.reach, color="#d0312d", linestyle="--",
                         label=f"target: {percentage(problem.targets.reach)}")  # fmt: skip
        axes.set(xlabel="cost to build [EUR per metre of road]", ylabel="P(reach) [%]")
        axes.set(xlim=(0.0, None), ylim=(0.0, None))
        axes.grid(alpha=0.25)
        figure.legend(loc="outside lower center", ncols=1, frameon=False)
        pictures.save(figure, path)
