"""Run the hard cases: `python -m experiments.hard_cases [--quick] [--out DIR]`."""

from experiments.hard_cases.study import run
from experiments.script import main

if __name__ == "__main__":
    main(run)
