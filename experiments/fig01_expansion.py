"""Figs 1 to 3: expansion of a rotating block by the linear displacement function.

Equation 2 moves a corner at distance r along its tangent by r dr, out of its circle (Fig. 1). A
block that falls down a slope expands (Fig. 2), unless equation 1 corrects it after each step (Fig.
3). Judged by the greatest relative error of the expansion per turn compared with the closed form,
and by the area with post-correction.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.script import BLUE, GREY, RED, Number, draw, main, write
from rigdda import Block, Scene, Settings, Simulation, Terrain
from rigdda.geometry import polygon_properties
from rigdda.validation.motion import growth, spinning
from rigdda.validation.scenes import Floats, ngon, rock

DT = 5e-3
"""Time step [s]."""

ROTATIONS = (1e-3, 3e-3, 1e-2, 3e-2, 5e-2)
"""Rotations per step [rad]."""

SLOPE = ((-6.0, 16.0), (0.0, 16.0), (16.0, 0.0), (60.0, 0.0))
"""Corners of the slope [m]."""

DURATION, FRAMES = 5.4, 9
"""Duration of the fall [s], and number of outlines that are drawn."""


def area(sim: Simulation) -> float:
    """Return the area of the only block [m2]."""
    return polygon_properties(sim.vertices(0))[0]


def grown(rotation: float) -> float:
    """Return the growth of area per turn without post-correction [-], at `rotation` per step."""
    sim = Simulation(spinning(rotation / DT), Settings(dt=DT, post_correction=False))
    before = area(sim)
    sim.step(round(2.0 * math.pi / math.atan(rotation)))
    return area(sim) / before - 1.0


class Fall(NamedTuple):
    """A block that fell down the slope: outlines (F, n, 2) [m], areas (F,) over the initial one."""

    corners: list[Floats]
    areas: Floats


def fall(post_correction: bool) -> Fall:
    """Simulate a block that rolls over the crest and down the slope."""
    block = Block(ngon(7, centre=(-0.6, 17.0), angle=0.3), velocity=(1.5, 0.0, -1.5))
    scene = Scene(Terrain(SLOPE), (block,), rock(40.0, 0.3))
    sim = Simulation(scene, Settings(dt=DT, post_correction=post_correction))
    corners, areas = [sim.vertices(0)], [area(sim)]
    for _ in range(FRAMES):
        sim.step(round(DURATION / FRAMES / DT))
        corners.append(sim.vertices(0))
        areas.append(area(sim))
    return Fall(corners, np.array(areas) / areas[0])


def draw_growth(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Draw the growth of area per turn against the rotation per step."""
    dr = np.geomspace(ROTATIONS[0] / 1.5, ROTATIONS[-1] * 1.5)
    exact = [100.0 * growth(r) for r in dr]
    axes.plot(dr, exact, color=GREY, label="$(1 + r_0^2)^{2\\pi/\\arctan r_0} - 1$")
    axes.plot([r["rotation_rad"] for r in rows], [100.0 * r["growth"] for r in rows], "o",
              color=RED, label="computed, not corrected")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="rotation in a step $r_0$ [rad]")
    axes.set(ylabel="growth of area in a turn [%]", title="Fig. 1: error of a rotation")
    axes.legend()


def draw_fall(axes: Axes, found: Fall, title: str, colour: str) -> None:
    """Draw a block on its way down."""
    x, y = np.array(SLOPE).T
    axes.fill_between(x, y, -3.0, color="#c9bca5", linewidth=0)
    for corners in found.corners:
        axes.fill(*corners.T, facecolor=colour, edgecolor=colour, alpha=0.35)
    axes.set(aspect="equal", xlim=(-5.0, 32.0), ylim=(-2.0, 19.0), xlabel="x [m]", ylabel="y [m]")
    axes.set_title(f"{title}: area × {found.areas[-1]:.3f} at the end")


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw; `quick` has no effect, since the run takes a second."""
    rows = [
        {"rotation_rad": dr, "growth": grown(dr), "closed_form": growth(dr)} for dr in ROTATIONS
    ]
    plain, corrected = fall(False), fall(True)

    def picture(figure: Figure) -> None:
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.4, 1.4))
        draw_growth(left, rows)
        draw_fall(middle, plain, "Fig. 2, not corrected", RED)
        draw_fall(right, corrected, "Fig. 3, corrected", BLUE)

    write(out / "fig01_expansion.csv", rows)
    draw(out / "fig01_expansion.png", (14.0, 3.6), picture)
    errors = [abs(r["growth"] / r["closed_form"] - 1.0) for r in rows]
    kept = float(np.abs(corrected.areas - 1.0).max())
    return Number(
        "greatest error of the growth over a turn, or of the area kept by the correction [-]",
        max(*errors, kept),
        high=0.02,
        note=f"on the slope the area grows by {100.0 * (plain.areas[-1] - 1.0):.1f} % without the "
        f"correction and changes by at most {kept:.1e} with it",
    )


if __name__ == "__main__":
    main(run)
