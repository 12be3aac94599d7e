"""Linear solvers against dense numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigdda.dynamics import solvers
from rigdda.dynamics.arrays import Matrix, Scratch
from rigdda.dynamics.packing import empty_matrix, empty_scratch
from rigdda.kernel import from_python

solve_block = from_python(solvers.solve_block)
multiply, solve_pcg = map(from_python, (solvers.multiply, solvers.solve_pcg))
profile, solve_skyline = map(from_python, (solvers.profile, solvers.solve_skyline))
solve_sor = from_python(solvers.solve_sor)

seeds = st.integers(0, 2**32 - 1)


def system(seed: int, n: int, spread: float = 1.0) -> tuple[Matrix, np.ndarray, int]:
    """Return a random system of n blocks that touch at random, the same dense, and its pairs."""
    rng = np.random.default_rng(seed)
    touching = [(i, j) for i in range(n) for j in range(i + 1, n) if rng.random() < 3.0 / n]
    m = empty_matrix(n, len(touching) + 1)
    dense = np.zeros((3 * n, 3 * n))

    def add(vector: np.ndarray) -> None:
        dense[:] += np.outer(vector, vector)

    for i in range(n):
        root = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-spread, spread)
        dense[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += root @ root.T + np.eye(3)
    for i, j in touching:  # springs, as contacts are
        spring = np.zeros(3 * n)
        spring[3 * i : 3 * i + 3], spring[3 * j : 3 * j + 3] = rng.normal(size=(2, 3))
        add(spring * 10.0 ** rng.uniform(-spread, spread))
    for i in range(n):
        m.diagonal[i] = dense[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
    for q, (i, j) in enumerate(touching):
        m.pair_i[q], m.pair_j[q] = i, j
        m.off[q] = dense[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
    m.rhs[:] = rng.normal(size=(n, 3))
    return m, dense, len(touching)


def scratch(m: Matrix) -> Scratch:
    """Return what the solvers of a system work on."""
    return empty_scratch(len(m.diagonal), len(m.off))


@given(seeds, st.integers(1, 30))
def test_multiply(seed, n):
    m, dense, pairs = system(seed, n)
    x, y = np.random.default_rng(seed).normal(size=(n, 3)), np.empty((n, 3))
    multiply(m, n, pairs, x, y)
    exact = dense @ x.ravel()
    assert np.abs(y.ravel() - exact).max() < 1e-12 * np.abs(dense).max()


@given(seeds, st.integers(1, 30), st.booleans(), st.booleans())
def test_pcg(seed, n, warm, by_block):
    m, dense, pairs = system(seed, n)
    exact = np.linalg.solve(dense, m.rhs.ravel())
    if warm:
        m.d[:n] = exact.reshape(n, 3) * 1.01
    iterations = solve_pcg(m, scratch(m), n, pairs, 1e-12, by_block)
    assert 0 < iterations < 30 * n + 30
    assert np.abs(m.d[:n].ravel() - exact).max() < 1e-8 * np.abs(exact).max()


def test_pcg_starts_from_the_given_value():
    m, dense, pairs = system(3, 20)
    m.d[:20] = np.linalg.solve(dense, m.rhs.ravel()).reshape(20, 3)
    assert solve_pcg(m, scratch(m), 20, pairs, 1e-8, False) == 0


def test_pcg_without_load():
    m, _, pairs = system(4, 5)
    m.rhs[:] = 0.0
    assert solve_pcg(m, scratch(m), 5, pairs, 1e-9, False) == 0
    assert (m.d == 0.0).all()


@pytest.mark.parametrize("size", [1.0, 1e-60, 1e-120, 1e-150, 1e-160])
@pytest.mark.parametrize("solver", ["pcg", "block-pcg", "sor"])
def test_what_moves_without_load_comes_to_rest(solver, size):
    """No share of a right-hand side of zero is a limit, and squares of small numbers underflow."""
    m, _, pairs = system(4, 5, spread=0.3)
    m.rhs[:] = 0.0
    m.d[:] = size * np.random.default_rng(0).normal(size=m.d.shape)
    if solver == "sor":
        solve_sor(m, scratch(m), 5, pairs, 1e-9, 1.0)
    else:
        solve_pcg(m, scratch(m), 5, pairs, 1e-9, solver == "block-pcg")
    assert np.isfinite(m.d).all()
    assert np.abs(m.d[:5]).max() < max(1e-12 * size, 1e-110)


@pytest.mark.parametrize("symmetric", [True, False])
@given(seed=seeds)
def test_solve_block(symmetric, seed):
    rng = np.random.default_rng(seed)
    k, f, d = rng.normal(size=(3, 3)), rng.normal(size=3), np.empty(3)
    k = k @ k.T + 0.1 * np.eye(3) if symmetric else k + 4.0 * np.eye(3)
    solve_block(k, f, d)
    exact = np.linalg.solve(k, f)
    assert np.abs(d - exact).max() < 1e-12 * np.linalg.cond(k) * np.abs(exact).max()


@given(seeds, st.integers(1, 30))
def test_skyline(seed, n):
    m, dense, pairs = system(seed, n)
    space = scratch(m)
    count = profile(m, space, n, pairs)
    assert count <= min(len(space.factor), (3 * n + 1) * 3 * n // 2)
    solve_skyline(m, space, n, pairs, count)
    exact = np.linalg.solve(dense, m.rhs.ravel())
    assert np.abs(m.d[:n].ravel() - exact).max() < 1e-9 * np.abs(exact).max()


@given(seeds, st.integers(1, 12), st.sampled_from([1.0, 1.5]))
def test_sor(seed, n, factor):
    m, dense, pairs = system(seed, n, spread=0.3)
    sweeps = solve_sor(m, scratch(m), n, pairs, 1e-12, factor)
    assert sweeps < 100 * n + 300
    exact = np.linalg.solve(dense, m.rhs.ravel())
    assert np.abs(m.d[:n].ravel() - exact).max() < 1e-6 * np.abs(exact).max()


@given(seeds, st.floats(3.0, 10.0))
def test_a_stiff_contact_of_a_lone_block_bears_what_it_should(seed, orders):
    """A contact is `10**orders` times as stiff as inertia and slips; its force is wanted, not d.

    With a + k n m^t d = a + k n (m . d), where n holds the friction of the contact, that force is
    k m . d, and Sherman and Morrison give it without cancellation.
    """
    rng = np.random.default_rng(seed)
    inertia, stiff = rng.uniform(0.1, 10.0, 3), 10.0**orders
    m, n, f = rng.normal(size=(3, 3))
    n = m + 0.5 * n * np.linalg.norm(m)
    compliance = (m * n / inertia).sum()
    if compliance < 0.1 * (m * m / inertia).sum():
        return
    matrix, d = np.diag(inertia) + stiff * np.outer(n, m), np.empty(3)
    solve_block(matrix, f, d)
    exact = stiff * (m * f / inertia).sum() / (1.0 + stiff * compliance)
    force = ((f - inertia * d) * n).sum() / (n * n).sum()
    assert abs(force - exact) < 1e-5 * max(abs(exact), np.abs(f).max())
