"""The constructors and measures that the tests share with the accuracy suite."""

from rigdda.validation.scenes import (
    FLAT,
    GRAVITY,
    box,
    incline,
    masses,
    momentum,
    ngon,
    polygon,
    rock,
    rough,
)

__all__ = [
    "FLAT",
    "GRAVITY",
    "box",
    "incline",
    "masses",
    "momentum",
    "ngon",
    "polygon",
    "rock",
    "rough",
]
