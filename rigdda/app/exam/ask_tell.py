"""Helper that turns a task of the exam into a function for any optimiser."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigdda import BadInput, Layout, check
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.menu import Menu
from rigdda.app.exam.task import Task

FINALISTS = 5
"""Number of the best layouts of a search that are compared on new releases."""

LAYOUTS = 60
"""Number of layouts of a search by default."""

REPEATS = 10
"""Greatest number of points for each layout that the budget allows, on average. It ends a search
that proposes known layouts only, which cost no releases."""


class AskTell:
    """The annual cost of a layout as a function of a point, within the budget of a task.

    A point is a vector in [0, 1]^n. Kinds of barrier have one score each in a slot, and the kind
    with the largest is built, see `rigdda.envs.encoding`; every point is a layout that may be
    built. Most of the budget is for the search; the rest is for a comparison of the best layouts
    on new releases.

    Parameters
    ----------
    task : Task
        The task of the exam, or one of `rigdda.app.exam.counter.practice`.
    releases : int, optional
        Number of releases of each layout. By default, the budget suffices for 60 layouts.
    final : float
        Share of the budget for the comparison of the best layouts, 0 to 1 [-].

    Attributes
    ----------
    size : int
        Length of a point.

    Raises
    ------
    BadInput
        If an argument is outside its range.

    Examples
    --------
    >>> from rigdda.app.exam.ask_tell import AskTell
    >>> from rigdda.app.exam.counter import practice
    >>> search = AskTell(practice("wide-1000003", budget=60))
    >>> rng = np.random.default_rng(0)
    >>> while search.open:
    ...     value = search(rng.uniform(size=search.size))
    >>> layout = search.best()
    """

    def __init__(self, task: Task, releases: int | None = None, final: float = 0.25):
        self.task, self.size = task, task.problem.size
        self._reserve = int(check.number("final", final, 0.0, 1.0) * task.left)
        each = max(1, (task.left - self._reserve) // LAYOUTS)
        self.releases = each if releases is None else check.integer("releases", releases, 1)
        self._points = REPEATS * ((task.left - self._reserve) // self.releases)
        self._found: dict[Layout, float] = {}

    @property
    def open(self) -> bool:
        """Whether the search may go on.

        It ends when the budget does not allow another layout, or after ten times as many points as
        the budget allows layouts.
        """
        return self._points > 0 and self.task.left - self._reserve >= self.releases

    def layout(self, point: ArrayLike) -> Layout:
        """Return the layout of a point.

        Raises
        ------
        BadInput
            If the point is not a vector of `size` finite numbers.
        """
        hint = f"give {self.size} finite numbers from 0 to 1"
        try:
            vector: NDArray[np.float64] = np.asarray(point, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise BadInput("point", point, hint) from None
        if vector.shape != (self.size,) or not np.isfinite(vector).all():
            raise BadInput("point", vector.shape, hint)
        return self.task.problem.decode(2.0 * vector - 1.0)

    def __call__(self, point: ArrayLike) -> float:
        """Return the estimated Z of a point [EUR per metre and year], to be minimised.

        All points are evaluated on the same releases. A layout that was evaluated before costs
        nothing. When the search is no longer `open`, the value of a new layout is infinite.
        """
        layout = self.layout(point)
        if layout not in self._found:
            if not self.open:
                return math.inf
            self._found[layout] = self.task.evaluate(layout, self.releases).objective
        self._points -= 1
        return self._found[layout]

    def best(self) -> Layout:
        """Return the best layout of the search.

        The best `FINALISTS` layouts are compared on new releases if the budget has any left.
        Without a search, it is the constant layout that is best on average.
        """
        if not self._found:
            return constant(self.task.problem, Menu(self.task.problem))
        ranked = sorted(self._found, key=lambda layout: self._found[layout])[:FINALISTS]
        each = self.task.left // len(ranked)
        if each < 1 or len(ranked) == 1:
            return ranked[0]
        values = [self.task.evaluate(own, each, self.releases).objective for own in ranked]
        return ranked[int(np.argmin(values))]
