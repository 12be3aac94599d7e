"""A catch bench below a mine face: retained share against width."""

from experiments.catch_bench.study import run

__all__ = ["run"]
