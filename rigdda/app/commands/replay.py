"""The command `rigdda replay`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.agents.limits import SINGLE_SEED
from rigdda.app.terminal import (
    folder_for,
    layout_option,
    note,
    out_option,
    read_layout,
    recorded_run,
    seed_option,
)


@click.command()
@click.argument("target")
@layout_option
@click.option(
    "--event",
    metavar="NAME",
    help="Replay a release of this event.  [default: draw an event by its rate]",
)
@seed_option("Seed of the release.", SINGLE_SEED)
@out_option("replay-SITE")
def replay(target: str, layout: str | None, event: str | None, seed: int, out: Path | None) -> None:
    """Open a replay, or record a release of a site as one.

    TARGET is a file or a site. A replay (FILE.rrd) is opened. A run (FILE.npz) is converted to
    FILE.rrd and opened. For a site, one release is simulated and episode.rrd is written.
    """
    import rigdda
    from rigdda import BadInput
    from rigdda.app.released import released
    from rigdda.app.reports import findings
    from rigdda.envs.replay_record import release_record
    from rigdda.replay.recording import Marks, is_recording
    from rigdda.replay.viewer import open_viewer

    file = Path(target)
    if file.suffix in (".npz", ".rrd") and (layout or event or seed or out):
        raise click.UsageError("--layout, --event, --seed and --out are for sites")
    if file.suffix == ".npz":
        run = rigdda.Run.load(file)
        file = file.with_suffix(".rrd")
        if file.exists() and not is_recording(file):
            raise BadInput("replay", str(file), "move it away: it is not a replay of rigdda")
        run.to_rerun(file, Marks(title=file.stem))
    if file.suffix == ".rrd":
        open_viewer(file)
        return
    where, barriers = released(target), read_layout(layout)
    where.realise(barriers, seed, event)
    folder = folder_for(out, f"replay-{where.name}", "episode.rrd")
    with recorded_run(folder, where):
        run, outcome = rigdda.release(where, barriers, seed, event)
        came = f"{outcome.road_volume:.2g} of {outcome.released_volume:.2g} m3"
        notes = {"event": outcome.event, "seed": str(seed), "volume on the road": came}
        if words := findings.of_layout(where, barriers, event):
            notes["note"] = words
            note(words)
        road, labels = (where.road.start, where.road.end), where.labels(barriers)
        record = release_record(where, barriers, seed, event, outcome)
        run.to_rerun(folder / "episode.rrd", Marks(road, notes, where.name, labels, record))
    click.echo(folder / "episode.rrd")
