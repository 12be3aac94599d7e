"""The command `rigdda evaluate`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.agents.designers import DESIGNERS
from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    count_option,
    counted,
    executor_option,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
)
from rigdda.model.site_names import SPLITS


@click.command()
@click.option("--designer", "names", type=click.Choice(DESIGNERS), multiple=True,
              default=("rule", "race"), show_default=True,
              help="Designer to compare with 'constant' and 'random'. May be "
              "repeated.")  # fmt: skip
@click.option(
    "--policy",
    type=click.Path(),
    help="Trained policy to compare as well: a file that `rigdda train` wrote.",
)
@click.option("--split", type=click.Choice(SPLITS), default="test",
              show_default=True, help="Split of the generated sites to use.")  # fmt: skip
@count_option("--budget", 2, 3_000, "Number of releases that each designer may simulate on a site.")
@count_option(
    "--sites",
    1,
    6,
    "Number of sites. Six sites contain each family of the first version once, and nine "
    "contain each family with wide ranges once.",
)
@count_option("--verify", 10, 2_000, "Number of new releases for verifying each layout.")
@seed_option("Seed of the searches and of their releases.", SEED)
@out_option("evaluate")
@executor_option
def evaluate(
    names: tuple[str, ...],
    policy: str | None,
    split: str,
    budget: int,
    sites: int,
    verify: int,
    seed: int,
    out: Path | None,
) -> None:
    """Compare designers on generated sites.

    Prints for each designer the number of releases, Z of its layouts, the fall of Z, the difference
    from the best designer of each site and the share of the greatest possible gain, as means over
    the sites with 95 % intervals. Writes scores.csv. An interrupted run continues from
    evaluations.jsonl.
    """
    from rigdda.agents import designers
    from rigdda.agents.designers.policy import load, using
    from rigdda.agents.designers.store import Store
    from rigdda.app import contest
    from rigdda.app.reports import tables

    tried = dict.fromkeys(("constant", "random", *names))
    entrants = {name: designers.module(name).design for name in tried}
    if policy is not None:
        entrants["policy"] = using(load(policy))
    places = contest.site_names(split, sites)
    folder = folder_for(out, "evaluate", "evaluations.jsonl", "scores.csv")
    with recorded_run(folder), progress(len(places) * len(entrants)) as tick:
        store = Store(folder / "evaluations.jsonl")
        scores = contest.hold(places, entrants, budget, verify, seed, store, tick)
        tables.write_rows(folder / "scores.csv", [score.row() for score in scores])
    click.echo("EUR per metre of road and year; best: the cheapest of these designers and of no "
               "barrier on each site")  # fmt: skip
    show(contest.table(scores))
    resumed = f", {store.resumed:,} releases from an earlier run" if store.resumed else ""
    click.echo(f"{counted(len(places), 'site')} of {split}, verified on {verify:,} releases each"
               f"{resumed}; "
               f"scores.csv is in {folder}")  # fmt: skip
