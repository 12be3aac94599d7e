"""All hard cases."""

from __future__ import annotations

from experiments.hard_cases import arch, ground, impacts, shapes, stacks, strength, supports
from experiments.hard_cases.case import Case

CASES: tuple[Case, ...] = (
    *stacks.CASES,
    *shapes.CASES,
    *arch.CASES,
    *strength.CASES,
    *impacts.CASES,
    *ground.CASES,
    *supports.CASES,
)

STEPS = (1e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1)
"""Steps [s]; the longest is a multiple of all others and must be refused."""

QUICK_STEPS = (5e-3, 2e-2, 1e-1)
