"""Rigid-block discontinuous deformation analysis for the design of rockfall protection.

The names in `rigdda.__all__` are imported when first used; `__init__.pyi` lists them.
"""

import lazy_loader

__version__ = "0.2.0"

MECHANICS = "3"
"""Version of everything that determines results: the mechanics, what is drawn from seeds, the
generator of sites, costs and statistics.

Stored results are used only if they have this version. CONTRIBUTING.md says when to change it. It
is a part of file names.
"""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
