"""The original DDA with six unknowns per block, for comparison (Fig. 4).

In the model of Shi and Goodman (1989, Int. J. Numer. Anal. Methods Geomech. 13, 359-380), a block
also has three constant strains and an elastic energy. Contacts are detected by the core and follow
the paper's plain penalty law. The equations are solved as in the core, by conjugate gradients with
the inverse diagonal, so that only the unknowns differ.
"""
