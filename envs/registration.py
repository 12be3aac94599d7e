"""The table of environments that Gymnasium knows by a name."""

from __future__ import annotations

import gymnasium

ENVIRONMENTS = {
    "rigdda/BarrierDesign-v0": (
        "rigdda.envs.environments:BarrierDesign",
        "rigdda.envs.vector:BarrierDesignVector",
    ),
    "rigdda/BarrierPlacement-v0": (
        "rigdda.envs.environments:BarrierPlacement",
        "rigdda.envs.vector:BarrierPlacementVector",
    ),
}
"""Entry points of every environment, alone and batched, imported when it is made first."""


def register() -> None:
    """Register every environment of the table; no time limit, an episode ends by itself."""
    for name, (alone, batched) in ENVIRONMENTS.items():
        gymnasium.register(id=name, entry_point=alone, vector_entry_point=batched)
