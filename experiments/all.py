"""Run all figures, tables and studies that are judged by a number.

This excludes those that take hours or need other engines: outcome_cost, tschamut, reference,
designers, bench, ablated.
"""

from __future__ import annotations

import importlib
import sys
import time
import traceback
from pathlib import Path
from typing import NamedTuple

import click
from rich.console import Console
from rich.table import Table

from experiments.script import Number, folder, options, say

SCRIPTS = (
    "fig01_expansion",
    "fig04_deformable",
    "fig05_solvers",
    "fig07_toppling",
    "fig10_modes",
    "fig13_deposit",
    "fig14_retained",
    "outcome_step",
    "run_out_step",
    "fence_step",
    "thrust",
    "one_slope",
    "lumped_mass",
    "catch_bench",
    "hard_cases",
    "speed_error",
)
"""Modules of `experiments` with `run(quick, out) -> Number`, in order of execution."""


class Result(NamedTuple):
    """Result of a script: its number, or the error that stopped it, and its processor time [s]."""

    script: str
    number: Number | None
    error: str
    cpu: float

    @property
    def passed(self) -> bool:
        """Whether the script ran and reached its target."""
        return self.number is not None and self.number.passed


def attempt(script: str, quick: bool, out: Path) -> Result:
    """Run a script and catch any error."""
    start = time.process_time()
    number, error = None, ""
    try:
        number = importlib.import_module(f"experiments.{script}").run(quick, out)
    except Exception as failure:  # run the other scripts after any error
        traceback.print_exc()
        error = f"{type(failure).__name__}: {failure}"
    return Result(script, number, error, time.process_time() - start)


def summary(results: list[Result]) -> Table:
    """Return a table of the results of all scripts."""
    table = Table("script", "what it is judged by", "value", "target", "reached", "CPU s")
    for r in results:
        what, value, target = r.error, "", ""
        if r.number:
            what, value, target = r.number.what, f"{r.number.value:.4g}", r.number.target
        mark = "yes" if r.passed else "[red]no[/]"
        table.add_row(r.script, what, value, target, mark, f"{r.cpu:.0f}")
    return table


@click.command(help=__doc__)
@options
def main(quick: bool, out: Path | None) -> None:
    """Run all scripts; exit with 1 and name those that failed or missed their target."""
    results = []
    for i, script in enumerate(SCRIPTS):
        say(f"[{i + 1}/{len(SCRIPTS)}] {script}")
        results.append(attempt(script, quick, folder(quick, out)))
        say(str(results[-1].number or results[-1].error))
    Console(width=None if sys.stdout.isatty() else 140).print(summary(results))
    failed = [r.script for r in results if not r.passed]
    if failed:
        raise click.ClickException(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
