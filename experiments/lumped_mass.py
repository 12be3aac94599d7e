"""Comparison of the lumped-mass and the block model: the paper's highway case and Ritchie's cuts.

Both models compute the same releases: the block model as jointed rock of rigid polygons in contact,
the lumped-mass model as independent points, with the restitution and friction of the same site file
and the usual tangential restitution. Neither is fitted. The models differ in shape, rotation,
interaction, and damping: the highway case damps blocks in flight, which points do not model.

Judged by whether the difference of the debris share in the highway case is significant.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.outcome_cost.cases import Case, cut, highway
from experiments.outcome_cost.cost import sampled
from experiments.outcome_cost.sample import MASS, RUN_OUT, Core, Floats, Points, Release
from experiments.script import BLUE, GREEN, GREY, Number, draw, main, say, write

DT = 5e-3
"""Step of the block model [s]."""

RELEASES, QUICK_RELEASES = 100, 5
COLOURS = {"blocks": BLUE, "lumped": GREEN}


def cumulative(releases: list[Release], grid: Floats) -> Floats:
    """Return the share of the rock that stops before each chainage."""
    blocks = np.concatenate([r.blocks for r in releases])
    order = np.argsort(blocks[:, RUN_OUT])
    share = np.concatenate([[0.0], np.cumsum(blocks[order, MASS])]) / blocks[:, MASS].sum()
    return share[np.searchsorted(blocks[order, RUN_OUT], grid, side="right")]


def picture(figure: Figure, every: dict[str, tuple[Case, dict[str, list[Release]]]]) -> None:
    """Draw the cumulative run-out of both models, one panel per site."""
    for axes, (name, (case, found)) in zip(
        figure.subplots(1, len(every), sharey=True), every.items(), strict=True
    ):
        far = max(np.concatenate([r.blocks[:, RUN_OUT] for r in rs]).max() for rs in found.values())
        grid = np.linspace(case.site.slope.points[0][0], far, 400)
        for model, releases in found.items():
            axes.plot(grid, cumulative(releases, grid), color=COLOURS[model], label=model)
        axes.axvline(case.site.road.start, color=GREY, lw=0.8, ls="--")
        axes.set(title=name, xlabel="chainage [m]", ylim=(0.0, 1.0))
    figure.axes[0].set_ylabel("share of the rock that stops before")
    figure.axes[0].legend()


def run(quick: bool, out: Path) -> Number:
    """Compute the releases; write the table and the picture."""
    count = QUICK_RELEASES if quick else RELEASES
    rows: list[dict[str, Any]] = []
    every, shares = dict[str, tuple[Case, dict[str, list[Release]]]](), []
    for case in (highway(), cut(35), cut(60), cut(80)):
        found = {}
        for model, computer in (("blocks", Core(case, DT, {})), ("lumped", Points(case))):
            say(f"lumped mass: {case.name}, {model}")
            found[model] = [computer.release(seed) for seed in range(count)]
            sample = sampled(found[model])
            row: dict[str, Any] = {"site": case.name, "model": model, "releases": count}
            names = ("debris", "run_out_m", "energy_kj")
            for name, mean, error in zip(names, sample.means, sample.error, strict=True):
                row |= {name: float(mean), f"{name}_95": 1.96 * float(error)}
            rows.append(row | {"cpu_ms": 1e3 * sample.cpu})
            shares.append((float(sample.means[0]), 1.96 * float(sample.error[0])))
        every[case.name] = case, found
    write(out / "lumped_mass.csv", rows)
    draw(out / "lumped_mass.png", (14.0, 3.8), lambda figure: picture(figure, every))
    (blocks, half), (points, other) = shares[:2]
    interval = float(np.hypot(half, other))  # 0 if all of a few releases are alike
    ratio = abs(points - blocks) / interval if interval > 0.0 else math.inf
    note = f"blocks {blocks:.3f} +- {half:.3f}, lumped mass {points:.3f} +- {other:.3f}"
    return Number(
        "difference of the debris share over its interval, highway", ratio, 1.0, note=note
    )


if __name__ == "__main__":
    main(run)
