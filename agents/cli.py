"""The command line: `rigdda sites | simulate | design | study | train | evaluate | ...`.

A command imports what it needs when it runs, so that help is there at once.
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

from rigdda.agents.designers import DEFAULT, DESIGNERS
from rigdda.agents.limits import SEED
from rigdda.agents.terminal import (
    Stopped,
    count_option,
    fail,
    folder_for,
    kept,
    layout_option,
    note,
    once,
    out_option,
    progress,
    read_layout,
    seed_option,
    show,
)

if TYPE_CHECKING:
    from rigdda.agents.design_study import DesignStudy
    from rigdda.agents.designers.store import Store
    from rigdda.envs import DesignProblem

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
    """Simulate rockfall on a slope, design barriers and replay releases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@cli.command()
def sites() -> None:
    """List the built-in sites with their events and the zone for barriers."""
    import rigdda
    from rigdda.agents.reports import tables

    show(tables.sites(map(rigdda.Site.load, rigdda.sites.names())))


@cli.command()
@click.argument("file", type=click.Choice(("site", "layout")), default="site")
def schema(file: str) -> None:
    """Print the JSON Schema of site files, or of layout files.

    With it an editor shows what the keys of a file mean and marks mistakes. Write it to a file, for
    example site.schema.json, and begin your site file with the line "#:schema ./site.schema.json".
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
    help="Simulate this event only.  [default: draw events by their rates]",
)
@count_option("--releases", 1, 100, "Number of releases.")
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="How rock is simulated. 'lumped' treats each block as a "
              "point: quick, but without barriers that stand on the ground.")  # fmt: skip
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
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
    """Simulate releases of SITE and report what reaches the road.

    SITE is the name of a built-in site or a TOML file. Writes outcomes.csv, run.npz (the first
    release) and section.png, or points.csv with --model lumped. The energy of a hit is the kinetic
    energy of the block just before it touches the barrier. The energy that a barrier absorbs is
    the work that its forces take from all blocks.
    """
    import rigdda
    from rigdda.agents import jobs
    from rigdda.agents.reports import findings, pictures, tables

    where, barriers = rigdda.Site.load(site), read_layout(layout)
    seeds = range(seed, seed + releases)
    if model == "lumped":
        points = rigdda.lumped(where, barriers, seeds, event)
        folder = folder_for(out, f"simulate-{where.name}", "points.csv")
        tables.write_points(folder / "points.csv", seeds, points)
        show(tables.points(points))
        note(findings.unfitted(where))
        note(findings.of_layout(where, barriers, event))
        click.echo(f"{releases} releases of points; points.csv is in {folder}")
        return
    where.realise(barriers, seed, event)  # what cannot be built is said before a folder is made
    folder = folder_for(out, f"simulate-{where.name}", "outcomes.csv", "run.npz", "section.png")
    with kept(folder), progress(releases) as tick:
        run, outcomes = jobs.simulate(where, barriers, seeds, event, tick)
        tables.write_outcomes(folder / "outcomes.csv", seeds, outcomes)
        run.save(folder / "run.npz")
        pictures.released(folder / "section.png", where, barriers, seeds, event)
    show(tables.outcomes(barriers, outcomes))
    note(findings.of_layout(where, barriers, event))
    click.echo(f"{releases} releases; outcomes.csv, run.npz and section.png are in {folder}")


@cli.command()
@click.argument("site")
@count_option("--releases", 10, 2000, "Number of releases of each layout at each fidelity.")
@seed_option("Seed of the releases.")
@out_option("fidelity-SITE")
def fidelity(site: str, releases: int, seed: int, out: Path | None) -> None:
    """Measure the bias and the speed-up of the fidelity "fast" on SITE.

    Compares Z and the processor time of a release without barriers, with the constant layout and
    with the layout of the engineering rule. Writes fidelity.csv.
    """
    from rigdda.agents import fidelity_bias
    from rigdda.envs import DesignProblem

    where = DesignProblem(site).site
    folder = folder_for(out, f"fidelity-{where.name}", "fidelity.csv")
    with kept(folder), progress(6 * releases) as tick:
        found = fidelity_bias.compare(where, releases, seed, tick)
    fidelity_bias.write(folder / "fidelity.csv", where, found)
    show(fidelity_bias.table(found))
    click.echo(f"{releases} releases of each; fidelity.csv is in {folder}")


@cli.command()
@click.argument("target")
@layout_option
@click.option(
    "--event", metavar="NAME", help="Replay a release of this event.  [default: drawn by rate]"
)
@seed_option("Seed of the release.")
@out_option("replay-SITE")
def replay(target: str, layout: str | None, event: str | None, seed: int, out: Path | None) -> None:
    """Open the replay TARGET, or record one of a release of the site TARGET.

    A replay (FILE.rrd) is opened. A run (FILE.npz) is converted to FILE.rrd and opened. For a site,
    a release is simulated and episode.rrd is written.
    """
    import rigdda
    from rigdda.agents.reports import findings
    from rigdda.barriers import standing
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
    where, barriers = rigdda.Site.load(target), read_layout(layout)
    where.realise(barriers, seed, event)
    folder = folder_for(out, f"replay-{where.name}", "episode.rrd")
    with kept(folder):
        run, outcome = rigdda.release(where, barriers, seed, event)
    came = f"{outcome.road_volume:.2g} of {outcome.released_volume:.2g} m3"
    notes = {"event": outcome.event, "seed": str(seed), "comes onto the road": came}
    if words := findings.of_layout(where, barriers, event):
        notes["doubt"] = words
    road, labels = (where.road.start, where.road.end), tuple(b.label for b in standing(barriers))
    record = release_record(where, barriers, seed, event, outcome)
    run.to_rerun(folder / "episode.rrd", Marks(road, notes, where.name, labels, record))
    click.echo(folder / "episode.rrd")


@cli.command()
@click.argument("file", metavar="EPISODE.rrd", type=click.Path(path_type=Path))
def repeat(file: Path) -> None:
    """Compute the episode or release of a replay again and compare it bit for bit.

    The file is a replay that an environment, `rigdda design` or `rigdda replay SITE` recorded; it
    holds the site, the actions and the seeds. The exit code is 1 if anything differs. Other
    versions than those of the recording are listed.
    """
    from rigdda.envs import repetition, replay_record

    found = repetition.repeat(replay_record.load(file))
    click.echo(found.what)
    for words in found.other_versions:
        note(f"other version: {words}")
    if not found.same:
        raise Stopped(f"it differs: recorded {found.recorded}, computed {found.computed}", 1)
    click.echo(f"the same to the last bit: {found.computed}")


BUDGET = 20_000
"""Default budget of a search: about a minute for a built-in site on two cores."""

RELEASES = 3_000
"""Default number of releases that each layout is verified on: Z to some per cent."""

CASES = 4
"""Layouts that are verified: nothing, the rule's, the constant, the found one."""

Kinds = tuple[str, ...] | None


def _kinds(_: click.Context, __: click.Parameter, value: str | None) -> Kinds:
    """Return the names in a list with commas or spaces between them."""
    return None if value is None else tuple(value.replace(",", " ").split())


@cli.command()
@click.argument("site")
@click.option("--designer", type=click.Choice(DESIGNERS), default=DEFAULT, show_default=True,
              help="Search method.")  # fmt: skip
@click.option("--kinds", callback=_kinds, metavar="KIND,...",
              help="Allowed kinds of barrier: fence, ditch, embankment, gravity_wall, mesh, wall.  "
              "[default: all except wall]")  # fmt: skip
@click.option("--target", type=click.FloatRange(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that rock of a design event reaches the "
              "road.")  # fmt: skip
@click.option("--failure", type=click.FloatRange(0.0, 1.0, min_open=True), metavar="P",
              help="Largest acceptable probability that a barrier fails in a design "
              "event.")  # fmt: skip
@click.option("--zone", type=float, nargs=2, metavar="A B",
              help="Place barriers between the chainages A and B [m].  [default: the zone of "
              "the site]")  # fmt: skip
@count_option("--budget", 2, BUDGET, "Number of releases that the search may simulate.")
@count_option("--verify", 10, RELEASES, "Number of new releases on which each layout is verified.")
@seed_option("Seed of the search and of its releases.", SEED)
@out_option("design-SITE")
def design(
    site: str,
    designer: str,
    kinds: Kinds,
    target: float | None,
    failure: float | None,
    zone: tuple[float, float] | None,
    budget: int,
    verify: int,
    seed: int,
    out: Path | None,
) -> None:
    """Search for the best layout of barriers on SITE and verify it on new releases.

    SITE is the name of a built-in site or a TOML file. The best layout has the least cost Z:
    capital and upkeep, expected harm on the road and expected repair, in EUR per metre of road and
    year.
    Writes layout.toml, evaluations.csv, section.png, cost.png and episode.rrd. A run that was
    interrupted continues from evaluations.jsonl. A folder with the design of another problem
    (problem.json) is refused.
    """
    from rigdda.agents import jobs
    from rigdda.agents.designers.store import FILE, claim
    from rigdda.agents.reports.folder import FILES, write

    problem = _pose(site, kinds, target, failure, zone)
    folder = folder_for(out, f"design-{problem.site.name}", *FILES, FILE)
    claim(folder, problem, *FILES)
    with kept(folder):
        with progress(budget + CASES * verify) as tick:
            done, store = jobs.study(problem, designer, budget, seed, verify, folder, tick)
            tick(budget + CASES * verify, "pictures")
            write(done, folder, seed)
    _tell(done, store, verify, folder)


def _pose(
    site: str,
    kinds: Kinds,
    target: float | None,
    failure: float | None,
    zone: tuple[float, float] | None,
) -> DesignProblem:
    """Return the problem that was asked."""
    from rigdda.envs import DesignProblem
    from rigdda.envs.problem import Targets

    asked: dict[str, Any] = {"kinds": kinds, "zone": zone or None}
    if target is not None or failure is not None:
        asked["targets"] = Targets(target, failure)
    return DesignProblem(site, **asked)


def _tell(done: DesignStudy, store: Store, verify: int, folder: Path) -> None:
    """Print the tables, the layout to order, what limits it, and what it took."""
    from rigdda.agents.reports import findings, tables
    from rigdda.agents.reports.folder import FILES
    from rigdda.agents.reports.wording import order

    chosen, result = done.chosen.evaluation, done.result
    click.echo(
        "Z and its parts in EUR per metre of road and year, cost to build in EUR per metre;\n"
        "rule: UNI 11211-4; debris: rock on the road, relative to no barriers"
    )
    show(tables.costs(done))
    chances = tables.chances(done)
    if chances is not None:
        click.echo("probabilities in each design event, with 95 % upper bounds")
        show(chances)
    else:
        click.echo("no design events: the site names none (design = true)")
    from_start = " (a starting layout of the search)" if result.origin == "start" else ""
    click.echo(f"layout{from_start}:" if chosen.layout else "layout: no barrier")
    for barrier in chosen.layout:
        click.echo(f"  {order(barrier, done.problem.site)}")
    cases = [(case.name, case.evaluation) for case in done.cases]
    lines = [findings.limits(result, cases, done.left)]
    lines += [
        *findings.cheaper(cases),
        *findings.failing(done.problem.site, chosen),
        findings.undecided(done.problem, chosen),
    ]
    for line in filter(None, lines):
        click.echo(line)
    resumed = f"; {store.resumed:,} releases from an earlier run" if store.resumed else ""
    click.echo(
        f"search: {result.simulations:,} releases, {result.seconds:.0f} s of processor time; "
        f"verification: {verify:,} new releases of each layout{resumed}\n"
        f"{', '.join(FILES)} are in {folder}"
    )


@cli.command()
@click.argument("file", metavar="STUDY.toml")
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
@out_option("study-NAME")
def study(file: str, seed: int, out: Path | None) -> None:
    """Compare the layouts of STUDY.toml on the same releases.

    The file gives a `site`, the number of `releases` of each event, and `layouts`: tables with a
    `name` and either `barriers`, as in a layout file, or a `file` that contains them. Writes one
    row for each layout to study.csv. A study that was interrupted continues from study.csv.
    """
    from rigdda.agents import studies
    from rigdda.agents.reports import findings

    asked = studies.load(file)
    folder = folder_for(out, f"study-{Path(file).stem}", "study.csv")
    with kept(folder), progress(asked.size) as tick:
        resumed = studies.run(asked, seed, folder / "study.csv", tick)
    click.echo("Z and its parts in EUR per metre of road and year; to build in EUR per metre")
    show(studies.table(asked, folder / "study.csv"))
    for name, layout in asked.layouts.items():
        if words := findings.unbuildable(asked.site, layout):
            note(f"the layout {name!r} {words}")
    words = f", {resumed} from an earlier run" if resumed else ""
    click.echo(f"{asked.size:,} releases{words}; study.csv is in {folder}")


@cli.command()
@click.argument("site")
@click.argument("observed", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--parameters", "names", multiple=True, required=True, metavar="PATH[=LOW:HIGH]",
              help="Number of the site file to fit, such as surfaces.soil.restitution. May be "
              "repeated; more than four are rarely identified.")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="Model that computes the run-outs.")  # fmt: skip
@count_option("--budget", 8, 160, "Number of sets of values to try.")
@count_option("--releases", 10, 150, "Number of releases of each event for each set.")
@seed_option("Seed of the search and of the first release.", SEED)
@out_option("fit-SITE")
def fit(
    site: str,
    observed: Path,
    names: tuple[str, ...],
    model: Literal["blocks", "lumped"],
    budget: int,
    releases: int,
    seed: int,
    out: Path | None,
) -> None:
    """Fit numbers of SITE to the run-outs in OBSERVED, a CSV file.

    The columns of the file are event and run_out_m, the chainage at which the block stopped. Prints
    the fitted numbers with 95 % intervals, or "not identified" where the interval is nearly as long
    as the range that was given, and how well they predict runs that were left out of the fit.
    Writes site.toml (SITE with the fitted numbers), fit.csv and fit.png.
    """
    import rigdda
    from rigdda.agents import fit as job
    from rigdda.agents.reports import tables

    where = rigdda.Site.load(site)
    seen, parameters = job.read(observed, where), [job.parse(name) for name in names]
    folder = folder_for(out, f"fit-{where.name}", "site.toml", "fit.csv", "fit.png")
    with kept(folder), progress(budget) as tick:
        found = job.fit(where, seen, parameters, budget, releases, seed, tick, model)
        found.site.save(folder / "site.toml")
        job.write(folder / "fit.csv", found, seen)
        job.draw(folder / "fit.png", found, seen)
    show(tables.fit(job.rows(found, seen)))
    click.echo(f"up to {budget} sets of values; site.toml, fit.csv and fit.png are in {folder}")


@cli.command()
@count_option("--sites", 2, 512, "Number of random sites to train on.")
@count_option("--episodes", 0, 49152, "Number of episodes.")
@seed_option("Seed of all random numbers.", SEED)
@out_option("train")
def train(sites: int, episodes: int, seed: int, out: Path | None) -> None:
    """Train a policy that designs a layout for a site without a search.

    The policy sees what comes down the site without barriers. Writes policy.safetensors, for
    `rigdda evaluate --policy`, and logs for TensorBoard. A training that was interrupted continues
    where it stopped, with the same result. One that is complete continues if --episodes is larger
    than before. Requires the extra `rl`.
    """
    from rigdda.agents import training

    terms = training.Terms(sites, episodes, seed)
    folder = folder_for(out, "train", *training.FILES)
    with kept(folder), progress(terms.episodes) as tick:
        trained = training.train(terms, folder, lambda done: tick(done, "PPO"))
    click.echo(
        f"share that layouts take off Z on {terms.beside} sites beside the training sites: before "
        f"{trained.before:.3f}, after {trained.after:.3f}; policy.safetensors is in {folder}"
    )


@cli.command()
@click.option("--designer", "names", type=click.Choice(DESIGNERS), multiple=True,
              default=("rule", "race"), show_default=True,
              help="Designer to compare with constant and random. May be repeated.")  # fmt: skip
@click.option(
    "--policy",
    type=click.Path(),
    help="Trained policy to compare as well, a file that `rigdda train` wrote.",
)
@click.option("--split", type=click.Choice(("train", "validation", "test")), default="test",
              show_default=True, help="Which of the generated sites to use.")  # fmt: skip
@count_option("--budget", 2, 3_000, "Number of releases that each designer may simulate on a site.")
@count_option("--sites", 1, 6, "Number of sites; six are one of each family.")
@count_option("--verify", 10, 2_000, "Number of new releases on which each layout is verified.")
@seed_option("Seed of the searches and of their releases.", SEED)
@out_option("evaluate")
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

    Prints by how much the layouts of each designer cost more than the best one, as means over the
    sites with 95 % intervals, and writes scores.csv. A run that was interrupted continues from its
    evaluations.
    """
    from rigdda.agents import contest, designers
    from rigdda.agents.designers.store import Store
    from rigdda.agents.policy import load, using
    from rigdda.agents.reports import tables

    tried = dict.fromkeys(("constant", "random", *names))
    entrants = {name: designers.module(name).design for name in tried}
    if policy is not None:
        entrants["policy"] = using(load(policy))
    posed = contest.pose(split, sites)
    folder = folder_for(out, "evaluate", "evaluations.jsonl", "scores.csv")
    store = Store(folder / "evaluations.jsonl")
    with kept(folder), progress(len(posed) * len(entrants)) as tick:
        scores = contest.hold(posed, entrants, budget, verify, seed, store, tick)
    tables.write_rows(folder / "scores.csv", [score.row() for score in scores])
    click.echo("EUR per metre of road and year; best: of these designers on each site")
    show(contest.table(scores))
    resumed = f", {store.resumed:,} releases from an earlier run" if store.resumed else ""
    click.echo(f"{len(posed)} sites of {split}, verified on {verify:,} releases each{resumed}; "
               f"scores.csv is in {folder}")  # fmt: skip


@cli.command()
@click.option("--only", multiple=True, metavar="NAME",
              help="Run only cases whose names start with NAME. May be repeated.")  # fmt: skip
@click.option("--slow", is_flag=True, help="Run the slow cases, too.")
@seed_option("Seed of the random shapes, speeds and offsets.")
@out_option("validate")
def validate(only: tuple[str, ...], slow: bool, seed: int, out: Path | None) -> None:
    """Compare computed motions with closed forms.

    Writes validate.csv, and convergence.csv with the observed order of convergence in the time
    step. The exit code is 1 if an error exceeds its bar. The last column of the table is processor
    time per simulated time, in microseconds per second.
    """
    from rigdda.agents import accuracy

    cases = accuracy.choose(only, slow)
    folder = folder_for(out, "validate", "validate.csv", "convergence.csv")
    with kept(folder), progress(accuracy.runs(cases)) as tick:
        results, studies = accuracy.validate(cases, seed, folder, tick)
    show(accuracy.table(results))
    if studies:
        show(accuracy.convergence_table(studies))
    missed = [f"{r.case} ({r.check.quantity})" for r in results if not r.passed]
    if missed:
        raise Stopped(f"{len(missed)} of {len(results)} miss their bars: {', '.join(missed)}", 1)
    click.echo(f"{len(results)} figures within their bars; the tables are in {folder}")


if __name__ == "__main__":
    sys.exit(main())
