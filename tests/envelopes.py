"""Design envelopes whose quantiles are given."""

from __future__ import annotations

from rigdda.envs.design_envelope import DesignEnvelope, EventEnvelope
from rigdda.envs.quantiles import Quantile


def exact(value: float) -> Quantile:
    return Quantile(value, value, value)


def event(
    speeds: list[float], height: float = 1.0, mass: float = 1000.0, name: str = "block"
) -> EventEnvelope:
    return EventEnvelope(
        name=name,
        releases=2000,
        blocks=2000,
        reaching=900,
        passing=[2000] * len(speeds),
        speed=[exact(v) for v in speeds],
        height=[exact(height)] * len(speeds),
        mass=mass,
        radius=0.4,
    )


def envelope(
    stations: dict[float, float], *, height: float = 1.0, mass: float = 1000.0
) -> DesignEnvelope:
    """Return an envelope with one event and a characteristic velocity [m/s] at each station."""
    own = event([*stations.values()], height, mass)
    return DesignEnvelope([*stations], 0.95, [own], [1.0] * len(stations))
