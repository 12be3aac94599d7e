"""What a fit leaves beside the site: a table and a picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.agents.fit import Fit
from rigdda.agents.prediction import QUANTILES, Quality, seen
from rigdda.agents.tables import write_rows

Floats = NDArray[np.float64]


NOT_IDENTIFIED = 0.7
"""Length of a 95 % interval over the range that was given, from which on the observed run-outs tell
nothing of a parameter [-]. An interval that they do not narrow is .95 of the range."""


def identified(fitted: Fit) -> list[bool]:
    """Return whether the observed run-outs tell each parameter from the others of its range."""
    ends = zip(fitted.parameters, fitted.low, fitted.high, strict=True)
    return [high - low < NOT_IDENTIFIED * (p.high - p.low) for p, low, high in ends]


def rows(fitted: Fit, observed: Mapping[str, Floats]) -> list[dict[str, Any]]:
    """Return the parameters and what they give beside what was observed, a row each."""
    ends = (fitted.parameters, fitted.best.values, fitted.low, fitted.high, identified(fitted))
    out: list[dict[str, Any]] = [
        {
            "what": p.path,
            "unit": "",
            "fitted": v,
            "low": a,
            "high": b,
            "observed": "",
            "left_out": "",
            "identified": "yes" if told else "no",
        }
        for p, v, a, b, told in zip(*ends, strict=True)
    ]
    own, left, real = fitted.fitted, fitted.validated, seen(observed, fitted.site.slope.toe)

    def add(what: str, unit: str, pick: Callable[[Quality], float]) -> None:
        row = {"what": what, "unit": unit, "fitted": pick(own), "low": "", "high": ""}
        out.append(row | {"observed": pick(real), "left_out": pick(left), "identified": ""})

    add("score", "m", lambda q: q.score)
    add("mean run-out", "m", lambda q: q.mean)
    for k, share in enumerate(QUANTILES):
        add(f"{share:.0%} of run-outs", "m", lambda q, k=k: q.quantiles[k])  # type: ignore[misc]
    for event in observed:
        add(f"mean run-out, {event}", "m", lambda q, e=event: q.means[e])  # type: ignore[misc]
    add("stops on the slope", "-", lambda q: q.stopped)
    return out


def write(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write `rows` as CSV."""
    write_rows(path, rows(fitted, observed))


def draw(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write a PNG: cumulative run-out observed and computed, all runs and each event."""
    from matplotlib.figure import Figure

    from rigdda.agents.pictures import save

    names = ["all", *observed] if len(observed) > 1 else list(observed)
    figure = Figure(figsize=(3.2 * len(names) + 0.6, 3.6), layout="constrained")
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        events = list(observed) if name == "all" else [name]
        real = np.concatenate([observed[e] for e in events])
        weight = [len(observed[e]) / len(real) for e in events]
        grid = np.linspace(min(0.0, real.min()), 1.25 * real.max(), 400)
        share = sum(w * (fitted.best.run_outs[e][:, None] <= grid).mean(axis=0)
                    for w, e in zip(weight, events, strict=True))  # fmt: skip
        half = 1.96 * np.sqrt(share * (1.0 - share) / len(real))
        axes.fill_between(grid, np.clip(share - half, 0, 1), np.clip(share + half, 0, 1),
                          color="#1c5aa0", alpha=0.2, lw=0)  # fmt: skip
        axes.plot(grid, share, color="#1c5aa0", label="computed, 95 % of samples as small")
        axes.step(np.sort(real), np.arange(1, len(real) + 1) / len(real), where="post",
                  color="#c0392b", label=f"observed, {len(real)}")  # fmt: skip
        axes.set(xlabel="run-out [m]", title=name, ylim=(0, 1))
    figure.axes[0].set_ylabel("share of runs")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="upper left")
    save(figure, path)
