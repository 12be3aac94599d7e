"""The command `rigdda train`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    WholeNumber,
    count_option,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
    typed,
)

TRAINING_SITES = {"policy": 0, "value": 96, "corridor": 12}
"""Default number of training sites by model; 0: those of the table of the package."""

COMPARISON = "comparison.csv"
"""File with Z of the policy and of simple rules on each site."""


@click.command()
@click.option("--model", type=click.Choice(tuple(TRAINING_SITES)),
              default="policy", show_default=True,
              help="A policy, the value network, or the agent for corridors.")  # fmt: skip
@click.option("--sites", type=WholeNumber(2), metavar="N",
              help="Number of random sites to train on.  [default: the table of forecasts of the "
              "package for a policy, 96 for the value network, 12 for corridors]")  # fmt: skip
@click.option("--algorithm", type=click.Choice(("gradient", "ppo")), default="gradient",
              show_default=True, help="For a policy: exact policy gradient or PPO.")  # fmt: skip
@click.option("--simulate", type=WholeNumber(0), default=0, show_default=True, metavar="K",
              help="For a policy: number of promising layouts of each site to simulate for a "
              "second stage of learning.")  # fmt: skip
@click.option("--compare", type=WholeNumber(0), default=6, show_default=True, metavar="N",
              help="For a policy: number of validation sites for the comparison with simple "
              "rules.")  # fmt: skip
@count_option("--verify", 10, 200, "For a policy: number of new releases for each layout of the "
              "comparison.")  # fmt: skip
@seed_option("Seed of all random numbers.", SEED)
@out_option("train")
def train(
    model: str, sites: int | None, algorithm: str, simulate: int, compare: int, verify: int,
    seed: int, out: Path | None,
) -> None:  # fmt: skip
    """Train a network that designs layouts without a search.

    A policy chooses a layout from a catalogue of relative layouts. It learns on forecasts of the
    value network, which takes seconds, and with --simulate also on outcomes. Its layouts are then
    compared with no barrier, the constant, the rule, the best layout of the family of each site and
    the layout with the least forecast Z. Writes policy.safetensors, for `rigdda evaluate --policy`,
    and comparison.csv.

    The value network forecasts the remaining risk with any layout from the rockfall without
    barriers. It is trained on simulated layouts of every site, which takes about half a minute for
    each site. Writes value.safetensors. The value network of the package is the prior of the
    designer `race`.

    The agent for corridors has to estimate how much the remaining money would save in the remaining
    sections. The estimate is computed from forecasts of the value network on every site, which
    takes about half a minute for each site. Writes prospect.safetensors.

    An interrupted training continues where it stopped and gives the same result; the training of
    the agent for corridors starts again. Training a policy or the value network requires the extra
    `rl`.
    """
    number = sites or TRAINING_SITES[model]
    if model != "policy" and typed("algorithm", "simulate", "compare", "verify"):
        words = "--algorithm, --simulate, --compare and --verify are for --model policy"
        raise click.UsageError(f"{words}: leave them out")
    if model == "policy":
        _policy(number, algorithm, simulate, compare, verify, seed, out)
    elif model == "value":
        _value(number, seed, out)
    else:
        _corridor(number, seed, out)


def _policy(
    sites: int, algorithm: str, simulate: int, compare: int, verify: int, seed: int,
    out: Path | None,
) -> None:  # fmt: skip
    """Train a policy and compare it with simple rules."""
    from rigdda.agents import training
    from rigdda.app.reports import tables, training_table
    from rigdda.envs import forecast_table

    terms = training.Terms(sites, algorithm, simulate, seed)
    names = training.comparison_sites(compare)
    number = sites or len(forecast_table.load().rows("train"))
    folder = folder_for(out, "train", *training.FILES, COMPARISON)
    with recorded_run(folder), progress(max(number, compare, training.MEMBERS)) as tick:
        policy = training.train(terms, folder, tick)
        rows = training.compare(policy, folder, terms, names, verify, tick)
        if rows:
            tables.write_rows(folder / COMPARISON, [asdict(row) for row in rows])
    if rows:
        click.echo(training_table.HEAD)
        show(training_table.table(rows))
    click.echo(f"policy.safetensors is in {folder}")


def _value(sites: int, seed: int, out: Path | None) -> None:
    """Train the value network."""
    from rigdda.agents import value_training

    asked = value_training.ValueTerms(sites, seed)
    folder = folder_for(out, "train", *value_training.VALUE_FILES)
    with recorded_run(folder), progress(asked.sites) as tick:
        value_training.train(asked, folder, tick)
    click.echo(f"value network of {asked.sites} sites; value.safetensors is in {folder}")


def _corridor(sites: int, seed: int, out: Path | None) -> None:
    """Train the agent for corridors."""
    from rigdda.agents.corridor import agent

    folder = folder_for(out, "train", agent.PROSPECT_FILE.name)
    with recorded_run(folder), progress(sites) as tick:
        found = agent.train(sites, seed, folder, tick)
    most = 100.0 * found.gain[-1]
    click.echo(
        f"forecasts on {sites} sites: unlimited money gains {most:.0f} % of the annual cost; "
        f"{agent.PROSPECT_FILE.name} is in {folder}"
    )
