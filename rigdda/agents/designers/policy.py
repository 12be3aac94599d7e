"""The trained policy that ships with the package, which designs without a search.

It chooses from a catalogue of relative layouts, see `rigdda.agents.policy`. `rigdda train` makes
such a policy. This module needs no torch.
"""

from __future__ import annotations

from rigdda.agents.designers.protocol import DesignResult, Progress
from rigdda.agents.designers.store import Store
from rigdda.envs import DesignProblem


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout that the policy chooses.

    At most a sixteenth of the budget is used for releases without barriers, and up to 64 releases
    for the evaluation of the layout. Targets are not taken into account.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    from rigdda.agents.policy import load, using

    return using(load())(problem, simulations, seed, progress, store)
