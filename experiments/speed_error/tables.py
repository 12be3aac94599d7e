"""Tables of the measurements as CSV rows, and comparisons with the default."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from experiments.speed_error.closed_forms import Point
from experiments.speed_error.highway import OUTCOMES, Sample

FIELDS = ("debris", "run_out", "energy")
"""Column names of the outcomes."""

RELEASES = (10, 30, 100, 300)
"""Numbers of releases for which the error of a mean is given."""


def bias(sample: Sample, reference: Sample) -> tuple[np.ndarray, np.ndarray]:
    """Return the bias of the three means, and half of its 95 % interval."""
    return sample.mean - reference.mean, np.hypot(sample.half(), reference.half())


def highway_rows(samples: Iterable[Sample], reference: Sample) -> list[dict[str, Any]]:
    """Return a row per choice: means, half 95 % intervals, biases and half intervals of these."""
    rows = []
    for s in samples:
        row: dict[str, Any] = {
            "engine": s.engine, "knob": s.knob, "value": s.value, "default": s.default,
            "releases": len(s.outcomes), "cpu_s_per_release": s.cpu,
        }  # fmt: skip
        off, sure = bias(s, reference)
        for k, name in enumerate(FIELDS):
            row[name], row[f"{name}_half"] = float(s.mean[k]), float(s.half()[k])
            row[f"{name}_bias"], row[f"{name}_bias_half"] = float(off[k]), float(sure[k])
        rows.append(row)
    return rows


def total_error(sample: Sample, reference: Sample, releases: int) -> np.ndarray:
    """Return the root mean square error of means of this number of releases, (3,): bias and noise.

    The uncertainty of the bias is included, so that few releases do not appear more accurate.
    """
    off, sure = bias(sample, reference)
    square = off**2 + (sure / 1.96) ** 2
    return np.sqrt(square + sample.outcomes.var(axis=0, ddof=1) / releases)


def highway_table(samples: Sequence[Sample], reference: Sample) -> str:
    """Return a Markdown table comparing the choices with the default and the reference."""
    default = next(s for s in samples if s.default)
    lines = ["| engine | choice | CPU a release / default | " + " | ".join(OUTCOMES) + " |"]
    lines.append("|---" * (len(OUTCOMES) + 3) + "|")
    for s in (*samples, reference):
        cells = [s.engine, f"{s.knob} {s.value:g}" + (" (default)" if s.default else "")]
        cells.append(f"{s.cpu / default.cpu:.2f}")
        off, sure = bias(s, reference)
        for k in range(len(OUTCOMES)):
            if s is reference:
                cells.append(f"{s.mean[k]:.3g} ± {s.half()[k]:.3g}")
            else:
                mark = "**" if abs(off[k]) > sure[k] else ""
                cells.append(f"{mark}{off[k]:+.3g} ± {sure[k]:.3g}{mark}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def closed_table(points: Sequence[Point]) -> str:
    """Return error and cost of each choice relative to the default, as medians of all closed forms.

    Cases with only rounding errors in both count as unchanged.
    """
    own = [p for p in points if p.engine == "rigdda"]
    default = {p.case: p for p in own if p.default}
    lines = ["| choice | CPU / default | error / default, middle | worst | in |", "|---" * 5 + "|"]
    for knob, value in dict.fromkeys((p.knob, p.value) for p in own if not p.default):
        here = [p for p in own if (p.knob, p.value) == (knob, value)]
        cost = [p.cpu_us_per_simulated_s / default[p.case].cpu_us_per_simulated_s for p in here]
        grown = [max(p.error, ROUNDING) / max(default[p.case].error, ROUNDING) for p in here]
        worst = here[int(np.argmax(grown))].case
        lines.append(
            f"| {knob} {value:g} | {np.median(cost):.2g} | {np.median(grown):.2g} | "
            f"{max(grown):.2g} | {worst} |"
        )
    return "\n".join(lines) + "\n"


ROUNDING = 1e-6
"""Error below which a case counts as exact, in its unit."""
