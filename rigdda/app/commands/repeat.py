"""The command `rigdda repeat`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    Stopped,
    note,
)


@click.command()
@click.argument("file", metavar="EPISODE.rrd", type=click.Path(path_type=Path))
def repeat(file: Path) -> None:
    """Repeat the computation of a replay and compare results.

    The episode or release is computed again, and its results are compared bit for bit.

    EPISODE.rrd is a replay that an environment, `rigdda design` or `rigdda replay SITE` recorded.
    It contains the site, the actions and the seeds. The exit code is 1 if a result differs.
    Programs whose versions differ from those of the recording are listed.
    """
    from rigdda.envs import repetition, replay_record

    found = repetition.repeat(replay_record.load(file))
    click.echo(found.what)
    for words in found.other_versions:
        note(f"version differs: {words}")
    if not found.same:
        raise Stopped(f"results differ: recorded {found.recorded}, computed {found.computed}", 1)
    click.echo(f"identical bit for bit: {found.computed}")
