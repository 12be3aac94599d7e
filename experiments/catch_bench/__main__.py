"""Run the catch bench study: `python -m experiments.catch_bench [--quick] [--out DIR]`."""

from experiments.catch_bench.study import run
from experiments.script import main

if __name__ == "__main__":
    main(run)
