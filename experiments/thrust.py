"""Thrust of a mass of rock compared with the resistance of barriers.

Embankments and gravity walls of every height of the catalogue, low walls, and fences of every class
at their greatest height are tested one by one under the mass of `shu-hwa` and of `quick`, on a
bench or at the toe, with steps of 10 and 2.5 ms. The thrust is the greatest mean over a second. The
resistance is weight times friction, or the mean braking force of the fence class, see
`rigdda.Scene.resistance`. Judged by the number of embankments and gravity walls that remain
standing although the thrust clearly exceeded their resistance. Barriers that failed before anything
leaned on them are drawn at 0.01.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.script import BLUE, GREEN, RED, Number, draw, main
from experiments.study import Row, tabulate
from rigdda import Barrier, Embankment, Fence, GravityWall, Site
from rigdda.barriers import FENCE_CLASSES, describe
from rigdda.barriers.base import CATALOGUE_HEIGHTS, SLENDER
from rigdda.releases import release_many

SITES = {"shu-hwa": 83.6, "quick": 23.0}
"""Sites with a mass, and the chainages of the barriers [m]: at the toe, and on a bench."""
STEPS, QUICK_STEPS = (1e-2, 2.5e-3), (1e-2,)
"""Steps [s]."""
RELEASES, QUICK_RELEASES = 6, 2
COLOURS = {"fence": BLUE, "embankment": GREEN, "gravity_wall": RED}
BEYOND = 1.1
"""Thrust over resistance that clearly exceeds the resistance [-]. Friction of the rock on a wall
and the inertia of the wall add some resistance."""


def barriers(x: float, highest: float) -> Iterator[Barrier]:
    """Yield the catalogue barriers of every height up to the highest one, at a chainage [m]."""
    for name, row in FENCE_CLASSES.items():
        yield Fence(x, row.height, energy_class=name)
    for h in (0.6, *CATALOGUE_HEIGHTS):
        if h <= highest:
            yield Embankment(x, h)
            yield GravityWall(x, h, max(0.5, SLENDER * h))


def catalogue() -> dict[tuple[str, str], Barrier]:
    """Return the barriers tested at each site, keyed by site name and description."""
    return {
        (name, describe(b)): b
        for name, x in SITES.items()
        for b in barriers(x, Site.load(name).barrier_zone.max_height)
    }


def measure(site: str, barrier: str, dt_ms: float, releases: int) -> Row:
    """Return the thrust and resistance of a barrier in mass releases of a site; forces in kN/m."""
    one = catalogue()[site, barrier]
    here = Site.load(site)
    here = replace(here, motion=replace(here.motion, dt=1e-3 * dt_ms))
    outcomes = release_many([(here, (one,), seed, "mass") for seed in range(releases)])
    found = [outcome.barriers[0] for outcome in outcomes]
    thrust = np.array([f.thrust for f in found])
    # a fence buried in a deposit is pushed from both sides and does not move
    judged = not isinstance(one, Fence)
    wrong = sum(judged and f.thrust > BEYOND * f.resistance and not f.failed for f in found)
    return {
        "kind": one.kind,
        "height_m": float(getattr(one, "height", 0.0)),
        "thrust_kn": round(1e-3 * float(thrust.mean()), 2),
        "greatest_thrust_kn": round(1e-3 * float(thrust.max()), 2),
        "resistance_kn": round(1e-3 * found[0].resistance, 2),
        "failed": sum(f.failed for f in found),
        "stand_beyond_resistance": wrong,
    }


def sentence(row: Row) -> str:
    """Return a progress message for a row."""
    words = f"{row['site']}, {row['barrier']}, {row['dt_ms']:g} ms"
    return f"{words}: fails in {row['failed']:g} of {row['releases']:g} releases"


def utilisation(row: Row) -> float:
    """Return the greatest thrust over the resistance [-].

    It is infinite if there is no resistance, on a slope that is steeper than the friction angle.
    """
    thrust, resistance = row["greatest_thrust_kn"], row["resistance_kn"]
    return float(thrust / resistance) if resistance > 0.0 else math.inf


def picture(figure: Figure, rows: list[Row]) -> None:
    """Draw thrust over resistance against height; filled marks if every release fails."""
    names = list(dict.fromkeys(r["site"] for r in rows))
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    for axes, name in zip(panels, names, strict=True):
        for kind, colour in COLOURS.items():
            own = [r for r in rows if r["site"] == name and r["kind"] == kind]
            for r in own:
                gone = r["failed"] / r["releases"]
                face = colour if gone == 1.0 else "none"
                small = r["dt_ms"] < 10.0
                axes.plot(
                    r["height_m"], min(max(utilisation(r), 1e-2), 1e3), "s" if small else "o",
                    color=colour, markerfacecolor=face, markersize=5 if small else 7,
                )  # fmt: skip
            axes.plot([], [], "o", color=colour, label=kind.replace("_", " "))
        axes.axhline(1.0, color="0.8", zorder=0)
        axes.set(title=f"mass of {name}", xlabel="height [m]", yscale="log", ylim=(None, 5e4))
        axes.set_ylabel("greatest thrust over resistance [-]")
        words = "filled: fails in every release\nsquares: 2.5 ms; at 0.01: failed by a blow"
        words += "\nat 1000: no resistance on a steep slope"
        axes.legend(title=words, fontsize=8, title_fontsize=8)


def run(quick: bool, out: Path) -> Number:
    """Write thrust.csv and thrust.png."""
    steps = [1e3 * dt for dt in (QUICK_STEPS if quick else STEPS)]
    releases = QUICK_RELEASES if quick else RELEASES
    cases = [
        {"site": site, "barrier": barrier, "dt_ms": dt, "releases": releases}
        for dt in steps
        for site, barrier in catalogue()
    ]
    rows = tabulate(out / "thrust.csv", cases, measure, sentence)
    draw(out / "thrust.png", (11.0, 4.5), lambda figure: picture(figure, rows))
    wrong = sum(r["stand_beyond_resistance"] for r in rows)
    finite = [ratio for ratio in map(utilisation, rows) if math.isfinite(ratio)]
    note = f"thrust over resistance up to {max(finite):.1f}" if finite else ""
    return Number("barriers that stand beyond their resistance", wrong, high=0.0, note=note)


if __name__ == "__main__":
    main(run)
