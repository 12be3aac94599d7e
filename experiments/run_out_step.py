"""Effect of the step on the run-out of single blocks.

Small bouncing blocks cause most of the risk on a road. Blocks of 0.05 to 2 m2 roll off the crest of
a slope of 45 degrees, 40 m high, onto level ground; the same blocks are released for every step.
Judged by the greatest difference of the mean run-out from that with the shortest step, less the 95
% interval of the difference, over the mean run-out from the toe.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from experiments.script import BLUE, GREEN, ORANGE, RED, Number, draw, interval, main
from experiments.study import Row, tabulate
from rigdda import Event, Site, Surface
from rigdda.model.site_tables import BarrierZone, Motion, Road, Slope
from rigdda.model.source import Source
from rigdda.releases import release_many

HEIGHT = 40.0
"""Height of the slope, and chainage of its toe [m]."""

AREAS, RESTITUTIONS = (0.05, 0.1, 0.5, 2.0), (0.0, 0.2, 0.4, 0.5)
"""Areas of the blocks [m2], and their restitution [-]."""

QUICK_AREAS, QUICK_RESTITUTIONS = (0.1,), (0.4,)

STEPS, QUICK_STEPS = (6e-4, 2.5e-3, 1e-2), (2.5e-3, 1e-2)
"""Steps [s], the shortest first."""

RELEASES, QUICK_RELEASES = 8_000, 1_000

MOST = 0.02
"""Target for this difference [-]."""

COLOURS = (BLUE, GREEN, ORANGE, RED)


def site(area: float, restitution: float, dt: float) -> Site:
    """Return the slope with a block of this area [m2] and restitution [-], and a step `dt` [s]."""
    return Site(
        name="slope",
        description="A slope of 45 degrees, 40 m high, above level ground.",
        slope=Slope(
            points=((-10.0, HEIGHT), (0.0, HEIGHT), (HEIGHT, 0.0), (440.0, 0.0)), toe=HEIGHT
        ),
        sources=(Source(name="crest", band=(1.0, 2.0), speed=(1.0, 2.0)),),
        events=(Event("block", 1.0, "crest", area=(area, area)),),
        road=Road(HEIGHT + 1.0, 400.0),
        barrier_zone=BarrierZone(HEIGHT - 2.0, HEIGHT - 1.0),
        surfaces={"rock": Surface(30.0, restitution=restitution)},
        motion=Motion(duration=60.0, dt=dt),
    )


@cache
def run_outs(area: float, restitution: float, dt: float, releases: int) -> NDArray[np.float64]:
    """Return the run-outs from the toe in this number of releases, (releases,) [m]."""
    here = site(area, restitution, dt)
    outcomes = release_many([(here, (), seed, None) for seed in range(releases)])
    return np.array([outcome.run_out[2] for outcome in outcomes]) - HEIGHT


def measure(
    area_m2: float, restitution: float, dt_s: float, shortest_s: float, releases: int
) -> Row:
    """Return the mean run-out and its difference from that with the shortest step [m]."""
    found = run_outs(area_m2, restitution, dt_s, releases)
    least = run_outs(area_m2, restitution, shortest_s, releases)
    mean, half = interval(found)
    other, other_half = interval(found - least)
    return {
        "run_out_m": mean, "half_interval_m": half, "difference_m": other,
        "difference_half_interval_m": other_half,
    }  # fmt: skip


def sentence(row: Row) -> str:
    """Return a progress message for a row."""
    what = f"{row['area_m2']:g} m2, restitution {row['restitution']:g}, {1e3 * row['dt_s']:.3g} ms"
    return f"{what}: {row['run_out_m']:.2f} m, {row['difference_m']:+.2f} m"


def excess(rows: list[Row]) -> float:
    """Return the greatest significant relative difference of a mean from the shortest step [-]."""
    return max(
        (abs(r["difference_m"]) - r["difference_half_interval_m"])
        / (r["run_out_m"] - r["difference_m"])
        for r in rows
    )


def picture(figure: Figure, rows: list[Row]) -> None:
    """Draw the differences of the mean run-outs from the shortest step, one panel per area."""
    areas = list(dict.fromkeys(r["area_m2"] for r in rows))
    for axes, area in zip(
        figure.subplots(1, len(areas), squeeze=False, sharey=True)[0], areas, strict=True
    ):
        axes.axhspan(-100.0 * MOST, 100.0 * MOST, color="0.92", zorder=0)
        for apart, (e, colour) in enumerate(zip(RESTITUTIONS, COLOURS, strict=True)):
            own = [r for r in rows if r["area_m2"] == area and r["restitution"] == e]
            if not own:
                continue
            dt, off, half = (
                np.array([r[k] for r in own])
                for k in ("dt_s", "difference_m", "difference_half_interval_m")
            )
            share = 100.0 / own[0]["run_out_m"]
            axes.errorbar(
                1e3 * dt * 1.06**apart, share * off, share * half, fmt="o-", color=colour,
                capsize=3, label=f"{e:g}",
            )  # fmt: skip
        axes.set(xscale="log", xlabel="step [ms]", title=f"{area:g} m2")
        axes.set_xticks([1e3 * dt for dt in STEPS], [f"{1e3 * dt:g}" for dt in STEPS])
        axes.set_xticks([], minor=True)
    figure.axes[0].set(ylabel=f"mean run-out over that at {1e3 * STEPS[0]:g} ms [%]")
    figure.axes[-1].legend(title="restitution", loc="upper left", fontsize=8)


def run(quick: bool, out: Path) -> Number:
    """Write run_out_step.csv and run_out_step.png."""
    steps = QUICK_STEPS if quick else STEPS
    cases = [
        {
            "area_m2": area, "restitution": e, "dt_s": dt, "shortest_s": steps[0],
            "releases": QUICK_RELEASES if quick else RELEASES,
        }
        for area in (QUICK_AREAS if quick else AREAS)
        for e in (QUICK_RESTITUTIONS if quick else RESTITUTIONS)
        for dt in steps
    ]  # fmt: skip
    rows = tabulate(out / "run_out_step.csv", cases, measure, sentence)
    draw(out / "run_out_step.png", (12.0, 4.2), lambda figure: picture(figure, rows))
    what = "greatest difference from the shortest step beyond its interval, over the mean run-out"
    return Number(what, excess(rows), high=MOST)


if __name__ == "__main__":
    main(run)
