"""Direct solution of one 3x3 block."""

from __future__ import annotations

from numpy.typing import NDArray

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
