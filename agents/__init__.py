"""Designers of barrier layouts and the command line.

Each designer is a module with `design(problem, simulations, seed=0, progress=None, store=None)`
that returns a `DesignResult`; `rigdda.agents.NAME` imports it when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from rigdda.agents.names import DESIGNERS

__all__ = ["DESIGNERS"]


def __getattr__(name: str) -> ModuleType:
    if name in DESIGNERS:
        return import_module(f"rigdda.agents.{name}")
    raise AttributeError(f"module 'agents' has no attribute {name!r}")
