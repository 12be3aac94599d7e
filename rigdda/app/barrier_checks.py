"""Checks of every barrier of a layout, each under the blocks that pass the barriers uphill of it.

The formulas are those of `rigdda.envs.barrier_formulas`.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from rigdda import Barrier, Ditch, Fence, Layout
from rigdda.barriers import standing
from rigdda.envs import DesignProblem, design_envelope
from rigdda.envs.barrier_formulas import BarrierCheck, checks_of
from rigdda.envs.fence_checks import FenceCheck, demand_at
from rigdda.ground.barrier_zone import BarrierZone


@dataclass(frozen=True, slots=True)
class LayoutChecks:
    """Checks of a layout.

    Parameters
    ----------
    fences : tuple of FenceCheck
        The design sheet of each fence.
    table : tuple of BarrierCheck
        All checks, going downhill.
    idle : tuple of str
        Barriers that no block of the design events reaches, in words.
    """

    fences: tuple[FenceCheck, ...]
    table: tuple[BarrierCheck, ...]
    idle: tuple[str, ...]

    @property
    def failed(self) -> tuple[BarrierCheck, ...]:
        """The checks that are not met."""
        return tuple(check for check in self.table if not check.satisfied)

    @property
    def satisfied(self) -> bool:
        """Whether all checks of new barriers are met."""
        return all(check.existing for check in self.failed)


def check_layout(problem: DesignProblem, layout: Layout, seed: int = 0) -> LayoutChecks:
    """Return the checks of every barrier that stands with a layout, existing ones included.

    Parameters
    ----------
    problem : DesignProblem
        The problem, with the partial factors of its site.
    layout : Layout
        The layout. Mesh is not checked.
    seed : int
        Seed of the releases of the design events.

    Raises
    ------
    BadInput
        If the layout is not feasible.
    Diverged
        If a simulation diverges.
    """
    site = problem.site
    own = standing(problem.check(layout))
    built = sorted(site.standing(layout), key=lambda barrier: barrier.x)
    fences: list[FenceCheck] = []
    table: list[BarrierCheck] = []
    idle: list[str] = []
    for i, barrier in enumerate(built):
        existing = barrier not in own
        label = f"existing {barrier.label}" if existing else barrier.label
        demand = None
        if not isinstance(barrier, Ditch):
            zone = including(problem.zone, barrier)
            envelope = design_envelope.of(site, zone, seed, layout=built[:i])
            demand = demand_at(envelope, site.rule, barrier.x)
            if demand is None:
                idle.append(f"{label}, at {barrier.x:.1f} m")
        if demand is not None and isinstance(barrier, Fence):
            fences.append(FenceCheck.of(site, barrier, demand))
        table += [
            check._replace(barrier=label, existing=existing)
            for check in checks_of(site, barrier, demand)
        ]
    return LayoutChecks(tuple(fences), tuple(table), tuple(idle))


def including(zone: BarrierZone, barrier: Barrier) -> BarrierZone:
    """Return a zone, extended to a barrier that stands outside it."""
    if zone.start <= barrier.x <= zone.end:
        return zone
    start, end = min(zone.start, barrier.x), max(zone.end, barrier.x)
    return msgspec.structs.replace(zone, start=start, end=end)
