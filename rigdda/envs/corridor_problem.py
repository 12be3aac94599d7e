"""Design of the barriers of a corridor: one layout for each section within a common budget.

The objective is the annual cost of all sections [EUR per year]: the sum of length times Z, see
`rigdda.envs.problem`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Barrier, Corridor, Layout
from rigdda.envs.cost import Evaluation
from rigdda.envs.intervals import Interval, Mean, total
from rigdda.envs.problem import DesignProblem


@dataclass(frozen=True, slots=True)
class CorridorEvaluation:
    """Evaluation of one layout for each section.

    Parameters
    ----------
    sections : tuple of Evaluation
        The evaluations of the sections, per metre of road.
    objective : float
        Sum of length times Z [EUR/year].
    ci : (float, float)
        Its 95 % interval.
    gain : float
        Reduction of the objective relative to no barriers anywhere [EUR/year].
    gain_ci : (float, float)
        Its 95 % interval.
    cost : float
        Construction cost [EUR].
    annual : float
        Annual cost of the barriers, annuities and upkeep [EUR/year].
    """

    sections: tuple[Evaluation, ...]
    objective: float
    ci: Interval
    gain: float
    gain_ci: Interval
    cost: float
    annual: float

    @property
    def layouts(self) -> tuple[Layout, ...]:
        """The layouts of the sections."""
        return tuple(evaluation.layout for evaluation in self.sections)


@dataclass(frozen=True, slots=True, init=False)
class CorridorProblem:
    """Design problems of the sections of a corridor.

    Parameters
    ----------
    corridor : Corridor, str or path
        The corridor, the name of a built-in one, or a TOML file.
    max_barriers : int
        Number of slots for barriers in each section.
    kinds : sequence of str, optional
        Kinds of barrier to choose from in each section. By default, all that are usual on its site.
    fidelity : {"full", "fast"}
        "fast" simulates cheaper approximations of the sites.
    checks : {"reported", "required"}
        Whether barriers must satisfy the checks of their kind, see `DesignProblem`.

    Raises
    ------
    BadInput
        If there is no such corridor, or an argument is outside its range.
    """

    corridor: Corridor
    problems: tuple[DesignProblem, ...] = field(repr=False)

    def __init__(
        self,
        corridor: Corridor | str | os.PathLike[str],
        max_barriers: int = 3,
        kinds: Sequence[str] | None = None,
        fidelity: str = "full",
        checks: str = "reported",
    ):
        whole = corridor if isinstance(corridor, Corridor) else Corridor.load(corridor)
        problems = []
        for section in whole.sections:
            try:
                limits = section.targets, fidelity, None, None, checks
                own = DesignProblem(section.site, max_barriers, kinds, *limits)
            except BadInput as bad:
                raise _of_section(section.name, bad) from None
            problems.append(own)
        object.__setattr__(self, "corridor", whole)
        object.__setattr__(self, "problems", tuple(problems))

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Lengths of the sections, (S,) [m]."""
        return np.array([section.length for section in self.corridor.sections])

    @property
    def nothing(self) -> float:
        """Objective without barriers anywhere [EUR/year]."""
        found = zip(self.lengths.tolist(), self.problems, strict=True)
        return math.fsum(length * problem.nothing.objective for length, problem in found)

    def cost(self, layouts: Sequence[Sequence[Barrier]]) -> float:
        """Return the construction cost of one layout for each section [EUR].

        Raises
        ------
        BadInput
            If there is not one feasible layout for each section.
        """
        checked = self.check(layouts)
        rows = zip(self.lengths.tolist(), self.problems, checked, strict=True)
        return math.fsum(length * problem.site.capital(own) for length, problem, own in rows)

    def check(self, layouts: Sequence[Sequence[Barrier]]) -> tuple[Layout, ...]:
        """Return feasible layouts, one for each section.

        Raises
        ------
        BadInput
            If their number is wrong, or one is not feasible.
        """
        if not isinstance(layouts, Sequence) or len(layouts) != len(self.problems):
            raise BadInput("layouts", layouts, f"give {len(self.problems)}, one for each section")
        found = []
        for section, problem, layout in zip(
            self.corridor.sections, self.problems, layouts, strict=True
        ):
            try:
                found.append(problem.check(layout))
            except BadInput as bad:
                raise _of_section(section.name, bad) from None
        return tuple(found)

    def evaluate(
        self, layouts: Sequence[Sequence[Barrier]], seeds: Sequence[int]
    ) -> CorridorEvaluation:
        """Evaluate one layout for each section by simulating one release per seed in each.

        Parameters
        ----------
        layouts : sequence of layouts
            A feasible layout for each section.
        seeds : sequence of int
            Distinct seeds of the releases.

        Raises
        ------
        BadInput
            If there is not one feasible layout for each section, or the seeds are invalid.
        Diverged
            If a simulation diverges.
        """
        checked = self.check(layouts)
        found = [
            problem.evaluate(layout, seeds)
            for problem, layout in zip(self.problems, checked, strict=True)
        ]
        return self.judge(found)

    def judge(self, evaluations: Sequence[Evaluation]) -> CorridorEvaluation:
        """Return the evaluation of the corridor from those of its sections.

        Sections without barriers do not contribute to the gain or to its interval. The errors of
        sections of the same site on the same releases are added; all others are independent.
        """
        lengths = self.lengths.tolist()
        rows = list(zip(lengths, self.problems, evaluations, strict=True))
        built = [row for row in rows if row[2].layout]
        whole, after = _total(rows), _total(built)
        before = _total([(length, p, p.nothing) for length, p, _ in built])
        gain = before.minus(after)
        return CorridorEvaluation(
            sections=tuple(evaluations),
            objective=whole.value,
            ci=whole.interval,
            gain=gain.value,
            gain_ci=gain.interval,
            cost=math.fsum(length * e.cost for length, _, e in rows),
            annual=math.fsum(length * e.capital for length, _, e in rows),
        )

    def ahead(self, one: CorridorEvaluation, other: CorridorEvaluation) -> Mean:
        """Return by how much the objective of one evaluation is less than that of another.

        Sections with the same layout contribute neither to the difference [EUR/year] nor to its
        95 % interval.
        """
        columns = (self.lengths.tolist(), self.problems, one.sections, other.sections)
        rows = [row for row in zip(*columns, strict=True) if row[2].layout != row[3].layout]
        less = _total([(length, problem, e) for length, problem, e, _ in rows])
        more = _total([(length, problem, f) for length, problem, _, f in rows])
        return more.minus(less)


def _total(rows: Sequence[tuple[float, DesignProblem, Evaluation]]) -> Mean:
    """Return the sum of length times Z over sections [EUR/year]."""
    groups: dict[tuple[bytes, tuple[int, ...]], list[Mean]] = {}
    for length, problem, e in rows:
        own = groups.setdefault((problem.key, e.seeds), [])
        own.append(Mean(e.objective, *e.ci).times(length))
    return total(Mean(*map(math.fsum, zip(*own, strict=True))) for own in groups.values())


def _of_section(name: str, bad: BadInput) -> BadInput:
    """Return an error about a section with the name of the section."""
    return BadInput(f"sections.{name}.{bad.field}", bad.value, bad.hint)
