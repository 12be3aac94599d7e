"""Solvers of the simultaneous equilibrium equations."""
