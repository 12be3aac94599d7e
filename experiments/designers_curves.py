"""Means over cases of what designers gain, with 95 % intervals, as a table and a picture."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from agents.tables import empty_table
from envs.evaluation import student_interval
from rigdda.files import atomic

if TYPE_CHECKING:
    from rich.table import Table

Row = Mapping[str, Any]
YARDSTICKS = ("random", "cma")
"""What every designer is compared with."""
RESAMPLES = 4000
COLOURS = {
    "cma": "#1f77b4", "cma from policy": "#17becf", "tpe": "#2ca02c", "pareto": "#8c564b",
    "convex": "#9467bd", "ppo": "#e377c2", "random": "#7f7f7f", "rule": "#d62728",
    "policy": "#ff7f0e",
}  # fmt: skip


def gains(rows: Sequence[Row], designer: str, budget: int) -> NDArray[np.float64]:
    """Return what a designer took off the objective at a budget, case by case (n,)."""
    return np.array([r["gain"] for r in rows if (r["designer"], r["budget"]) == (designer, budget)])


def names(rows: Sequence[Row]) -> list[str]:
    """Return the designers in their order."""
    return list(dict.fromkeys(row["designer"] for row in rows))


def summary(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return for each designer and budget the mean gain and its comparison with the yardsticks.

    `ahead_of_random`: paired difference at the same budget; `share_of_cma`: of what CMA-ES gains
    with its whole budget.
    """
    last = max(row["budget"] for row in rows)
    out = []
    for name in names(rows):
        for budget in sorted({row["budget"] for row in rows}):
            own = gains(rows, name, budget)
            low, high = student_interval(own)
            row = {
                "designer": name, "budget": budget, "cases": len(own), "gain": float(own.mean()),
                "gain_low": low, "gain_high": high,
            }  # fmt: skip
            other, best = gains(rows, YARDSTICKS[0], budget), gains(rows, YARDSTICKS[1], last)
            if len(other):
                low, high = student_interval(own - other)
                row |= {"ahead_of_random": float((own - other).mean())}
                row |= {"ahead_low": low, "ahead_high": high}
            if len(best) and best.mean() > 0.0:
                low, high = share_interval(own, best)
                row |= {"share_of_cma": float(own.mean() / best.mean())}
                row |= {"share_low": low, "share_high": high}
            out.append(row)
    return out


def share_interval(part: NDArray[np.float64], whole: NDArray[np.float64]) -> tuple[float, float]:
    """Return the 95 % interval of the ratio of two means over the same cases, by bootstrap."""
    drawn = np.random.default_rng(0).integers(len(part), size=(RESAMPLES, len(part)))
    whole_means = np.maximum(whole[drawn].mean(axis=1), 1e-9)  # a sample may gain nothing
    ratios = part[drawn].mean(axis=1) / whole_means
    low, high = np.quantile(ratios, (0.025, 0.975)).tolist()
    return low, high


def table(summed: Sequence[Row]) -> Table:
    """Return the table of the whole budget."""
    last = max(row["budget"] for row in summed)
    out = empty_table(("designer", "fall", "ahead of random", "share of cma (95 %)"))
    for row in summed:
        if row["budget"] == last:
            share = "-"
            if "share_of_cma" in row:
                share = f"{row['share_of_cma']:.2f} ({row['share_low']:.2f} to "
                share += f"{row['share_high']:.2f})"
            spans = _span(row, "gain", "gain"), _span(row, "ahead_of_random", "ahead")
            out.add_row(row["designer"], *spans, share)
    return out


def _span(row: Row, name: str, interval: str) -> str:
    """Return a mean with half its 95 % interval in words."""
    if name not in row:
        return "-"
    half = 0.5 * (row[f"{interval}_high"] - row[f"{interval}_low"])
    return f"{row[name]:.3f} ± {half:.3f}" if np.isfinite(half) else f"{row[name]:.3f}"


def _shown(own: Sequence[Row]) -> dict[int, float]:
    """Return the budgets of a designer that say something new, and what it used of each."""
    out: dict[int, float] = {}
    for budget in sorted({row["budget"] for row in own}):
        at = [row for row in own if row["budget"] == budget]
        used = float(np.mean([row["simulations"] for row in at]))
        if any(row["barriers"] for row in at) and used > max(out.values(), default=0.0):
            out[budget] = used
    return out


def picture(path: str | os.PathLike[str], rows: Sequence[Row]) -> None:
    """Write a PNG of the mean gain against the simulations used, with 95 % intervals."""
    from matplotlib.figure import Figure

    figure = Figure((9.0, 5.4), dpi=120, layout="constrained")
    axes = figure.subplots()
    for name in names(rows):
        own = [row for row in rows if row["designer"] == name]
        used = _shown(own)
        shown = list(used)
        values = [gains(own, name, b) for b in shown]
        mean = np.array([v.mean() for v in values])
        bounds = np.array([student_interval(v) for v in values])
        low, high = np.where(np.isfinite(bounds), bounds, mean[:, None]).T
        x, style = [used[b] for b in shown], {"color": COLOURS[name], "label": name}
        if len(shown) == 1:
            axes.errorbar(x, mean, [mean - low, high - mean], fmt="D", capsize=4, **style)
        else:
            axes.plot(x, mean, "o-", markersize=4, linewidth=1.6, **style)
            axes.fill_between(x, low, high, color=COLOURS[name], alpha=0.12, linewidth=0)
    axes.set(xscale="log", xlabel="simulated releases",
             ylabel="fall of the objective (verified; mean over cases, 95 %)")  # fmt: skip
    budgets = sorted({row["budget"] for row in rows})
    apart = [b for b in budgets if b == budgets[-1] or 1.5 * b < budgets[-1]]
    axes.set_xticks(apart, [str(budget) for budget in apart])
    axes.minorticks_off()
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right upper", frameon=False)
    with atomic(path) as part:
        figure.savefig(part, format="png")
