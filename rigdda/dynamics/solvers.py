"""Solvers of the simultaneous equations of an island.

The default is the conjugate gradient method, preconditioned by the inverse of the diagonal (Koo and
Chern 1998), or by the inverses of its 3x3 blocks for comparison. Successive over-relaxation is the
original solver of DDA (Fig. 5). The direct solver computes Cholesky factors within the skyline of
the matrix. It is best for few blocks and for chains such as stacks, whose skyline is short if
blocks are numbered along the chain.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.kernel import kernel


@kernel
def solve_block(k: NDArray, f: NDArray, d: NDArray) -> None:
    """Solve K d = f for one 3x3 block, symmetric or not, by elimination with partial pivoting.

    A contact may be 1e7 times as stiff as the inertia term. Cramer's rule would square that ratio,
    which leaves only two digits of the force of such a contact.
    """
    i, j, n = 0, 1, 2  # row order after pivoting
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
def profile(m: Matrix, scratch: Scratch, n: int, pairs: int) -> int:
    """Set first[i], the leftmost block in row i, and return the number of skyline entries.

    row[r] is the index in scratch.factor at which scalar row r would have its column 0.
    """
    for i in range(n):
        scratch.first[i] = i
    for q in range(pairs):
        i, j = m.pair_i[q], m.pair_j[q]
        scratch.first[max(i, j)] = min(scratch.first[max(i, j)], min(i, j))
    count = 0
    for r in range(3 * n):
        low = 3 * scratch.first[r // 3]
        scratch.row[r] = count - low
        count += r + 1 - low
    return count


@kernel
def fill(m: Matrix, scratch: Scratch, n: int, pairs: int, count: int) -> None:
    """Copy the lower triangle of the block-sparse matrix into the skyline."""
    for e in range(count):
        scratch.factor[e] = 0.0
    for i in range(n):
        for a in range(3):
            for b in range(a + 1):
                scratch.factor[scratch.row[3 * i + a] + 3 * i + b] = m.diagonal[i, a, b]
    for q in range(pairs):
        i, j = m.pair_i[q], m.pair_j[q]
        for a in range(3):
            for b in range(3):
                if i > j:
                    scratch.factor[scratch.row[3 * i + a] + 3 * j + b] += m.off[q, a, b]
                else:
                    scratch.factor[scratch.row[3 * j + b] + 3 * i + a] += m.off[q, a, b]


@kernel
def solve_skyline(m: Matrix, scratch: Scratch, n: int, pairs: int, count: int) -> None:
    """Solve K d = rhs for n blocks whose skyline has `count` entries; the solution is in m.d."""
    fill(m, scratch, n, pairs, count)
    factor, row = scratch.factor, scratch.row
    for r in range(3 * n):
        low = 3 * scratch.first[r // 3]
        total = m.rhs[r // 3, r % 3]
        for s in range(low, r):
            start = max(low, 3 * scratch.first[s // 3])
            value = factor[row[r] + s]
            for t in range(start, s):
                value -= factor[row[r] + t] * factor[row[s] + t]
            value /= factor[row[s] + s]
            factor[row[r] + s] = value
            total -= value * m.d[s // 3, s % 3]
        pivot = factor[row[r] + r]
        for t in range(low, r):
            pivot -= factor[row[r] + t] ** 2
        factor[row[r] + r] = math.sqrt(pivot)
        m.d[r // 3, r % 3] = total / factor[row[r] + r]
    for r in range(3 * n - 1, -1, -1):
        m.d[r // 3, r % 3] /= factor[row[r] + r]
        value = m.d[r // 3, r % 3]
        for s in range(3 * scratch.first[r // 3], r):
            m.d[s // 3, s % 3] -= factor[row[r] + s] * value


SMALLEST = float(np.finfo(float).tiny)
"""Least squared residual norm that counts as nonzero; forces in equilibrium give a right-hand side
of zero."""


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
    """Set scaled = residual / diagonal, by entries or 3x3 blocks; return residual . scaled."""
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
    """Solve K d = rhs by preconditioned conjugate gradients, starting from m.d.

    Stops when the residual, in the norm of the preconditioner, is below `tolerance` times that of
    the right-hand side, or at the smallest positive number.

    Returns
    -------
    int
        Number of iterations.
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


@kernel
def list_neighbours(m: Matrix, scratch: Scratch, n: int, pairs: int) -> None:
    """Build linked lists of the off-diagonal blocks of each row.

    A list starts at first[i], continues through next[2 q] or next[2 q + 1], and ends at -1.
    """
    for i in range(n):
        scratch.first[i] = -1
    for q in range(pairs):
        i, j = m.pair_i[q], m.pair_j[q]
        scratch.next[2 * q], scratch.first[i] = scratch.first[i], 2 * q
        scratch.next[2 * q + 1], scratch.first[j] = scratch.first[j], 2 * q + 1


@kernel
def solve_sor(
    m: Matrix, scratch: Scratch, n: int, pairs: int, tolerance: float, factor: float
) -> int:
    """Solve K d = rhs by over-relaxation of 3x3 blocks, starting from m.d; return the sweeps.

    Stops when the residual, in the norm of the inverse diagonal as for conjugate gradients, is
    below `tolerance` times that of the right-hand side, or at the smallest positive number.
    """
    list_neighbours(m, scratch, n, pairs)
    scale = 0.0
    for i in range(n):
        for a in range(3):
            scale += m.rhs[i, a] ** 2 / m.diagonal[i, a, a]
    limit = max(tolerance * tolerance * scale, SMALLEST)
    sweeps, off = 0, 1e300
    while off > limit and sweeps < 100 * n + 300:
        off = 0.0
        for i in range(n):
            k = m.diagonal[i]
            for a in range(3):
                scratch.residual[i, a] = m.rhs[i, a]
                for b in range(3):
                    scratch.residual[i, a] -= k[a, b] * m.d[i, b]
            entry = scratch.first[i]
            while entry >= 0:
                q = entry // 2
                for a in range(3):
                    for b in range(3):
                        if entry % 2 == 0:
                            scratch.residual[i, a] -= m.off[q, a, b] * m.d[m.pair_j[q], b]
                        else:
                            scratch.residual[i, a] -= m.off[q, b, a] * m.d[m.pair_i[q], b]
                entry = scratch.next[entry]
            solve_block(k, scratch.residual[i], scratch.scaled[i])
            for a in range(3):
                off += scratch.residual[i, a] ** 2 / k[a, a]
                m.d[i, a] += factor * scratch.scaled[i, a]
        sweeps += 1
    return sweeps
