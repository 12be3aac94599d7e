"""A designed layout beside those that it is compared with, each verified on unseen releases."""

from __future__ import annotations

from dataclasses import dataclass

from rigdda import Site
from rigdda.agents.designers.protocol import DesignResult
from rigdda.envs import DesignProblem, Evaluation

NOTHING, RULE, CONSTANT, SHED = "nothing", "rule", "constant", "rock shed"


@dataclass(frozen=True, slots=True)
class VerifiedLayout:
    """A layout that was verified on releases that no search has seen.

    Parameters
    ----------
    name : str
        What it is.
    evaluation : Evaluation
        What it is worth.
    """

    name: str
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class DesignStudy:
    """A designed layout beside what it is compared with.

    Parameters
    ----------
    problem : DesignProblem
        What was to be designed.
    result : DesignResult
        What the designer found.
    cases : tuple of VerifiedLayout
        Nothing, the rule, the constant, what was found: the last.
    left : str
        What is left of the risk with what was found, in words.
    """

    problem: DesignProblem
    result: DesignResult
    cases: tuple[VerifiedLayout, ...]
    left: str

    @property
    def nothing(self) -> VerifiedLayout:
        """No barrier."""
        return self.cases[0]

    @property
    def chosen(self) -> VerifiedLayout:
        """What was found."""
        return self.cases[-1]


def design_events(site: Site) -> tuple[str, ...]:
    """Return the names of the design events."""
    return tuple(event.name for event in site.events if event.design)
