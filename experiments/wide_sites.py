"""How far the best layout of a family is behind the best layout of a site, by forecasts.

`python -m experiments.wide_sites [--quick] [--out DIR]`. On training sites with the ranges of the
first version of the splits (`narrow`) and with wide ranges (`wide`), the value network forecasts Z
of all candidate layouts (`rigdda.agents.learning.relative_layouts`). Nothing but releases without
barriers is simulated. The best layout of the family has the least mean over the other sites of the
family (leave one out). A layout that cannot be built counts as no barrier in this mean, and the
next best that can be built takes its place. For each site the table also contains the least
forecasts of single barriers and of pairs, which tell whether a second barrier matters.

Writes wide_sites.csv, one row per site. An interrupted run is resumed. Judged by the mean distance
of the best layout of the family to the best of all candidates on wide sites, over Z without
barriers. A policy that chooses from these layouts cannot gain more than this over the family.
Forecasts of wide sites are read from the working folder of `experiments.known_forecasts`, if they
are there. Sites where Z without barriers is below `forecasts.LEAST_COST` are left out.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.known_forecasts import WORK, folder_of
from experiments.made_with import MADE_WITH, resumed
from experiments.script import Number, interval, main, say, write
from rigdda import sites
from rigdda.agents.learning import forecasts
from rigdda.agents.learning.forecasts import SiteForecasts
from rigdda.agents.learning.relative_layouts import candidates

MASSES = "shu-hwa"
"""Family that is left out, since its sites are the only ones with large masses."""
SITES, QUICK_SITES = {"wide": 72, "narrow": 24}, {"wide": 18, "narrow": 12}
"""Number of the first training sites of each version of the splits."""
BAR = 0.08
"""Least mean distance on wide sites [-]."""


def names(ranges: str, count: int) -> list[str]:
    """Return the names of the sites of a version of the splits."""
    first = sites.split("wide-train" if ranges == "wide" else "train")[:count]
    return [name for name in first if sites.family_of(name) != MASSES]


def row(name: str, ranges: str, own: SiteForecasts) -> dict[str, Any]:
    """Return the row of a site: least forecasts, and those of all layouts."""
    catalogue = candidates()
    count = np.array([len(json.loads(layout)) for layout in catalogue])
    least = {k: float(np.nanmin(np.where(count == k, own.z, np.nan), initial=1.0)) for k in (1, 2)}
    return {
        "site": name, "family": sites.family_of(name), "ranges": ranges, **MADE_WITH,
        "z_nothing": own.nothing, "least": float(np.nanmin(own.z)),
        "single": least[1], "pair": least[2],
        "z": json.dumps([None if np.isnan(z) else round(float(z), 4) for z in own.z]),
    }  # fmt: skip


def of_family(rows: list[Any]) -> NDArray[np.float64]:
    """Return the forecast Z of the best layout of the family, chosen on the other sites, (n,)."""
    z = np.array([json.loads(r["z"]) for r in rows], dtype=np.float64)
    counted = np.where(np.isfinite(z), z, 1.0)
    out = np.ones(len(rows))
    for i in range(len(rows)):
        order = np.argsort(np.delete(counted, i, axis=0).mean(axis=0), kind="stable")
        out[i] = next(z[i, j] for j in order if np.isfinite(z[i, j]))
    return out


def column(rows: list[Any], name: str) -> NDArray[np.float64]:
    """Return a column of numbers."""
    return np.array([float(r[name]) for r in rows])


def gaps(rows: list[Any], ranges: str) -> tuple[NDArray[np.float64], list[str]]:
    """Return the distance of the best of the family on every site, and lines about them [-]."""
    found, lines = [], []
    for family in dict.fromkeys(r["family"] for r in rows if r["ranges"] == ranges):
        own = [r for r in rows if r["family"] == family and r["ranges"] == ranges]
        if len(own) < 2:
            continue
        behind = of_family(own) - column(own, "least")
        pairs = column(own, "single") - np.minimum(column(own, "pair"), column(own, "single"))
        found.append(behind)
        lines.append(
            f"{ranges} {family}: {len(own)} sites, least {column(own, 'least').mean():.3f}, "
            f"best of the family {behind.mean():.3f} behind, pairs gain {pairs.mean():.3f}"
        )
    every = np.concatenate(found) if found else np.zeros(0)
    return every, lines


def run(quick: bool, out: Path) -> Number:
    """Write wide_sites.csv."""
    path = out / "wide_sites.csv"
    rows: list[Any] = resumed(path)
    known, folder = {r["site"] for r in rows}, folder_of(WORK)
    for ranges, count in (QUICK_SITES if quick else SITES).items():
        asked = [name for name in names(ranges, count) if name not in known]
        for name in asked:
            say(name)
            found = forecasts.collect([name], candidates(), folder, lambda *_: None)
            rows += [row(name, ranges, own) for own in found.values()]
            write(path, rows)
    lines, ends = [], {}
    for ranges in ("narrow", "wide"):
        ends[ranges], told = gaps(rows, ranges)
        mean, half = interval(ends[ranges])
        own = [r for r in rows if r["ranges"] == ranges]
        gain = column(own, "single") - np.minimum(column(own, "pair"), column(own, "single"))
        pairs = "pairs gain {:.3f} +- {:.3f}".format(*interval(gain))
        lines += [*told, f"{ranges}: {mean:.3f} +- {half:.3f} behind, {pairs}"]
    what = "mean distance of the best layout of the family to that of the site, wide ranges"
    return Number(what, float(ends["wide"].mean()), low=BAR, note="\n".join(lines))


if __name__ == "__main__":
    main(run)
