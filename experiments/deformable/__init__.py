"""The original DDA, six unknowns a block, as a model to compare with (Fig. 4).

Shi and Goodman (1989, Int. J. Numer. Anal. Methods Geomech. 13, 359-380): a block also has three
constant strains and an elastic energy. Contacts are detected by the core and follow the paper's
plain penalty law; the equations are solved as in the core, by conjugate gradients with the inverse
diagonal, so that the unknowns are all that differs.
"""
