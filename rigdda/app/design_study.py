"""A designed layout and the layouts for comparison, each verified on new releases."""

from __future__ import annotations

from dataclasses import dataclass, field

from rigdda import Site
from rigdda.agents.designers.frontier import TriedLayout
from rigdda.agents.designers.protocol import DesignResult
from rigdda.agents.designers.rule import RuleAnswer
from rigdda.app.barrier_checks import LayoutChecks
from rigdda.envs import DesignProblem, Evaluation
from rigdda.envs.comparison import Difference

NOTHING, CONSTANT, SHED = "nothing", "constant", "rock shed"

WITHOUT_CHECKS = "without checks"
"""Name of the layout that is found if checks are not required."""

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
class ComparedLayouts:
    """Layouts of a design problem that are compared.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    cases : tuple of VerifiedLayout
        The layouts. The first is no barrier, and the last is the layout that is recommended.
    """

    problem: DesignProblem
    cases: tuple[VerifiedLayout, ...]

    @property
    def nothing(self) -> VerifiedLayout:
        """The case without barriers."""
        return self.cases[0]

    @property
    def chosen(self) -> VerifiedLayout:
        """The case with the layout that is recommended."""
        return self.cases[-1]


@dataclass(frozen=True, slots=True)
class DesignStudy(ComparedLayouts):
    """A designed layout and the layouts with which it is compared.

    The cases are no barrier, the rule, the constant, the layout found without required checks if
    they are required, and, as the last, the layout found.

    Parameters
    ----------
    result : DesignResult
        Result of the designer.
    left : str
        Text on the risk that remains with the layout found.
    rule : RuleAnswer
        Answer of the rule with its design sheet.
    checks : LayoutChecks
        Checks of the barriers of the layout found.
    frontier : tuple of TriedLayout
        If the layout of the designer misses a target: the cheapest layout for each level of
        P(reach) among all that were evaluated.
    replaced : bool
        Whether the layout found is one of the frontier, which is better than that of the designer.
    other_checks : dict of str to LayoutChecks
        If checks are required: the checks of the other cases, by their names.
    compliance : Difference, optional
        If checks are required and a layout was found without them: Z of the layout found minus Z
        of this layout, on the same releases.
    """

    result: DesignResult
    left: str
    rule: RuleAnswer
    checks: LayoutChecks
    frontier: tuple[TriedLayout, ...] = ()
    replaced: bool = False
    other_checks: dict[str, LayoutChecks] = field(default_factory=dict)
    compliance: Difference | None = None

    @property
    def comparable(self) -> tuple[VerifiedLayout, ...]:
        """The cases that may be proposed: if checks are required, those that meet them."""
        failed = {name for name, checks in self.other_checks.items() if not checks.satisfied}
        return tuple(case for case in self.cases if case.name not in failed)

    @property
    def unchecked(self) -> VerifiedLayout | None:
        """The case that was found without required checks, if it differs from the last."""
        return next((case for case in self.cases if case.name == WITHOUT_CHECKS), None)


def design_events(site: Site) -> tuple[str, ...]:
    """Return the names of the design events."""
    return tuple(event.name for event in site.events if event.design)
