"""How strong must a fence on the upper bench be? Its energy class against what a year costs.

Run it: `python examples/study.py`. It prints one line a class, and where a year costs least.
"""

from __future__ import annotations

from rigdda import Fence
from rigdda.barriers import FENCE_CLASSES
from rigdda.envs import DesignProblem, Evaluation


def study(
    site: str = "quick", x: float = 17.0, height: float = 2.5, releases: int = 200
) -> dict[int, Evaluation]:
    """Return the evaluation of a fence for each energy class [kJ], on the same releases."""
    problem = DesignProblem(site)
    fences = {name: Fence(x, height, energy_class=name) for name in FENCE_CLASSES}
    return {
        name: problem.evaluate((fence,), range(releases))
        for name, fence in fences.items()
        if problem.fits((fence,))
    }


def main() -> None:
    """Print the study and its best class."""
    found = study()
    for name, e in found.items():
        (low, high), failure = e.ci, e.failure["block"]
        print(
            f"{name:5d} kJ: Z {e.objective:4.0f} ({low:.0f} to {high:.0f}) EUR per m and year, "
            f"{e.capital:3.0f} of it capital; fails in {failure.probability:4.0%} of single blocks"
        )
    best = min(found, key=lambda name: found[name].objective)
    nothing = DesignProblem("quick").nothing
    print(f"a year costs least with {best} kJ; without a fence Z is {nothing.objective:.0f}")


if __name__ == "__main__":
    main()
