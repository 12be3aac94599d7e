"""Rigid-block discontinuous deformation analysis for the design of rockfall protection.

The names in `rigdda.__all__` are imported when first used; `__init__.pyi` lists them.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
