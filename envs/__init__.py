"""Gymnasium environments of barrier design, and the same problem without Gymnasium.

Importing this package registers the environments; `gymnasium.make("envs:rigdda/BarrierDesign-v0")`
imports it on its own.
"""

from envs.evaluation import Evaluation
from envs.problem import DesignProblem
from envs.registration import register

__all__ = ["DesignProblem", "Evaluation"]

register()
