"""Adapters of engines that load the same scene, one module each.

Each module has a `NAME`, `OPTIONS` to be tried with each step, and a class `Engine`.
"""

from __future__ import annotations

import importlib
from types import ModuleType

PEERS = {"chipmunk": "pymunk", "box2d": "pyb2d3", "mjc": "mujoco"}
"""Adapter module and required package of each peer."""

HINT = 'pip install -c constraints.txt -e ".[bench]"'


class PeerMissing(ImportError):
    """A peer is not installed; the message says how to install all of them."""


def load() -> list[ModuleType]:
    """Return all adapters, this core's first.

    Raises
    ------
    PeerMissing
        If a peer is not installed.
    """
    return [adapter("core"), *map(adapter, PEERS)]


def adapter(name: str) -> ModuleType:
    """Return the adapter of a module name.

    Raises
    ------
    PeerMissing
        If its engine is not installed.
    """
    try:
        return importlib.import_module(f"{__name__}.{name}")
    except ModuleNotFoundError as error:
        if error.name != PEERS.get(name):
            raise
        raise PeerMissing(f"{error.name} is not installed; get the peers by: {HINT}") from None
