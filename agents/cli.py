"""The command line: `rigdda sites | simulate | design | study | train | evaluate | ...`.

Start-up imports click only; a command imports what it needs.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from agents.commands import evaluate, study, train, validate
from agents.limits import SEED
from agents.names import DESIGNERS
from agents.options import count_option, out_option, seed_option
from agents.terminal import Stopped, fail, folder_for, kept, progress, show

if TYPE_CHECKING:
    from rigdda import Layout

SIMULATIONS = 176
"""Default budget of a search."""

RELEASES = 32
"""Default number of releases that a layout is verified on."""

CASES = 3
"""Layouts that are verified: none, the rule's, the found one."""


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
        return cli.main(argv, prog_name="rigdda", standalone_mode=False) or 0
    except click.Abort:
        return fail("interrupted", 130)
    except click.ClickException as error:
        return fail(error.format_message(), error.exit_code)
    except Stopped as stop:
        return fail(str(stop), stop.code)
    except OSError as error:
        return fail(str(error), 2 if isinstance(error, BAD_PATH) else 1)
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


layout_option = click.option(
    "--layout", type=click.Path(), help="Barriers: a TOML or JSON file, as `design` writes."
)


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
              help="Show the version.")  # fmt: skip
@click.pass_context
def cli(context: click.Context) -> None:
    """Rockfall protection: simulate a slope, design its barriers, look at releases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for command in (study, train, evaluate, validate):
    cli.add_command(command)


@cli.command()
def sites() -> None:
    """List the built-in sites."""
    import rigdda
    from agents import tables

    show(tables.sites(map(rigdda.Site.load, rigdda.sites.names())))


@cli.command()
@click.argument("site")
@layout_option
@count_option("--releases", 1, 16, "Releases to average.")
@seed_option("Seed of the first release; the others follow it.")
@out_option("simulate-SITE")
def simulate(site: str, layout: str | None, releases: int, seed: int, out: Path | None) -> None:
    """Simulate releases of SITE (a name or a TOML file) and say what reaches the road.

    Writes outcomes.csv, run.npz (the first release) and profile.png (the same).
    The energy of a hit is that of the block just before it touches; a barrier absorbs what its
    forces take from all blocks, whether they hit it or lie against it.
    """
    import rigdda
    from agents import job, pictures, tables

    where, walls = rigdda.Site.load(site), _layout(layout)
    seeds = range(seed, seed + releases)
    where.realise(walls, seed)  # what cannot be built is said before a folder is made
    folder = folder_for(out, f"simulate-{where.name}", "outcomes.csv", "run.npz", "profile.png")
    with kept(folder), progress(releases) as tick:
        run, outcomes = job.simulate(where, walls, seeds, tick)
    tables.write_outcomes(folder / "outcomes.csv", seeds, outcomes)
    run.save(folder / "run.npz")
    share = outcomes[0].debris_fraction
    title = f"release {seed}: {share:.1%} of the mass past the road's edge"
    pictures.profile(folder / "profile.png", where, [pictures.Panel(title, run)])
    show(tables.outcomes(walls, outcomes))
    click.echo(f"{releases} releases; outcomes.csv, run.npz and profile.png are in {folder}")


@cli.command()
@click.argument("site")
@click.option("--designer", type=click.Choice(DESIGNERS), default="cma", show_default=True,
              help="How to search.")  # fmt: skip
@count_option("--simulations", 2, SIMULATIONS, "Releases that the search may simulate.")
@count_option("--verify", 2, RELEASES, "Unseen releases that each layout is verified on.")
@seed_option("Seed of the search and of its releases.", SEED)
@out_option("design-SITE")
def design(
    site: str, designer: str, simulations: int, verify: int, seed: int, out: Path | None
) -> None:
    """Design the barriers of SITE (a name or a TOML file) and verify them on unseen releases.

    Writes layout.toml, evaluations.csv, profile.png, search.png and episode.rrd; the designer
    pareto front.csv and front.png too. Layouts that a killed or former run has evaluated are in
    evaluations.jsonl and are not simulated again.
    """
    from agents import job, tables
    from envs import DesignProblem
    from rigdda.barriers import describe

    problem = DesignProblem(site)
    folder = folder_for(out, f"design-{problem.site.name}", *job.files(designer))
    with kept(folder):
        with progress(simulations + CASES * verify) as tick:
            done, store = job.study(problem, designer, simulations, seed, verify, folder, tick)
        job.write(done, folder)
    show(tables.designs(done.cases))
    chosen = done.cases[-1][1]
    for i, barrier in enumerate(chosen.layout):
        click.echo(describe(barrier) + tables.failures(barrier, i, chosen.outcomes))
    resumed = f"; {store.resumed} releases taken from a former run" if store.resumed else ""
    click.echo(
        f"search: {done.result.simulations} releases; verification: {verify} unseen ones each "
        f"(seeds of a stream of their own){resumed}\nlayout.toml, evaluations.csv, profile.png, "
        f"search.png and episode.rrd are in {folder}"
    )


@cli.command()
@click.argument("site")
@count_option("--releases", 2, 64, "Releases of each layout at each fidelity.")
@seed_option("Seed of the releases.")
@out_option("calibrate-SITE")
def calibrate(site: str, releases: int, seed: int, out: Path | None) -> None:
    """Measure what fidelity "fast" costs and gains on SITE (a name or a TOML file).

    Compares the debris of no barrier, one fence and two fences, and the processor time of a
    release. Writes calibrate.csv.
    """
    import rigdda
    from agents import calibrate as job

    where = rigdda.Site.load(site)
    total = 2 * releases * len(job.layouts(where))
    folder = folder_for(out, f"calibrate-{where.name}", "calibrate.csv")
    with kept(folder), progress(total) as tick:
        found = job.calibrate(where, releases, seed, tick)
    job.write(folder / "calibrate.csv", where, found)
    show(job.table(found))
    click.echo(f"{releases} releases of each; calibrate.csv is in {folder}")


@cli.command()
@click.argument("target")
@layout_option
@seed_option("Seed of the release.")
@out_option("replay-SITE")
def replay(target: str, layout: str | None, seed: int, out: Path | None) -> None:
    """Open a replay (FILE.rrd, or a run FILE.npz) or make one of a release of a site.

    For a site, writes episode.rrd and prints its path; for a run, FILE.rrd beside it.
    """
    import rigdda
    from rigdda.replay import Marks, open_viewer

    file = Path(target)
    if file.suffix in (".npz", ".rrd") and (layout or seed or out):
        raise click.UsageError("--layout, --seed and --out are for sites")
    if file.suffix == ".npz":
        run = rigdda.Run.load(file)
        file = file.with_suffix(".rrd")
        run.to_rerun(file, Marks(title=file.stem))
    if file.suffix == ".rrd":
        open_viewer(file)
        return
    where = rigdda.Site.load(target)
    walls = _layout(layout)
    where.realise(walls, seed)
    folder = folder_for(out, f"replay-{where.name}", "episode.rrd")
    with kept(folder):
        run, outcome = rigdda.release(where, walls, seed, progress=sys.stderr.isatty())
    notes = {"seed": str(seed), "past the road's edge": f"{outcome.debris_fraction:.1%}"}
    road = (where.road.start, where.road.end)
    run.to_rerun(folder / "episode.rrd", Marks(road, notes, where.name))
    click.echo(folder / "episode.rrd")


def _layout(path: str | None) -> Layout:
    """Return the layout of a file, no barriers without one."""
    from rigdda import load_layout

    return () if path is None else load_layout(path)


if __name__ == "__main__":
    sys.exit(main())
