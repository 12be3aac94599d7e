"""Run the studies of grounds: `python -m experiments.grounds [--quick] [--out DIR]`.

These are the comparison with the field cases (`study`), the laws of the ground (`laws`) and the
road cut (`road_cut`).
"""

from pathlib import Path

from experiments.grounds import laws, road_cut, study
from experiments.script import Number, main, say

STEPS = {"field cases": study.run, "laws": laws.run, "road cut": road_cut.run}


def run(quick: bool, out: Path) -> Number:
    """Run all steps and return the first number that misses its target, or that of the study."""
    found = []
    for i, (name, step) in enumerate(STEPS.items()):
        say(f"grounds: {name}, step {i + 1} of {len(STEPS)}")
        found.append(step(quick, out))
        say(str(found[-1]))
    return next((number for number in found if not number.passed), found[0])


if __name__ == "__main__":
    main(run)
