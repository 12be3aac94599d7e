"""The table of environments that Gymnasium knows by a name."""

from __future__ import annotations

import gymnasium

ENVIRONMENTS = {
    "rigdda/BarrierDesign-v0": "envs.design:BarrierDesign",
    "rigdda/BarrierPlacement-v0": "envs.placement:BarrierPlacement",
}
"""Entry point of every environment, imported when it is made first."""


def register() -> None:
    """Register every environment of the table; no time limit, an episode ends by itself."""
    for name, entry_point in ENVIRONMENTS.items():
        gymnasium.register(id=name, entry_point=entry_point)
