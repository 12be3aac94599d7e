"""Precomputed properties of the generated sites without barriers, shipped with the package.

`python -m experiments.known_sites` computes the ensembles and envelopes of the sites of some splits
and writes them to the file of `rigdda.envs.site_store`. The first `reset` on such a site reads them
instead of simulating two thousand releases. The file is only used with the sources that made it, so
it must be made last before a release. Values in the user's cache are not computed again.
"""

from __future__ import annotations

from pathlib import Path

import click

from experiments.script import say
from rigdda import sites
from rigdda.envs import ensemble, envelope, site_store
from rigdda.envs.problem import DesignProblem
from rigdda.files import atomic

SPLITS = ("validation", "test")


@click.command(help=__doc__)
@click.option("--split", "splits", multiple=True, default=SPLITS, show_default=True,
              type=click.Choice(tuple(sites.SPLITS)), help="May be repeated.")  # fmt: skip
@click.option("--sites", "count", type=click.IntRange(1), default=60, show_default=True,
              help="Number of sites of each split.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), default=site_store.SHIPPED,
              show_default=True, help="The file.")  # fmt: skip
def main(splits: tuple[str, ...], count: int, out: Path) -> None:
    """Compute and write the file."""
    values = {}
    for name in [name for split in splits for name in sites.split(split)[:count]]:
        problem = DesignProblem(name)
        key = problem.key.hex()
        values[f"{ensemble.NAME}-{key}"] = ensemble.of(problem.site, problem.key)
        seen = envelope.Kept.of(envelope.envelope(problem.site))
        values[f"{envelope.NAME}-{key}"] = seen
        say(name)
    with atomic(out) as part:
        part.write_bytes(site_store.pack(values))
    say(f"{len(values) // 2} sites, {out.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
