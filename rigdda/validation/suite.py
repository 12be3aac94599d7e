"""All cases of the accuracy suite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

from rigdda.scene import Scene
from rigdda.settings import Settings
from rigdda.validation import (
    arches,
    collisions,
    energy,
    flight,
    impacts,
    invariance,
    ritchie,
    rocking,
    rolling,
    rotation,
    slides,
    stacks,
    toppling,
    walls,
)
from rigdda.validation.case import Case

CASES: tuple[Case, ...] = (
    *flight.CASES,
    *slides.CASES,
    *rolling.CASES,
    *rocking.CASES,
    *impacts.CASES,
    *collisions.CASES,
    *invariance.CASES,
    *rotation.CASES,
    *walls.CASES,
    *energy.CASES,
    *stacks.CASES,
    *arches.CASES,
    *ritchie.CASES,
)
"""Cases that can be computed."""


def has(owner: type, *names: str) -> Callable[[], bool]:
    """Return a question: whether a dataclass has all the fields that a case needs."""
    return lambda: set(names) <= {f.name for f in fields(owner)}


PENDING: tuple[tuple[Case, Callable[[], bool]], ...] = (
    (slides.PRESSED, has(Scene, "loads")),
    (slides.NEWMARK, has(Scene, "base_motion")),
    # a gravity vector comes with the motion of the base
    (invariance.TURNED, has(Scene, "base_motion")),
    (rotation.LINEAR, has(Settings, "post_correction")),
    (toppling.FORCES, has(Settings, "mode")),
    (toppling.MODES, has(Settings, "mode")),
    (toppling.STANDING, has(Settings, "mode")),
)
"""Cases that wait for a part of the mechanics, each with the question whether it is there."""


def ready() -> tuple[Case, ...]:
    """Return all cases that can be computed, the pending ones whose part is there included."""
    return (*CASES, *(case for case, there in PENDING if there()))
