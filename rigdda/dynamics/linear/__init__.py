"""Solvers of the simultaneous equations; relaxation of forces, which needs no matrix."""
