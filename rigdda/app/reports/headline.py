"""The first line of a design: what to build, or why nothing that was found should be built."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

from rigdda.app.reports.wording import euros, percent
from rigdda.envs.problem import MET, MISSED

Money = tuple[float, float, float]
"""Z with the ends of its 95 % interval [EUR per metre and year]."""


OFTEN = 0.05
"""Share of the releases of a design event that reach the road from which it is told [-]."""

MANY = 1000.0
"""Utilisation above which its value says no more; one without any capacity is infinite [-]."""


class FailedCheck(NamedTuple):
    """A check that is not met: barrier and check in words, and demand over capacity [-]."""

    barrier: str
    check: str
    use: float


class DesignAnswer(NamedTuple):
    """Result of a design, as far as its first line needs it.

    Parameters
    ----------
    layout : str
        The layout in words, empty if it has no barrier.
    bare : str
        What the case without the layout is called in a sentence.
    z, nothing : Money
        Z with the layout and without it.
    targets : str or None
        Whether the targets are met; None without targets.
    asked : str
        The targets in words, such as "a block reaches the road with at most 5 %".
    required : bool
        Whether all checks had to be met.
    failed : sequence of FailedCheck
        Checks that the layout does not meet.
    reaching : (str, float)
        The design event that most often reaches the road with the layout, empty without design
        events, and the share of its releases that do [-].
    """

    layout: str
    bare: str
    z: Money
    nothing: Money
    targets: str | None
    asked: str
    required: bool
    failed: Sequence[FailedCheck]
    reaching: tuple[str, float]


def headline(answer: DesignAnswer) -> str:
    """Return the first line of a design.

    A layout is never headed "build" if it fails one of its checks, misses a target, or costs more
    than it saves without being needed for a target.
    """
    layout, own = answer.layout, [f for f in answer.failed if not is_existing(f)]
    fails = f" It fails its checks: {failed_words(own)}." if own else ""
    if answer.targets == MISSED:
        if not layout:
            return f"No layout that was found meets the target that {answer.asked}."
        return (
            f"No layout that was found meets the target that {answer.asked}. "
            f"The best of those that miss it: {layout}.{fails}"
        )
    if not layout:
        worth = "meets every check and is worth" if answer.required else "is worth"
        if answer.targets == MET:
            return f"Build nothing: the slope {answer.bare} meets the target."
        return f"Build nothing: no layout was found that {worth} its cost."
    if fails:
        return f"Do not build this as it is: {layout}.{fails}"
    if answer.targets not in (None, MET):
        return (
            f"Verify with more releases before you build: {layout}. These releases do not decide "
            f"whether it meets the target that {answer.asked}."
        )
    more = answer.z[0] - answer.nothing[0]
    if answer.z[1] > answer.nothing[2]:
        if answer.targets == MET:
            return (
                f"Build, for the target alone: {layout}. It costs {euros(more)} EUR per metre and "
                f"year more than {answer.bare}.{_left(answer)}"
            )
        return (
            f"Build nothing: the best layout that was found costs {euros(more)} EUR per metre and "
            f"year more than {answer.bare}: {layout}."
        )
    if answer.z[2] >= answer.nothing[1] and answer.targets is None:
        return (
            f"Verify with more releases before you build: {layout}. It is not shown that it saves "
            "more than it costs."
        )
    return f"Build: {layout}.{_left(answer)}"


def _left(answer: DesignAnswer) -> str:
    """Return a sentence on how often rock still reaches the road; empty if it hardly does."""
    event, share = answer.reaching
    if share < OFTEN:
        return ""
    return f" Rock of {event!r} still reaches the road in {percent(share)} of the releases."


def failed_words(failed: Sequence[FailedCheck]) -> str:
    """Return the barriers with checks that are not met in words, with their utilisation."""
    words = []
    for barrier, group in groupby(failed, key=lambda one: one.barrier):
        uses = " and ".join(f"{one.check} {_times(one.use)}" for one in group)
        words.append(f"{barrier}: {uses} times the limit")
    return "; ".join(words)


def is_existing(failed: FailedCheck) -> bool:
    """Return whether a check is that of a barrier that stands already."""
    return failed.barrier.startswith("existing ")


def _times(use: float) -> str:
    """Return a utilisation with two decimals below 10, and in whole above."""
    if use > MANY:
        return f"more than {MANY:,.0f}"
    return f"{use:.2f}" if use < 9.995 else f"{use:,.0f}"
