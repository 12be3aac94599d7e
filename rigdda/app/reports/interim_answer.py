"""What a design knows before it is done: its layouts with Z, as one line and as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from rigdda.app.design_study import VerifiedLayout
from rigdda.app.reports.tables import empty_table
from rigdda.app.reports.wording import euros, span


def line(cases: Sequence[VerifiedLayout]) -> str:
    """Return the layouts in one line: the name, Z and its interval, and what the last one is."""
    parts = []
    for case in cases:
        e = case.evaluation
        parts.append(f"{case.name} {euros(e.objective)} ({span(e.ci)})")
    last = cases[-1]
    what = f"; {last.name}: {_labels(last)}" if last.evaluation.layout else ""
    head = f"so far, with {last.evaluation.releases:,} releases of each layout"
    return f"{head}: Z {', '.join(parts)} EUR per metre and year{what}"


def table(cases: Sequence[VerifiedLayout]) -> Table:
    """Return the table of the layouts with Z and its 95 % interval."""
    releases = cases[-1].evaluation.releases
    found = empty_table((f"so far ({releases:,} releases each)", "Z (95 %)", "barriers"))
    for case in cases:
        e = case.evaluation
        found.add_row(case.name, f"{euros(e.objective)} ({span(e.ci)})", _labels(case))
    return found


def _labels(case: VerifiedLayout) -> str:
    """Return the barriers of a layout in words."""
    return ", ".join(f"{b.label} at {b.x:.1f} m" for b in case.evaluation.layout)
