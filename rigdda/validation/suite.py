"""All cases of the validation suite."""

from __future__ import annotations

from rigdda.validation import (
    arches,
    collisions,
    crests,
    energy,
    fences,
    free_flight,
    gravity_walls,
    impacts,
    invariance,
    joint_strength,
    jointed_blocks,
    ritchie,
    rocking,
    rolling,
    rotation,
    silos,
    slides,
    stacks,
    supports,
    toppling,
    walls,
)
from rigdda.validation.case import Case

CASES: tuple[Case, ...] = (
    *free_flight.CASES,
    *slides.CASES,
    *jointed_blocks.CASES,
    *joint_strength.CASES,
    *rolling.CASES,
    *rocking.CASES,
    *impacts.CASES,
    *collisions.CASES,
    *crests.CASES,
    *invariance.CASES,
    *rotation.CASES,
    *walls.CASES,
    *gravity_walls.CASES,
    *fences.CASES,
    *energy.CASES,
    *stacks.CASES,
    *silos.CASES,
    *supports.CASES,
    *arches.CASES,
    *toppling.CASES,
    *ritchie.CASES,
)
