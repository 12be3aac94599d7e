"""Laws of what the ground takes from a block, fitted and compared in the same way.

Each law of `LAWS` is one line: the values of the ground that it fixes. Friction, restitution and,
where the law has it, rolling resistance are fitted to the 33 runs at Tschamut, with the same sets
of values and the same seeds for all laws. The scatter of friction is that of `meadow` in the
library. The best set of each law is computed again with a shorter step and fresh seeds, and
predicts the contacts at Chant Sura and the catch bench. In addition, one parameter of each law is
fitted to the catch bench alone, with the other values of its site file, and a slab slides down a
plane, where friction alone should act.

Judged by the speed of the slab over that with Coulomb friction, for the law farthest from 1.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from scipy.stats import qmc

from experiments.catch_bench import study as bench
from experiments.catch_bench.study import FITTED, PREDICTED, Variant, within
from experiments.grounds.contacts import mid_slope
from experiments.grounds.reach import SLOWED_AT
from experiments.grounds.study import FACE, FRESH, RANGES, Field, tschamut_figures
from experiments.script import Number, main, say, write
from rigdda import Scene, Settings, Simulation, Site, Surface
from rigdda.app.uncertainty.fit import Floats, scores
from rigdda.app.uncertainty.parameters import Parameter
from rigdda.ground.grounds import GROUNDS
from rigdda.validation.scenes import GRAVITY
from rigdda.validation.slides import slab_scene

LAWS: dict[str, dict[str, Any]] = {
    "none": {"rolling": 0.0, "restitution_speed": None},
    "rolling resistance": {"restitution_speed": None},
    "rolling resistance and falling restitution": {"restitution_speed": SLOWED_AT},
    "falling restitution alone": {"rolling": 0.0, "restitution_speed": SLOWED_AT},
}
"""Values of the ground that each law fixes; the others are fitted."""

PARAMETERS = ("friction_deg", "restitution", "rolling")
"""Fitted parameters; a law without one of them ignores its values."""

SCATTER = GROUNDS["meadow"].friction_sd_deg
"""Standard deviation of friction from release to release, for all laws [deg]."""

SETS, QUICK_SETS = 64, 16
"""Sets of values that are computed for each law, powers of two."""

RELEASES, QUICK_RELEASES = 64, 32
"""Releases of each block with each set."""

AGAIN, QUICK_AGAIN = 400, 60
"""Releases of each block with the best set."""

BENCH, QUICK_BENCH = 1500, 300
"""Releases for the fit to the catch bench and for its prediction."""

SEARCH_DT, DT = 1e-2, 5e-3
"""Step of the search and of the best set [s]."""

PLANE, FRICTION, FALL = 60.0, 32.0, 34.6
"""Slope of the plane [deg], friction of weathered rock on it [deg] and height of fall [m]."""

BAR = 0.005
"""Tolerance of the speed of the slab, relative [-]."""


def field(law: str, dt: float) -> Field:
    """Return the field cases for the ground of a law, with a step at Tschamut [s]."""
    found = Field("blocks", LAWS[law] | {"friction_sd_deg": SCATTER})
    found.slope = replace(found.slope, motion=replace(found.slope.motion, dt=dt))
    return found


def sets(count: int) -> Floats:
    """Return `count` sets of the parameters, which are the same for all laws."""
    low, high = np.array([RANGES["blocks"][name] for name in PARAMETERS]).T
    places = qmc.Sobol(len(PARAMETERS), seed=0).random(count)
    return np.asarray(low + (high - low) * places)


def score(cases: Field, found: dict[str, Floats]) -> float:
    """Return the mean continuous ranked probability score of the observed runs [m]."""
    return float(np.concatenate([scores(found[e], cases.seen[e]) for e in cases.seen]).mean())


def best(law: str, count: int, releases: int) -> Floats:
    """Return the values of the ground with the best score of `count` sets."""
    cases = field(law, SEARCH_DT)
    tried = sets(count)[:, [PARAMETERS.index(name) for name in cases.names]]
    found = [score(cases, cases.tschamut(values, range(releases))) for values in tried]
    return np.asarray(tried[int(np.argmin(found))])


def own_bench(law: str, releases: int) -> tuple[float, Floats]:
    """Return the parameter of a law fitted to the catch bench, and the widths of fresh releases.

    Rolling resistance is fitted if the law has it, restitution otherwise, with the ranges of
    `experiments.catch_bench`. The parameter is NaN and there are no widths if no value fits.
    """
    site: Site = bench.below(FACE)
    name = "restitution" if "rolling" in LAWS[law] else "rolling"
    rock = replace(site.surfaces["rock"], **LAWS[law])
    site = replace(site, surfaces=site.surfaces | {"rock": rock})
    low, high = bench.VARIANTS[name].fitted.low, bench.VARIANTS[name].fitted.high
    variant = Variant("blocks", Parameter(f"surfaces.rock.{name}", low, high))
    value = bench.fitted(site, variant, releases)
    if value is None:
        return math.nan, np.zeros(0)
    return value, bench.widths(site, variant, value, range(FRESH, FRESH + releases))


def slab_speed(ground: Surface) -> float:
    """Return the speed of a slab of 3.5 x 1 m at the foot of a plane over Coulomb's [-].

    It starts at rest on a ground with these values but the friction of weathered rock.
    """
    plain, down = slab_scene(PLANE, FRICTION, 0.0)
    rock = replace(ground, friction_deg=FRICTION)
    sim = Simulation(Scene(plain.terrain, plain.blocks, {"rock": rock}), Settings(dt=DT))
    slope, friction = math.radians(PLANE), math.radians(FRICTION)
    pull = GRAVITY * (math.sin(slope) - math.cos(slope) * math.tan(friction))
    steps = round(math.sqrt(2.0 * FALL / math.sin(slope) / pull) / DT)
    sim.step(steps)
    return float(sim.velocities[0, :2] @ down) / (pull * steps * DT)


def row(law: str, values: Floats, again: int, releases: int) -> dict[str, Any]:
    """Return the row of a law with its best values.

    Parameters
    ----------
    law : str
        The law.
    values : array
        The fitted values of the ground.
    again, releases : int
        Number of releases of each block, and on the catch bench.
    """
    cases, seeds = field(law, DT), range(FRESH, FRESH + again)
    ground = cases.ground(values)
    found = cases.tschamut(values, seeds)
    weights = {e: len(cases.seen[e]) / len(found[e]) for e in found}
    kept = cases.contacts(values, seeds)
    middle = [c.kept for c in mid_slope(ground, max(again // 10, 6), FRESH)]
    widths = cases.widths(values, range(FRESH, FRESH + releases))
    fitted, own = own_bench(law, releases)
    out: dict[str, Any] = {"law": law}
    out |= {name: float(getattr(ground, name)) for name in PARAMETERS}
    out |= {"restitution_speed": ground.restitution_speed or math.nan}
    out |= {"score_m": score(cases, found)}
    out |= tschamut_figures(found, weights, cases.slope.slope.toe)
    out |= {"contacts_mean": float(kept.mean()), "contacts_median": float(np.median(kept))}
    out |= {"mid_slope_mean": float(np.mean(middle)) if middle else math.nan}
    shares = (FITTED[0], PREDICTED[0])
    out |= {f"within_{width:g}_m": within(widths, width) for width in shares}
    out |= {"bench_fitted": "restitution" if "rolling" in LAWS[law] else "rolling"}
    out |= {"bench_value": fitted}
    out |= {f"own_{w:g}_m": within(own, w) if len(own) else math.nan for w in shares}
    return out | {"slab_over_coulomb": slab_speed(ground)}


def run(quick: bool, out: Path) -> Number:
    """Fit each law, predict with it, and write the table."""
    count, releases = (QUICK_SETS, QUICK_RELEASES) if quick else (SETS, RELEASES)
    again, wide = (QUICK_AGAIN, QUICK_BENCH) if quick else (AGAIN, BENCH)
    rows = []
    for i, law in enumerate(LAWS):
        say(f"laws of the ground: {law}, {i + 1} of {len(LAWS)}")
        rows.append(row(law, best(law, count, releases), again, wide))
    write(out / "laws.csv", rows)
    ratios = [r["slab_over_coulomb"] for r in rows]
    worst = max(ratios, key=lambda ratio: abs(ratio - 1.0))
    note = ", ".join(f"{r['law']} {r['score_m']:.2f} m" for r in rows)
    what = "speed of a slab on a plane over Coulomb's, the farthest from 1 [-]"
    return Number(what, worst, 1.0 - BAR, 1.0 + BAR, f"scores at Tschamut: {note}")


if __name__ == "__main__":
    main(run)
