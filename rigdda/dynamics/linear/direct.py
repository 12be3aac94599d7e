"""Direct solution for one block and for two, whose friction makes the matrix unsymmetric."""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Matrix
from rigdda.kernel import kernel


@kernel
def solve_block(k: NDArray, f: NDArray, d: NDArray) -> None:
    """Solve K d = f for one 3x3 block, symmetric or not, by Cramer's rule."""
    c00 = k[1, 1] * k[2, 2] - k[1, 2] * k[2, 1]
    c01 = k[1, 2] * k[2, 0] - k[1, 0] * k[2, 2]
    c02 = k[1, 0] * k[2, 1] - k[1, 1] * k[2, 0]
    scale = 1.0 / (k[0, 0] * c00 + k[0, 1] * c01 + k[0, 2] * c02)
    c10 = k[0, 2] * k[2, 1] - k[0, 1] * k[2, 2]
    c11 = k[0, 0] * k[2, 2] - k[0, 2] * k[2, 0]
    c12 = k[0, 1] * k[2, 0] - k[0, 0] * k[2, 1]
    c20 = k[0, 1] * k[1, 2] - k[0, 2] * k[1, 1]
    c21 = k[0, 2] * k[1, 0] - k[0, 0] * k[1, 2]
    c22 = k[0, 0] * k[1, 1] - k[0, 1] * k[1, 0]
    d[0] = scale * (c00 * f[0] + c10 * f[1] + c20 * f[2])
    d[1] = scale * (c01 * f[0] + c11 * f[1] + c21 * f[2])
    d[2] = scale * (c02 * f[0] + c12 * f[1] + c22 * f[2])


@kernel
def solve_two_blocks(m: Matrix, dense: NDArray) -> None:
    """Set the displacements of two blocks, slots 0 and 1, that touch in pair 0 at most.

    Gaussian elimination with partial pivoting; `m.lower` is the block below the diagonal.
    """
    a, first = dense, m.pair_i[0]
    for i in range(3):
        for j in range(3):
            a[i, j], a[3 + i, 3 + j] = m.diagonal[0, i, j], m.diagonal[1, i, j]
            upper, lower = m.off[0, i, j], m.lower[i, j]
            a[i, 3 + j] = upper if first == 0 else lower
            a[3 + i, j] = lower if first == 0 else upper
        a[i, 6], a[3 + i, 6] = m.rhs[0, i], m.rhs[1, i]
    for j in range(6):
        pivot = j
        for i in range(j + 1, 6):
            if abs(a[i, j]) > abs(a[pivot, j]):
                pivot = i
        for q in range(j, 7):
            a[j, q], a[pivot, q] = a[pivot, q], a[j, q]
        for i in range(j + 1, 6):
            factor = a[i, j] / a[j, j]
            for q in range(j + 1, 7):
                a[i, q] -= factor * a[j, q]
    for j in range(5, -1, -1):
        value = a[j, 6]
        for q in range(j + 1, 6):
            value -= a[j, q] * m.d[q // 3, q % 3]
        m.d[j // 3, j % 3] = value / a[j, j]
