r"""Contact springs as submatrices.

A spring of stiffness k along direction e of a contact contributes k e_i^t e_j to the stiffness,
with e_i = (l, m, r x (l, m)) the rows of T_i along (l, m) = the normal or the shear direction.
`island.assemble_contact` adds the springs of a contact to the system, friction among them.
"""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.records import Contact
from rigdda.kernel import kernel


@kernel
def normal_row(c: Contact, of_a: bool) -> tuple[float, float, float]:
    """Return e along the normal of a contact for its body a, or b."""
    if of_a:
        return c.nx, c.ny, c.ra_x * c.ny - c.ra_y * c.nx
    return -c.nx, -c.ny, -(c.rb_x * c.ny - c.rb_y * c.nx)


@kernel
def shear_row(c: Contact, of_a: bool) -> tuple[float, float, float]:
    """Return e along the normal turned by +90 degrees for body a, or b."""
    if of_a:
        return -c.ny, c.nx, c.ra_x * c.nx + c.ra_y * c.ny
    return c.ny, -c.nx, -(c.rb_x * c.nx + c.rb_y * c.ny)


@kernel
def add_block(
    matrix: NDArray, stiffness: float, e: tuple[float, float, float], f: tuple[float, float, float]
) -> None:
    """Add stiffness e^t f to a 3x3 block."""
    for i in range(3):
        for j in range(3):
            matrix[i, j] += stiffness * e[i] * f[j]


@kernel
def add_force(rhs: NDArray, force: float, e: tuple[float, float, float]) -> None:
    """Add the generalised force of `force` along e to a right-hand side."""
    rhs[0] += force * e[0]
    rhs[1] += force * e[1]
    rhs[2] += force * e[2]


@kernel
def along(e: tuple[float, float, float], d: NDArray) -> float:
    """Return the displacement along e of a block that moves by d."""
    return e[0] * d[0] + e[1] * d[1] + e[2] * d[2]


@kernel
def relative_displacement(c: Contact, d: NDArray, i: int, j: int) -> tuple[float, float]:
    """Return the normal and shear displacement of a contact of slots i and j (-1: at rest) [m]."""
    dn, ds = along(normal_row(c, True), d[i]), along(shear_row(c, True), d[i])
    if j >= 0:
        dn += along(normal_row(c, False), d[j])
        ds += along(shear_row(c, False), d[j])
    return dn, ds
