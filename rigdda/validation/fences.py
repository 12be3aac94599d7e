"""A fence takes its capacity from the blocks that hit it and leaves them the rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate

from rigdda.barriers import Fence
from rigdda.dynamics.monitors import FAILED
from rigdda.model.scene import Scene, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, box, kinetic_energy, masses, rock

CAPACITY = 1e5
"""Of the fence [J/m]."""

FENCE = Fence(0.0, 20.0, CAPACITY)

SIDE = 1.4
"""Side of the squares [m]."""

DURATION = 4.0
"""Time in which three squares arrive and fly on [s]."""

PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Parts of a step by which a volley is late: it hits elsewhere in a step."""


def volley(shares: Sequence[float], late: float = 0.0) -> Scene:
    """Return squares that hit the fence flat, one after the other, without gravity.

    `shares` are their energies over its capacity, `late` is a time [s].
    """
    mass = masses(Scene(None, (box(width=SIDE, height=SIDE),)))[0][0]
    blocks = []
    for i, share in enumerate(shares):
        speed = math.sqrt(2.0 * share * CAPACITY / mass)
        x, y = -3.0 - 5.0 * i - speed * late, 2.0 + 3.0 * i
        blocks.append(box(x, y, SIDE, SIDE, velocity=(speed, 0.0, 0.0)))
    return Scene(Terrain(FLAT), tuple(blocks), rock(30.0, 0.5), barriers=(FENCE,), gravity=0.0)


def outcome(shares: Sequence[float]) -> tuple[int, float]:
    """Return which hit breaks the fence, 0 if none does, and the energy kept over capacity."""
    taken = list(accumulate(shares))
    breaking = next((hit for hit, total in enumerate(taken, 1) if total > 1.0), 0)
    return breaking, max(taken[-1] - 1.0, 0.0)


def fly(lab: Lab, scene: Scene) -> tuple[int, float]:
    """Return what `outcome` foretells, as it is computed."""
    sim = lab.simulate(scene)
    events = sim.run(DURATION).events
    broken = events[events["kind"] == FAILED]
    kept = kinetic_energy(sim.velocities, *masses(scene)) / CAPACITY
    return int(broken["block"][0]) + 1 if len(broken) else 0, kept


def measure(lab: Lab, shares: Sequence[float]) -> tuple[Measured, Measured]:
    """Throw one volley, at all phases."""
    found = (fly(lab, volley(shares, phase * lab.dt)) for phase in PHASES)
    breaking, kept = zip(*found, strict=True)
    exact = outcome(shares)
    return Measured(breaking, exact[0]), Measured(kept, exact[1])


def case(name: str, *shares: float) -> Case:
    """Return the case of one volley."""
    checks = (
        Check("hit that breaks it", "the first beyond the capacity", "-", 0.0, "absolute"),
        Check("energy kept", "sum of hits - capacity E, or none", "E", 0.01, "absolute"),
    )
    return Case(name, checks, lambda lab: measure(lab, shares))


def absorbed(lab: Lab, row: int, shots: Sequence[float]) -> tuple[Measured]:
    """Return what a fence takes, where a row of unit squares leans on it and others come behind.

    `shots` are the places of what comes with 10 m/s [m]. Of the energy E of one that arrives
    through n others the fence takes E / (n + 1), of what comes together all.
    """
    blocks = [box(-0.5 - i, 0.5) for i in range(row)]
    blocks += [box(x, 0.5, velocity=(10.0, 0.0, 0.0)) for x in shots]
    scene = Scene(Terrain(FLAT), tuple(blocks), rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
    one = 50.0 * masses(scene)[0][0]
    exact = sum(one / (row + i + 1) for i in range(len(shots))) if row else one * len(shots)
    return (Measured(lab.simulate(scene).run(1.0).absorbed[0], exact),)


def struck(lab: Lab, ahead: float) -> tuple[Measured]:
    """Return what a fence takes, where a fast block strikes a slow one that hits it.

    Both in the same step: it takes the energy of the slow one, and half of that of the fast one.
    """
    fast, dt = 20.0, lab.dt
    blocks = (
        box(-0.5 - 0.3 * ahead * dt, 0.5, velocity=(ahead, 0.0, 0.0)),
        box(-1.5 - 0.3 * fast * dt, 0.5, velocity=(fast, 0.0, 0.0)),
    )
    scene = Scene(Terrain(FLAT), blocks, rock(0.0), barriers=(Fence(0.0, 5.0, 1e9),))
    exact = 0.5 * masses(scene)[0][0] * (ahead**2 + 0.5 * fast**2)
    return (Measured(lab.simulate(scene).run(1.0).absorbed[0], exact),)


def train(name: str, row: int, *shots: float) -> Case:
    """Return the case of blocks that come one behind the other."""
    check = Check("absorbed energy", "momentum of blows and trains", "J", 0.08, "relative")
    return Case(name, (check,), lambda lab: absorbed(lab, row, shots))


CASES = (
    train("fence-train", 0, -3.0, -4.0, -5.0),
    train("fence-row", 3, -6.0, -7.3, -8.6),
    Case(
        "fence-struck",
        (Check("absorbed energy", "momentum of blow and hit", "J", 0.01, "relative"),),
        lambda lab: struck(lab, 0.5),
    ),
    case("fence-0.9", 0.9),
    case("fence-1.1", 1.1),
    case("fence-3x0.45", 0.45, 0.45, 0.45),
)
