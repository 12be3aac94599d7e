"""Kernels of the DDA time step and the simulation built on them.

Start reading at `step.advance`, then `detection.detect`, `step.solve_and_move` and, for each
island, `island_step.step_island`. docs/theory.md maps each equation of the paper to its function.
`point_mass` is not part of the analysis: it treats blocks as points and is used for comparison.
"""
