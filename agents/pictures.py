"""Pictures of a design: the slope with what stays where, and how the search went."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.protocol import History
from envs import Evaluation
from envs.picture import BARRIER, ROAD, ROCK, draw
from rigdda import Ditch, Run, Site
from rigdda.barriers import Standing
from rigdda.files import atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

START, ZONE, SEARCH, RULE, NOTHING = "#e0c3a4", "#9dc3e6", "#9aa5b1", "#8a5fb5", "#c0392b"
FONT: dict[Any, Any] = {"font.size": 11, "axes.spines.top": False, "axes.spines.right": False}
DPI = 120


@dataclass(frozen=True, slots=True)
class Panel:
    """One slope of a picture: its title and a release on it."""

    title: str
    run: Run


def profile(path: str | os.PathLike[str], site: Site, panels: Sequence[Panel]) -> None:
    """Write a PNG of releases, one above the other, to scale and on the same axes.

    Shown are the slope, the road, the barrier zone, the barriers, and the blocks at the start
    (pale) and at the end.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    left, right, bottom, top = _window(site)
    scale = min(9.5 / (right - left), 5.2 / (top - bottom))  # inches a metre
    width = max((right - left) * scale + 1.2, 8.5)  # room for the words
    size = width, ((top - bottom) * scale + 0.7) * len(panels) + 0.8
    with rc_context(FONT):
        figure = Figure(size, dpi=DPI, layout="constrained")
        grid = figure.subplots(len(panels), sharex=True, squeeze=False)
        for axes, panel in zip(grid[:, 0], panels, strict=True):
            _slope(axes, site, panel)
            axes.set(xlim=(left, right), ylim=(bottom, top))
            axes.label_outer()
        _key(figure, max(panel.run.times[-1] for panel in panels))
        _save(figure, path)


def _window(site: Site) -> tuple[float, float, float, float]:
    """Return left, right, bottom, top of what matters: from the source to beyond the road [m]."""
    source = site.source.outline
    x, y = np.array(site.slope.points).T
    reach = site.road.end - source[:, 0].min()
    left = max(source[:, 0].min() - 0.05 * reach, x[0])
    right = min(site.road.end + 0.2 * reach, x[-1])
    return left, right, y.min() - 0.04 * np.ptp(y), source[:, 1].max() + 0.05 * np.ptp(y)


def _slope(axes: Axes, site: Site, panel: Panel) -> None:
    """Draw one panel; what is drawn first is covered by the ground and the final blocks."""
    run, road, zone, terrain = panel.run, site.road, site.barrier_zone, site.profile
    inner = [x for x, _ in site.slope.points if zone.start < x < zone.end]
    reach = [zone.start, *inner, zone.end]
    ground = [terrain.height(x) for x in reach]
    axes.plot(reach, ground, color=ZONE, linewidth=7, zorder=0.5, solid_capstyle="butt")
    for block in run.scene.blocks:
        axes.fill(*block.vertices.T, facecolor=START, edgecolor="white", linewidth=0.2)
    for i, barrier in enumerate(run.scene.barriers):
        outline = run.outline(i)
        if isinstance(barrier, Standing) and not math.isfinite(run.failure(i)):
            axes.fill(*outline.T, facecolor=BARRIER, edgecolor=BARRIER, linewidth=2.5)
        size = barrier.depth if isinstance(barrier, Ditch) else barrier.height
        axes.annotate(
            f"{size:.1f} m",
            outline[np.argmax(outline[:, 1])],
            xytext=(16, 26),
            textcoords="offset points",
            color=BARRIER,
            fontweight="bold",
            arrowprops={"arrowstyle": "-", "color": BARRIER, "linewidth": 0.8},
        )
    draw(axes, run, (road.start, road.end))
    axes.set_title(panel.title, loc="left", fontsize=11)


def _key(figure: Figure, duration: float) -> None:
    """Write what the colours of a profile mean below it."""
    from matplotlib.patches import Patch

    words = {
        "source": START,
        f"blocks after {duration:g} s": ROCK,
        "barrier": BARRIER,
        "barriers may stand": ZONE,
        "road": ROAD,
    }
    patches = [Patch(color=colour, label=label) for label, colour in words.items()]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(words), frameon=False)


def search(
    path: str | os.PathLike[str], history: History, references: Sequence[tuple[str, Evaluation]]
) -> None:
    """Write a PNG of the objective of every layout against the simulations.

    Parameters
    ----------
    path : path
        The PNG.
    history : History
        What the designer evaluated.
    references : sequence of (str, Evaluation)
        Verified layouts, no barrier first, drawn as lines with their 95 % intervals.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((9.0, 5.4), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        colours = (NOTHING, RULE, BARRIER)
        for (name, evaluation), colour in zip(references, colours, strict=False):
            low, high = np.nan_to_num(evaluation.ci, posinf=evaluation.objective)
            axes.axhspan(low, high, color=colour, alpha=0.13, linewidth=0)
            axes.axhline(evaluation.objective, color=colour, linewidth=1.4, label=name)
        _points(axes, history)
        axes.set(xlabel="simulated releases", ylabel="objective (risk and cost, less is better)")
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.25)
        figure.legend(loc="outside lower center", ncols=3, frameon=False)
        _save(figure, path)


def _points(axes: Axes, history: History) -> None:
    """Draw the layouts of the search, the best so far, and the finalists with their intervals."""
    searched, finals = history.stage("search"), history.stage("final")
    if searched:
        at, best = history.best_so_far()
        values = [entry.evaluation.objective for entry in searched]
        axes.plot(at, values, "o", color=SEARCH, markersize=5, label="layout, by few releases")
        axes.step(at, best, where="post", color="black", linewidth=1.2, label="best by these")
    if finals:
        mean = np.array([entry.evaluation.objective for entry in finals])
        spread = np.array([entry.evaluation.ci[1] for entry in finals]) - mean
        spread[~np.isfinite(spread) | (spread < 0.0)] = 0.0  # one release; equal ones, rounded
        axes.errorbar(
            [entry.simulations for entry in finals],
            mean,
            yerr=spread,
            fmt="D",
            color="black",
            markersize=5,
            capsize=3,
            linewidth=1.0,
            label="finalist on other releases",
        )


def front(
    path: str | os.PathLike[str],
    history: History,
    found: Sequence[Evaluation],
    points: Sequence[tuple[str, Evaluation]],
) -> None:
    """Write a PNG of cost against debris: all layouts of a search, the front, and named layouts.

    Parameters
    ----------
    path : path
        The PNG.
    history : History
        What the search evaluated.
    found : sequence of Evaluation
        The front, the cheapest first, drawn with its 95 % intervals.
    points : sequence of (str, Evaluation)
        Verified layouts to show beside it, with theirs.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure((9.0, 5.4), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        tried = [entry.evaluation for entry in history.stage("search")]
        axes.plot([e.cost for e in tried], [100 * e.debris for e in tried], "o", color=SEARCH,
                  markersize=3.5, alpha=0.6, label="layout, by few releases")  # fmt: skip
        steps = [e.cost for e in found], [100 * e.debris for e in found]
        axes.step(*steps, where="post", color=BARRIER, linewidth=1.4)
        _crosses(axes, found, "o", BARRIER, "front, on other releases")
        for i, (name, e) in enumerate(points):
            _crosses(axes, [e], "Ds^v<>pX"[i % 8], f"C{i}", name)
        axes.set(xlabel="cost per metre of slope width", ylabel="debris past the road's edge [%]")
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.25)
        figure.legend(loc="outside lower center", ncols=3, frameon=False)
        _save(figure, path)


def _crosses(
    axes: Axes, evaluations: Sequence[Evaluation], marker: str, colour: str, label: str
) -> None:
    """Draw costs and debris of evaluations with the intervals of the debris."""
    debris = np.array([e.debris for e in evaluations])
    spread = np.abs(np.array([e.debris_ci for e in evaluations]) - debris[:, None]).T
    cost = [e.cost for e in evaluations]
    axes.errorbar(cost, 100 * debris, 100 * spread, fmt=marker, color=colour, markersize=6,
                  capsize=3, linewidth=1.0, label=label)  # fmt: skip


def _save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, whole or not at all."""
    with atomic(path) as part:
        figure.savefig(part, format="png")
