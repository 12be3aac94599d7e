"""Validation suite: computed motions compared with closed-form solutions and invariances.

A case is one computed experiment with one or more checked quantities, each with an error tolerance.
`suite.CASES` lists all cases; `rigdda validate` prints their results and the tests run them.
"""

from rigdda.validation.case import (
    Case,
    Check,
    Convergence,
    Lab,
    Measured,
    Result,
    converge,
    evaluate,
)
from rigdda.validation.suite import CASES

__all__ = [
    "CASES",
    "Case",
    "Check",
    "Convergence",
    "Lab",
    "Measured",
    "Result",
    "converge",
    "evaluate",
]
