"""Processor time that each engine needs for an outcome of given accuracy.

For three cases (`cases`), each engine (`engines`) computes releases with several settings. The
outcomes are those that a designer needs: the share of the debris that passes the edge of the road,
the run-out of 95 % of the rock, and the energy that 95 % of the blocks at a barrier do not exceed.
With n releases, the error of an outcome consists of its bias from the reference and its scatter. An
answer within `e` of the reference needs the n for which bias^2 + scatter^2 / n = e^2 for the worst
of the three outcomes. Its cost is n times the processor time of a release, and infinite if the bias
exceeds e.

The reference is this core at 1 ms; its scatter is common to all ratios of a case. Part of the bias
of a peer is due to a different impact law: on `quick`, the finest settings of Box2D and pymunk
converge to more debris than the reference. All engines compute the same scenes (MuJoCo without
restitution, which it does not model) for the duration of the site or until all blocks are at rest,
which also defines the run-out. The settings are computed in turns of some releases each, so that
all are exposed to the same noise of the machine. A peer's setting is dropped once it is certainly
biased by more than 3 %, or too expensive to be the cheapest.

Judged by the cost of this core over that of the cheapest other block engine at 3 %, for the worst
case.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.outcome_cost.cases import CASES
from experiments.outcome_cost.cost import Sample, cost, judge
from experiments.outcome_cost.engines import CORE, LUMPED, REFERENCE, Setting
from experiments.outcome_cost.gathering import JUDGED, gather
from experiments.outcome_cost.sample import OUTCOMES
from experiments.script import BLUE, GREEN, GREY, ORANGE, RED, Number, draw, write

LEVELS = (0.1, 0.03, 0.01)
"""Permitted errors over the reference [-]."""

RELEASES = {"highway": 300, "quick": 1500, "tschamut": 4500}
QUICK_RELEASES = {"highway": 4, "quick": 20, "tschamut": 60}
COLOURS = {CORE: BLUE, "Box2D": RED, "pymunk": GREEN, "MuJoCo": ORANGE, LUMPED: GREY}


def rows(name: str, samples: dict[Setting, Sample]) -> Iterator[dict[str, Any]]:
    """Yield a row per setting: outcomes, bias, and the cost at each level."""
    reference = samples[REFERENCE]
    for setting, sample in samples.items():
        verdict = judge(sample, reference)
        row: dict[str, Any] = {
            "case": name,
            "engine": setting.engine,
            "setting": "reference" if setting == REFERENCE else str(setting),
            "releases": sample.releases,
            "cpu_ms": 1e3 * sample.cpu,
        }
        columns = ("debris", "run_out", "energy")
        for k, what in enumerate(columns):
            row[what] = float(sample.means[k])
            row[f"{what}_bias"] = math.nan if setting == REFERENCE else float(verdict.bias[k])
            row[f"{what}_bias_95"] = math.nan if setting == REFERENCE else 1.96 * verdict.error[k]
            row[f"{what}_scatter"] = float(verdict.scatter[k])
        for level in LEVELS:
            names = [f"{what}_{level:.0%}_s" for what in ("cost", "low", "high")]
            row |= dict.fromkeys(names, math.nan)
            if setting == REFERENCE:
                continue
            found = cost(sample, reference, level)
            if found.known:
                row |= dict(zip(names, (found.value, *found.ends()), strict=True))
        yield row


def compared(samples: dict[Setting, Sample], level: float) -> dict[str, Any]:
    """Return the cheapest settings of this core and of the peers, and the ratio of their costs.

    A peer with unknown bias counts as unbiased, so that the ratio is an upper bound, which is noted
    in `told`. The ratio is NaN if this core does not reach the level, and 0 if no peer does.
    """
    every = {s: cost(x, samples[REFERENCE], level) for s, x in samples.items() if s != REFERENCE}
    mine = {s: c for s, c in every.items() if s.engine == CORE}
    theirs = {s: c for s, c in every.items() if s.engine not in (CORE, LUMPED)}
    ours = min((s for s in mine if mine[s].known), key=lambda s: mine[s].value, default=None)
    least = {s: c.value if c.known else float(c.resampled[0]) for s, c in theirs.items()}
    peer = min(least, key=least.__getitem__)
    row: dict[str, Any] = {
        "level": level,
        "rigdda": str(ours) if ours else "",
        "rigdda_s": mine[ours].value if ours else math.nan,
        "peer": str(peer) if math.isfinite(least[peer]) else "",
        "peer_s": least[peer],
        "told": "its cost" if theirs[peer].known else "its least cost",
        "ratio": math.nan,
        "low": math.nan,
        "high": math.nan,
    }
    if ours is not None and math.isfinite(mine[ours].value):
        row["ratio"] = mine[ours].value / least[peer]
        best = np.min([c.resampled for c in mine.values() if c.known], axis=0)
        other = np.min([c.resampled for c in theirs.values()], axis=0)
        with np.errstate(invalid="ignore"):
            each = np.where(np.isinf(best), math.inf, best / other)
        row["low"], row["high"] = np.quantile(each, (0.025, 0.975), method="nearest").tolist()
    return row


def ratios(every: dict[str, dict[Setting, Sample]]) -> list[dict[str, Any]]:
    """Return `compared` for each case and level."""
    return [{"case": n} | compared(s, level) for n, s in every.items() for level in LEVELS]


def picture(figure: Figure, every: dict[str, dict[Setting, Sample]]) -> None:
    """Draw the greatest bias of each setting against the processor time of a release."""
    for axes, (name, samples) in zip(
        figure.subplots(1, len(every), squeeze=False)[0], every.items(), strict=True
    ):
        reference = samples[REFERENCE]
        for setting, sample in samples.items():
            if setting == REFERENCE:
                continue
            verdict = judge(sample, reference)
            worst = int(np.abs(verdict.bias).argmax())
            axes.errorbar(
                1e3 * sample.cpu,
                100.0 * abs(verdict.bias[worst]),
                196.0 * verdict.error[worst],
                fmt="o",
                color=COLOURS[setting.engine],
                lw=0.8,
            )
        axes.axhline(100.0 * JUDGED, color=GREY, lw=0.8, ls="--")
        axes.set(xscale="log", title=name, xlabel="processor time of a release [ms]")
        axes.set_yscale("symlog", linthresh=10.0, linscale=2.0)
        axes.set_ylim(0.0, 2000.0)
        axes.set_yticks([0, 2, 4, 6, 8, 10, 100, 1000], [0, 2, 4, 6, 8, 10, 100, 1000])
    for engine, colour in COLOURS.items():
        figure.axes[0].plot([], [], "o", color=colour, label=engine)
    figure.axes[0].set_ylabel("greatest bias of the three outcomes [%]")
    figure.axes[-1].legend(*figure.axes[0].get_legend_handles_labels())


def run(quick: bool, out: Path) -> Number:
    """Compute all cases; write the tables and the picture."""
    folder = out / "outcome_cost"
    counts = QUICK_RELEASES if quick else RELEASES
    every = {name: gather(name, counts[name], folder / "samples") for name in CASES}
    write(folder / "outcome_cost.csv", [r for name, s in every.items() for r in rows(name, s)])
    found = ratios(every)
    write(folder / "ratios.csv", found)
    draw(folder / "outcome_cost.png", (12.0, 4.2), lambda figure: picture(figure, every))
    judged = {row["case"]: row["ratio"] for row in found if row["level"] == JUDGED}
    note = ", ".join(f"{name} {ratio:.2f}" for name, ratio in judged.items())
    note += f"; outcomes: {', '.join(OUTCOMES)}"
    what = f"cost over the cheapest peer's at {JUDGED:.0%}, worst case"
    return Number(what, float(np.max(list(judged.values()))), high=1.0, note=note)
