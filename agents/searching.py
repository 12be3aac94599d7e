"""The search that most designers share: proposals, semifinals, finals, and a report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rigdda import Layout
from rigdda.agents.protocol import DesignResult, Ledger, Proposals
from rigdda.agents.ranking import final_score, ranked
from rigdda.envs import DesignProblem, Evaluation

Choose = Callable[[DesignProblem, Sequence[Evaluation], int], list[Evaluation]]
"""Returns at most so many of some evaluations."""

MOST = 100
"""Releases of a layout in a search at most: layouts that differ by 5 % of the gain differ by less
than their spread then, and the semifinals tell them apart."""


@dataclass(frozen=True, slots=True)
class Plan:
    """How a budget is spent: half for the search, half for who was best in it.

    A budget sees 80 layouts in the search, more once each has `MOST` releases. An eighth is for
    semifinals, a quarter for finals; an eighth reports what was chosen. Finals below 16 releases
    each choose nothing: then the best of the search is reported.
    """

    releases: int
    semifinalists: int
    semifinal_releases: int
    finalists: int
    final_releases: int
    report: int

    @classmethod
    def of(cls, simulations: int, most: int = 5) -> Plan:
        """Return the plan for a budget, with at most so many finalists."""
        report = max(1, simulations // 8)
        final = simulations // 4
        finalists = min(most, final // 16) if final >= 32 else 0
        semifinal = simulations // 8
        semifinalists = 3 * most if semifinal // (3 * most) >= 16 else 0
        return cls(
            releases=min(MOST, max(1, simulations // 160)),
            semifinalists=semifinalists,
            semifinal_releases=semifinal // semifinalists if semifinalists else 0,
            finalists=finalists,
            final_releases=final // finalists if finalists else 0,
            report=report,
        )

    @property
    def reserve(self) -> int:
        """Releases that are kept for the semifinals, the finals and the report."""
        semifinal = self.semifinalists * self.semifinal_releases
        return semifinal + self.finalists * self.final_releases + self.report


def best(problem: DesignProblem, evaluations: Sequence[Evaluation], n: int) -> list[Evaluation]:
    """Return those of the best `n` different layouts, the best first."""
    return ranked(problem, evaluations)[:n]


def search(
    ledger: Ledger, proposals: Proposals, choose: Choose = best, most: int = 5
) -> DesignResult:
    """Evaluate what is proposed as far as the budget goes, then the best on other releases.

    Parameters
    ----------
    ledger : Ledger
        Counts the releases.
    proposals : Proposals
        What is evaluated in the search.
    choose : callable
        Chooses who is in the finals, by default the best.
    most : int
        Finalists at most.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    plan = Plan.of(ledger.left, most)
    first = layout = next(proposals)
    while ledger.left >= plan.reserve + plan.releases:
        evaluation = ledger.evaluate(layout, "search", plan.releases)
        try:
            layout = proposals.send(evaluation)
        except StopIteration:
            break
    if not ledger.entries:  # too small a budget to compare anything
        return ledger.result(ledger.evaluate(first, "report", ledger.left))
    return finish(ledger, plan, choose)


def finish(ledger: Ledger, plan: Plan, choose: Choose = best) -> DesignResult:
    """Evaluate the best of a search on other releases, choose one, report it on yet others.

    No barrier at all and what needs no search, `Ledger.known`, are among the finalists, so that the
    choice is not worse: of a few releases in the search the luckiest layouts come out best.

    Raises
    ------
    BadInput, Diverged
        As `DesignProblem.evaluate` does.
    """
    problem = ledger.problem
    left = [entry.evaluation for entry in ledger.entries if entry.stage == "search"]
    if plan.semifinalists > 0:
        chosen = choose(problem, left, plan.semifinalists)
        n = plan.semifinal_releases
        left = [ledger.evaluate(e.layout, "semifinal", n) for e in chosen]
    if plan.finalists > 0:
        known: list[Layout] = [(), *ledger.known]
        searched = [e.layout for e in choose(problem, left, plan.finalists)]
        found = [layout for layout in searched if layout not in known]
        layouts = [*found[: max(1, plan.finalists - len(known))], *known][: plan.finalists]
        left = [ledger.evaluate(layout, "final", plan.final_releases) for layout in layouts]
        winner = min(left, key=lambda e: final_score(problem, e))
    else:
        winner = choose(problem, left, 1)[0]
    return ledger.result(ledger.evaluate(winner.layout, "report", min(plan.report, ledger.left)))
