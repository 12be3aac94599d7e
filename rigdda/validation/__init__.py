"""The accuracy suite: computed motions against closed forms and invariances.

One case is one computed experiment with one or more figures, each with its bar. `suite.CASES` lists
them; `rigdda validate` prints them and the tests run them.
"""

from rigdda.validation.case import Case, Check, Lab, Measured, Result, evaluate
from rigdda.validation.convergence import Convergence, converge
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
