"""What every script of a figure or a study shares: its protocol, command line, files and clock.

A script is a module with `run(quick, out) -> Number`. It writes a CSV and a picture of its own name
into `out` and returns the one number that it is judged by.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from experiments.made_by import KERNELS, kernels_hash, made_by
from rigdda.envs.intervals import quantile
from rigdda.files import atomic

RESULTS = Path("experiments/results")
"""Where results are recorded; quick ones go into its folder `quick`."""

BLUE, RED, GREEN, ORANGE, GREY = "#1c5aa0", "#c0392b", "#2e8b57", "#e85d04", "#68584a"
"""Colours of curves."""

STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
DPI = 100


class Number(NamedTuple):
    """The number that a script is judged by.

    Parameters
    ----------
    what : str
        What it is, with its unit.
    value : float
        What was computed.
    low, high : float
        Between which it must be.
    note : str
        What else was found, for the reader.
    """

    what: str
    value: float
    low: float = -math.inf
    high: float = math.inf
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the target is reached."""
        return self.low <= self.value <= self.high

    @property
    def target(self) -> str:
        """The target in words."""
        if self.low == self.high:
            return f"{self.low:g}"
        ends = (("at least", self.low), ("at most", self.high))
        return ", ".join(f"{word} {end:g}" for word, end in ends if math.isfinite(end))

    def __str__(self) -> str:
        verdict = "" if self.passed else ": NOT REACHED"
        note = f"\n{self.note}" if self.note else ""
        return f"{self.what}: {self.value:.4g}, target {self.target}{verdict}{note}"


Run = Callable[[bool, Path], Number]


def options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options of every script to a function of (quick, out); None is where results go."""
    quick = click.option("--quick", is_flag=True, help="Fewer sizes, releases and steps: minutes.")
    out = click.option(
        "--out", type=click.Path(path_type=Path), help=f"Folder of CSV and pictures: {RESULTS}."
    )
    return quick(out(command))


def folder(quick: bool, out: Path | None) -> Path:
    """Return the folder that was asked for, or where results go."""
    return out or (RESULTS / "quick" if quick else RESULTS)


def main(run: Run) -> None:
    """Run one script from the command line; exits with 1 if its target is not reached."""

    @click.command(help=sys.modules[run.__module__].__doc__)
    @options
    def command(quick: bool, out: Path | None) -> None:
        number = run(quick, folder(quick, out))
        click.echo(number)
        sys.exit(not number.passed)

    command()


def say(what: str) -> None:
    """Tell on the terminal how far a script is."""
    click.echo(what, err=True)


def write(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV and note beside it which kernels made them, see `experiments.made_by`."""
    put(path, rows)
    made = made_by(path.parent) | {path.name: kernels_hash()}
    put(path.parent / KERNELS, [{"table": k, "kernels": made[k]} for k in sorted(made)])


def put(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV, a column a key, numbers to six digits; whole or not at all.

    What is not a number does not apply: its cell is empty.
    """
    with atomic(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: cell(v) for k, v in row.items()})


def cell(value: Any) -> Any:
    """Return what a cell of a table holds."""
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.6g}"


def draw(
    path: Path,
    size: tuple[float, float],
    picture: Callable[[Figure], None],
    dpi: int = DPI,
) -> None:
    """Write what `picture` draws into a figure of `size` [inch] as PNG; whole or not at all."""
    with rc_context(STYLE), atomic(path) as part:
        figure = Figure(size, dpi=dpi, layout="constrained")
        picture(figure)
        figure.savefig(part, format="png")


def cpu_time(call: Callable[[], object], repeats: int = 5, least: float = 0.01) -> float:
    """Return the median processor time of a call [s], each measurement of at least `least` [s]."""
    times = []
    for _ in range(repeats):
        calls, start = 0, time.process_time()
        while calls == 0 or time.process_time() - start < least:
            call()
            calls += 1
        times.append((time.process_time() - start) / calls)
    return float(np.median(times))


def interval(values: Iterable[float]) -> tuple[float, float]:
    """Return the mean of independent values and half of its 95 % interval, Student's."""
    sample = np.array(list(values), dtype=np.float64)
    n = len(sample)
    half = quantile(n - 1) * sample.std(ddof=1) / math.sqrt(n) if n > 1 else math.nan
    return float(sample.mean()), float(half)
