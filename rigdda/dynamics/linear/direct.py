"""Direct solution for one block and for two, whose friction makes the matrix unsymmetric."""

from __future__ import annotations

from numpy.typing import NDArray

from rigdda.dynamics.arrays import Matrix
from rigdda.kernel import kernel


@kernel
def solve_block(k: NDArray, f: NDArray, d: NDArray) -> None:
    """Solve K d = f for one 3x3 block, symmetric or not: elimination with partial pivoting.

    A contact may be 1e7 times as stiff as inertia. Cramer's rule squares that ratio, which leaves
    two digits of the force of such a contact.
    """
    i, j, n = 0, 1, 2  # rows in the order of the pivots
    if abs(k[1, 0]) > abs(k[i, 0]):
        i, j = 1, 0
    if abs(k[2, 0]) > abs(k[i, 0]):
        i, n = 2, i
    left, right = k[j, 0] / k[i, 0], k[n, 0] / k[i, 0]
    j1, j2, fj = k[j, 1] - left * k[i, 1], k[j, 2] - left * k[i, 2], f[j] - left * f[i]
    n1, n2, fn = k[n, 1] - right * k[i, 1], k[n, 2] - right * k[i, 2], f[n] - right * f[i]
    if abs(n1) > abs(j1):
        j1, j2, fj, n1, n2, fn = n1, n2, fn, j1, j2, fj
    factor = n1 / j1
    last = (fn - factor * fj) / (n2 - factor * j2)
    middle = (fj - j2 * last) / j1
    d[0] = (f[i] - k[i, 1] * middle - k[i, 2] * last) / k[i, 0]
    d[1], d[2] = middle, last


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
