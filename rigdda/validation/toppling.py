"""A toppling slope of 16 columns in static mode, compared with its limit equilibrium.

This is the example of Goodman and Bray (1976) that Koo and Chern (1998) analyse in Figs 6 to 8 and
Table 1: base dip 30 deg, columns 10 m wide, base steps of 1 m, rock of 25 kN/m3.
"""

from __future__ import annotations

import math

import numpy as np

from rigdda.limit_equilibrium import Toppling, columns, toppling
from rigdda.model.loads import PointLoad
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import GRAVITY, Floats, polygon

WIDTH, STEP, DIP_DEG, WEIGHT = 10.0, 1.0, 30.0, 25e3
"""Width of a column [m], step of the base [m], dip [deg], unit weight [N/m3]."""

HEIGHTS = columns(crest=10, above=6, rise=5.0, fall=5.0, step=STEP)
"""Heights of the columns from the toe upwards [m]."""

LIMIT_DEG = 38.15
"""Friction angle at which forces are compared [deg]; the limit is 38.151 deg."""

BOLTED_DEG = math.degrees(math.atan(0.65))
"""Friction angle at which a bolt force of 2,013 kN is required in the toe column [deg]."""

STEPS, STEP_TIME, PENETRATION = 2000, 1e-2, 1e-3
"""Number of static steps, their length [s] and the target penetration [m].

k_n dt^2/M = g dt^2/penetration is about 1 for the highest column. If it is much smaller, forces do
not converge in this number of steps; if it is much greater, they do not converge at all.
"""

STILL = 1e-6
"""Displacement per step over that of a free fall, g dt^2/2, below which a slope is stable [-]."""


def limit(friction_deg: float) -> Toppling:
    """Return the limit equilibrium of the slope."""
    return toppling(HEIGHTS, WIDTH, STEP, DIP_DEG, friction_deg, WEIGHT)


def slope() -> tuple[Terrain, tuple[Block, ...]]:
    """Return the stepped base and the columns; the slope rises to the right."""
    dip = math.radians(DIP_DEG)
    chain, blocks = [(-40.0, 0.0)], []
    for n, height in enumerate(HEIGHTS):
        left, right, base = n * WIDTH, (n + 1) * WIDTH, n * STEP
        chain += [(left, base), (right, base)] if n else [(right, base)]
        column = [(left, base), (right, base), (right, base + height), (left, base + height)]
        blocks.append(Block(polygon(column, angle=dip), density=WEIGHT / GRAVITY))
    top = len(HEIGHTS) * STEP
    chain += [(right, top), (right + 40.0, top)]
    return Terrain(polygon(chain, angle=dip)), tuple(blocks)


def relax(lab: Lab, friction_deg: float, bolt: float = 0.0) -> Metered:
    """Return the slope after static steps, with a horizontal force [N] into the toe column.

    Contacts are the paper's plain springs. Higher columns settle more on them, which mobilises
    friction between columns that then slide together, as the limit equilibrium assumes.
    """
    terrain, blocks = slope()
    centre = blocks[0].vertices.mean(axis=0)
    loads = (PointLoad(0, tuple(centre), (bolt, 0.0)),) if bolt else ()
    surfaces = {"rock": Surface(friction_deg=friction_deg, restitution=None)}
    scene = Scene(terrain, blocks, surfaces, loads=loads)
    sim = lab.simulate(scene, mode="static", penetration=PENETRATION, sleeping=False)
    sim.step(STEPS)
    return sim


def base_forces(sim: Metered) -> tuple[Floats, Floats]:
    """Return normal and shear forces of the base on each column [N], shear positive up the dip."""
    contacts = sim.contacts()
    force = np.zeros((len(HEIGHTS), 2))
    for c in contacts[contacts["block_b"] == -1]:
        along = np.array([-c["ny"], c["nx"]])
        normal = np.array([c["nx"], c["ny"]])
        force[c["block_a"]] += c["normal_force"] * normal + c["shear_force"] * along
    local = polygon(force, angle=-math.radians(DIP_DEG))
    return local[:, 1], local[:, 0]


def modes(sim: Metered, steps: int) -> list[str]:
    """Return the mode of motion of each column in the next `steps` steps.

    The mode is given by the greater of the displacement of its top by rotation and the sliding of
    its lower corner. A column is stable if both are below a hundredth of the greatest displacement
    of all columns.
    """
    heel, angle = heels(sim), sim.poses[:, 2]
    sim.step(steps)
    turned = np.abs(sim.poses[:, 2] - angle) * np.array(HEIGHTS)
    slid = np.hypot(*(heels(sim) - heel).T)
    most = np.maximum(turned, slid)
    moving = np.where(turned > slid, "toppling", "sliding")
    return [str(mode) for mode in np.where(most < 0.01 * most.max(), "stable", moving)]


def heels(sim: Metered) -> Floats:
    """Return the lower downhill corners of all columns, (N, 2) [m]."""
    return np.array([sim.vertices(n)[0] for n in range(len(HEIGHTS))])


def measure_forces(lab: Lab) -> tuple[Measured, Measured]:
    """Compare the 32 base forces."""
    exact = limit(LIMIT_DEG)
    normal, shear = base_forces(relax(lab, LIMIT_DEG))
    return Measured(normal, exact.normal), Measured(shear, exact.shear)


def measure_modes(lab: Lab) -> tuple[Measured]:
    """Count the columns whose mode differs from the limit equilibrium, below the limit."""
    found, exact = modes(relax(lab, 38.0), STEPS), limit(38.0).mode
    return (Measured(sum(a != b for a, b in zip(found, exact, strict=True))),)


def advance(sim: Metered) -> float:
    """Return the greatest displacement of a column per step over that of a free fall [-]."""
    start, dt = sim.poses, sim.settings.dt
    sim.step(STEPS // 2)
    moved = float(np.hypot(*(sim.poses - start)[:, :2].T).max())
    return moved / (STEPS // 2) / (0.5 * GRAVITY * dt**2)


def measure_standing(lab: Lab) -> tuple[Measured, Measured, Measured]:
    """Compare a slope above the limit, one with sufficient bolting and one with too little."""
    return (
        Measured(advance(relax(lab, 38.3))),
        Measured(advance(relax(lab, BOLTED_DEG, 2150e3))),
        Measured(float(advance(relax(lab, BOLTED_DEG, 1500e3)) > STILL), 1.0),
    )


SOURCE = "limit equilibrium (Goodman, Bray 1976)"

CASES = (
    Case(
        "toppling-forces",
        (
            Check("base normal forces", SOURCE, "N", 1e-2, "relative"),
            Check("base shear forces", SOURCE, "N", 1e-2, "relative"),
        ),
        measure_forces,
        dt=STEP_TIME,
    ),
    Case(
        "toppling-modes",
        (Check("other modes", f"none: {SOURCE}", "-", 0.0, "bound"),),
        measure_modes,
        dt=STEP_TIME,
    ),
    Case(
        "toppling-stands",
        (
            Check("advance at 38.3 deg", f"none: limit 38.151, {SOURCE}", "-", STILL, "bound"),
            Check("advance at 2,150 kN", f"none: limit 2,013, {SOURCE}", "-", STILL, "bound"),
            Check("moves at 1,500 kN", f"yes: limit 2,013, {SOURCE}", "-", 0.0, "absolute"),
        ),
        measure_standing,
        dt=STEP_TIME,
    ),
)
