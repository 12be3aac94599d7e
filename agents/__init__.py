"""Designers of barrier layouts, the command line, studies, fits and reports.

`rigdda.agents.NAME` imports the designer of that name when it is first used.
"""

from __future__ import annotations

from types import ModuleType

from rigdda.agents.designers import DESIGNERS, module

__all__ = ["DESIGNERS"]


def __getattr__(name: str) -> ModuleType:
    if name in DESIGNERS:
        return module(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
