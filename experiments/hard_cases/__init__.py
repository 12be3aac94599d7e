"""Scenes that break contact mechanics, swept over the step: which hold, which refuse."""

from experiments.hard_cases.study import run

__all__ = ["run"]
