"""Tables on the terminal and as CSV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from experiments import script
from experiments.bench.levels import Level


def write(path: Path, rows: Sequence[Any]) -> None:
    """Write dataclasses as CSV with a column per field, see `experiments.script.write`."""
    script.write(path, [asdict(row) for row in rows])


def show_levels(console: Console, rows: Sequence[Level]) -> None:
    """Print the comparison at equal error."""
    table = Table(title="CPU us per simulated s at equal error")
    for name in ("case", "error", "cheapest peer", "peer", "rigdda", "ratio", "must", "aim"):
        table.add_column(name, justify="right" if name in ("peer", "rigdda", "ratio") else "left")
    for r in rows:
        cells = (f"{v:.4g}" if math.isfinite(v) else "-" for v in (r.peer_cpu, r.core_cpu, r.ratio))
        marks = ("yes" if v else "no" for v in (r.must, r.aim))
        table.add_row(r.case, f"{r.error:g}", r.peer, *cells, *marks)
    console.print(table)


def show(console: Console, title: str, row: Any) -> None:
    """Print the fields of a dataclass, one per line."""
    table = Table(title=title, show_header=False)
    for name, value in asdict(row).items():
        table.add_row(
            name.replace("_", " "), f"{value:.4g}" if isinstance(value, float) else str(value)
        )
    console.print(table)


def show_rows(console: Console, title: str, rows: Sequence[Any]) -> None:
    """Print dataclasses, one per line."""
    table = Table(title=title)
    for name in asdict(rows[0]):
        table.add_column(name.replace("_", " "), justify="right")
    for row in rows:
        table.add_row(*(f"{v:.4g}" for v in asdict(row).values()))
    console.print(table)
