"""What computes: the step of the analysis as kernels on arrays, and the simulation around it.

Read `step.advance` first, then `detection.detect`, `step.solve_and_move` and, for each island,
`island_step.step_island`. docs/theory.md leads from each equation to its function. `lumped` is no
part of the analysis: points in place of blocks, for comparison.
"""
