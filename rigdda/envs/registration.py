"""Registration of the environments with Gymnasium."""

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
    "rigdda/Corridor-v0": (
        "rigdda.envs.corridor_environment:CorridorDesign",
        "rigdda.envs.vector:CorridorDesignVector",
    ),
}
"""Entry points of each environment, single and vectorised; they are imported on first use."""

FORECAST = {
    "rigdda/BarrierForecast-v0": (
        "rigdda.envs.forecast_environment:BarrierForecast",
        "rigdda.envs.forecast_environment:BarrierForecastVector",
    ),
}
"""The same for the environment that simulates nothing, which has other keywords."""


def register() -> None:
    """Register all environments, without a time limit because every episode ends by itself."""
    for name, (alone, batched) in (ENVIRONMENTS | FORECAST).items():
        gymnasium.register(id=name, entry_point=alone, vector_entry_point=batched)
