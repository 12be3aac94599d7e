"""Cost and error of each setting: closed forms and the outcome of the highway case."""

from experiments.speed_error.study import run

__all__ = ["run"]
