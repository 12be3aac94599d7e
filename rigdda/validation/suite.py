"""All cases of the validation suite."""

from __future__ import annotations

from rigdda.validation import (
    assemblies,
    barriers,
    impacts,
    joints,
    motion,
    single_block,
    slopes,
    supports,
)
from rigdda.validation.case import Case

CASES: tuple[Case, ...] = (
    *motion.FREE_FLIGHT,
    *single_block.SLIDING,
    *joints.SLIDES_OVER_JOINTS,
    *joints.JOINT_STRENGTH,
    *single_block.ROLLING,
    *single_block.ROCKING,
    *impacts.IMPACTS,
    *impacts.COLLISIONS,
    *slopes.CRESTS,
    *motion.INVARIANCE,
    *motion.ROTATION,
    *barriers.THIN_WALLS,
    *barriers.GRAVITY_WALLS,
    *barriers.FENCES,
    *motion.ENERGY_BALANCE,
    *assemblies.STACKS,
    *assemblies.SILOS,
    *supports.SUPPORT_CASES,
    *assemblies.ARCHES,
    *slopes.TOPPLING,
    *slopes.RITCHIE_CASES,
)
