"""Direct solution of an island: Cholesky factors within the profile of the matrix (a skyline).

Best for few blocks and for chains such as stacks, whose profile is short when blocks are numbered
along the chain.
"""

from __future__ import annotations

import math

from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.kernel import kernel


@kernel
def profile(m: Matrix, scratch: Scratch, n: int, pairs: int) -> int:
    """Set first[i], the leftmost block in row i, and return the number of entries of the profile.

    row[r] is the place in scratch.factor at which scalar row r would have its column 0.
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
    """Copy the lower half of the block-sparse matrix into the profile."""
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
    """Solve K d = rhs for n blocks whose `profile` has `count` entries; sets m.d."""
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
