"""Energy balance of a whole release."""

from __future__ import annotations

from rigdda.model.site import Site
from rigdda.validation.case import Case, Check, Lab, Measured

STATE = ("kinetic", "potential", "elastic")
"""Energies of the state; all other entries of the ledger are work done on the blocks so far."""


def measure(lab: Lab) -> tuple[Measured]:
    """Release the site shu-hwa-paper for 25 s; the change of state must equal the work done."""
    sim = lab.simulate(Site.load("shu-hwa-paper").realise(seed=lab.seed))
    start = sim.energy()
    sim.step(lab.steps(25.0))
    end = sim.energy()
    change = {name: getattr(end, name) - getattr(start, name) for name in end._fields}
    state = sum(value for name, value in change.items() if name in STATE)
    work = sum(value for name, value in change.items() if name not in STATE)
    return (Measured(abs(state - work) / -change["potential"]),)


CASES = (
    Case(
        "energy-ledger",
        (Check("gap over release", "none: first law", "-", 1e-3, "bound"),),
        measure,
    ),
)
