"""The command line: `rigdda sites | simulate | design | study | train | evaluate | ...`.

Start-up imports click only; a command imports what it needs.
"""

from __future__ import annotations

import errno
import io
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import click

from rigdda.agents.commands import evaluate, fit, study, train, validate
from rigdda.agents.designing import design
from rigdda.agents.options import count_option, layout_option, out_option, read_layout, seed_option
from rigdda.agents.terminal import Stopped, fail, folder_for, kept, note, once, progress, show

BAD_PATH = (
    FileNotFoundError, FileExistsError, NotADirectoryError, IsADirectoryError, PermissionError,
)  # fmt: skip
"""Errors of the system that come of a path that was given."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    0: done. 2: bad input. 1: it failed on the way. 130: interrupted. Each but 0 comes with one
    line on standard error.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # names may have letters that the locale lacks
    try:
        with warnings.catch_warnings():
            warnings.showwarning = once()
            return cli.main(argv, prog_name="rigdda", standalone_mode=False) or 0
    except click.Abort:
        return fail("interrupted", 130)
    except click.ClickException as error:
        return fail(error.format_message(), error.exit_code)
    except Stopped as stop:
        return fail(str(stop), stop.code)
    except OSError as error:
        bad = isinstance(error, BAD_PATH) or error.errno == errno.ENAMETOOLONG
        return fail(str(error), 2 if bad else 1)
    except Exception as error:
        from rigdda import BadInput, Error

        if not isinstance(error, Error):
            raise
        return fail(str(error), 2 if isinstance(error, BadInput) else 1)


def _version(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted:
        from rigdda import __version__

        click.echo(f"rigdda {__version__}")
        context.exit()


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
              help="Show the version.")  # fmt: skip
@click.pass_context
def cli(context: click.Context) -> None:
    """Rockfall protection: simulate a slope, design its barriers, look at releases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for command in (design, fit, study, train, evaluate, validate):
    cli.add_command(command)


@cli.command()
def sites() -> None:
    """List the built-in sites: families, events with their rates, where barriers may stand."""
    import rigdda
    from rigdda.agents import tables

    show(tables.sites(map(rigdda.Site.load, rigdda.sites.names())))


@cli.command()
@click.argument("site")
@layout_option
@click.option("--event", metavar="NAME", help="Releases of this event only.  [default: by rate]")
@count_option("--releases", 1, 100, "Releases to average.")
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="lumped: each block a point, for a quick look without "
              "barriers that stand.")  # fmt: skip
@seed_option("Seed of the first release; the others follow it.")
@out_option("simulate-SITE")
def simulate(
    site: str,
    layout: str | None,
    event: str | None,
    releases: int,
    model: str,
    seed: int,
    out: Path | None,
) -> None:
    """Simulate releases of SITE (a name or a TOML file) and say what reaches the road.

    Without --event each release is of an event drawn by its rate. Writes outcomes.csv, run.npz
    (the first release) and section.png; with --model lumped points.csv. The energy of a hit is that
    of the block just before it touches; a barrier absorbs what its forces take from all blocks.
    """
    import rigdda
    from rigdda.agents import doubts, job, section, tables

    where, barriers = rigdda.Site.load(site), read_layout(layout)
    seeds = range(seed, seed + releases)
    if model == "lumped":
        points = rigdda.lumped(where, barriers, seeds, event)
        folder = folder_for(out, f"simulate-{where.name}", "points.csv")
        tables.write_points(folder / "points.csv", seeds, points)
        show(tables.points(points))
        note(doubts.unfitted(where))
        note(doubts.of_layout(where, barriers, event))
        click.echo(f"{releases} releases of points; points.csv is in {folder}")
        return
    where.realise(barriers, seed, event)  # what cannot be built is said before a folder is made
    folder = folder_for(out, f"simulate-{where.name}", "outcomes.csv", "run.npz", "section.png")
    with kept(folder), progress(releases) as tick:
        run, outcomes = job.simulate(where, barriers, seeds, event, tick)
        tables.write_outcomes(folder / "outcomes.csv", seeds, outcomes)
        run.save(folder / "run.npz")
        section.released(folder / "section.png", where, barriers, seeds, event)
    show(tables.outcomes(barriers, outcomes))
    note(doubts.of_layout(where, barriers, event))
    click.echo(f"{releases} releases; outcomes.csv, run.npz and section.png are in {folder}")


@cli.command()
@click.argument("site")
@count_option("--releases", 10, 2000, "Releases of each layout at each fidelity.")
@seed_option("Seed of the releases.")
@out_option("fidelity-SITE")
def fidelity(site: str, releases: int, seed: int, out: Path | None) -> None:
    """Measure what fidelity "fast" costs and gains on SITE (a name or a TOML file).

    Compares Z and the processor time of a release, for no barrier, the constant and what the
    engineering rule builds. Writes fidelity.csv.
    """
    from rigdda.agents import fidelity_bias as job
    from rigdda.envs import DesignProblem

    where = DesignProblem(site).site
    folder = folder_for(out, f"fidelity-{where.name}", "fidelity.csv")
    with kept(folder), progress(6 * releases) as tick:
        found = job.compare(where, releases, seed, tick)
    job.write(folder / "fidelity.csv", where, found)
    show(job.table(found))
    click.echo(f"{releases} releases of each; fidelity.csv is in {folder}")


@cli.command()
@click.argument("target")
@layout_option
@click.option("--event", metavar="NAME", help="A release of this event.  [default: by rate]")
@seed_option("Seed of the release.")
@out_option("replay-SITE")
def replay(target: str, layout: str | None, event: str | None, seed: int, out: Path | None) -> None:
    """Open a replay (FILE.rrd, or a run FILE.npz) or make one of a release of a site.

    For a site, writes episode.rrd and prints its path; for a run, FILE.rrd beside it.
    """
    import rigdda
    from rigdda.agents import doubts
    from rigdda.agents.wording import short, standing
    from rigdda.results.marks import Marks
    from rigdda.results.viewer import open_viewer

    file = Path(target)
    if file.suffix in (".npz", ".rrd") and (layout or event or seed or out):
        raise click.UsageError("--layout, --event, --seed and --out are for sites")
    if file.suffix == ".npz":
        run = rigdda.Run.load(file)
        file = file.with_suffix(".rrd")
        run.to_rerun(file, Marks(title=file.stem))
    if file.suffix == ".rrd":
        open_viewer(file)
        return
    where, barriers = rigdda.Site.load(target), read_layout(layout)
    where.realise(barriers, seed, event)
    folder = folder_for(out, f"replay-{where.name}", "episode.rrd")
    with kept(folder):
        run, outcome = rigdda.release(where, barriers, seed, event)
    came = f"{outcome.road_volume:.2g} of {outcome.released_volume:.2g} m3"
    notes = {"event": outcome.event, "seed": str(seed), "comes onto the road": came}
    if words := doubts.of_layout(where, barriers, event):
        notes["doubt"] = words
    road, labels = (where.road.start, where.road.end), tuple(map(short, standing(barriers)))
    run.to_rerun(folder / "episode.rrd", Marks(road, notes, where.name, labels))
    click.echo(folder / "episode.rrd")


if __name__ == "__main__":
    sys.exit(main())
