"""Common parts of all scripts: their protocol, command line, files and timing.

A script is a module with `run(quick, out) -> Number`. It writes a CSV file and a picture with its
own name into `out` and returns the number by which it is judged.
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

from experiments.made_by import MADE_BY, made_by
from rigdda import MECHANICS
from rigdda.envs.intervals import quantile
from rigdda.files import atomic

RESULTS = Path("experiments/results")
"""Folder of recorded results; those of quick runs are in its subfolder `quick`."""

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
    """The number by which a script is judged.

    Parameters
    ----------
    what : str
        Description with unit.
    value : float
        Computed value.
    low, high : float
        Target range.
    note : str
        Further results for the reader.
    """

    what: str
    value: float
    low: float = -math.inf
    high: float = math.inf
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value is in the target range."""
        return self.low <= self.value <= self.high

    @property
    def target(self) -> str:
        """The target range in words."""
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
    """Add the options `--quick` and `--out` to a command; `out` is None by default."""
    quick = click.option(
        "--quick", is_flag=True, help="Use fewer sizes, releases and steps (minutes)."
    )
    out = click.option(
        "--out",
        type=click.Path(path_type=Path),
        help=f"Folder for CSV files and pictures; default {RESULTS}.",
    )
    return quick(out(command))


def folder(quick: bool, out: Path | None) -> Path:
    """Return the requested folder, or the default folder of results."""
    return out or (RESULTS / "quick" if quick else RESULTS)


def main(run: Run) -> None:
    """Run one script from the command line; exit with 1 if its target is not reached."""

    @click.command(help=sys.modules[run.__module__].__doc__)
    @options
    def command(quick: bool, out: Path | None) -> None:
        number = run(quick, folder(quick, out))
        click.echo(number)
        sys.exit(not number.passed)

    command()


def say(what: str) -> None:
    """Print a progress message."""
    click.echo(what, err=True)


def write(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV and note the version of the mechanics, see `experiments.made_by`."""
    put(path, rows)
    made = made_by(path.parent) | {path.name: MECHANICS}
    put(path.parent / MADE_BY, [{"table": k, "mechanics": made[k]} for k in sorted(made)])


def put(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as CSV atomically, one column per key, with numbers to six digits.

    NaN means not applicable and gives an empty cell.
    """
    with atomic(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: cell(v) for k, v in row.items()})


def cell(value: Any) -> Any:
    """Return the content of a table cell."""
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.6g}"


def draw(
    path: Path,
    size: tuple[float, float],
    picture: Callable[[Figure], None],
    dpi: int = DPI,
) -> None:
    """Write a picture drawn by `picture` on a figure of `size` [inch] as PNG, atomically."""
    with rc_context(STYLE), atomic(path) as part:
        figure = Figure(size, dpi=dpi, layout="constrained")
        picture(figure)
        figure.savefig(part, format="png")


def cpu_time(call: Callable[[], object], repeats: int = 5, least: float = 0.01) -> float:
    """Return the median processor time of a call [s], with at least `least` [s] per measurement."""
    times = []
    for _ in range(repeats):
        calls, start = 0, time.process_time()
        while calls == 0 or time.process_time() - start < least:
            call()
            calls += 1
        times.append((time.process_time() - start) / calls)
    return float(np.median(times))


def interval(values: Iterable[float]) -> tuple[float, float]:
    """Return the mean of independent values and half of its 95 % interval by Student's t."""
    sample = np.array(list(values), dtype=np.float64)
    n = len(sample)
    half = quantile(n - 1) * sample.std(ddof=1) / math.sqrt(n) if n > 1 else math.nan
    return float(sample.mean()), float(half)
