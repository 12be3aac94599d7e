"""Interim answer of a design: the first answer, and the best layout of the search so far."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rigdda import Layout
from rigdda.agents.designers.protocol import Entry, score
from rigdda.app.design_study import VerifiedLayout
from rigdda.app.verification import Verification

Tell = Callable[[Sequence[VerifiedLayout]], None]
"""Called during a job with the layouts that are known so far, the best one last."""

BEST = "best so far"
"""Name of the best layout of an unfinished search."""

FIRST = 1000
"""Number of releases of a search after which its best layout is shown for the first time. It is
shown again after twice as many, and so on."""


class InterimAnswer:
    """Shows the layouts that need no search, and later the best layout of the search so far.

    All layouts are evaluated on the first releases of the verification. They can therefore be
    compared, and the evaluation of the best one is not biased by the search, which does not use
    these releases.

    Parameters
    ----------
    verification : Verification
        Evaluates the layouts.
    tell : callable
        Function that shows the layouts.
    """

    def __init__(self, verification: Verification, tell: Tell):
        self._verification, self._tell = verification, tell
        self._cases: list[VerifiedLayout] = []
        self._best: tuple[tuple[float, float], Layout] | None = None
        self._next = FIRST

    def begin(self, cases: Sequence[tuple[str, Layout]]) -> None:
        """Evaluate the layouts that need no search and show them."""
        for name, layout in cases:
            self._cases.append(VerifiedLayout(name, self._verification.evaluate(layout)))
        self._tell(tuple(self._cases))

    def consider(self, entry: Entry) -> None:
        """Take account of an evaluation of the search, and show the best layout from time to time.

        The best layout has the lowest upper end of the interval of Z, because the lowest Z of many
        layouts with few releases is often due to chance.
        """
        missed, _ = score(self._verification.problem, entry.evaluation)
        key = missed, entry.evaluation.ci[1]
        if self._best is None or key < self._best[0]:
            self._best = key, entry.evaluation.layout
        if entry.simulations >= self._next:
            while self._next <= entry.simulations:
                self._next *= 2
            best = self._verification.evaluate(self._best[1])
            self._tell((*self._cases, VerifiedLayout(BEST, best)))
