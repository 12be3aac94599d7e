"""Inertia and mass-proportional damping of a block (Koo and Chern 1998)."""

from __future__ import annotations

from rigdda.kernel import kernel


@kernel
def inertia_stiffness(mass: float, damping: float, dt: float) -> float:
    """Return 2 M / dt^2 + alpha M / dt: inertia and damping on the diagonal [N/m].

    With the second moment instead of the mass it is the entry of the rotation. The submatrices
    integrate T^t T over the block, diagonal about the centroid.
    """
    return 2.0 * mass / (dt * dt) + damping * mass / dt


@kernel
def inertia_force(mass: float, velocity: float, dt: float) -> float:
    """Return 2 M V0 / dt, the force of inertia in dynamic mode [N]."""
    return 2.0 * mass * velocity / dt
