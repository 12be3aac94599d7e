"""What computes: the step of the analysis as kernels on arrays, and the simulation around it."""
