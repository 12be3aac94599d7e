"""All cases of the accuracy suite."""

from __future__ import annotations

from rigdda.validation import (
    arches,
    collisions,
    crests,
    energy,
    fences,
    flight,
    gravity_walls,
    impacts,
    invariance,
    joint_strength,
    joints,
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
    *flight.CASES,
    *slides.CASES,
    *joints.CASES,
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
