"""The command `rigdda validate`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    Stopped,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
)


@click.command()
@click.option("--only", multiple=True, metavar="NAME",
              help="Run only cases whose names begin with NAME. May be repeated.")  # fmt: skip
@click.option("--slow", is_flag=True, help="Run the slow cases as well.")
@seed_option("Seed of the random shapes, speeds and offsets.")
@out_option("validate")
def validate(only: tuple[str, ...], slow: bool, seed: int, out: Path | None) -> None:
    """Compare computed motions with closed-form solutions.

    Writes validate.csv and, with the observed order of convergence in the time step,
    convergence.csv. The exit code is 1 if an error exceeds its tolerance (column "bar"). The last
    column of the table is the processor time in microseconds per simulated second.
    """
    from rigdda.app import accuracy

    cases = accuracy.choose(only, slow)
    folder = folder_for(out, "validate", "validate.csv", "convergence.csv")
    with recorded_run(folder), progress(accuracy.runs(cases)) as tick:
        results, studies = accuracy.validate(cases, seed, folder, tick)
    show(accuracy.table(results))
    if studies:
        show(accuracy.convergence_table(studies))
    missed = [f"{r.case} ({r.check.quantity})" for r in results if not r.passed]
    if missed:
        raise Stopped(
            f"{len(missed)} of {len(results)} exceed their tolerances: {', '.join(missed)}", 1
        )
    click.echo(f"{len(results)} figures are within their tolerances; the tables are in {folder}")
