"""List recorded results that the current kernels did not make.

`python -m experiments.stale [--out DIR]`. Tables without a note of their kernels count as stale.
The references of the exam are listed, too.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click

from experiments.made_by import KERNELS, made_by
from experiments.script import RESULTS
from rigdda import MECHANICS
from rigdda.agents.exam import specification


def stale(folder: Path) -> list[Path]:
    """Return the tables below a folder that were made by other or unknown kernels."""
    tables = sorted(path for path in folder.rglob("*.csv") if path.name != KERNELS)
    return [path for path in tables if made_by(path.parent).get(path.name) != MECHANICS]


@click.command(help=__doc__)
@click.option("--out", type=click.Path(path_type=Path), default=RESULTS, show_default=True,
              help="Folder of results.")  # fmt: skip
def main(out: Path) -> None:
    """List the stale tables; exit with 1 if there are any."""
    found, exam = stale(out), specification.load()
    exam_stale = out == RESULTS and not exam.current
    if exam_stale:
        click.echo(f"references of the exam (experiments.exam_reference): {exam.mechanics}")
    for path in found:
        click.echo(f"{path}: {made_by(path.parent).get(path.name, 'made by unknown kernels')}")
    sys.exit(bool(found) or exam_stale)


if __name__ == "__main__":
    main()
