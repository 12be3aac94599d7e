"""Run the Tschamut study: `python -m experiments.tschamut [--quick] [--out DIR]`."""

from experiments.script import main
from experiments.tschamut.study import run

if __name__ == "__main__":
    main(run)
