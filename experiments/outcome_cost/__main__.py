"""Run the study: `python -m experiments.outcome_cost [--quick] [--out DIR]`."""

from experiments.outcome_cost.study import run
from experiments.script import main

if __name__ == "__main__":
    main(run)
