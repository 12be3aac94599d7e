"""Run the study: `python -m experiments.grounds [--quick] [--out DIR]`."""

from experiments.grounds.study import run
from experiments.script import main

if __name__ == "__main__":
    main(run)
