"""A designed layout and the layouts for comparison, each verified on new releases."""

from __future__ import annotations

from dataclasses import dataclass

from rigdda import Site
from rigdda.agents.designers.protocol import DesignResult
from rigdda.envs import DesignProblem, Evaluation

NOTHING, RULE, CONSTANT, SHED = "nothing", "rule", "constant", "rock shed"

AS_IT_STANDS = "as it stands"
"""Name of the case without new barriers on a site with existing ones."""


@dataclass(frozen=True, slots=True)
class VerifiedLayout:
    """A layout that was verified on releases that no search used.

    Parameters
    ----------
    name : str
        Name of the layout.
    evaluation : Evaluation
        Its evaluation on these releases.
    """

    name: str
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class DesignStudy:
    """A designed layout and the layouts with which it is compared.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    result : DesignResult
        Result of the designer.
    cases : tuple of VerifiedLayout
        No barrier, the rule, the constant and, as the last, the layout found.
    left : str
        Text on the risk that remains with the layout found.
    """

    problem: DesignProblem
    result: DesignResult
    cases: tuple[VerifiedLayout, ...]
    left: str

    @property
    def nothing(self) -> VerifiedLayout:
        """The case without barriers."""
        return self.cases[0]

    @property
    def chosen(self) -> VerifiedLayout:
        """The case with the layout found."""
        return self.cases[-1]


def design_events(site: Site) -> tuple[str, ...]:
    """Return the names of the design events."""
    return tuple(event.name for event in site.events if event.design)
