"""The command `rigdda train`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rigdda.agents import limits
from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    WholeNumber,
    folder_for,
    out_option,
    progress,
    recorded_run,
    seed_option,
)

if TYPE_CHECKING:
    pass


TRAINING_SITES = {"policy": 512, "value": 96, "corridor": 12}
"""Default number of training sites by model."""


EPISODES = 49_152
"""Default number of episodes of a policy."""


@click.command()
@click.option("--model", type=click.Choice(tuple(TRAINING_SITES)),
              default="policy", show_default=True,
              help="A policy trained with PPO, the value network, or the agent for "
              "corridors.")  # fmt: skip
@click.option("--sites", type=WholeNumber(2), metavar="N",
              help="Number of random sites to train on.  [default: 512 for a policy, 96 for the "
              "value network, 12 for corridors]")  # fmt: skip
@click.option("--episodes", type=WholeNumber(0, limits.RELEASES), metavar="N",
              help="Number of episodes, for a policy.  [default: 49152]")  # fmt: skip
@seed_option("Seed of all random numbers.", SEED)
@out_option("train")
def train(model: str, sites: int | None, episodes: int | None, seed: int, out: Path | None) -> None:
    """Train a network that designs layouts without a search.

    A policy observes the ground, the prices and the rockfall without barriers, and is improved by
    PPO. Writes policy.safetensors, for `rigdda evaluate --policy`, and logs for TensorBoard. A
    complete training continues if --episodes is larger than before.

    The value network forecasts the remaining risk with any layout from the rockfall without
    barriers. It is trained on simulated layouts of every site, about half a minute each. Writes
    value.safetensors. The one that ships with the package is the prior of the designer `race`.

    The agent for corridors needs to know how much money will save in the remaining sections. This
    is computed from forecasts of the value network on every site, about half a minute each. Writes
    prospect.safetensors.

    An interrupted training continues where it stopped and gives the same result; the one of the
    agent for corridors starts again. A policy and the value network require the extra `rl`.
    """
    from rigdda.agents import training, value_training
    from rigdda.agents.corridor import agent

    sites = sites or TRAINING_SITES[model]
    if model != "policy" and episodes is not None:
        raise click.UsageError("--episodes is for --model policy: leave it out")
    if model == "corridor":
        folder = folder_for(out, "train", agent.FILE.name)
        with recorded_run(folder), progress(sites) as tick:
            found = agent.train(sites, seed, folder, tick)
        most = 100.0 * found.gain[-1]
        click.echo(
            f"forecasts on {sites} sites: unlimited money gains {most:.0f} % of the annual cost; "
            f"{agent.FILE.name} is in {folder}"
        )
        return
    if model == "value":
        asked = value_training.ValueTerms(sites, seed)
        folder = folder_for(out, "train", *value_training.FILES)
        with recorded_run(folder), progress(asked.sites) as tick:
            value_training.train(asked, folder, tick)
        click.echo(f"value network of {asked.sites} sites; value.safetensors is in {folder}")
        return
    terms = training.Terms(sites, EPISODES if episodes is None else episodes, seed)
    folder = folder_for(out, "train", *training.FILES)
    with recorded_run(folder), progress(terms.episodes) as tick:
        trained = training.train(terms, folder, lambda done: tick(done, "PPO"))
    click.echo(
        f"mean relative reduction of Z on {terms.beside} sites not used in training: "
        f"{trained.before:.3f} before the training, {trained.after:.3f} after it; "
        f"policy.safetensors is in {folder}"
    )
