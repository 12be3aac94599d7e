"""Effect of the step on debris and failures of layouts whose barriers can fail.

Layouts: fences of 2.5 and 3.5 m on the two benches of `shu-hwa` with capacities at which some fail
and some do not, one fence on `quick`, a ditch, an embankment and a gravity wall; with contact
damping only. Both sites are also run without barriers, to show step dependence that is not caused
by barriers. Judged by the greatest difference from the shortest step over the 95 % interval of the
difference.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.script import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Number,
    draw,
    interval,
    main,
)
from experiments.study import Row, tabulate
from rigdda import Ditch, Embankment, Fence, GravityWall, Layout, Settings, Site
from rigdda.releases import release_many


def benches(upper: float, lower: float) -> Layout:
    """Return fences of these capacities on the two benches of `shu-hwa`."""
    return Fence(50.5, 2.5, upper), Fence(67.8, 3.5, lower)


LAYOUTS: dict[str, tuple[str, Layout]] = {
    "none": ("shu-hwa", ()),
    "none on quick": ("quick", ()),
    "fences, 0.7 MJ/m": ("shu-hwa", benches(7e5, 7e5)),
    "fences, 3 MJ/m": ("shu-hwa", benches(3e6, 3e6)),
    "fences, 6 and 12 MJ/m": ("shu-hwa", benches(6e6, 1.2e7)),
    "fence": ("quick", (Fence(24.0, 3.0, 1.4e6),)),
    "ditch": ("quick", (Ditch(29.8, 1.5, 4.0),)),
    "embankment": ("quick", (Embankment(24.5, 1.0, 0.5, 0.5),)),
    "gravity wall": ("quick", (GravityWall(24.0, 2.0, 1.0),)),
}
"""Site and layout by name."""

COLOURS = ("0.1", "0.4", BLUE, RED, GREEN, ORANGE, GREY, "#7d3c98", "#148f77")

STEPS, QUICK_STEPS = (1.25e-3, 2.5e-3, 5e-3, 1e-2, 2e-2), (2.5e-3, 5e-3, 1e-2)
"""Steps [s]; the first and shortest one is the basis of comparison."""

RELEASES, QUICK_RELEASES = 24, 6

MOST = 1.6
"""Greatest difference over its interval that may occur by chance in 72 comparisons [-]: 3.1
standard deviations, which one of them exceeds in a tenth of such studies."""


def measure(layout: str, dt_s: float, releases: int) -> Row:
    """Return the mean debris share and number of failures of a layout at a step [s].

    Half intervals are included. If all releases are alike, the interval of the failures is 3/n, the
    rule of three.
    """
    name, barriers = LAYOUTS[layout]
    site = Site.load(name)
    site = replace(site, motion=replace(site.motion, dt=dt_s))
    outcomes = release_many([(site, barriers, seed, "mass") for seed in range(releases)])
    debris, half = interval(outcome.debris_fraction for outcome in outcomes)
    failures, half_failures = interval(sum(b.failed for b in o.barriers) for o in outcomes)
    return {
        "debris": debris,
        "debris_half": half,
        "failures": failures,
        "failures_half": max(half_failures, 3.0 / releases),
    }


def sentence(row: Row) -> str:
    """Return a progress message for a row."""
    words = f"{row['layout']}, {1e3 * row['dt_s']:g} ms"
    return f"{words}: debris {row['debris']:.3f}, failures {row['failures']:.2f}"


def difference(rows: list[Row]) -> float:
    """Return the greatest difference from the shortest step, over its 95 % interval [-]."""
    most = 0.0
    for name in LAYOUTS:
        for what in ("debris", "failures"):
            here = [(r[what], r[f"{what}_half"]) for r in rows if r["layout"] == name]
            value, half = np.array(here).T
            apart = np.abs(value - value[0]) / np.maximum(np.hypot(half, half[0]), 1e-9)
            most = max(most, float(apart.max()))
    return most


def picture(figure: Figure, rows: list[Row]) -> None:
    """Draw debris and failures against the step."""
    left, right = figure.subplots(1, 2)
    for axes, what in ((left, "debris"), (right, "failures")):
        for name, colour in zip(LAYOUTS, COLOURS, strict=True):
            here = [r for r in rows if r["layout"] == name]
            dt, value, half = (
                np.array([r[k] for r in here]) for k in ("dt_s", what, f"{what}_half")
            )
            axes.errorbar(1e3 * dt, value, half, fmt="o-", color=colour, capsize=3, label=name)
        axes.axvline(1e3 * Settings().dt, color="0.8", linewidth=6.0, zorder=0)
        axes.set(xscale="log", xlabel="step [ms]", ylim=(0, None))
        axes.set_xticks([1e3 * dt for dt in STEPS], [f"{1e3 * dt:g}" for dt in STEPS], minor=False)
        axes.minorticks_off()
        axes.set_ylabel(
            "share past the road's edge [-]" if what == "debris" else "barriers that fail"
        )
    left.legend(loc="lower left", ncols=2)


def run(quick: bool, out: Path) -> Number:
    """Write fence_step.csv and fence_step.png."""
    steps = QUICK_STEPS if quick else STEPS
    releases = QUICK_RELEASES if quick else RELEASES
    cases = [{"layout": k, "dt_s": dt, "releases": releases} for k in LAYOUTS for dt in steps]
    rows = tabulate(out / "fence_step.csv", cases, measure, sentence)
    draw(out / "fence_step.png", (11.0, 4.5), lambda figure: picture(figure, rows))
    most = difference(rows)
    return Number("greatest difference from the shortest step, over its interval", most, high=MOST)


if __name__ == "__main__":
    main(run)
