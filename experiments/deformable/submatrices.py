r"""Submatrices of a block with D = (u0, v0, r0, ex, ey, gxy) (Shi and Goodman 1989).

.. math:: T = \begin{bmatrix} 1 & 0 & -Y & X & 0 & Y/2 \\ 0 & 1 & X & 0 & Y & X/2 \end{bmatrix},
          \qquad X = x - x_0, \; Y = y - y_0

gives the displacement of a point; the centroid is (x0, y0).
"""

from __future__ import annotations

from rigdda.dynamics.arrays import Outlines
from rigdda.dynamics.records import Floats
from rigdda.kernel import kernel

UNKNOWNS = 6

Row = tuple[float, float, float, float, float, float]


@kernel
def row_along(x: float, y: float, lx: float, ly: float) -> Row:
    """Return (lx, ly) T at arm (x, y) [m]: displacement along a direction per unknown."""
    return (
        lx,
        ly,
        x * ly - y * lx,
        x * lx,
        y * ly,
        0.5 * (y * lx + x * ly),
    )


@kernel
def area_moments(outlines: Outlines, i: int, n: int, x0: float, y0: float) -> Row:
    """Return area [m2], then integrals of X^2, Y^2 and XY over block i [m4], and two zeros.

    They are found by simplex integration over the triangles from the centroid to each of the n
    edges.
    """
    area = xx = yy = xy = 0.0
    for k in range(n):
        end = k + 1 if k + 1 < n else 0
        ax, ay = outlines.corner[i, k].x - x0, outlines.corner[i, k].y - y0
        bx, by = outlines.corner[i, end].x - x0, outlines.corner[i, end].y - y0
        cross = ax * by - ay * bx
        area += 0.5 * cross
        xx += cross * (ax * ax + ax * bx + bx * bx) / 12.0
        yy += cross * (ay * ay + ay * by + by * by) / 12.0
        xy += cross * (2.0 * (ax * ay + bx * by) + ax * by + bx * ay) / 24.0
    return area, xx, yy, xy, 0.0, 0.0


@kernel
def set_inertia(matrix: Floats, mass: float, moments: Row) -> None:
    """Set the (6, 6) integral of rho T^t T over a block [kg, kg m2 per metre of width]."""
    density = mass / moments[0]
    xx, yy, xy = density * moments[1], density * moments[2], density * moments[3]
    matrix[:] = 0.0
    matrix[0, 0] = matrix[1, 1] = mass
    matrix[2, 2], matrix[3, 3], matrix[4, 4] = xx + yy, xx, yy
    matrix[5, 5] = 0.25 * (xx + yy)
    matrix[2, 3] = matrix[3, 2] = -xy
    matrix[2, 4] = matrix[4, 2] = xy
    matrix[2, 5] = matrix[5, 2] = 0.5 * (xx - yy)
    matrix[3, 5] = matrix[5, 3] = matrix[4, 5] = matrix[5, 4] = 0.5 * xy


@kernel
def add_elasticity(
    matrix: Floats, rhs: Floats, area: float, elasticity: Floats, stress: Floats
) -> None:
    """Add S E for the strains of a block, and - S sigma_0 for its present stress [N m].

    `elasticity` is the (3, 3) matrix E [Pa] and `stress` is (sx, sy, txy) [Pa].
    """
    for a in range(3):
        rhs[3 + a] -= area * stress[a]
        for b in range(3):
            matrix[3 + a, 3 + b] += area * elasticity[a, b]
