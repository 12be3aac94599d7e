"""How far the best layout of a family is behind the best layout of a site, by forecasts.

`python -m experiments.wide_sites [--quick] [--out DIR]`. Instances of each family without large
masses are generated with the ranges of the splits (`narrow`) and with wide ranges (`wide`), see
`rigdda.model.site_generator`. For each site the value network forecasts Z of a catalogue of
relative layouts, of all single barriers and of pairs. The best layout of the family has the least
mean over the other sites of the family (leave one out). A layout that cannot be built counts as no
barrier in this mean, and the next best that can be built takes its place. Nothing but releases
without barriers is simulated.

Writes wide_sites.csv, one row per site. An interrupted run is resumed. Judged by the mean distance
of the best layout of the family to the best layout of the catalogue on wide sites, over Z without
barriers. A policy that chooses from the catalogue cannot gain more than this over the family.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.script import Number, interval, main, say, write
from experiments.search_gain import load
from rigdda import MECHANICS, sites
from rigdda.agents.designers.catalogue import ensemble
from rigdda.agents.designers.forecast import Forecast, forecast_seeds, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.race import forecasts_of, single_barriers
from rigdda.agents.learning.forecasts import of_site
from rigdda.agents.learning.relative_layouts import candidates
from rigdda.envs import DesignProblem
from rigdda.model.site_generator import NARROW, WIDE, generate

FAMILIES = ("verge", "bench", "talus", "narrow", "cliff")
SITES, QUICK_SITES = 12, 4
"""Number of sites of each family and range."""
FIRST = 3 * 10**9
"""Number of the first instance, beyond those of the splits and of the exam."""
BAR = 0.08
"""Least mean distance on wide sites [-]."""


def row(family: str, number: int, ranges: str) -> dict[str, Any]:
    """Return the row of a site: least forecasts, and those of all layouts of the catalogue."""
    by = WIDE if ranges == "wide" else NARROW
    site = generate(sites.load(family), f"{family}-{ranges}-{number}", number, by)
    problem = DesignProblem(site)
    menu = Menu(problem)
    crossings = ensemble(site, forecast_seeds(site), menu.stations)
    own = of_site(problem, candidates(), crossings)
    surrogate = forecasts_of(
        Forecast(problem, crossings, value_network()), menu, [], single_barriers(menu)
    )
    every = surrogate.value()
    return {
        "family": family, "ranges": ranges, "number": number, "mechanics": MECHANICS,
        "z_nothing": problem.nothing.objective, "catalogue": float(np.nanmin(own.z)),
        "whole": min(float(every.min(initial=1.0)), 1.0),
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


def run(quick: bool, out: Path) -> Number:
    """Write wide_sites.csv."""
    path = out / "wide_sites.csv"
    rows: list[Any] = load(path)
    known = {(r["family"], r["ranges"], int(r["number"])) for r in rows}
    for ranges in ("wide", "narrow"):
        for number in range(FIRST, FIRST + (QUICK_SITES if quick else SITES)):
            for family in FAMILIES:
                if (family, ranges, number) not in known:
                    say(f"{family} {number}, {ranges}")
                    rows.append(row(family, number, ranges))
                    write(path, rows)
    lines, gaps = [], {}
    for ranges in ("narrow", "wide"):
        parts = []
        for family in FAMILIES:
            own = [r for r in rows if r["family"] == family and r["ranges"] == ranges]
            if len(own) < 2:
                continue
            best = np.array([float(r["catalogue"]) for r in own])
            whole = np.array([float(r["whole"]) for r in own])
            behind = of_family(own) - best
            parts.append(behind)
            whole_gap = float((of_family(own) - whole).mean())
            words = f"{behind.mean():.3f} behind the catalogue, {whole_gap:.3f} behind all"
            lines.append(f"{ranges} {family}: {len(own)} sites, best of the family {words}")
        if not parts:
            continue
        gaps[ranges] = np.concatenate(parts)
        mean, half = interval(gaps[ranges])
        lines.append(f"{ranges}: {mean:.3f} +- {half:.3f}")
    what = "mean distance of the best layout of the family to that of the site, wide ranges"
    return Number(what, float(gaps["wide"].mean()), low=BAR, note="\n".join(lines))


if __name__ == "__main__":
    main(run)
