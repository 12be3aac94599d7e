"""Road cut of 45 m in schist: which blocks stay on the slope, by their aspect and its friction.

`road_cut.toml` is an invented section as real ones look. Schist falls as slabs, which slide, so
that friction decides whether they stay. Each aspect is released with each friction of the weathered
rock, with the rolling resistance of the library and without any. P(road) may rise with friction, as
blocks that roll clear the ditch; the share that stays may not fall. The site as it is is also
computed with three steps.

Judged by the greatest fall with friction of the share that stays, with the rolling resistance of
the library: its lower 95 % limit must not be above zero.
"""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from msgspec.structs import replace

from experiments.script import BLUE, GREEN, ORANGE, Number, draw, main, say, write
from rigdda import Site, release_many
from rigdda.envs.intervals import mid_p

SITE = Path(__file__).parent / "road_cut.toml"

EVENT = "crest medium"

ASPECTS = ((1.0, 1.5), (2.0, 2.5), (3.0, 4.0))
"""Ranges of length over breadth of the blocks [-]."""

FRICTIONS = (20.0, 26.0, 32.0, 38.0)
"""Friction angles of the weathered rock [deg]."""

ROLLING = ("library", "none")
"""Rolling resistance of the surfaces: that of their grounds, or zero."""

STEPS = (1e-2, 5e-3, 2.5e-3)
"""Steps with which the site as it is is computed [s]."""

RELEASES, QUICK_RELEASES = 400, 60
"""Releases of each combination."""

COLOURS = (BLUE, GREEN, ORANGE)


def changed(site: Site, aspect: tuple[float, float], friction: float, rolling: str) -> Site:
    """Return the site with blocks of other aspects and a ground of other properties.

    Parameters
    ----------
    site : Site
        The road cut.
    aspect : (float, float)
        Least and greatest length over breadth of the blocks [-].
    friction : float
        Friction of the weathered rock [deg].
    rolling : {"library", "none"}
        Rolling resistance of all surfaces.
    """
    sources = tuple(replace(source, aspect=aspect) for source in site.sources)
    surfaces = dict(site.surfaces)
    surfaces["weathered_rock"] = replace(surfaces["weathered_rock"], friction_deg=friction)
    if rolling == "none":
        surfaces = {n: replace(s, rolling=0.0, rolling_sd=0.0) for n, s in surfaces.items()}
    return replace(site, sources=sources, surfaces=surfaces)


def case(aspect: tuple[float, float], friction: float, rolling: str, site: Site) -> dict[str, Any]:
    """Return the columns of a combination; the friction of the site as it is is NaN."""
    return {
        "aspect_low": aspect[0],
        "aspect_high": aspect[1],
        "friction_deg": friction,
        "rolling": rolling,
        "dt": site.motion.dt,
    }


def shares(site: Site, releases: int) -> dict[str, Any]:
    """Return P(road) and the share that stops uphill of the toe, with 95 % intervals."""
    outcomes = release_many([(site, (), seed, EVENT) for seed in range(releases)])
    reached = sum(outcome.reached for outcome in outcomes)
    stays = sum(outcome.run_out[2] < site.slope.toe for outcome in outcomes)
    out: dict[str, Any] = {"releases": releases}
    for name, count in (("road", reached), ("stays", stays)):
        low, high = mid_p(count, releases)
        out |= {name: count / releases, f"{name}_low": low, f"{name}_high": high}
    return out


def rows(releases: int) -> list[dict[str, Any]]:
    """Return the shares of each combination, then those of the site as it is by step."""
    site, found = Site.load(SITE), []
    for aspect in ASPECTS:
        for rolling in ROLLING:
            say(f"road cut: aspect {aspect[0]:g} to {aspect[1]:g}, rolling resistance {rolling}")
            for friction in FRICTIONS:
                own = changed(site, aspect, friction, rolling)
                found.append(case(aspect, friction, rolling, own) | shares(own, releases))
    aspect = next(source.aspect for source in site.sources if source.name == "crest")
    for dt in STEPS:
        say(f"road cut: the site as it is, step {1e3 * dt:g} ms")
        own = replace(site, motion=replace(site.motion, dt=dt))
        found.append(case(aspect, math.nan, "library", own) | shares(own, releases))
    return found


def lines(
    table: list[dict[str, Any]], rolling: str
) -> dict[tuple[float, float], list[dict[str, Any]]]:
    """Return the rows of each aspect in order of friction."""
    return {
        aspect: [
            row
            for friction in FRICTIONS
            for row in table
            if (row["aspect_low"], row["aspect_high"]) == aspect
            and (row["friction_deg"], row["rolling"]) == (friction, rolling)
        ]
        for aspect in ASPECTS
    }


def fall(table: list[dict[str, Any]]) -> float:
    """Return the lower 95 % limit of the greatest fall with friction of the share that stays [-].

    The limit of a difference is that of Zou and Donner, see `rigdda.envs.intervals`.
    """
    return max(
        less["stays"]
        - more["stays"]
        - math.hypot(less["stays"] - less["stays_low"], more["stays_high"] - more["stays"])
        for line in lines(table, "library").values()
        for less, more in combinations(line, 2)
    )


def picture(figure: Figure, table: list[dict[str, Any]]) -> None:
    """Draw P(road) and the share that stays against friction, one line for each aspect."""
    for axes, (name, words) in zip(
        figure.subplots(1, 2, sharey=True),
        (("road", "P(road)"), ("stays", "share that stays on the slope")),
        strict=True,
    ):
        for rolling, style in zip(ROLLING, ("-", "--"), strict=True):
            for (aspect, line), colour in zip(lines(table, rolling).items(), COLOURS, strict=True):
                share, low, high = np.array(
                    [[row[name], row[f"{name}_low"], row[f"{name}_high"]] for row in line]
                ).T
                label = f"aspect {aspect[0]:g} to {aspect[1]:g}"
                if rolling == "none":
                    label += ", no rolling resistance"
                axes.errorbar(FRICTIONS, share, (share - low, high - share), fmt="o", ls=style,
                              color=colour, capsize=2, label=label)  # fmt: skip
        axes.set(title=words, xlabel="friction of the weathered rock [deg]", ylim=(0.0, 1.0))
    figure.axes[0].set_ylabel("share of releases")
    figure.axes[1].legend(fontsize=8, handlelength=4.0)


def run(quick: bool, out: Path) -> Number:
    """Compute all combinations; write the table and the picture."""
    table = rows(QUICK_RELEASES if quick else RELEASES)
    write(out / "road_cut.csv", table)
    draw(out / "road_cut.png", (11.0, 4.5), lambda figure: picture(figure, table))
    steps = ", ".join(f"{1e3 * r['dt']:g} ms {r['road']:.3f}" for r in table[-len(STEPS) :])
    slabs = zip(*(lines(table, rolling)[ASPECTS[-1]] for rolling in ROLLING), strict=True)
    more = max(own["stays"] - without["stays"] for own, without in slabs)
    note = f"P(road) by step: {steps}; without rolling resistance slabs stay up to {more:.2f} less"
    what = "fall with friction of the share that stays, lower 95 % limit [-]"
    return Number(what, fall(table), high=0.0, note=f"{note} often")


if __name__ == "__main__":
    main(run)
