"""Effect of the step on the share of rock that passes the road's edge, without barriers.

On `ramp`, a plane of 51 degrees above level ground, ten blocks slide down in a train and the same
corner hits the ground in every release, so that the effect of the step on this impact is not
averaged out. `quick` is the mass of the site of that name, whose releases differ. Judged by the
greatest difference from the shortest step on either site, over the 95 % interval of the difference.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.script import BLUE, RED, Number, draw, interval, main
from experiments.study import Row, tabulate
from rigdda import Settings, Site, Surface
from rigdda.model.joints import JointSet
from rigdda.model.site_tables import BarrierZone, Motion, Road, Slope
from rigdda.model.source import Source
from rigdda.releases import release_many

RAMP = Site(
    name="ramp",
    description="A plane of 51 degrees, 25 m high, with a road 3 m from its toe.",
    slope=Slope(points=((-10.0, 25.0), (0.0, 25.0), (20.0, 0.0), (70.0, 0.0)), toe=20.0),
    sources=(
        Source(
            name="mass",
            polygon=((1.0, 23.75), (7.0, 16.25), (9.0, 18.5), (4.0, 24.5)),
            joints=(JointSet(51.0), JointSet(-39.0)),
            block_area=2.5,
        ),
    ),
    road=Road(23.0, 31.0),
    barrier_zone=BarrierZone(10.0, 22.0),
    surfaces={"rock": Surface(22.0)},
    motion=Motion(duration=8.0),
)

SITES = {"ramp": RAMP, "quick": Site.load("quick")}
COLOURS = {"ramp": BLUE, "quick": RED}

STEPS, QUICK_STEPS = (1e-3, 2.5e-3, 5e-3, 1e-2, 2e-2), (2.5e-3, 5e-3, 1e-2)
"""Steps [s]; the shortest one is the basis of comparison."""

MOST = 1.5
"""Greatest difference over its interval that may occur by chance in eight comparisons [-]: 2.9
standard deviations, which one of them exceeds in 3 % of such studies."""

RELEASES, QUICK_RELEASES = {"ramp": 500, "quick": 200}, {"ramp": 40, "quick": 20}


def measure(site: str, dt_s: float, releases: int) -> Row:
    """Return the mean share of a site at a step [s] with its 95 % half interval."""
    here = replace(SITES[site], motion=replace(SITES[site].motion, dt=dt_s))
    found = release_many([(here, (), seed, "mass") for seed in range(releases)])
    share, half = interval(outcome.debris_fraction for outcome in found)
    return {"share": share, "half_interval": half}


def sentence(row: Row) -> str:
    """Return a progress message for a row."""
    return f"{row['site']}, {1e3 * row['dt_s']:g} ms: {row['share']:.3f}"


def difference(rows: list[Row]) -> float:
    """Return the greatest difference from the first row of a site, over its 95 % interval [-]."""
    most = 0.0
    for name in SITES:
        share, half = np.array(
            [(r["share"], r["half_interval"]) for r in rows if r["site"] == name]
        ).T
        most = max(most, float((np.abs(share - share[0]) / np.hypot(half, half[0])).max()))
    return most


def picture(figure: Figure, rows: list[Row]) -> None:
    """Draw the shares against the step."""
    axes = figure.subplots()
    for name, colour in COLOURS.items():
        here = [r for r in rows if r["site"] == name]
        dt, share, half = (
            np.array([r[k] for r in here]) for k in ("dt_s", "share", "half_interval")
        )
        axes.errorbar(1e3 * dt, share, half, fmt="o-", color=colour, capsize=3, label=name)
    axes.axvline(1e3 * Settings().dt, color="0.8", linewidth=6.0, zorder=0, label="default")
    axes.set(xscale="log", xlabel="step [ms]", ylabel="share past the road's edge [-]", ylim=(0, 1))
    axes.set_xticks([1e3 * dt for dt in STEPS], [f"{1e3 * dt:g}" for dt in STEPS], minor=False)
    axes.minorticks_off()
    axes.legend()


def run(quick: bool, out: Path) -> Number:
    """Write outcome_step.csv and outcome_step.png."""
    releases = QUICK_RELEASES if quick else RELEASES
    steps = QUICK_STEPS if quick else STEPS
    cases = [{"site": s, "dt_s": dt, "releases": releases[s]} for s in SITES for dt in steps]
    rows = tabulate(out / "outcome_step.csv", cases, measure, sentence)
    draw(out / "outcome_step.png", (7.0, 4.5), lambda figure: picture(figure, rows))
    most = difference(rows)
    return Number("greatest difference from the shortest step, over its interval", most, high=MOST)


if __name__ == "__main__":
    main(run)
