"""Fig. 4: processor time per step against the number of blocks, for 3N and 6N unknowns.

The same loaded pile is computed with rigid blocks and with the original deformable ones. Both
models share the contact detection, the penalty law, the solver and its tolerance. Judged by the
least ratio of the two times over all sizes.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from experiments.deformable.model import Deformable
from experiments.pile import pile, settings
from experiments.script import BLUE, RED, Number, draw, main, say, write
from rigdda import Simulation

STIFFNESS = 1.0
"""k_n dt^2 / (2 m) of the contacts [-]."""

COURSES, QUICK_COURSES = (2, 3, 5, 8, 11, 16, 22, 32), (2, 4, 8, 16)
"""Courses of the pile."""

WARM_UP, STEPS, REPEATS, QUICK_REPEATS = 2, 20, 15, 9
"""Number of steps that are not timed, of steps that are timed, and of repetitions."""


def rigid(courses: int) -> Simulation:
    """Return the pile of rigid blocks, all in one system."""
    chosen = settings(STIFFNESS, mode="static", islands=False, solver="pcg")
    return Simulation(pile(courses), chosen)


def deformable(courses: int) -> Deformable:
    """Return the pile of deformable blocks."""
    return Deformable(pile(courses), settings(STIFFNESS, mode="static"))


def time_of_step(model: Simulation | Deformable) -> float:
    """Return the processor time per step [s]."""
    model.step(WARM_UP)
    start = time.process_time()
    model.step(STEPS)
    return (time.process_time() - start) / STEPS


def row(courses: int, repeats: int) -> dict[str, Any]:
    """Return times and iterations of both models, with the least of several times.

    The models are timed alternately, so that other load affects both.
    """
    times = [
        (time_of_step(rigid(courses)), time_of_step(deformable(courses))) for _ in range(repeats)
    ]
    few, many = (min(each) for each in zip(*times, strict=True))
    first, second = rigid(courses), deformable(courses)
    first.step(STEPS)
    second.step(STEPS)
    done, blocks = first.diagnostics, len(first.scene.blocks)
    return {
        "blocks": blocks,
        "rigid_unknowns": 3 * blocks,
        "deformable_unknowns": 6 * blocks,
        "rigid_us": 1e6 * few,
        "deformable_us": 1e6 * many,
        "ratio": many / few,
        "rigid_open_close": done.open_close_iterations / done.steps,
        "deformable_open_close": second.work["open_close"],
        "rigid_iterations": done.solver_iterations / done.steps,
        "deformable_iterations": second.work["solver"],
    }


def draw_times(figure: Figure, rows: list[dict[str, Any]]) -> None:
    """Draw times and their ratio."""
    left, right = figure.subplots(1, 2)
    blocks = [r["blocks"] for r in rows]
    left.plot(blocks, [r["deformable_us"] for r in rows], "o-", color=RED, label="deformable, 6N")
    left.plot(blocks, [r["rigid_us"] for r in rows], "o-", color=BLUE, label="rigid, 3N")
    left.set(xscale="log", yscale="log", xlabel="blocks", ylabel="CPU of a step [µs]")
    left.set_title("Fig. 4: processor time of a step")
    left.legend()
    right.plot(blocks, [r["ratio"] for r in rows], "o-", color="black", label="processor time")
    right.plot(
        blocks,
        [r["deformable_iterations"] / r["rigid_iterations"] for r in rows],
        "s--",
        color="0.6",
        label="iterations of the solver",
    )
    right.axhline(1.0, color="0.8", zorder=0)
    right.set(xscale="log", xlabel="blocks", ylabel="deformable over rigid [-]", ylim=(0.0, None))
    right.legend()


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    rows = []
    deformable(2).step()  # compile the kernels
    for courses in QUICK_COURSES if quick else COURSES:
        say(f"fig04: {courses} courses")
        rows.append(row(courses, QUICK_REPEATS if quick else REPEATS))
    write(out / "fig04_deformable.csv", rows)
    draw(out / "fig04_deformable.png", (10.0, 4.0), lambda figure: draw_times(figure, rows))
    ratios = ", ".join(f"{r['ratio']:.1f} at {r['blocks']}" for r in rows)
    return Number(
        "least ratio of the times of a step, deformable over rigid [-]",
        min(r["ratio"] for r in rows),
        low=1.0,
        note=f"ratio of times by blocks: {ratios}",
    )


if __name__ == "__main__":
    main(run)
