"""Designers' modules by name; what an extra brings is asked for in one line if it is missing."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from rigdda import BadInput, check
from rigdda.agents.names import DESIGNERS


def module(name: str) -> ModuleType:
    """Return the module of a designer.

    Raises
    ------
    BadInput
        If there is none of that name, or it needs what is not installed.
    """
    try:
        return import_module(f"rigdda.agents.{check.one_of('designer', name, DESIGNERS)}")
    except ModuleNotFoundError as error:
        mend = f"install {error.name}: pip install 'rigdda[rl]'"
        raise BadInput("designer", name, mend) from None
