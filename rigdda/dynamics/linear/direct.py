"""Direct solution for one block."""

from __future__ import annotations

from numpy.typing import NDArray

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
