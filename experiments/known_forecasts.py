"""Table of forecasts that ships with the package, for `rigdda/BarrierForecast-v0`.

`python -m experiments.known_forecasts` computes the forecasts of the value network that ships for
all candidate layouts on the first sites of each split. The catalogue is chosen on the training
sites only. Sites whose forecasts are in the working folder are read, so that an interrupted run
continues. Writes the file of `rigdda.envs.forecast_table`.

Run it after every change of the mechanics or of the value network. Then train the policy that ships
anew: `rigdda train --simulate 12 --out runs/policy`, and copy `policy.safetensors` from this folder
to `rigdda/agents/designers`.
"""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from experiments.made_with import VALUE_NETWORK
from experiments.script import say
from rigdda import MECHANICS, sites
from rigdda.agents.learning import forecasts
from rigdda.agents.learning.relative_layouts import candidates
from rigdda.envs import forecast_table

TRAIN, VALIDATION, TEST = 72, 18, 18
"""Default numbers of sites of each split."""
WORK = Path("runs/known_forecasts")
"""Default working folder."""


def folder_of(work: Path) -> Path:
    """Return the folder for forecasts with the present networks and mechanics; it is created."""
    folder = work / f"mechanics-{MECHANICS}-{VALUE_NETWORK}"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@click.command(help=__doc__)
@click.option("--train", type=click.IntRange(2), default=TRAIN, show_default=True,
              help="Number of training sites.")  # fmt: skip
@click.option("--validation", type=click.IntRange(1), default=VALIDATION, show_default=True,
              help="Number of validation sites.")  # fmt: skip
@click.option("--test", type=click.IntRange(1), default=TEST, show_default=True,
              help="Number of test sites.")  # fmt: skip
@click.option("--layouts", type=click.IntRange(2), default=forecasts.LAYOUTS, show_default=True,
              help="Number of layouts of the catalogue.")  # fmt: skip
@click.option("--work", type=click.Path(path_type=Path), default=WORK,
              show_default=True, help="Working folder.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), default=forecast_table.SHIPPED,
              show_default=True, help="The file.")  # fmt: skip
def main(train: int, validation: int, test: int, layouts: int, work: Path, out: Path) -> None:
    """Compute and write the file."""
    counts = {"train": train, "validation": validation, "test": test}
    names = [
        name for split, count in counts.items() for name in sites.split(f"wide-{split}")[:count]
    ]
    catalogue = candidates()
    found = forecasts.collect(names, catalogue, folder_of(work), lambda i, name: say(f"{i} {name}"))
    z = np.array([own.z for name, own in found.items() if sites.part_of(name) == "train"])
    kept = forecasts.choose(z, catalogue, layouts)
    command = f"python -m experiments.known_forecasts --train {train} --validation {validation}"
    notes = {"command": f"{command} --test {test} --layouts {layouts}"}
    forecasts.table(found, catalogue, kept, notes).save(out)
    whole, own = (np.nanmin(z[:, some], axis=1).mean() for some in (slice(None), kept))
    say(f"{len(found)} sites, {out.stat().st_size / 1e3:.0f} kB")
    say("mean of the least forecast Z over Z without barriers on the training sites:")
    say(f"{whole:.3f} of all candidates, {own:.3f} of the catalogue")


if __name__ == "__main__":
    main()
