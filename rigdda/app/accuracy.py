"""The accuracy suite for the command line: choice of cases, tables and files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from rigdda import BadInput
from rigdda.app.reports.tables import applies_not, empty_table, write_rows
from rigdda.validation import CASES, Case, Convergence, Result, converge, evaluate
from rigdda.validation.convergence import STEPS
from rigdda.validation.free_flight import CASES as FLIGHT

if TYPE_CHECKING:
    from rich.table import Table


def choose(only: Sequence[str], slow: bool) -> tuple[Case, ...]:
    """Return the cases to run.

    Parameters
    ----------
    only : sequence of str
        Beginnings of the names of cases. If it is empty, all cases are chosen.
    slow : bool
        Whether slow cases are included. Cases that `only` selects are always included.

    Raises
    ------
    BadInput
        If no name begins with one of the given texts.
    """
    for start in only:
        if not start or not any(case.name.startswith(start) for case in CASES):
            names = ", ".join(case.name for case in CASES)
            raise BadInput("--only", start, f"use the beginning of one of {names}")
    if only:
        return tuple(case for case in CASES if case.name.startswith(tuple(only)))
    return tuple(case for case in CASES if slow or not case.slow)


def runs(cases: Sequence[Case]) -> int:
    """Return the number of progress reports: one per case and another per smooth case."""
    return len(cases) + sum(case.smooth for case in cases)


def validate(
    cases: Sequence[Case], seed: int, out: Path, tick: Callable[[int, str], None]
) -> tuple[list[Result], list[Convergence]]:
    """Run cases and the convergence of smooth cases, and write the tables after each of them."""
    evaluate(FLIGHT[0])  # compile the kernels first, so that no case is charged for it
    results: list[Result] = []
    studies: list[Convergence] = []
    for done, case in enumerate(cases):
        tick(done, case.name)
        results += evaluate(case, seed=seed)
        write_results(out / "validate.csv", results)
    for done, case in enumerate([case for case in cases if case.smooth], len(cases)):
        tick(done, f"{case.name}: order of convergence")
        studies += converge(case, seed)
        write_studies(out / "convergence.csv", studies)
    return results, studies


def write_results(path: Path, results: Iterable[Result]) -> None:
    """Write a CSV file with one row per computed quantity."""
    rows = [
        {
            "case": r.case,
            "quantity": r.check.quantity,
            "closed_form": r.check.closed_form,
            "unit": r.check.unit,
            "exact": r.exact,
            "computed": r.computed,
            "kind": r.check.error,
            "error": r.error,
            "bar": r.check.bar,
            "passed": r.passed,
            "cpu_us_per_s": r.cpu,
        }
        for r in results
    ]
    write_rows(path, rows)


def write_studies(path: Path, studies: Iterable[Convergence]) -> None:
    """Write a CSV file with one row per smooth quantity: its error at each step and the order."""
    rows = [
        {"case": s.case, "quantity": s.quantity}
        | {f"error_at_{dt:g}_s": error for dt, error in zip(STEPS, s.errors, strict=True)}
        | {"order": s.order}
        for s in studies
    ]
    write_rows(path, rows)


def table(results: Iterable[Result]) -> Table:
    """Return the table of quantities, at most 80 characters wide.

    Errors above their tolerance are marked with an exclamation mark.
    """
    out = empty_table(("case", "closed form", "computed", "error", "bar", "us/s"))
    for name, figures in groupby(results, lambda result: result.case):
        for i, r in enumerate(figures):
            if i == 0:
                out.add_row(name, "", "", "", "", "" if applies_not(r.cpu) else f"{r.cpu:.0f}")
            unit = "" if r.check.unit == "-" else f" [{r.check.unit}]"
            out.add_row(
                f"  {r.check.quantity}{unit}",
                "-" if r.check.error == "bound" else f"{r.exact:.6g}",
                f"{r.computed:.6g}",
                f"{r.error:.1e}{'  ' if r.passed else ' !'}",
                f"{r.check.bar:.0e}",
            )
    return out


def convergence_table(studies: Iterable[Convergence]) -> Table:
    """Return the table of the errors at each time step and of the observed orders."""
    out = empty_table(("case", *(f"{1e3 * dt:g} ms" for dt in STEPS), "order"))
    for name, figures in groupby(studies, lambda study: study.case):
        out.add_row(name)
        for s in figures:
            order = f"{s.order:.2f}" if math.isfinite(s.order) else "-"
            out.add_row(f"  {s.quantity}", *(f"{e:.1e}" for e in s.errors), order)
    return out
