"""Fixed points do no work and bolts conserve energy, for any step length."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ellipk

from rigdda.dynamics.simulation import Simulation
from rigdda.model.loads import Bolt, FixedPoint
from rigdda.model.scene import Block, Scene
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import GRAVITY, box, polygon, rock

LENGTH, WIDTH, ARM = 2.0, 0.2, 0.9
"""Length and width of a bar, and distance of its pin from its middle [m]."""
START = math.radians(150.0)
"""Initial angle from the hanging position [rad]."""
RATE, SPUN = 20.0, 60.0
"""Rate of rotation without gravity [rad/s], and duration [s]."""
SWINGS = 100
"""Number of periods after which energies are compared."""
COARSER = (0.2, 1.0, 4.0)
"""Steps relative to that of the lab, by default 1, 5 and 20 ms [-]."""
STIFF = (1e5, 1e6, 1e7)
"""Stiffnesses of a bolt [N/m], for which a block of 2.6 t has periods of 1, 0.32 and 0.1 s."""


def pinned(angle: float, rate: float = 0.0, gravity: float = GRAVITY) -> Scene:
    """Return a bar that is pinned at the origin, at an angle from the hanging position [rad]."""
    turn = angle - 0.5 * math.pi
    centre = ARM * np.array([math.cos(turn), math.sin(turn)])
    corners = 0.5 * np.array([LENGTH, WIDTH]) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    bar = Block(
        polygon(corners, centre, turn), velocity=(-rate * centre[1], rate * centre[0], rate)
    )
    return Scene(None, (bar,), rock(), supports=(FixedPoint(0, (0.0, 0.0)),), gravity=gravity)


def period() -> float:
    """Return the period of the bar [s]: 4 sqrt(I / m g r) K(sin(a/2)), with I about the pin."""
    radius = (LENGTH**2 + WIDTH**2) / 12.0 + ARM**2
    return float(4.0 * math.sqrt(radius / (GRAVITY * ARM)) * ellipk(math.sin(0.5 * START) ** 2))


def total(sim: Simulation) -> float:
    """Return the total energy [J]."""
    energy = sim.energy()
    return energy.kinetic + energy.potential + energy.elastic


def change(lab: Lab, scene: Scene, dt: float, time: float) -> float:
    """Return the change of the energy of a scene in a time [J]."""
    sim = lab.simulate(scene, dt)
    before = total(sim)
    sim.step(round(time / dt))
    return total(sim) - before


def measure_swing(lab: Lab) -> tuple[Measured, Measured, Measured]:
    """Swing the bar with several steps; measure its period with the step of the lab."""
    scene, passed = pinned(START), list[float]()
    mass = lab.simulate(scene).energy().potential / (-GRAVITY * ARM * math.cos(START))
    height = mass * GRAVITY * ARM * (1.0 - math.cos(START))
    found = [change(lab, scene, k * lab.dt, SWINGS * period()) / height for k in COARSER]
    sim, below = lab.simulate(scene), START
    while len(passed) < 5:
        sim.step()
        angle = START + float(sim.poses[0, 2])
        if angle * below < 0.0:
            passed.append(sim.time - lab.dt * angle / (angle - below))
        below = angle
    return (
        Measured([max(gained, 0.0) for gained in found]),
        Measured([max(-gained, 0.0) for gained in found[:2]]),
        Measured(0.5 * (passed[4] - passed[0]), period()),
    )


def measure_spin(lab: Lab) -> tuple[Measured]:
    """Spin the bar about its pin with several steps."""
    scene = pinned(0.0, RATE, 0.0)
    energy = total(lab.simulate(scene))
    found = [change(lab, scene, k * lab.dt, SPUN) / energy for k in COARSER]
    return (Measured(np.abs(found)),)


def measure_drop(lab: Lab) -> tuple[Measured, Measured]:
    """Apply the weight of a block to bolts suddenly, with several steps."""
    peaks, changes = [], []
    block = box(0.0, 0.0)
    for stiffness in STIFF:
        scene = Scene(
            None, (block,), rock(), supports=(Bolt(0, (0.0, 0.5), None, (0.0, 2.5), stiffness),)
        )
        mass = block.density  # of 1 m2
        swing, weight = 2.0 * math.pi * math.sqrt(mass / stiffness), mass * GRAVITY
        for k in COARSER:
            sim, most = lab.simulate(scene, k * lab.dt), 0.0
            before = total(sim)
            for _ in range(math.ceil(3.0 * swing / (k * lab.dt))):
                sim.step()
                most = max(most, float(sim.supports()[0, 1]))
            sim.step(round(SWINGS * swing / (k * lab.dt)))
            peaks.append(most / weight)
            changes.append(abs(total(sim) - before) * stiffness / weight**2)
    return Measured(peaks, 2.0), Measured(changes)


SUPPORT_CASES = (
    Case(
        "pin-swing",
        (
            Check("energy gained in 100 periods", "none", "-", 1e-3, "bound"),
            Check("energy lost in steps of 1 and 5 ms", "none", "-", 2e-3, "bound"),
            Check("period", "4 sqrt(I / m g r) K(sin(a/2))", "s", 1e-3, "relative"),
        ),
        measure_swing,
    ),
    Case(
        "pin-spin",
        (Check("change of energy in 60 s", "none: a constraint does no work", "-", 1e-3, "bound"),),
        measure_spin,
    ),
    Case(
        "bolt-drop",
        (
            Check("greatest tension over weight", "2", "-", 2e-2, "relative"),
            Check("change of energy in 100 periods", "none", "-", 1e-3, "bound"),
        ),
        measure_drop,
    ),
)
