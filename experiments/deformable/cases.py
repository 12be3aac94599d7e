"""Columns of elastic blocks with closed-form stresses."""

from __future__ import annotations

import numpy as np

from experiments.deformable.model import Deformable, Floats, Rock
from rigdda import PointLoad, Scene, Settings, Surface, Terrain
from rigdda.validation.scenes import FLAT, GRAVITY, box

WIDTH, HEIGHT, BLOCKS = 1.0, 1.0, 8
"""Size of a block [m], and number of blocks in a column."""

DENSITY = 2600.0
"""Density of the rock [kg/m3]."""

STEPS, DT, PENETRATION = 600, 0.02, 1e-4
"""Number of static steps to equilibrium, their length [s] and the target penetration [m]."""


def column(load: float, gravity: float) -> Deformable:
    """Return a column at rest on smooth ground, loaded by `load` [N] on the middle of its top."""
    blocks = [box(0.0, HEIGHT * (i + 0.5), WIDTH, HEIGHT, density=DENSITY) for i in range(BLOCKS)]
    loads = (PointLoad(BLOCKS - 1, (0.0, HEIGHT * BLOCKS), (0.0, -load)),) if load else ()
    smooth = {"rock": Surface(0.0, restitution=None)}
    scene = Scene(Terrain(FLAT), tuple(blocks), smooth, loads=loads, gravity=gravity)
    settings = Settings(dt=DT, penetration=PENETRATION, mode="static", sleeping=False)
    model = Deformable(scene, settings, Rock())
    model.step(STEPS)
    return model


def bar_under_its_weight() -> tuple[Floats, Floats]:
    """Return the computed vertical stress of each block, and - rho g (H - y) at its middle [Pa]."""
    y = np.array([HEIGHT * (i + 0.5) for i in range(BLOCKS)])
    return column(0.0, GRAVITY).stress[:, 1], -DENSITY * GRAVITY * (HEIGHT * BLOCKS - y)


def column_in_compression(load: float = 1e6) -> tuple[Floats, Floats]:
    """Return stress and strains of a loaded column without weight, computed and exact.

    They are the vertical stress - P / w [Pa], vertical strain - P / (w E) and lateral strain nu P /
    (w E) [-] of all blocks, (3, N).
    """
    model, rock = column(load, 0.0), Rock()
    corners = np.array([model.vertices(i) for i in range(BLOCKS)])
    tall, wide = np.ptp(corners[:, :, 1], axis=1), np.ptp(corners[:, :, 0], axis=1)
    computed = np.array([model.stress[:, 1], tall / HEIGHT - 1.0, wide / WIDTH - 1.0])
    stress = load / WIDTH
    exact = np.array([-stress, -stress / rock.young, rock.poisson * stress / rock.young])
    return computed, np.repeat(exact[:, None], BLOCKS, axis=1)
