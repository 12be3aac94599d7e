"""Designers of barrier layouts, training of policies and networks, and planning of corridors.

The attribute `rigdda.agents.NAME` imports the designer NAME when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rigdda.agents.designers import DESIGNERS, module

if TYPE_CHECKING:  # `as` declares these names as exports of this package
    from rigdda.agents.designers import cma as cma
    from rigdda.agents.designers import constant as constant
    from rigdda.agents.designers import convex as convex
    from rigdda.agents.designers import pareto as pareto
    from rigdda.agents.designers import ppo as ppo
    from rigdda.agents.designers import race as race
    from rigdda.agents.designers import random as random
    from rigdda.agents.designers import rule as rule
    from rigdda.agents.designers import tpe as tpe

__all__ = ["DESIGNERS"]


def __getattr__(name: str) -> Any:
    if name in DESIGNERS:
        return module(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
