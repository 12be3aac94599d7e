"""The command line: `rigdda sites | simulate | design | reprice | study | train | ...`.

Each command imports its modules when it runs, so that `--help` is fast.
"""

from __future__ import annotations

import errno
import io
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from rigdda.agents import limits
from rigdda.agents.designers import DEFAULT, DESIGNERS
from rigdda.agents.limits import SEED
from rigdda.agents.terminal import (
    Folder,
    RealNumber,
    Stopped,
    WholeNumber,
    count_option,
    counted,
    executor_option,
    fail,
    finding,
    folder_for,
    interim,
    layout_option,
    note,
    once,
    out_option,
    posterior_option,
    progress,
    read_layout,
    recorded_run,
    seed_option,
    show,
)
from rigdda.app.page.command import open_page

if TYPE_CHECKING:
    from rigdda.agents.design_study import ComparedLayouts, DesignStudy
    from rigdda.agents.designers.store import Store
    from rigdda.envs import DesignProblem

BAD_PATH = (
    FileNotFoundError, FileExistsError, NotADirectoryError, IsADirectoryError, PermissionError,
)  # fmt: skip
"""Errors of the operating system that are caused by a path which the user gave."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    The codes are 0 for success, 2 for bad input, 1 for a failure during the run and 130 for an
    interruption. With every code except 0, one line is written on standard error.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # the locale may lack letters of a name
    try:
        with warnings.catch_warnings():
            warnings.showwarning = once()
            return _run(sys.argv[1:] if argv is None else argv)
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


def _run(argv: Sequence[str]) -> int:
    """Run a command; its arguments are the object of the context, from which they are recorded."""
    typed = list(argv)
    return cli.main(typed, prog_name="rigdda", standalone_mode=False, obj=list(typed)) or 0


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
    """Simulate rockfall on a slope, design barriers and replay releases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


cli.add_command(open_page)


@cli.command()
def sites() -> None:
    """List the built-in sites, their events and barrier zones."""
    import rigdda
    from rigdda.agents.reports import tables

    show(tables.sites(map(rigdda.Site.load, rigdda.sites.names())))


@cli.command()
@click.argument("name")
@click.option("--profile", type=click.Path(path_type=Path), required=True, metavar="FILE",
              help="Surveyed profile: a CSV file with columns such as chainage and elevation, or a "
              "DXF drawing with a polyline (extra `dxf`).")  # fmt: skip
@click.option("--layer", metavar="LAYER", help="Layer of the polyline in a DXF drawing.")
@click.option("--road", type=RealNumber(), nargs=2, metavar="START END", help="Edges of the road.")
@click.option("--toe", type=RealNumber(), metavar="X", help="Foot of the slope.")
@click.option(
    "--zone", type=RealNumber(), nargs=2, metavar="START END", help="Where barriers may stand."
)
@click.option("--ground", "grounds", multiple=True, metavar="NAME:START-END",
              help="Stretch of a ground of the library, such as talus:12-30, or only its name for "
              "all other ground. May be repeated.")  # fmt: skip
@click.option("--source", "sources", multiple=True, metavar="NAME:START-END",
              help="Band of the slope where loose rock lies. May be repeated.")  # fmt: skip
@click.option("--mass", "masses", multiple=True, metavar="NAME:START-END:DIP",
              help="Jointed mass that is taken out of the ground between two chainages: it has a "
              "vertical crack at its upper end and rests on a plane that dips downhill by DIP "
              "degrees to its lower end. May be repeated.")  # fmt: skip
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.toml",
              help="Site file to write.  [default: NAME.toml]")  # fmt: skip
def new(
    name: str,
    profile: Path,
    layer: str | None,
    road: tuple[float, float] | None,
    toe: float | None,
    zone: tuple[float, float] | None,
    grounds: tuple[str, ...],
    sources: tuple[str, ...],
    masses: tuple[str, ...],
    out: Path | None,
) -> None:
    """Write a site file for the surveyed profile of a slope.

    All chainages are those of the survey. If the survey has the coordinates of a grid, an offset is
    taken off and kept in the file. The comment on each value says whether it was surveyed or given,
    or is a placeholder to replace.
    """
    from rigdda.agents import new_site

    request = new_site.SiteRequest(road or None, toe, zone or None, grounds, sources, masses, layer)
    file = new_site.file_of(name, out)
    text, found = new_site.compose(name, profile, request)
    new_site.write(file, text)
    for words in found.notes:
        note(words)
    count = counted(new_site.placeholders(text), "placeholder")
    click.echo(
        f"{len(found.points)} points; {file} is written, with {count} to replace. "
        f"To draw and check it: rigdda check {file}"
    )


@cli.command()
@click.argument("site")
@seed_option("Seed of the releases that are tried.")
@out_option("check-SITE")
def check(site: str, seed: int, out: Path | None) -> None:
    """Draw SITE, say what will be computed and what looks odd.

    SITE is the name of a built-in site or a TOML file. A few releases are simulated to estimate the
    time that others take. Writes site.png.
    """
    from rigdda.agents import site_check
    from rigdda.agents.released import released

    where = released(site)
    folder = folder_for(out, f"check-{where.name}", "site.png")
    with recorded_run(folder, where):
        site_check.draw(folder / "site.png", where)
        trials = site_check.try_releases(where, seed)
    for line in site_check.facts(where):
        click.echo(line)
    show(site_check.table(where, trials))
    click.echo(site_check.time_of(where, trials))
    _warn_of_placeholders(site)
    odd = site_check.oddities(where, trials, site_check.written_events(site))
    for line in odd:
        finding(f"odd: {line}")
    words = f"{len(odd)} things look odd" if len(odd) != 1 else "1 thing looks odd"
    click.echo(f"{words if odd else 'nothing looks odd'}; site.png is in {folder}")


def _warn_of_placeholders(site: str) -> None:
    """Print a note if a site file still has placeholders of `rigdda new`."""
    from rigdda.agents import site_check

    if count := site_check.placeholders(site):
        note(f"the site file marks {count} values as placeholders to replace")


@cli.command()
@click.argument("file", type=click.Choice(("site", "layout")), default="site")
def schema(file: str) -> None:
    """Print the JSON Schema of site files, or of layout files.

    With the schema, an editor explains the keys of a file and marks mistakes. Write it to a file,
    for example site.schema.json, and begin your site file with the line
    "#:schema ./site.schema.json".
    """
    import json

    from rigdda.sites.schema import schema as of

    click.echo(json.dumps(of(file), indent=2))


@cli.command()
@click.argument("site")
@layout_option
@click.option(
    "--event",
    metavar="NAME",
    help="Simulate only this event.  [default: draw events by their rates]",
)
@count_option("--releases", 1, 100, "Number of releases.")
@click.option("--station", "at", type=RealNumber(), multiple=True, metavar="X",
              help="Chainage at which passing blocks are recorded [m], as in the site file, not "
              "of its survey. May be repeated.  "
              "[default: the uphill edge of the road]")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="Mechanical model. 'lumped' treats each block as a point; "
              "it is fast but cannot simulate barriers that stand on the ground.")  # fmt: skip
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
@out_option("simulate-SITE")
@executor_option
def simulate(
    site: str,
    layout: str | None,
    event: str | None,
    releases: int,
    at: tuple[float, ...],
    model: str,
    seed: int,
    out: Path | None,
) -> None:
    """Simulate releases of SITE and report what reaches the road.

    SITE is the name of a built-in site or a TOML file. The energy of a hit is the kinetic energy
    of the block just before it touches the barrier. The energy that a barrier absorbs is the work
    that its forces do against all blocks.

    Writes, each as CSV and Parquet: stations and along_slope (energies, velocity, bounce height and
    passing rate, with quantiles and intervals), passages (every passage at a station), run_out,
    stopping and stops (where rock stops, also beyond the road). Writes pictures (section.png,
    along_slope.png, run_out.png, and one for each station), outcomes.csv and run.npz (the first
    release). With --model lumped, writes points.csv only. A run that was interrupted continues
    where it stopped.
    """
    import rigdda
    from rigdda.agents import jobs
    from rigdda.agents.released import released
    from rigdda.agents.reports import findings, simulation_folder, stations, tables
    from rigdda.agents.reports.stations import Passing
    from rigdda.passages import check_stations

    where, barriers = released(site), read_layout(layout)
    seeds = range(seed, seed + releases)
    if model == "lumped":
        if at:
            raise click.UsageError("--station is for --model blocks")
        points = rigdda.lumped(where, barriers, seeds, event)
        folder = folder_for(out, f"simulate-{where.name}", "points.csv")
        with recorded_run(folder, where):
            tables.write_points(folder / "points.csv", seeds, points)
        show(tables.points(points))
        note(findings.unfitted(where))
        note(findings.of_layout(where, barriers, event))
        click.echo(f"{releases} releases of points; points.csv is in {folder}")
        return
    where.realise(barriers, seed, event)  # report an impossible layout before making a folder
    asked = check_stations(where, at or (where.road.start,))
    folder = folder_for(out, f"simulate-{where.name}", *simulation_folder.files(asked.tolist()))
    with recorded_run(folder, where), progress(releases) as tick:
        lines = simulation_folder.lines(where, asked)
        found = jobs.simulate(where, barriers, seeds, event, lines.tolist(), folder, tick)
        tick(releases, "tables and pictures")
        tables.write_outcomes(folder / "outcomes.csv", seeds, found.outcomes)
        found.run.save(folder / "run.npz")
        passing = Passing.of(where, barriers, event, found.passages)
        rows, rest = simulation_folder.write(folder, passing, barriers, asked)
        jobs.forget(folder)
    show(tables.outcomes(where, barriers, found.outcomes, stations.stopped(rest)))
    for line, table in stations.tables(rows):
        click.echo(line)
        show(table)
    click.echo("intervals: 95 %; ?: too few blocks for this end; height: of the centre of a block")
    note(findings.of_layout(where, barriers, event))
    _warn_of_placeholders(site)
    note(stations.undecided(passing))
    note(stations.lower_bound(rest))
    if passing.not_drawn:
        names = ", ".join(passing.not_drawn)
        note(f"no release is of {names}: give --event to simulate one of them, or more releases")
    resumed = f", {found.resumed:,} from an interrupted run" if found.resumed else ""
    click.echo(f"{releases:,} releases{resumed}; tables and pictures are in {folder}")


@cli.command()
@click.argument("site")
@count_option("--releases", 10, 2000, "Number of releases of each layout at each fidelity.")
@seed_option("Seed of the releases.")
@out_option("fidelity-SITE")
def fidelity(site: str, releases: int, seed: int, out: Path | None) -> None:
    """Measure the bias and the speed-up of fidelity "fast".

    Compares Z and the processor time of a release without barriers, with the constant layout and
    with the layout of the engineering rule. Writes fidelity.csv.
    """
    from rigdda.agents import fidelity_bias
    from rigdda.agents.released import released

    where = released(site)
    folder = folder_for(out, f"fidelity-{where.name}", "fidelity.csv")
    with recorded_run(folder, where), progress(6 * releases) as tick:
        found = fidelity_bias.compare(where, releases, seed, tick)
    fidelity_bias.write(folder / "fidelity.csv", where, found)
    show(fidelity_bias.table(found))
    click.echo(f"{releases} releases of each; fidelity.csv is in {folder}")


@cli.command()
@click.argument("target")
@layout_option
@click.option(
    "--event",
    metavar="NAME",
    help="Replay a release of this event.  [default: draw an event by its rate]",
)
@seed_option("Seed of the release.")
@out_option("replay-SITE")
def replay(target: str, layout: str | None, event: str | None, seed: int, out: Path | None) -> None:
    """Open a replay, or record a release of a site as one.

    TARGET is a file or a site. A replay (FILE.rrd) is opened. A run (FILE.npz) is converted to
    FILE.rrd and opened. For a site, one release is simulated and episode.rrd is written.
    """
    import rigdda
    from rigdda.agents.released import released
    from rigdda.agents.reports import findings
    from rigdda.envs.replay_record import release_record
    from rigdda.replay.recording import Marks
    from rigdda.replay.viewer import open_viewer

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


@cli.command()
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


BUDGET = 20_000
"""Default limit of the releases of a search."""

RELEASES = 3_000
"""Default limit of the releases for the verification of a layout; with all of them, Z is known to a
few per cent."""

PRECISION = 0.02
"""Default precision of a design relative to Z [-]."""

CASES = 5
"""Greatest number of layouts that are verified: no barrier, the rule, the constant, the layout
without required checks and the result."""

Kinds = tuple[str, ...] | None

checks_option = click.option(
    "--checks", type=click.Choice(("required", "reported")), default="required", show_default=True,
    help="Whether every barrier must meet the checks of its kind, such as energy and height of a "
    "fence, or they are only reported.",
)  # fmt: skip


def _kinds(_: click.Context, __: click.Parameter, value: str | None) -> Kinds:
    """Return the names in a list that is separated by commas or spaces."""
    return None if value is None else tuple(value.replace(",", " ").split())


@cli.command()
@click.argument("site")
@click.option("--designer", type=click.Choice(DESIGNERS), default=DEFAULT, show_default=True,
              help="Search method.")  # fmt: skip
@click.option("--kinds", callback=_kinds, metavar="KIND,...",
              help="Allowed kinds of barrier: fence, ditch, embankment, gravity_wall, mesh, wall, "
              "removal (of a removable existing barrier).  [default: all except wall]")  # fmt: skip
@click.option("--target", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that rock of a design event reaches the "
              "road.")  # fmt: skip
@click.option("--failure", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that a barrier fails in a design "
              "event.")  # fmt: skip
@click.option("--target-risk", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable individual risk of a commuter [1/year]. The site must have "
              "a table [traffic].")  # fmt: skip
@click.option("--max-cost", type=RealNumber(min=0.0), metavar="EUR_PER_M",
              help="Largest capital cost of a layout in EUR per metre of road.")  # fmt: skip
@click.option("--zone", type=RealNumber(), nargs=2, metavar="A B",
              help="Place barriers between the chainages A and B [m], as in the site file, not of "
              "its survey.  [default: the zone of the site]")  # fmt: skip
@click.option("--precision", type=RealNumber(0.0, 0.5), default=PRECISION, show_default=True,
              metavar="P", help="Precision of the answer relative to Z. The verification ends when "
              "the order of the layouts is clear or Z is known to within P, the search when "
              "another 1,000 releases are expected to lower Z by less than P/2. 0 uses all "
              "releases of --budget and --verify, as a target does.")  # fmt: skip
@count_option("--budget", 2, BUDGET, "Largest number of releases of the search.")
@checks_option
@count_option("--verify", 10, RELEASES, "Largest number of new releases for verifying each layout.")
@click.option("--ground-samples", "grounds", type=WholeNumber(0, 1000), default=6,
              show_default=True, help="Number of grounds within the plausible range on which the "
              "layouts are compared at the end; 0 for none.")  # fmt: skip
@posterior_option
@seed_option("Seed of the search and of its releases.", SEED)
@out_option("design-SITE")
@executor_option
def design(
    site: str,
    designer: str,
    kinds: Kinds,
    target: float | None,
    failure: float | None,
    target_risk: float | None,
    max_cost: float | None,
    zone: tuple[float, float] | None,
    precision: float,
    budget: int,
    checks: str,
    verify: int,
    grounds: int,
    posterior: Path | None,
    seed: int,
    out: Path | None,
) -> None:
    """Find the best layout of barriers on SITE and verify it.

    SITE is the name of a built-in site or a TOML file. The layout is verified on releases that the
    search did not use. The best layout has the least cost Z of those whose barriers meet their
    checks; a second search with at most half of the budget shows what this condition costs. Z is
    the sum of capital and upkeep, expected harm on the road and expected repair, in EUR per metre
    of road and year. At the end, the layouts are compared on other grounds within the plausible
    range.

    A first answer appears within seconds and improves during the search. The search and the
    verification stop when more releases would hardly change the answer (--precision).

    If the layout misses a target, the cheapest layout for each level of P(reach) is reported and
    written to frontier.csv and frontier.png.

    Writes layout.toml, evaluations.csv, section.png, cost.png and episode.rrd. The comparison on
    other grounds is in band.csv and band.png, the checks of the barriers are in checks.csv and
    design_sheet.csv, and what the engineering rule demands along the slope is in demand.csv and
    demand.png. For a site with traffic, risk.csv contains the risk to life. The outcomes of all
    releases are kept for `rigdda reprice`.

    An interrupted run continues from evaluations.jsonl. A folder that contains the design of
    another problem (problem.json) is refused.
    """
    from rigdda.agents import ground_band, jobs
    from rigdda.agents.designers.store import FILE, record_problem
    from rigdda.agents.parameters import read_posterior
    from rigdda.agents.reports import band_report, interim_answer
    from rigdda.agents.reports.folder import FILES, write

    problem = _pose(site, kinds, (target, failure, target_risk), max_cost, zone, checks)
    fitted = None if posterior is None else read_posterior(posterior, problem.site)
    folder = folder_for(out, f"design-{problem.site.name}", *FILES, *band_report.FILES, FILE)
    record_problem(folder, problem, *FILES)
    band = None
    with recorded_run(folder, problem.site):
        total = jobs.search_budget(problem, designer, budget) + CASES * verify
        with interim(total) as (tick, show_interim):
            done, store = jobs.study(
                problem, designer, budget, seed, verify, folder, tick, precision,
                lambda cases: show_interim(interim_answer.line(cases), interim_answer.table(cases)),
            )  # fmt: skip
            tick(total, "pictures")
            write(done, folder, seed)
        if grounds:
            with progress(grounds) as tick:
                band = ground_band.assess(done, grounds, fitted, seed, folder, tick)
            band_report.write(folder, band)
            ground_band.forget(folder)
    _tell(done, store, folder)
    if band is not None:
        click.echo(
            f"on {len(band.samples)} other grounds ({band.source}), {band.releases} releases of "
            "each layout on each;\nP(reach): of the design event that reaches the road most often"
        )
        show(band_report.table(band))
        for line in filter(None, (band_report.verdict(band), band_report.on_target(band))):
            finding(line)
        click.echo(f"{', '.join(band_report.FILES)} are in {folder}")
    _warn_of_placeholders(site)


TRAFFIC = (
    "risk to the traffic on {0.section_length:g} m of road, per year: vehicles hit by falling "
    "rock,\nvehicles that run into debris, deaths, deaths per km, and the individual risk\n"
    "of a person who travels it {0.commuter_trips:g} times, with the upper end of its 95 % interval"
)
"""Line above the table of the risk to a `Traffic`."""


def _pose(
    site: str,
    kinds: Kinds,
    targets: tuple[float | None, float | None, float | None],
    max_cost: float | None,
    zone: tuple[float, float] | None,
    checks: str,
) -> DesignProblem:
    """Return the design problem that the options describe.

    `targets` are the greatest acceptable probabilities of reach and failure and individual risk.
    """
    from rigdda.agents.released import released
    from rigdda.envs import DesignProblem
    from rigdda.envs.problem import Targets

    asked: dict[str, Any] = {
        "kinds": kinds, "zone": zone or None, "max_cost": max_cost, "checks": checks,
    }  # fmt: skip
    if any(target is not None for target in targets):
        asked["targets"] = Targets(*targets)
    return DesignProblem(released(site), **asked)


def _tell(done: DesignStudy, store: Store, folder: Path) -> None:
    """Print the tables, the layout to order, its limits and the computing effort."""
    from rigdda.agents.reports import checks, findings, frontier_report, headline, tables
    from rigdda.agents.reports.folder import FILES
    from rigdda.agents.reports.wording import order, unchanged

    chosen, result = done.chosen.evaluation, done.result
    click.echo(f"{headline.headline(findings.answer(done))}\n")
    click.echo(
        "Z, capital, harm and repair in EUR per metre of road and year; to build in EUR per\n"
        "metre; debris: rock on the road, relative to the first layout"
    )
    show(tables.costs(done))
    chances = tables.chances(done)
    if chances is not None:
        click.echo("probabilities in each design event, with 95 % upper bounds in brackets")
        show(chances)
    else:
        click.echo("the site has no design events (design = true)")
    _show_risks(done)
    for line in findings.frontier(done, done.frontier, len(result.tried), done.replaced):
        finding(line)
    if done.frontier:
        show(frontier_report.table(done.problem.site, done.frontier))
    from_start = " (a starting layout of the search)" if result.origin == "start" else ""
    site = done.problem.site
    click.echo(f"layout{from_start}:" if chosen.layout else f"layout: {unchanged(site)}")
    for barrier in chosen.layout:
        click.echo(f"  {order(barrier, site)}")
    for line in findings.existing_barriers(site, chosen.layout):
        click.echo(f"  {line}")
    finding(checks.rule_words(done.rule))
    if done.checks.table:
        click.echo("checks of this layout (checks.csv, design_sheet.csv)")
        show(checks.table(done.checks))
    for line in checks.notes(done.checks):
        finding(line)
    for line in findings.of_design(done):
        finding(line)
    resumed = f"; {store.resumed:,} releases from an earlier run" if store.resumed else ""
    files = [*FILES, *(frontier_report.FILES if done.frontier else ())]
    files += [tables.RISKS] if site.traffic is not None else []
    click.echo(
        f"search: {result.simulations:,} releases, {result.seconds:.0f} s of processor time; "
        f"verification: {chosen.releases:,} new releases of each layout{resumed}\n"
        f"{', '.join(files)} are in {folder}"
    )


def _show_risks(done: ComparedLayouts) -> None:
    """Print the risk of each layout to the traffic, if the site has traffic."""
    from rigdda.agents.reports import tables

    risks = tables.risks(done)
    if risks is not None:
        click.echo(TRAFFIC.format(done.problem.site.traffic))
        show(risks)


@cli.command()
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", type=Folder(file_okay=False, path_type=Path),
              help="Folder to write into.  [default: the first of RESULTS]")  # fmt: skip
@click.option("--pdf", is_flag=True, help="Print the report to report.pdf as well. Needs Chromium, "
              "Chrome or Edge.")  # fmt: skip
@click.option("--serve", is_flag=True, help="Serve the report on this machine beside the replay "
              "of RESULTS, which begins at the first impact. Ctrl-C ends it.")  # fmt: skip
def report(results: tuple[Path, ...], out: Path | None, pdf: bool, serve: bool) -> None:
    """Write one report of results folders: report.html.

    RESULTS are folders that design, simulate, study, reprice, check, fit, sensitivity or corridor
    wrote. The page needs no other file and no network, and it prints on A4: a summary, the site,
    the assumptions with their sources, what comes down, the layouts compared, the limits of the
    method, and the commands, seeds and versions to repeat the results.
    """
    from rigdda.agents import browser
    from rigdda.agents.reports import report_page, results_folder

    folders = results_folder.open_all(results)
    program = browser.find() if pdf else None
    replay = results_folder.replay_of(folders) if serve else None
    page = report_page.compose(folders)
    files = (report_page.FILE, "report.pdf") if pdf else (report_page.FILE,)
    file = report_page.write(page, folder_for(out or results[0], "", *files))
    click.echo(file)
    if program is not None:
        click.echo(browser.print_pdf(program, file))
    if replay is not None:
        from rigdda.agents.report_server import serve as show_both

        show_both(file, replay, click.echo)


@cli.command()
@click.argument("results", metavar="RESULTS", type=click.Path(path_type=Path))
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE",
              help="New value of a key of the site file, such as consequences.closure=20000. May "
              "be repeated.")  # fmt: skip
@click.option("--target", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that rock of a design event reaches the "
              "road.  [default: that of the design]")  # fmt: skip
@click.option("--failure", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that a barrier fails in a design event.  "
              "[default: that of the design]")  # fmt: skip
@click.option("--target-risk", type=RealNumber(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable individual risk of a commuter [1/year].  [default: that of "
              "the design]")  # fmt: skip
@click.option("--max-cost", type=RealNumber(min=0.0), metavar="EUR_PER_M",
              help="Largest capital cost of a layout in EUR per metre of road.  [default: that of "
              "the design]")  # fmt: skip
@out_option("reprice-RESULTS")
def reprice(
    results: Path,
    settings: tuple[str, ...],
    target: float | None,
    failure: float | None,
    target_risk: float | None,
    max_cost: float | None,
    out: Path | None,
) -> None:
    """Evaluate the design in the folder RESULTS again with other prices, rates, targets or caps.

    Nothing is simulated: the outcomes of all releases of the design are evaluated with the new
    values. The last row of the table is the best of all layouts that the search evaluated. Keys
    on which the motion of rock depends are refused.

    Writes costs.csv, site.toml (the site with the new values), layout.toml (the best layout),
    cost.png and, if a target is missed, frontier.csv and frontier.png; with traffic risk.csv.
    """
    from rigdda.agents import reprice as job
    from rigdda.agents.reports import findings, frontier_report, reprice_report, tables
    from rigdda.agents.reports.wording import order, unchanged

    asked = job.other_targets(target, failure, target_risk)
    done = job.reprice(results, job.parse_all(settings), asked, max_cost)
    files = (*reprice_report.FILES, *frontier_report.FILES)
    folder = folder_for(out, f"reprice-{results.resolve().name}", *files)
    if folder.resolve() == results.resolve():
        raise click.UsageError("--out is the folder of the design: name another folder")
    with recorded_run(folder, done.problem.site):
        reprice_report.write(done, folder)
    for change in done.changes:
        click.echo(reprice_report.changed(change))
    show(tables.costs(done))
    chances = tables.chances(done)
    if chances is not None:
        show(chances)
    _show_risks(done)
    for line in findings.frontier(done, done.frontier, done.tried, False):
        finding(line)
    if done.frontier:
        show(frontier_report.table(done.problem.site, done.frontier))
    chosen, site = done.chosen.evaluation.layout, done.problem.site
    click.echo("layout:" if chosen else f"layout: {unchanged(site)}")
    for barrier in chosen:
        click.echo(f"  {order(barrier, site)}")
    for line in findings.existing_barriers(site, chosen):
        click.echo(f"  {line}")
    for line in reprice_report.sentences(done):
        finding(line)
    click.echo(f"nothing was simulated; the results are in {folder}")


@cli.command()
@click.argument("file", metavar="STUDY.toml")
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
@out_option("study-NAME")
@executor_option
def study(file: str, seed: int, out: Path | None) -> None:
    """Compare the layouts of STUDY.toml on the same releases.

    The file gives a `site`, the number of `releases` of each event, and `layouts`. Each layout has
    a `name` and either `barriers`, as in a layout file, or the name of a layout `file`.

    Writes study.csv (one row for each release), layouts.csv (Z and its parts), events.csv
    (probabilities and energies), differences.csv (of each pair of layouts, on common releases),
    sections.png, costs.png and, of a site with traffic, risk.csv. An interrupted study continues
    from study.csv.
    """
    from dataclasses import replace

    from rigdda.agents import studies
    from rigdda.agents.released import released
    from rigdda.agents.reports import findings, study_report

    asked = studies.load(file)
    asked = replace(asked, site=released(asked.site))
    folder = folder_for(out, f"study-{Path(file).stem}", "study.csv", *study_report.FILES)
    with recorded_run(folder, asked.site), progress(asked.size) as tick:
        resumed = studies.run(asked, seed, folder / "study.csv", tick)
        tick(asked.size, "tables and pictures")
        found = studies.results(asked, folder / "study.csv")
        study_report.write(folder, found, seed)
    click.echo("Z, capital, harm, repair: EUR per metre and year; to build: EUR per metre")
    show(study_report.costs(found))
    click.echo(
        "probabilities with 95 % upper bounds in brackets; largest energies on the road and of a\n"
        "hit: 95 % quantiles of the releases with one, in kJ per metre of width"
    )
    show(study_report.events(found))
    risks = study_report.risks(found)
    if risks is not None:
        click.echo(TRAFFIC.format(asked.site.traffic))
        show(risks)
    for line in study_report.sentences(found):
        finding(line)
    for name, layout in asked.layouts.items():
        if words := findings.unbuildable(asked.site, layout):
            note(f"the layout {name!r} {words}")
    words = f", {resumed} from an earlier run" if resumed else ""
    click.echo(f"{asked.size:,} releases{words}; tables and pictures are in {folder}")


@cli.command()
@click.argument("file", metavar="CORRIDOR")
@click.option("--budget", "budgets", type=RealNumber(0.0, 1e12), multiple=True, metavar="EUR",
              help="Budget for construction. May be repeated.  [default: those of the "
              "file]")  # fmt: skip
@count_option("--releases", 200, 4_000, "Number of releases per section.")
@click.option("--robust", is_flag=True, help="Choose by the mean of the highest fifth of the "
              "estimates of the cost (conditional value at risk).")  # fmt: skip
@checks_option
@seed_option("Seed of the searches and of their releases.", SEED)
@out_option("corridor-NAME")
@executor_option
def corridor(
    file: str,
    budgets: tuple[float, ...],
    releases: int,
    robust: bool,
    checks: str,
    seed: int,
    out: Path | None,
) -> None:
    """Choose the barriers of all sections of CORRIDOR within a common budget.

    CORRIDOR is a TOML file or a built-in corridor (corridor-12, corridor-50). Every section is
    searched for layouts from the cheapest to the best, and an integer programme chooses one layout
    for each section and budget. The choice is compared with the same money for every metre of road,
    with the worst section first and with the greatest saving per cost.

    Writes budgets.csv, sections.csv, fronts.csv (all layouts), priorities.csv (what should be built
    next), the folder layouts, and pictures: gain.png (gain against budget) and strip.png (what is
    built where). An interrupted run continues where it stopped.
    """
    from msgspec.structs import replace

    import rigdda
    from rigdda.agents.corridor.planning import Planner
    from rigdda.agents.released import released
    from rigdda.agents.reports import corridor_folder as report
    from rigdda.envs import CorridorProblem

    where = rigdda.Corridor.load(file)
    sections = tuple(replace(section, site=released(section.site)) for section in where.sections)
    where = replace(where, sections=sections)
    if budgets:
        where = replace(where, budgets=budgets)
    problem = CorridorProblem(where, checks=checks)
    folder = folder_for(out, f"corridor-{where.name}", *report.FILES)
    stored = folder / "evaluations"
    stored.mkdir(exist_ok=True)
    with recorded_run(folder), progress(releases * len(where.sections)) as tick:
        plan = Planner(problem, releases, seed, robust, stored, tick).plan()
        report.write(plan, folder)
    click.echo(
        "Costs in thousand EUR, savings in thousand EUR per year. share: saving over that of\n"
        "unlimited money; same, worst and ratio: the same share with equal money for every\n"
        "metre, with the worst section first, and with the greatest saving per cost first;\n"
        "1 EUR: what one more EUR would save each year."
    )
    show(report.table_of_budgets(plan))
    own = report.shown_budget(plan)
    click.echo(
        f"what a budget of {own.budget:,.0f} EUR builds; next: what comes first if there is more\n"
        "money, see priorities.csv"
    )
    show(report.table_of_sections(plan, own))
    for one in plan.plans[:-1]:
        if missing := report.sections_that_miss(plan, one):
            finding(
                f"with {one.budget:,.0f} EUR, these sections may miss a target: "
                f"{', '.join(missing)}"
            )
    click.echo(
        f"{len(where.sections)} sections, {where.length:,.0f} m, {plan.releases:,} releases; "
        f"{', '.join(report.FILES)} and layouts are in {folder}"
    )


@cli.command()
@click.argument("site")
@click.argument("observed", type=click.Path(dir_okay=False, path_type=Path), nargs=-1,
                required=True)  # fmt: skip
@click.option("--parameters", "names", multiple=True, required=True, metavar="PATH[=LOW:HIGH]",
              help="Number of the site file to fit, such as surfaces.soil.restitution. May be "
              "repeated; more than four are rarely identified.")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="Model that computes the run-outs.")  # fmt: skip
@count_option("--budget", 8, 160, "Largest number of parameter sets to try.")
@count_option("--releases", 10, 150, "Number of releases of each event for each parameter set.")
@seed_option("Seed of the search and of the first release.", SEED)
@out_option("fit-SITE")
@executor_option
def fit(
    site: str,
    observed: tuple[Path, ...],
    names: tuple[str, ...],
    model: Literal["blocks", "lumped"],
    budget: int,
    releases: int,
    seed: int,
    out: Path | None,
) -> None:
    """Fit numbers of SITE to the observations in OBSERVED, one or several CSV files.

    The columns of a file are event and one of: run_out_m, the chainage at which a block stopped;
    start_m, end_m and share, mass_t or volume_m3, the deposit in an interval of chainage; or
    station_m, quantity (such as velocity or height) and value, of blocks that pass a station.

    Prints the fitted numbers with 95 % intervals, or "not identified" if the interval is nearly as
    long as the given range. Also prints how well the fit predicts observations that were left out
    of it. Writes site.toml (SITE with the fitted numbers), fit.csv, fit.png and posterior.csv,
    which `design` and `sensitivity` can sample. A run that was interrupted continues where it
    stopped.
    """
    import rigdda
    from rigdda.agents import fit as job
    from rigdda.agents import observations
    from rigdda.agents.parameters import parse
    from rigdda.agents.reports import tables

    where = rigdda.Site.load(site)
    seen, parameters = observations.read(observed, where), [parse(name) for name in names]
    files = ("site.toml", "fit.csv", "fit.png", "posterior.csv")
    folder = folder_for(out, f"fit-{where.name}", *files)
    with recorded_run(folder, where), progress(budget) as tick:
        found = job.fit(where, seen, parameters, budget, releases, seed, tick, model, folder)
        found.site.save(folder / "site.toml")
        job.write(folder / "fit.csv", found)
        job.draw(folder / "fit.png", found)
        tables.write_rows(folder / "posterior.csv", found.posterior.rows())
        job.forget(folder)
    show(tables.fit(job.rows(found, found.observed)))
    click.echo(f"up to {budget} parameter sets; {', '.join(files)} are in {folder}")


@cli.command()
@click.argument("site")
@layout_option
@click.option("--method", type=click.Choice(("morris", "sobol")), default="morris",
              show_default=True, help="Screening by the method of Morris, or indices of Sobol', "
              "which take several times as many releases.")  # fmt: skip
@click.option("--samples", type=WholeNumber(2), metavar="N",
              help="Number of trajectories (morris), or of points from which indices are computed "
              "(sobol), a power of two.  [default: 20 for morris, 64 for sobol]")  # fmt: skip
@count_option("--releases", 2, 200, "Number of releases at each point, over all events.")
@click.option("--parameters", "names", multiple=True, metavar="GROUP|PATH[=LOW:HIGH]",
              help="Inputs to vary: ground, sizes, rates, prices, or the path of a number in the "
              "site file. May be repeated.  [default: all four groups]")  # fmt: skip
@posterior_option
@seed_option("Seed of the points, of the bootstrap and of the first release.", SEED)
@out_option("sensitivity-SITE")
@executor_option
def sensitivity(
    site: str,
    layout: str | None,
    method: Literal["morris", "sobol"],
    samples: int | None,
    releases: int,
    names: tuple[str, ...],
    posterior: Path | None,
    seed: int,
    out: Path | None,
) -> None:
    """Find which uncertain numbers of SITE the results depend on.

    Varies the ground within the ranges of the library, block sizes, rates, prices and consequences,
    and computes how much Z and, for each design event, the probabilities that the road is reached
    and that a barrier fails depend on each. All points have the same releases. Prices and rates
    need no simulation of their own.

    Writes sensitivity.csv (indices with intervals), samples.csv (inputs and outputs at each point)
    and tornado.png. A run that was interrupted continues where it stopped.
    """
    from rigdda.agents import parameters
    from rigdda.agents import sensitivity as job
    from rigdda.agents.released import released
    from rigdda.agents.reports import sensitivity_report

    where, barriers = released(site), read_layout(layout)
    where.realise(barriers)
    inputs = parameters.inputs(names, where, barriers, posterior)
    asked = job.plan(where, barriers, inputs, method, samples, releases, seed)
    folder = folder_for(out, f"sensitivity-{where.name}", *sensitivity_report.FILES)
    with recorded_run(folder, where), progress(asked.size) as tick:
        found = job.run(asked, folder, tick)
        tick(asked.size, "tables and picture")
        sensitivity_report.write(folder, found)
        job.forget(folder)
    for line, table in sensitivity_report.tables(found):
        click.echo(line)
        show(table)
    finding(sensitivity_report.explain(found))
    resumed = f", {found.resumed:,} from an interrupted run" if found.resumed else ""
    click.echo(
        f"{len(asked.sites):,} points with {len(asked.groups):,} simulated sites, {asked.size:,} "
        f"releases{resumed}; {', '.join(sensitivity_report.FILES)} are in {folder}"
    )


TRAINING_SITES = {"policy": 512, "value": 96, "corridor": 12}
"""Default number of training sites by model."""

EPISODES = 49_152
"""Default number of episodes of a policy."""


@cli.command()
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


@cli.command()
@click.option("--designer", "names", type=click.Choice(DESIGNERS), multiple=True,
              default=("rule", "race"), show_default=True,
              help="Designer to compare with 'constant' and 'random'. May be "
              "repeated.")  # fmt: skip
@click.option(
    "--policy",
    type=click.Path(),
    help="Trained policy to compare as well: a file that `rigdda train` wrote.",
)
@click.option("--split", type=click.Choice(("train", "validation", "test")), default="test",
              show_default=True, help="Split of the generated sites to use.")  # fmt: skip
@count_option("--budget", 2, 3_000, "Number of releases that each designer may simulate on a site.")
@count_option("--sites", 1, 6, "Number of sites. With six, each family is used once.")
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

    Prints how much more the layouts of each designer cost than the best layout of each site, as
    means over the sites with 95 % intervals. Writes scores.csv. An interrupted run continues from
    evaluations.jsonl.
    """
    from rigdda.agents import contest, designers
    from rigdda.agents.designers.store import Store
    from rigdda.agents.policy import load, using
    from rigdda.agents.reports import tables

    tried = dict.fromkeys(("constant", "random", *names))
    entrants = {name: designers.module(name).design for name in tried}
    if policy is not None:
        entrants["policy"] = using(load(policy))
    places = contest.site_names(split, sites)
    folder = folder_for(out, "evaluate", "evaluations.jsonl", "scores.csv")
    store = Store(folder / "evaluations.jsonl")
    with recorded_run(folder), progress(len(places) * len(entrants)) as tick:
        scores = contest.hold(places, entrants, budget, verify, seed, store, tick)
    tables.write_rows(folder / "scores.csv", [score.row() for score in scores])
    click.echo("EUR per metre of road and year; best: the cheapest of these designers and of no "
               "barrier on each site")  # fmt: skip
    show(contest.table(scores))
    resumed = f", {store.resumed:,} releases from an earlier run" if store.resumed else ""
    click.echo(f"{counted(len(places), 'site')} of {split}, verified on {verify:,} releases each"
               f"{resumed}; "
               f"scores.csv is in {folder}")  # fmt: skip


@cli.command()
@click.option("--entry", required=True, metavar="MODULE:FUNCTION",
              help="Function that receives a task and returns a layout, such as "
              "mymodule:design.")  # fmt: skip
@click.option("--corridor-entry", default="", metavar="MODULE:FUNCTION",
              help="Function for corridors, which returns one layout for each section.  [default: "
              "the entry, with the same money for every metre of road]")  # fmt: skip
@click.option("--spec", type=click.Path(path_type=Path), metavar="FILE",
              help="Specification of another exam.  [default: the one of the package]")  # fmt: skip
@click.option("--sites", type=WholeNumber(1), metavar="N",
              help="Play only the first N sites, and no corridor unless --corridors is "
              "given.")  # fmt: skip
@click.option("--corridors", type=WholeNumber(0), metavar="N",
              help="Play only the first N corridors.")  # fmt: skip
@click.option("--budget", "budgets", type=WholeNumber(0, limits.RELEASES), multiple=True,
              metavar="N", help="Releases per section. May be repeated.  [default: those of the "
              "specification]")  # fmt: skip
@click.option("--verify", type=WholeNumber(10, limits.RELEASES), metavar="N",
              help="Releases for the verification of each layout.  [default: that of the "
              "specification]")  # fmt: skip
@seed_option("Seed of the tasks and of their releases.", SEED)
@out_option("exam-FUNCTION")
@executor_option
def exam(
    entry: str,
    corridor_entry: str,
    spec: Path | None,
    sites: int | None,
    corridors: int | None,
    budgets: tuple[int, ...],
    verify: int | None,
    seed: int,
    out: Path | None,
) -> None:
    """Score an optimiser or a policy on sites and corridors that no training uses.

    The entry runs in a process of its own and simulates only through its task, which counts the
    releases. Its layouts are verified on releases whose seeds follow from the layouts. The score is
    1 for the recorded reference and 0 for random layouts. Entries that break a rule are flagged,
    and the exit code is then 1.

    Writes results.csv (a row for each task), summary.csv (interquartile means with intervals) and
    score.png. An interrupted exam continues where it stopped.
    """
    from rigdda.agents.exam import ranking, scorer, specification

    asked = specification.load(spec)
    references = specification.references(asked, spec)
    part = scorer.part(asked, sites, corridors, budgets, verify, seed)
    scorer.check_references(part, references)
    for name in filter(None, (entry, corridor_entry)):
        scorer.source_hash_of(name)  # refuses a module that cannot be found
    folder = folder_for(out, f"exam-{entry.rpartition(':')[2]}", *ranking.FILES)
    secrets = (specification.file_of_references(asked, spec),)
    with recorded_run(folder), progress(part.size) as tick:
        job = scorer.Scorer(part, references, entry, corridor_entry, folder, secrets, tick)
        scores = job.run()
        found = ranking.write(folder, scores, part, entry)
    click.echo(
        "score: 1 for the reference, 0 for random layouts; distance: 0 for the reference, 1 for no "
        "barrier"
    )
    show(ranking.table(found))
    for line in ranking.remarks(part, references):
        note(line)
    click.echo(f"{counted(part.size, 'task')}, verified on {part.verification:,} releases each; "
               f"{', '.join(ranking.FILES)} are in {folder}")  # fmt: skip
    flags = ranking.broken(scores)
    for line in flags:
        finding(line)
    if flags:
        raise Stopped(f"{entry} is disqualified: {counted(len(flags), 'broken rule')}", 1)


@cli.command()
@click.option("--split", type=click.Choice(("train", "validation", "test")), default="train",
              show_default=True, help="Split of the generated sites to use.")  # fmt: skip
@count_option("--sites", 1, 12, "Number of sites. With six, each family is used once.")
@count_option("--layouts", 1, 32, "Number of layouts of each site.")
@count_option("--releases", 1, 100, "Number of releases of each layout, over all events.")
@seed_option("Seed of the layouts and of the releases.", SEED)
@out_option("dataset-SPLIT")
@executor_option
def dataset(
    split: str, sites: int, layouts: int, releases: int, seed: int, out: Path | None
) -> None:
    """Simulate many layouts on many sites and write the outcomes as Parquet.

    The layouts are no barrier, constants, single barriers of the catalogue, random layouts and
    neighbours of these. Writes for each site outcomes/SITE.parquet, with one row per release (site,
    layout, event, seed and outcome), and sites/SITE.parquet, with what is known of the site. An
    interrupted run continues with the next site, and a data set grows with --sites.
    """
    from rigdda.agents import dataset as job

    recipe = job.Recipe(split, layouts, releases, seed)
    names = recipe.names(sites)
    folder = folder_for(out, f"dataset-{split}", job.RECIPE)
    with recorded_run(folder), progress(len(names)) as tick:
        rows = job.write(recipe, sites, folder, tick)
    click.echo(f"{rows:,} releases on {counted(len(names), 'site')} of {split}; outcomes and "
               "sites are in "
               f"{folder}")  # fmt: skip


@cli.command()
@click.option("--only", multiple=True, metavar="NAME",
              help="Run only cases whose names begin with NAME. May be repeated.")  # fmt: skip
@click.option("--slow", is_flag=True, help="Run the slow cases as well.")
@seed_option("Seed of the random shapes, speeds and offsets.")
@out_option("validate")
def validate(only: tuple[str, ...], slow: bool, seed: int, out: Path | None) -> None:
    """Compare computed motions with closed-form solutions.

    Writes validate.csv and, with the observed order of convergence in the time step,
    convergence.csv. The exit code is 1 if an error exceeds its tolerance (column "bar"). The last
    column of the table is the processor time in microseconds per simulated second.
    """
    from rigdda.agents import accuracy

    cases = accuracy.choose(only, slow)
    folder = folder_for(out, "validate", "validate.csv", "convergence.csv")
    with recorded_run(folder), progress(accuracy.runs(cases)) as tick:
        results, studies = accuracy.validate(cases, seed, folder, tick)
    show(accuracy.table(results))
    if studies:
        show(accuracy.convergence_table(studies))
    missed = [f"{r.case} ({r.check.quantity})" for r in results if not r.passed]
    if missed:
        raise Stopped(
            f"{len(missed)} of {len(results)} exceed their tolerances: {', '.join(missed)}", 1
        )
    click.echo(f"{len(results)} figures are within their tolerances; the tables are in {folder}")


if __name__ == "__main__":
    sys.exit(main())
