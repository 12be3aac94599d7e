"""Lock for the imports of heavy modules, which several threads of the page begin when it opens.

Two threads that import a package and one of its modules at the same time wait for each other, and
Python ends this by giving one of them a module that is not complete.
"""

from __future__ import annotations

import threading

IMPORTING = threading.RLock()
"""Held by a thread of the page while it imports modules that other threads may import, too."""
