"""Run the study: `python -m experiments.speed_error [--quick] [--out DIR]`."""

from experiments.script import main
from experiments.speed_error.study import run

if __name__ == "__main__":
    main(run)
