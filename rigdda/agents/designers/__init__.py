"""Designers of barrier layouts, with one module for each designer.

Each module has a function `design(problem, simulations, seed=0, progress=None, store=None)`, which
returns a `DesignResult` (see `rigdda.agents.designers.protocol`).
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from rigdda import BadInput, check

DEFAULT = "race"
"""Name of the default designer."""

DESIGNERS = (
    "cma", "constant", "convex", "pareto", "policy", "ppo", "race", "random", "rule", "tpe",
    "value",
)  # fmt: skip
"""Names of the designers."""

STOPPING = ("race",)
"""Designers whose `design` takes a `precision` and stops when the search gains less than that."""


def module(name: str) -> ModuleType:
    """Return the module of a designer.

    Raises
    ------
    BadInput
        If there is no designer of this name, or if it needs a package that is not installed.
    """
    try:
        return import_module(f"{__name__}.{check.one_of('designer', name, DESIGNERS)}")
    except ModuleNotFoundError as error:
        hint = f"install {error.name}: pip install 'rigdda[rl]'"
        raise BadInput("designer", name, hint) from None
