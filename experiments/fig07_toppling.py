"""Figs 6 to 8 and Table 1: a toppling slope of 16 columns compared with its limit equilibrium.

Static mode is used, as in the paper. The columns are 10 m wide on steps of 1 m, which correspond to
the published forces. Forces are compared at the friction angle of the paper, 38.15 deg, and modes
just below the limit of 38.151 deg, where the slope moves. Judged by the greatest error of the 32
base forces; a mode that differs from Table 1 counts as 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from experiments.script import BLUE, GREEN, GREY, ORANGE, RED, Number, draw, main, write
from rigdda.limit_equilibrium import Toppling
from rigdda.validation import slopes
from rigdda.validation.case import Lab, Metered
from rigdda.validation.scenes import Floats

MODES_DEG = 38.0
"""Friction angle for the comparison of modes [deg]."""

TABLE_1 = ("sliding",) * 3 + ("toppling",) * 10 + ("stable",) * 3
"""Modes of the columns from the toe upwards: Table 1, after Hoek and Bray (1981)."""

COLOURS = {"stable": GREEN, "toppling": ORANGE, "sliding": RED}

SHOWN = 4.0
"""Length at which the greatest displacement is drawn [m]."""


class Found(NamedTuple):
    """Computed base forces (16,) [N], modes, and the slope before and after its motion."""

    normal: Floats
    shear: Floats
    modes: list[str]
    before: list[Floats]
    after: list[Floats]


def corners(sim: Metered) -> list[Floats]:
    """Return the corners of all columns, the slope rising to the left as in the paper [m]."""
    return [sim.vertices(n) * (-1.0, 1.0) for n in range(len(slopes.COLUMN_HEIGHTS))]


def compute() -> Found:
    """Relax the slope at both friction angles."""
    lab = Lab(slopes.STATIC_STEP_TIME)
    normal, shear = slopes.base_forces(slopes.relax(lab, slopes.LIMIT_DEG))
    sim = slopes.relax(lab, MODES_DEG)
    before = corners(sim)
    return Found(
        normal, shear, slopes.toppling_modes(sim, slopes.STATIC_STEPS), before, corners(sim)
    )


def draw_geometry(axes: Axes) -> None:
    """Draw the slope (Fig. 6)."""
    terrain, blocks = slopes.toppling_slope()
    _base(axes, terrain.points * (-1.0, 1.0))
    for n, block in enumerate(blocks):
        shape = block.vertices * (-1.0, 1.0)
        axes.fill(*shape.T, facecolor="#ddd3c2", edgecolor=GREY, linewidth=0.8)
        axes.annotate(str(n + 1), shape[2:].mean(axis=0), ha="center", va="bottom", fontsize=8)
    axes.set_title("Fig. 6: columns 10 m wide, base 30°")


def draw_forces(axes: Axes, computed: Floats, exact: Floats, title: str, colour: str) -> None:
    """Draw the forces of all columns against the limit equilibrium (Fig. 7)."""
    number = np.arange(1, len(exact) + 1)
    axes.bar(number, exact / 1e6, color="0.85", label="limit equilibrium")
    axes.plot(number, computed / 1e6, "o", color=colour, markersize=5, label="computed")
    axes.set(xlabel="column, from the toe", ylabel="force on the base [MN/m]", title=title)
    axes.set_xticks(number[::3])
    axes.legend()


def draw_modes(axes: Axes, found: Found) -> None:
    """Draw how the columns move, exaggerated, in the colour of their mode (Fig. 8)."""
    terrain, _ = slopes.toppling_slope()
    _base(axes, terrain.points * (-1.0, 1.0))
    most = max(np.abs(b - a).max() for a, b in zip(found.before, found.after, strict=True))
    for old, new, mode in zip(found.before, found.after, found.modes, strict=True):
        shape = old + SHOWN / most * (new - old)
        axes.fill(*shape.T, facecolor=COLOURS[mode], edgecolor="white", alpha=0.8, linewidth=0.6)
    axes.set_title(f"Fig. 8 and Table 1: modes at {MODES_DEG:g}°")
    axes.legend(handles=[Patch(color=c, label=name) for name, c in COLOURS.items()])


def _base(axes: Axes, chain: Floats) -> None:
    axes.fill(*np.vstack([chain, [(-150.0, -30.0), (40.0, -30.0)]]).T, color="#c9bca5", linewidth=0)
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.set(xlim=(-140.0, 25.0), ylim=(-18.0, 116.0))


def rows(found: Found, exact: Toppling) -> list[dict[str, object]]:
    """Return Fig. 7 and Table 1 as a table, from the top column down."""
    return [
        {
            "column": n + 1,
            "normal_N": found.normal[n],
            "normal_exact_N": exact.normal[n],
            "shear_N": found.shear[n],
            "shear_exact_N": exact.shear[n],
            "mode": found.modes[n],
            "mode_table_1": TABLE_1[n],
        }
        for n in reversed(range(len(TABLE_1)))
    ]


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw; `quick` has no effect, since the run takes seconds."""
    found, exact = compute(), slopes.limit_state(slopes.LIMIT_DEG)

    def picture(figure: Figure) -> None:
        (a, b), (c, d) = figure.subplots(2, 2)
        draw_geometry(a)
        draw_modes(b, found)
        draw_forces(c, found.normal, exact.normal, "Fig. 7: normal forces", BLUE)
        draw_forces(d, found.shear, exact.shear, "Fig. 7: shear forces", RED)

    write(out / "fig07_toppling.csv", rows(found, exact))
    draw(out / "fig07_toppling.png", (10.0, 8.4), picture)
    normal = float(np.abs(found.normal / exact.normal - 1.0).max())
    shear = float(np.abs(found.shear / exact.shear - 1.0).max())
    other = sum(a != b for a, b in zip(found.modes, TABLE_1, strict=True))
    return Number(
        "greatest relative error of 32 forces, or columns of another mode than in Table 1 [-]",
        max(normal, shear, float(other)),
        high=0.01,
        note=f"normal forces {normal:.2e}, shear forces {shear:.2e}; {other} modes differ",
    )


if __name__ == "__main__":
    main(run)
