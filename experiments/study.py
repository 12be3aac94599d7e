"""Runner of studies that compute a table case by case and can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from experiments.script import say, write
from rigdda import MECHANICS
from rigdda.files import atomic

Row = dict[str, Any]


def tabulate(
    path: Path,
    cases: Sequence[Row],
    measure: Callable[..., Row],
    told: Callable[[Row], str],
    processes: int = 1,
) -> list[Row]:
    """Measure all cases, write the table and return its rows.

    A row has the columns of its case followed by the measured ones. Until the table is complete,
    rows are saved beside it under the version of the mechanics: an interrupted study is resumed if
    it is the same, and restarted otherwise.

    Parameters
    ----------
    path : Path
        The table.
    cases : sequence of dict
        Keyword arguments of `measure`, numbers and strings; all different.
    measure : callable
        Returns the other columns of a case.
    told : callable
        Returns a progress message for a row.
    processes : int
        Number of cases measured at once; more than one only if each starts its own process.
    """
    kept = path.with_name(f"{path.stem}-{MECHANICS}.part.json")
    rows: list[Row] = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else []
    by_case = {key(row, cases[0]): row for row in rows}
    todo = [case for case in cases if key(case, case) not in by_case]
    if by_case:
        say(f"{path.stem}: resuming with {len(todo)} of {len(cases)} cases")
    for case, found in zip(todo, several(todo, measure, processes), strict=True):
        row = by_case[key(case, case)] = case | found
        with atomic(kept) as part:
            done = json.dumps(list(by_case.values()), default=lambda x: x.item())
            part.write_text(done, encoding="utf-8")
        say(f"{path.stem}: {told(row)}")
    rows = [by_case[key(case, case)] for case in cases]
    write(path, rows)
    kept.unlink(missing_ok=True)
    return rows


def several(cases: Iterable[Row], measure: Callable[..., Row], processes: int) -> Iterator[Row]:
    """Yield the measured columns of each case, in order."""
    if processes == 1:
        yield from (measure(**case) for case in cases)
        return
    with ThreadPoolExecutor(processes) as pool:
        yield from pool.map(lambda case: measure(**case), cases)


def key(row: Row, case: Mapping[str, Any]) -> str:
    """Return the identity of a row: the columns of its case."""
    return json.dumps({name: row[name] for name in case})
