"""Submatrices of the simultaneous equilibrium equations."""
