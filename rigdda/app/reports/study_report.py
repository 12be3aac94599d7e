"""Tables, CSV files and pictures of a study of given layouts."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout, Site
from rigdda.app.reports import pictures
from rigdda.app.reports.tables import (
    bounded,
    chance_columns,
    empty_table,
    risk_table,
    write_risks,
    write_rows,
)
from rigdda.app.reports.wording import euros, span
from rigdda.envs.comparison import LEAST_PER_EVENT, Difference, difference_of_accounts
from rigdda.envs.cost import Account, Facts, Risk, Sums, learn, stratified
from rigdda.envs.intervals import Estimate, estimate
from rigdda.envs.problem import can_fail

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

STUDY_FILES = ("layouts.csv", "events.csv", "differences.csv", "sections.png", "costs.png")
"""Files besides study.csv."""

QUANTILE = 0.95
"""Quantile of energies in tables [-]."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class StudiedLayout:
    """A layout of a study and its releases.

    Parameters
    ----------
    name : str
        Name of the layout.
    layout : tuple of Barrier
        The barriers.
    found : Account
        Costs and occurrences of its n releases.
    on_road, hit : (n,) array
        Largest energy of a block on the road and of a hit on a barrier in each release [kJ/m]; 0
        without one.
    released : (n,) array
        Volume of rock in each release [m3].
    widths : (n,) array
        Width of each release [m].
    """

    name: str
    layout: Layout
    found: Account
    on_road: Floats
    hit: Floats
    released: Floats
    widths: Floats

    def chance(self, event: str, failed: bool = False) -> Estimate:
        """Return the probability that a block reaches the road, or that a barrier fails."""
        own = self.found.event == event
        happened = self.found.failed if failed else self.found.reached
        return estimate(int((happened & own).sum()), int(own.sum()))

    def energy(self, event: str, hit: bool = False) -> float:
        """Return the 95 % quantile of an energy of an event [kJ/m], NaN if there is none.

        It is taken over those releases in which a block reaches the road or hits a barrier.
        """
        own = (self.hit if hit else self.on_road)[self.found.event == event]
        own = own[own > 0.0]
        return float(np.quantile(own, QUANTILE)) if len(own) else float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class StudyResults:
    """Results of a study.

    Parameters
    ----------
    site : Site
        The site.
    layouts : tuple of StudiedLayout
        The layouts, with the same releases.
    facts : mapping of str to Facts
        Statistics of each event over all layouts.
    """

    site: Site
    layouts: tuple[StudiedLayout, ...]
    facts: Mapping[str, Facts]

    @classmethod
    def of(cls, site: Site, layouts: Sequence[StudiedLayout]) -> StudyResults:
        """Return the results of layouts on a site, with the facts that their releases provide."""
        found = Account.join([one.found for one in layouts])
        released = np.concatenate([one.released for one in layouts])
        widths = np.concatenate([one.widths for one in layouts])
        facts = {}
        for name in site.event_names:
            own = found.event == name
            facts[name] = learn(site, found.of(own), released[own], widths[own], 1.0)
        return cls(site, tuple(layouts), facts)

    def sums(self, one: StudiedLayout) -> Sums:
        """Return the expected harm and repair of a layout and their intervals."""
        return stratified(self.site, one.layout, one.found, self.facts)

    def objective(self, one: StudiedLayout) -> tuple[float, float, float]:
        """Return Z of a layout and the ends of its 95 % interval."""
        annual, both = self.site.annual(one.layout), self.sums(one).both
        return annual + both.value, annual + both.low, annual + both.high

    def risk(self, one: StudiedLayout) -> Risk | None:
        """Return the risk of a layout to the traffic; None if the site has no `[traffic]`."""
        if self.site.traffic is None:
            return None
        return Risk.of(self.site.traffic, self.sums(one).toll)

    def cheapest(self) -> StudiedLayout:
        """Return the layout with the lowest Z."""
        return min(self.layouts, key=lambda one: self.objective(one)[0])

    def difference(self, one: StudiedLayout, two: StudiedLayout) -> Difference | None:
        """Return the difference in Z between two layouts; None with too few releases."""
        counts = [int((one.found.event == name).sum()) for name in self.site.event_names]
        if min(counts) < LEAST_PER_EVENT:
            return None
        layouts, accounts = (one.layout, two.layout), (one.found, two.found)
        return difference_of_accounts(self.site, layouts, accounts, self.facts)


def costs(results: StudyResults) -> Table:
    """Return the table of the costs of each layout [EUR per metre of road and year].

    The last column is the difference in Z from the layout with the lowest Z, with its 95 % interval
    on common releases.
    """
    best = results.cheapest()
    head = ("layout", "Z (95 %)", "capital", "harm", "repair", "to build", "above best")
    out = empty_table(head)
    for one in results.layouts:
        z, low, high = results.objective(one)
        sums, annual = results.sums(one), results.site.annual(one.layout)
        more = None if one is best else results.difference(one, best)
        words = "-" if more is None else f"{euros(more.value)} ({span(more.ci)})"
        parts = map(euros, (annual, sums.harm.value, sums.repair.value))
        build = euros(results.site.capital(one.layout))
        out.add_row(one.name, f"{euros(z)} ({span((low, high))})", *parts, build, words)
    return out


def events(results: StudyResults) -> Table:
    """Return the table of probabilities and energies of each event and layout.

    The energies are 95 % quantiles [kJ per metre of width].
    """
    out = empty_table(("event", "layout", "reaches road", "barrier fails", "on road", "hit"))
    for event in results.site.event_names:
        for i, one in enumerate(results.layouts):
            fallible = can_fail(results.site, one.layout)
            fails = bounded(one.chance(event, failed=True)) if fallible else "-"
            energies = [one.energy(event), one.energy(event, hit=True)]
            words = ["-" if np.isnan(e) else euros(e) for e in energies]
            reach = bounded(one.chance(event))
            out.add_row("" if i else event, one.name, reach, fails, *words)
        out.add_section()
    return out


def risks(results: StudyResults) -> Table | None:
    """Return the table of the risk of each layout to the traffic, or None without traffic."""
    known = _known_risks(results)
    return risk_table(known) if known else None


def _known_risks(results: StudyResults) -> list[tuple[str, Risk]]:
    """Return the risk of each layout to the traffic; empty without traffic."""
    pairs = ((one.name, results.risk(one)) for one in results.layouts)
    return [(name, risk) for name, risk in pairs if risk is not None]


def layout_rows(results: StudyResults) -> list[dict[str, Any]]:
    """Return one row for each layout: Z and its parts in EUR per metre of road and year."""
    rows = []
    for one in results.layouts:
        z, low, high = results.objective(one)
        sums = results.sums(one)
        rows.append(
            {
                "layout": one.name,
                "objective": z,
                "objective_low": low,
                "objective_high": high,
                "capital": results.site.annual(one.layout),
                "harm": sums.harm.value,
                "harm_low": sums.harm.low,
                "harm_high": sums.harm.high,
                "repair": sums.repair.value,
                "repair_low": sums.repair.low,
                "repair_high": sums.repair.high,
                "cost": results.site.capital(one.layout),
                "debris": sums.volume.value,
                "debris_low": sums.volume.low,
                "debris_high": sums.volume.high,
            }
        )
    return rows


def event_rows(results: StudyResults) -> list[dict[str, Any]]:
    """Return one row for each layout and event: probabilities, energies in kJ/m and its cost."""
    rows = []
    for one, name in itertools.product(results.layouts, results.site.event_names):
        row: dict[str, Any] = {"layout": one.name, "event": name}
        for words, failed in (("reach", False), ("failure", True)):
            known = not failed or can_fail(results.site, one.layout)
            row |= chance_columns(words, one.chance(name, failed) if known else None)
        row["energy_on_road_95"] = one.energy(name)
        row["energy_of_hit_95"] = one.energy(name, hit=True)
        row["harm_and_repair"] = results.sums(one).by_event[name]
        row["releases"] = one.chance(name).releases
        rows.append(row)
    return rows


def difference_rows(results: StudyResults) -> list[dict[str, Any]]:
    """Return one row for each pair of layouts: Z of the first minus Z of the second."""
    rows = []
    for one, two in itertools.combinations(results.layouts, 2):
        found = results.difference(one, two)
        if found is not None:
            rows.append(
                {
                    "one": one.name,
                    "two": two.name,
                    "difference": found.value,
                    "low": found.ci[0],
                    "high": found.ci[1],
                    "releases": found.releases,
                    "differ": found.differ,
                }
            )
    return rows


def write(folder: Path, results: StudyResults, seed: int) -> None:
    """Write the CSV files and the pictures of a study.

    Raises
    ------
    Diverged
        If a simulation for the trajectories diverges.
    """
    write_rows(folder / STUDY_FILES[0], layout_rows(results))
    write_rows(folder / STUDY_FILES[1], event_rows(results))
    fields = ("one", "two", "difference", "low", "high", "releases", "differ")
    write_rows(folder / STUDY_FILES[2], difference_rows(results), fields)
    write_risks(folder, _known_risks(results))
    sections(folder / STUDY_FILES[3], results, seed)
    bars(folder / STUDY_FILES[4], results)


def sections(path: Path, results: StudyResults, seed: int) -> None:
    """Write a PNG with the slope and trajectories of the same releases for every layout."""
    site, seeds = results.site, range(seed, seed + pictures.DRAWN_TRAJECTORIES)
    panels = []
    for one in results.layouts:
        shown = [pictures.trajectories(site, one.layout, name, seeds) for name in site.event_names]
        z, low, high = results.objective(one)
        title = f"{one.name}: Z = {euros(z)} ({span((low, high))})"
        panels.append(pictures.Panel(title, one.layout, shown))
    pictures.slopes(path, site, site.barrier_zone, panels)


def bars(path: Path, results: StudyResults) -> None:
    """Write a PNG with bars of the parts of Z of every layout and the interval of Z."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(pictures.FONT):
        size = (9.0, 1.6 + 0.5 * len(results.layouts))
        figure = Figure(size, dpi=pictures.DPI, layout="constrained")
        axes: Axes = figure.subplots()
        names = [one.name for one in results.layouts]
        left = np.zeros(len(names))
        rows = layout_rows(results)
        for part, colour in (("capital", "#0072b2"), ("harm", "#d0312d"), ("repair", "#b8860b")):
            values = np.array([row[part] for row in rows])
            words = "capital and upkeep" if part == "capital" else part
            axes.barh(names, values, left=left, color=colour, label=words)
            left = left + values
        z = np.array([results.objective(one) for one in results.layouts]).T
        spread = np.abs(z[1:] - z[0])
        axes.errorbar(z[0], names, xerr=spread, fmt="none", color="black", capsize=4)
        axes.invert_yaxis()
        axes.set_xlabel("Z [EUR per metre of road and year], with the 95 % interval")
        figure.legend(loc="outside lower center", ncols=3, frameon=False)
        pictures.save(figure, path)


def sentences(results: StudyResults) -> Sequence[str]:
    """Return which differences from the layout with the lowest Z are shown."""
    best, open_ = results.cheapest(), []
    for one in results.layouts:
        found = None if one is best else results.difference(one, best)
        if one is not best and (found is None or found.ci[0] <= 0.0):
            open_.append(one.name)
    if len(results.layouts) < 2:
        return []
    if not open_:
        return [f"{best.name!r} has the lowest Z; these releases show that all others cost more"]
    names = ", ".join(map(repr, open_))
    line = f"{best.name!r} has the lowest Z; these releases do not show that it costs less than"
    return [f"{line} {names}"]
