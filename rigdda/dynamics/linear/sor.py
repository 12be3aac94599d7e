"""Successive over-relaxation, the original solver of DDA, kept for comparison (Fig. 5)."""

from __future__ import annotations

from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.dynamics.linear.direct import solve_block
from rigdda.dynamics.linear.pcg import SMALLEST
from rigdda.kernel import kernel


@kernel
def list_neighbours(m: Matrix, scratch: Scratch, n: int, pairs: int) -> None:
    """List the off-diagonal blocks of each row: chains first[i], next[2 q], next[2 q + 1], -1."""
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
    """Solve K d = rhs from the start value in m.d, row by row of 3x3 blocks; returns the sweeps.

    Stops when the residual, in the norm of the inverse diagonal as for conjugate gradients, is
    below `tolerance` times the forces, or as small as numbers can be.
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
