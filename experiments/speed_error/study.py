"""Speed against error: cost and error of each setting, and the position of the default.

Judged by the greatest bias of an outcome of the highway case with the default settings from a
converged reference, over half the 95 % interval of its mean over 100 releases.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from types import ModuleType

import numpy as np

from experiments.bench.engines import PEERS, PeerMissing, adapter
from experiments.script import Number, draw, say, write
from experiments.speed_error import closed_forms, highway, pictures
from experiments.speed_error.closed_forms import Point
from experiments.speed_error.tables import bias, closed_table, highway_rows, highway_table
from rigdda.files import atomic

SAMPLES = "highway-samples"
"""Subfolder of the results for the outcomes of every release."""

JUDGED = 100
"""Number of releases for the 95 % interval that is the measure of bias."""


def peers() -> list[ModuleType]:
    """Return the adapters of the installed peers."""
    found = []
    for name in PEERS:
        try:
            found.append(adapter(name))
        except PeerMissing as missing:
            say(f"speed against error: peer skipped: {missing}")
    return found


def closed(quick: bool, others: list[ModuleType]) -> list[Point]:
    """Return all points of the closed forms."""
    points: list[Point] = []
    cases = closed_forms.with_peers(quick)
    list(closed_forms.sweep(cases[0]))  # compile the kernels
    for case in cases:
        say(f"closed form: {case.name}")
        points += closed_forms.sweep(case)
        points += closed_forms.sweep_peers(case, others, say)
    for alone in closed_forms.alone(quick):
        say(f"closed form: {alone.name}")
        points += closed_forms.sweep_alone(alone)
    return points


def worst_bias(default: highway.Sample, reference: highway.Sample) -> tuple[float, float]:
    """Return the greatest relative bias of an outcome, and its uncertainty [-].

    Both are over the 95 % interval of the outcome.
    """
    off, sure = bias(default, reference)
    measure = default.half(JUDGED)
    scattered = measure > 0.0  # constant outcomes have no interval
    off, sure = np.abs(off[scattered]) / measure[scattered], sure[scattered] / measure[scattered]
    worst = int(np.argmax(off))
    return float(off[worst]), float(sure[worst])


def run(quick: bool, out: Path) -> Number:
    """Compute, write and draw."""
    others = peers()
    points = closed(quick, others)
    write(out / "speed_error.csv", [asdict(p) for p in points])
    panels = out / "speed_error.png"
    draw(panels, (15.0, 10.0), lambda f: pictures.closed_forms(f, points), dpi=70)
    budget = highway.QUICK if quick else highway.FULL
    say(f"highway: reference, {budget.reference} releases")
    folder = out / SAMPLES
    reference = highway.reference(budget, folder)
    own = highway.samples(budget, folder, say)
    samples = [*own, *highway.peer_samples(budget, others, folder, say)]
    write(out / "highway.csv", highway_rows([*samples, reference], reference))
    draw(out / "highway.png", (13.0, 8.0), lambda f: pictures.highway(f, samples, reference))
    with atomic(out / "speed_error.md") as part:
        tables = f"{closed_table(points)}\n{highway_table(samples, reference)}"
        part.write_text(tables, encoding="utf-8")
    default = next(s for s in samples if s.default)
    value, known = worst_bias(default, reference)
    return Number(
        f"bias of the highway outcome by default over its 95 % interval at {JUDGED} releases",
        value,
        high=1.0 + known if quick else 1.0,  # quick runs only detect bias beyond their noise
        note=f"uncertainty ± {known:.2g}\n{highway_table(samples, reference)}",
    )
