"""Conjugate gradients preconditioned by the inverse of the diagonal (Koo and Chern 1998).

Or, for comparison, by the inverses of the 3x3 blocks on it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.dynamics.linear.direct import solve_block
from rigdda.kernel import kernel

SMALLEST = float(np.finfo(float).tiny)
"""Least residual that is told from none: forces that balance leave a right-hand side of zero."""


@kernel
def multiply(m: Matrix, n: int, pairs: int, x: NDArray, y: NDArray) -> None:
    """Set y = K x for the first n blocks and `pairs` symmetric off-diagonal blocks."""
    for i in range(n):
        k = m.diagonal[i]
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        y[i, 0] = k[0, 0] * x0 + k[0, 1] * x1 + k[0, 2] * x2
        y[i, 1] = k[1, 0] * x0 + k[1, 1] * x1 + k[1, 2] * x2
        y[i, 2] = k[2, 0] * x0 + k[2, 1] * x1 + k[2, 2] * x2
    for q in range(pairs):
        i, j, k = m.pair_i[q], m.pair_j[q], m.off[q]
        x0, x1, x2 = x[j, 0], x[j, 1], x[j, 2]
        y[i, 0] += k[0, 0] * x0 + k[0, 1] * x1 + k[0, 2] * x2
        y[i, 1] += k[1, 0] * x0 + k[1, 1] * x1 + k[1, 2] * x2
        y[i, 2] += k[2, 0] * x0 + k[2, 1] * x1 + k[2, 2] * x2
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        y[j, 0] += k[0, 0] * x0 + k[1, 0] * x1 + k[2, 0] * x2
        y[j, 1] += k[0, 1] * x0 + k[1, 1] * x1 + k[2, 1] * x2
        y[j, 2] += k[0, 2] * x0 + k[1, 2] * x1 + k[2, 2] * x2


@kernel
def precondition(m: Matrix, scratch: Scratch, n: int, by_block: bool) -> float:
    """Set scaled = residual / diagonal, entries or 3x3 blocks, and return their product."""
    product = 0.0
    for i in range(n):
        if by_block:
            solve_block(m.diagonal[i], scratch.residual[i], scratch.scaled[i])
            for j in range(3):
                product += scratch.residual[i, j] * scratch.scaled[i, j]
            continue
        for j in range(3):
            r = scratch.residual[i, j]
            z = r / m.diagonal[i, j, j]
            scratch.scaled[i, j] = z
            product += r * z
    return product


@kernel
def solve_pcg(
    m: Matrix, scratch: Scratch, n: int, pairs: int, tolerance: float, by_block: bool
) -> int:
    """Solve K d = rhs from the start value in m.d, in place.

    Stops when the residual, in the norm of the preconditioner, is below `tolerance` times the
    forces, or as small as numbers can be.

    Returns
    -------
    int
        Iterations used.
    """
    multiply(m, n, pairs, m.d, scratch.product)
    scale = 0.0
    for i in range(n):
        for j in range(3):
            scratch.residual[i, j] = m.rhs[i, j] - scratch.product[i, j]
            scale += m.rhs[i, j] ** 2 / m.diagonal[i, j, j]
    rho = precondition(m, scratch, n, by_block)
    for i in range(n):
        for j in range(3):
            scratch.direction[i, j] = scratch.scaled[i, j]
    limit = max(tolerance * tolerance * scale, SMALLEST)
    iterations = 0
    while rho > limit and iterations < 10 * n + 30:
        multiply(m, n, pairs, scratch.direction, scratch.product)
        curvature = 0.0
        for i in range(n):
            for j in range(3):
                curvature += scratch.direction[i, j] * scratch.product[i, j]
        alpha = rho / curvature
        for i in range(n):
            for j in range(3):
                m.d[i, j] += alpha * scratch.direction[i, j]
                scratch.residual[i, j] -= alpha * scratch.product[i, j]
        before, rho = rho, precondition(m, scratch, n, by_block)
        beta = rho / before
        for i in range(n):
            for j in range(3):
                scratch.direction[i, j] = scratch.scaled[i, j] + beta * scratch.direction[i, j]
        iterations += 1
    return iterations
