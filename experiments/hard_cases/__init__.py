"""Hard cases of contact mechanics for a range of steps: which are solved, which are refused."""

from experiments.hard_cases.study import run

__all__ = ["run"]
