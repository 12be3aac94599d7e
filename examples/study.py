"""How strong must a fence high on the slope be? Its capacity against the debris on the road.

Run it: `python examples/study.py`. It prints one line a capacity, and where the objective is least.
"""

from __future__ import annotations

import numpy as np

from envs import DesignProblem, Evaluation
from rigdda import Fence


def study(site: str = "quick", releases: int = 16) -> dict[float, Evaluation]:
    """Return the evaluation of an upper fence for each capacity [J/m], on the same releases."""
    problem = DesignProblem(site)
    zone = problem.site.barrier_zone  # the fence stands where it starts
    return {
        capacity: problem.evaluate([Fence(zone.start, zone.max_height, capacity)], range(releases))
        for capacity in np.geomspace(zone.min_capacity, zone.max_capacity, 5).tolist()
    }


def main() -> None:
    """Print the study and its best capacity."""
    found = study()
    for capacity, e in found.items():
        low, high = (100.0 * share for share in e.debris_ci)
        failed = np.mean([outcome.barriers[0].failed for outcome in e.outcomes])
        print(
            f"{capacity / 1e3:6.0f} kJ/m: {100 * e.debris:4.1f} % on the road "
            f"({low:.1f} to {high:.1f} %), fails in {failed:4.0%}, objective {e.objective:.3f}"
        )
    best = min(found, key=lambda capacity: found[capacity].objective)
    print(f"least objective at {best / 1e3:.0f} kJ/m")


if __name__ == "__main__":
    main()
