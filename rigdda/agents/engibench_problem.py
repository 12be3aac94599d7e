"""The sites as a problem of EngiBench (extra `engibench`).

EngiBench (https://engibench.ethz.ch) is a library of engineering design problems with a common
interface. The design is the decision vector of `rigdda.envs.DesignProblem` in [-1, 1], the
objective is the annual cost Z, and the conditions are the site and the largest capital cost. There
is no published data set: `rigdda dataset` makes one.

EngiBench reads the bounds of conditions from their annotations, which therefore must not be strings
here.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from engibench.constraint import bounded
from engibench.core import ObjectiveDirection, OptiStep, Problem
from gymnasium import spaces
from matplotlib.figure import Figure

from rigdda import display
from rigdda.agents import designers
from rigdda.envs import DesignProblem
from rigdda.seeds import release_seeds

DEFAULT_SITE = "wide-narrow-2000000003"
"""Site of a problem without a configuration: the cheapest family to simulate."""


class RockfallBarriers(Problem[npt.NDArray[np.float64]]):
    """Layout of rockfall barriers with the least annual cost.

    Parameters
    ----------
    seed : int
        Seed of random designs and of the releases.
    config : dict, optional
        Values of `Config`.

    Raises
    ------
    BadInput
        If there is no such site.
    """

    version = 0
    objectives = (("annual_cost", ObjectiveDirection.MINIMIZE),)

    @dataclass
    class Conditions:
        """What distinguishes one design task from another."""

        site: str = DEFAULT_SITE
        """Name of a built-in or generated site."""
        max_cost: Annotated[float, bounded(lower=0.0)] = float("inf")
        """Largest capital cost [EUR per metre of road]."""

    @dataclass
    class Config(Conditions):
        """Conditions, and how designs are simulated."""

        max_barriers: Annotated[int, bounded(lower=1, upper=100)] = 3
        """Largest number of barriers."""
        releases: Annotated[int, bounded(lower=1)] = 200
        """Releases of a simulation, which are the same for all designs."""
        designer: str = "race"
        """Designer of the package that `optimize` uses."""
        budget: Annotated[int, bounded(lower=2)] = 2000
        """Releases of `optimize`."""

    config: Config
    conditions: Conditions
    dataset_id = "rigdda/rockfall_barriers_v0"
    container_id = None

    def __init__(self, seed: int = 0, config: dict[str, Any] | None = None):
        super().__init__(seed=seed)
        self.config = self.Config(**(config or {}))
        self.conditions = self.Conditions(self.config.site, self.config.max_cost)
        self.problem = self._posed(self.config)
        low, high = self.problem.bounds
        self.design_space = spaces.Box(low, high, dtype=np.float64)

    @property
    def dataset(self) -> Any:
        """There is no data set.

        Raises
        ------
        NotImplementedError
            Always.
        """
        raise NotImplementedError("there is no published data set: make one with `rigdda dataset`")

    def _posed(self, config: Config) -> DesignProblem:
        most = config.max_cost if np.isfinite(config.max_cost) else None
        return DesignProblem(config.site, config.max_barriers, max_cost=most)

    def _configured(self, config: dict[str, Any] | None) -> tuple[Config, DesignProblem]:
        """Return the configuration with other values, and its problem."""
        if not config:
            return self.config, self.problem
        new = self.Config(**{**asdict(self.config), **config})
        return new, self._posed(new)

    def simulate(
        self, design: npt.NDArray[np.float64], config: dict[str, Any] | None = None
    ) -> npt.NDArray[np.float64]:
        """Return the annual cost of a design, (1,) [EUR per metre of road and year].

        Raises
        ------
        BadInput
            If the design has another length, or an entry is not finite.
        """
        now, problem = self._configured(config)
        seeds = release_seeds("verification", self.seed or 0, now.releases)
        return np.array([problem.evaluate(np.asarray(design), seeds).objective])

    def optimize(
        self,
        starting_point: npt.NDArray[np.float64] | None = None,
        config: dict[str, Any] | None = None,
    ) -> tuple[npt.NDArray[np.float64], Sequence[OptiStep]]:
        """Return the best design of a designer of the package and the history of its search.

        If the layout of the designer cannot be encoded exactly, the best design of the history that
        can be is returned; if there is none, the starting point.
        """
        now, problem = self._configured(config)
        design = designers.module(now.designer).design
        found = design(problem, now.budget, self.seed or 0)
        steps = [
            OptiStep(np.array([entry.evaluation.objective]), i)
            for i, entry in enumerate(found.history.entries)
        ]
        tried = sorted(found.history.entries, key=lambda entry: entry.evaluation.objective)
        for layout in (found.layout, *(entry.evaluation.layout for entry in tried)):
            try:
                return problem.encode(layout), steps
            except ValueError:  # a size that no vector has
                continue
        first = np.full(problem.size, -1.0) if starting_point is None else starting_point
        return np.asarray(first, dtype=np.float64), steps

    def reset(self, seed: int | None = None) -> None:
        """Set the seed of random designs and of the releases."""
        super().reset(seed)

    def render(self, design: npt.NDArray[np.float64], *, open_window: bool = False) -> Figure:
        """Return a picture of the layout of a design on its slope."""
        figure = Figure(figsize=(8.0, 4.5))
        display.draw(figure.subplots(), self.problem.site.section(self.problem.decode(design)))
        if open_window:
            figure.show()
        return figure

    def random_design(self) -> tuple[npt.NDArray[np.float64], int]:
        """Return a random design, and -1, because it is not of a data set."""
        low, high = self.problem.bounds
        return self.np_random.uniform(low, high), -1
