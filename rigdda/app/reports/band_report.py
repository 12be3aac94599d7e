"""Table, picture and text of the band of a design over the plausible range of the ground."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigdda.app.reports.pictures import DPI, EVENTS, FONT, MARKERS, save
from rigdda.app.reports.tables import empty_table, write_rows
from rigdda.app.reports.wording import euros, percent, span
from rigdda.app.uncertainty.ground_band import Band
from rigdda.envs.problem import MET, MISSED, UNDECIDED

if TYPE_CHECKING:
    from rich.table import Table

FILES = ("band.csv", "band.png")


def rows(band: Band) -> list[dict[str, Any]]:
    """Return one row for each ground and layout."""
    out = []
    for i, sample in enumerate(band.samples):
        for case in sample.cases:
            e = case.evaluation
            row: dict[str, Any] = {"ground": i + 1} | sample.values | {"layout": case.name}
            row |= {"Z": e.objective, "Z_low": e.ci[0], "Z_high": e.ci[1]}
            row |= {"capital": e.capital, "harm": e.harm, "repair": e.repair}
            for event in band.events:
                row[f"P(reach) of {event}"] = e.reach[event].probability
                row[f"P(failure) of {event}"] = e.failure[event].probability
            chosen = case is sample.cases[-1]
            row |= {"releases": e.releases, "state": sample.state if chosen else ""}
            out.append(row)
    return out


def write(folder: Path, band: Band) -> None:
    """Write `FILES` into a folder."""
    write_rows(folder / "band.csv", rows(band))
    draw(folder / "band.png", band)


def table(band: Band) -> Table:
    """Return the table of the least, median and greatest values over the grounds.

    P(reach) is the greatest of the design events on a ground.
    """
    head = ["layout", "Z: median", "least to greatest"]
    if band.events:
        head.append("P(reach)")
    out = empty_table(head)
    for i, case in enumerate(band.samples[0].cases):
        own = [sample.cases[i].evaluation for sample in band.samples]
        z = [e.objective for e in own]
        cells = [case.name, euros(float(np.median(z))), span((min(z), max(z)))]
        if band.events:
            worst = [max(e.reach[name].probability for name in band.events) for e in own]
            cells.append(f"{percent(min(worst), 'down')} to {percent(max(worst), 'up')}")
        out.add_row(*cells)
    return out


def on_target(band: Band) -> str:
    """Return a text that says on how many grounds the targets are met; empty without targets."""
    states = [sample.targets for sample in band.samples if sample.targets is not None]
    if not states:
        return ""
    counts = {state: states.count(state) for state in (MET, UNDECIDED, MISSED)}
    words = ", ".join(f"{state} on {count}" for state, count in counts.items() if count)
    return f"the targets are {words} of {len(states)} grounds"


def verdict(band: Band) -> str:
    """Return a text that says whether the choice survives other grounds."""
    count = len(band.samples)
    best, open_, dearer = (
        round(count * band.share(state)) for state in ("cheapest", "undecided", "dearer")
    )
    words = f"on {best} of {count} grounds, the chosen layout is the cheapest of these"
    if open_:
        words += f"; on {open_}, another one is cheaper by no more than the noise"
    if not dearer:
        return f"{words}: the choice survives"
    lost = [sample for sample in band.samples if sample.state == "dearer"]
    rivals = dict.fromkeys(sample.cheapest.name for sample in lost)
    named = " or ".join(repr(name) for name in rivals)
    most = max(s.cases[-1].priced.objective - s.cheapest.priced.objective for s in lost)
    return (
        f"{words}; on {dearer}, {named} is cheaper by up to {euros(most)} EUR per metre and year: "
        "the choice depends on the ground"
    )


def draw(path: Path, band: Band) -> None:
    """Write the picture: Z of each layout on each ground, ordered by Z without barriers."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    order = sorted(band.samples, key=lambda sample: sample.cases[0].priced.objective)
    x = np.arange(len(order))
    with rc_context(FONT):
        figure = Figure((9.0, 5.0), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        for i, case in enumerate(order[0].cases):
            own = [sample.cases[i].evaluation for sample in order]
            z = np.array([e.objective for e in own])
            ends = np.abs(np.array([e.ci for e in own]).T - z)
            axes.errorbar(
                x + 0.08 * (i - 1.5), z, ends, fmt=MARKERS[i % len(MARKERS)], capsize=3,
                color=EVENTS[i % len(EVENTS)], label=case.name,
            )  # fmt: skip
        axes.set_xticks(x, [str(band.samples.index(sample) + 1) for sample in order])
        axes.set(xlabel=f"ground ({band.source}), by Z without barriers",
                 ylabel="Z [EUR per metre of road and year]")  # fmt: skip
        axes.set_ylim(bottom=0.0)
        axes.grid(axis="y", alpha=0.25)
        figure.legend(loc="outside lower center", ncols=4, frameon=False)
        save(figure, path)
