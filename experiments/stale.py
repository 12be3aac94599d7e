"""List recorded results that are not of the current version of the mechanics.

`python -m experiments.stale [--out DIR]`. Tables without a note of their version count as stale.
The references of the exam and the statistics of sites that ship with the package are listed, too.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import click

from experiments.made_by import MADE_BY, made_by
from experiments.script import RESULTS
from rigdda import MECHANICS
from rigdda.agents.designers import policy
from rigdda.agents.designers.forecast import NETWORK_FILE as VALUE_NETWORK
from rigdda.agents.network import Network
from rigdda.app.exam import specification
from rigdda.envs import forecast_table, site_store

UNKNOWN = "made by unknown mechanics"


def stale(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield the tables below a folder that other or unknown mechanics made, and which."""
    for path in sorted(folder.rglob("*.csv")):
        made = made_by(path.parent).get(path.name, UNKNOWN)
        if path.name != MADE_BY and made != MECHANICS:
            yield path, made


def stale_package() -> Iterator[tuple[str, str]]:
    """Yield the stored results of the package that other or unknown mechanics made, and which."""
    exam, store = specification.load(), site_store.shipped()
    if not exam.current:
        yield "references of the exam (experiments.exam_reference)", exam.mechanics
    if store is None or not store.current:
        made = UNKNOWN if store is None else store.mechanics
        yield "statistics of sites (experiments.known_sites)", made
    made = forecast_table.load().notes.get("mechanics", UNKNOWN)
    if made != MECHANICS:
        yield "table of forecasts (experiments.known_forecasts)", made
    made = Network.load(VALUE_NETWORK).notes.get("mechanics", UNKNOWN)
    if made != MECHANICS:
        yield "value network (rigdda train --model value)", made
    made = policy.load().network.notes.get("mechanics", UNKNOWN)
    if made != MECHANICS:
        yield "policy (rigdda train, see experiments.known_forecasts)", made


@click.command(help=__doc__)
@click.option("--out", type=click.Path(path_type=Path), default=RESULTS, show_default=True,
              help="Folder of results.")  # fmt: skip
def main(out: Path) -> None:
    """List the stale results; exit with 1 if there are any."""
    package = stale_package() if out == RESULTS else ()
    found = [*package, *stale(out)]
    for what, made in found:
        click.echo(f"{what}: {made}")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
