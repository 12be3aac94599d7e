"""The worst releases of a study: those with the most energy on the road, and failures of barriers.

They are written as a table and as a picture of their trajectories. The seed and the event of a
release are those of `rigdda replay`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rigdda.app.reports import pictures
from rigdda.app.reports.tables import write_rows
from rigdda.app.reports.wording import figure
from rigdda.app.studies import Study
from rigdda.files import remove_results

WORST_FILES = ("worst.csv", "worst.png")
"""Files with the worst releases, beside those of the study."""

ON_ROAD, FAILURE = "most energy on the road", "failure of a barrier"
"""Why a release is among the worst."""


class WorstRelease(NamedTuple):
    """A release that is among the worst of its layout."""

    layout: str
    """Name of the layout."""
    why: str
    """`ON_ROAD` or `FAILURE`."""
    event: str
    seed: int
    energy: float
    """Greatest kinetic energy on the road [kJ per metre of width]."""
    volume: float
    """Volume that came onto the road [m3]."""


def worst(rows: Sequence[Mapping[str, str]], count: int) -> list[WorstRelease]:
    """Return the worst releases in the rows of a study.csv.

    Parameters
    ----------
    rows : sequence of dict of str to str
        The rows, with the columns layout, event, seed, max_energy_on_road [J/m], road_volume [m3],
        and barrier_0_failed and so on.
    count : int
        Greatest number of releases of each layout and reason.

    Returns
    -------
    list of WorstRelease
        For each layout those with the most energy on the road, of the releases in which rock comes
        onto it, and those in which a barrier fails, the most energy on the road first.
    """
    found = []
    for layout in dict.fromkeys(row["layout"] for row in rows):
        own = [_release(row) for row in rows if row["layout"] == layout]
        order = sorted(own, key=lambda one: (-one.energy, -one.volume, one.event, one.seed))
        for why in (ON_ROAD, FAILURE):
            these = [one for one in order if (one.why == FAILURE if why == FAILURE else _came(one))]
            found += [one._replace(why=why) for one in these[:count]]
    return found


def _came(one: WorstRelease) -> bool:
    return one.volume > 0.0 or one.energy > 0.0


def _release(row: Mapping[str, str]) -> WorstRelease:
    """Return the release of a row; its reason is a failure if there is one."""
    failed = any(
        text == "True"
        for name, text in row.items()
        if name.startswith("barrier_") and name.endswith("_failed")
    )
    energy = 1e-3 * (float(row["max_energy_on_road"] or "nan"))
    energy = 0.0 if math.isnan(energy) else energy
    return WorstRelease(
        row["layout"], FAILURE if failed else ON_ROAD, row["event"], int(row["seed"]), energy,
        float(row["road_volume"] or 0.0),
    )  # fmt: skip


def write(folder: Path, study: Study, rows: Sequence[Mapping[str, str]], count: int) -> list[str]:
    """Write the table and the picture of the worst releases, and return the names of the files.

    Without any such release there is a table without rows, and no picture.

    Raises
    ------
    Diverged
        If a simulation for the trajectories diverges.
    """
    found = worst(rows, count)
    fields = ("layout", "why", "event", "seed", "energy_on_road", "road_volume")
    table: list[dict[str, Any]] = [dict(zip(fields, one, strict=True)) for one in found]
    write_rows(folder / WORST_FILES[0], table, fields)
    if not found:
        remove_results(folder, WORST_FILES[1:])
        return [WORST_FILES[0]]
    panels = []
    for one in found:
        layout = study.layouts[one.layout]
        way = pictures.trajectories(study.site, layout, one.event, [one.seed])
        told = f"{one.layout}: {one.why}\n{one.event}, seed {one.seed}"
        panels.append(pictures.Panel(f"{told}, {figure(one.energy)} kJ/m", layout, [way]))
    pictures.slopes(folder / WORST_FILES[1], study.site, study.site.barrier_zone, panels)
    return list(WORST_FILES)
