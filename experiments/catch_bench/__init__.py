"""A catch bench below a mine face: share of retained blocks against its width."""

from experiments.catch_bench.study import run

__all__ = ["run"]
