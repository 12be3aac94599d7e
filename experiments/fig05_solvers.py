"""Fig. 5: successive over-relaxation compared with preconditioned conjugate gradients.

The systems are those of one step of a loaded pile of bricks with all contacts closed, at three
stiffnesses h = k_n dt^2 / (2 m) of its contacts relative to the inertia of its blocks. Both solvers
start from zero displacement and stop at the same residual. Over-relaxation uses the fixed factor of
`Settings`, as a program must choose it in advance, and the best factor for each system, which is
only known afterwards.

Judged by the number of blocks above which conjugate gradients need fewer iterations than
over-relaxation with the fixed factor, at h = 10. Fewer iterations than with the best factor are
reported but not reached where inertia keeps the system well conditioned: there, optimal
over-relaxation converges at up to twice the rate of conjugate gradients with the inverse diagonal
(Young 1971, Iterative solution of large linear systems).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.pile import pile, system
from experiments.script import BLUE, ORANGE, RED, Number, cpu_time, draw, main, say, write
from rigdda import Settings
from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.dynamics.solvers import solve_pcg, solve_sor
from rigdda.kernel import entry_kernel

STIFFNESS = (0.1, 1.0, 10.0)
"""k_n dt^2 / (2 m) [-]."""

COURSES, QUICK_COURSES = (2, 3, 5, 8, 11, 16, 22, 32), (2, 4, 8, 16)
"""Courses of the pile."""

TOLERANCE = 1e-7
"""Residual at which both solvers stop, in the norm of the inverse diagonal, over the forces [-]."""

FACTOR = Settings().relaxation
"""The fixed over-relaxation factor [-]."""

FACTORS = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.75, 1.8, 1.85, 1.9, 1.93, 1.95, 1.97, 1.98)
"""Factors among which the best one is selected [-]."""

LARGEST = 256
"""Target: number of blocks above which conjugate gradients need fewer iterations."""

SOLVERS = {"pcg": ("PCG", BLUE), "sor": (f"SOR {FACTOR:g}", RED), "best": ("SOR best", ORANGE)}
"""Columns of the table with their labels and colours."""


@entry_kernel
def pcg(m: Matrix, scratch: Scratch, n: int, pairs: int) -> int:
    """Solve from zero displacement by conjugate gradients; return the iterations."""
    m.d[:] = 0.0
    return solve_pcg(m, scratch, n, pairs, TOLERANCE, False)


@entry_kernel
def sor(m: Matrix, scratch: Scratch, n: int, pairs: int, factor: float) -> int:
    """Solve from zero displacement by over-relaxation; return the sweeps."""
    m.d[:] = 0.0
    return solve_sor(m, scratch, n, pairs, TOLERANCE, factor)


def row(courses: int, h: float) -> dict[str, Any]:
    """Return iterations and times of both solvers for one pile."""
    (matrix, scratch), n, pairs = system(pile(courses), h)
    sweeps = {factor: sor(matrix, scratch, n, pairs, factor) for factor in (*FACTORS, FACTOR)}
    best = min(sweeps, key=lambda factor: sweeps[factor])
    found = matrix.d[:n].copy()  # with FACTOR
    steps = pcg(matrix, scratch, n, pairs)
    solved = matrix.d[:n].copy()
    return {
        "h": h,
        "blocks": n,
        "pcg_iterations": steps,
        "sor_iterations": sweeps[FACTOR],
        "best_iterations": sweeps[best],
        "best_factor": best,
        "pcg_us": 1e6 * cpu_time(lambda: pcg(matrix, scratch, n, pairs)),
        "sor_us": 1e6 * cpu_time(lambda: sor(matrix, scratch, n, pairs, FACTOR)),
        "best_us": 1e6 * cpu_time(lambda: sor(matrix, scratch, n, pairs, best)),
        "difference": float(np.abs(solved - found).max() / np.abs(found).max()),
    }


def crossing(rows: list[dict[str, Any]], h: float, other: str, what: str) -> float:
    """Return the number of blocks above which PCG has less of `what`, inf if there is none."""
    least = math.inf
    for r in sorted((r for r in rows if r["h"] == h), key=lambda r: -r["blocks"]):
        if r[f"pcg_{what}"] >= r[f"{other}_{what}"]:
            break
        least = r["blocks"]
    return least


def report(rows: list[dict[str, Any]]) -> str:
    """Return the numbers of blocks above which conjugate gradients are ahead, in words."""
    lines = []
    for h in STIFFNESS:
        for other, (name, _) in list(SOLVERS.items())[1:]:
            cells = []
            for what, word in (("iterations", "fewer iterations"), ("us", "less time")):
                blocks = crossing(rows, h, other, what)
                found = f"from {blocks:g} blocks on" if blocks < math.inf else "at no size"
                cells.append(f"{word} {found}")
            lines.append(f"h = {h:g}: PCG against {name}: {', '.join(cells)}")
    lost = any(crossing(rows, h, "best", "iterations") == math.inf for h in STIFFNESS)
    told = "NOT REACHED: fewer iterations than SOR at its best factor, unknown in advance"
    return "\n".join([*lines, *([told] if lost else [])])


def draw_lines(axes: Axes, rows: list[dict[str, Any]], what: str, label: str) -> None:
    """Draw a quantity of both solvers against the number of blocks."""
    for h, style in zip(STIFFNESS, (":", "--", "-"), strict=True):
        here = [r for r in rows if r["h"] == h]
        blocks = [r["blocks"] for r in here]
        for key, (name, colour) in SOLVERS.items():
            values = [r[f"{key}_{what}"] for r in here]
            axes.plot(blocks, values, style, marker="o", markersize=3, color=colour,
                      label=f"{name}, h = {h:g}")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="blocks", ylabel=label)


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    rows = []
    for courses in QUICK_COURSES if quick else COURSES:
        say(f"fig05: {courses} courses")
        rows += [row(courses, h) for h in STIFFNESS]

    def picture(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        draw_lines(left, rows, "us", "CPU of one solution [µs]")
        draw_lines(right, rows, "iterations", "iterations")
        figure.legend(*right.get_legend_handles_labels(), loc="outside right center", fontsize=8)
        figure.suptitle(f"Fig. 5: a pressed pile, residual {TOLERANCE:g}")

    write(out / "fig05_solvers.csv", rows)
    draw(out / "fig05_solvers.png", (10.0, 4.2), picture)
    return Number(
        f"blocks from which on PCG needs fewer iterations than SOR {FACTOR:g}, h = 10 [-]",
        crossing(rows, 10.0, "sor", "iterations"),
        high=LARGEST,
        note=report(rows),
    )


if __name__ == "__main__":
    main(run)
