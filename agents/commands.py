"""Commands that run many simulations: `rigdda fit | study | train | evaluate | validate`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from rigdda.agents.limits import SEED
from rigdda.agents.names import DESIGNERS
from rigdda.agents.options import count_option, out_option, seed_option
from rigdda.agents.terminal import Stopped, folder_for, kept, note, progress, show


@click.command()
@click.argument("file", metavar="STUDY.toml")
@seed_option("Seed of the first release; the others follow it.")
@out_option("study-NAME")
def study(file: str, seed: int, out: Path | None) -> None:
    """Simulate every layout of STUDY.toml in the same releases: one row each in study.csv.

    The file names a `site`, how many `releases` of each event, and `layouts`: tables with a `name`
    and either `barriers`, as in a layout file, or the `file` that holds them. A study that was
    killed goes on from its study.csv.
    """
    from rigdda.agents import doubts, studies, study_file

    asked = study_file.load(file)
    folder = folder_for(out, f"study-{Path(file).stem}", "study.csv")
    with kept(folder), progress(asked.size) as tick:
        resumed = studies.run(asked, seed, folder / "study.csv", tick)
    click.echo("Z and its parts in EUR per metre of road and year; to build in EUR per metre")
    show(studies.table(asked, folder / "study.csv"))
    for name, layout in asked.layouts.items():
        if words := doubts.unbuildable(asked.site, layout):
            note(f"the layout {name!r} {words}")
    words = f", {resumed} taken from a former run" if resumed else ""
    click.echo(f"{asked.size:,} releases{words}; study.csv is in {folder}")


@click.command()
@click.argument("site")
@click.argument("observed", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--parameters", "names", multiple=True, required=True, metavar="PATH[=LOW:HIGH]",
              help="A number of the site file to fit, such as surfaces.soil.restitution; repeat "
              "it, four at most are wise.")  # fmt: skip
@click.option("--model", type=click.Choice(("blocks", "lumped")), default="blocks",
              show_default=True, help="What computes run-outs.")  # fmt: skip
@count_option("--budget", 8, 160, "Sets of values that are computed.")
@count_option("--releases", 10, 150, "Releases of each event with each set.")
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
    """Fit numbers of SITE (a name or a TOML file) to run-outs in OBSERVED, a CSV file.

    Its columns are event and run_out_m, the chainage at which the block stopped. Prints the fitted
    numbers with 95 % intervals, or "not identified" where the interval is nearly as long as the
    range that was given, and what they predict of runs that were left out. Writes site.toml (SITE
    with them), fit.csv and fit.png.
    """
    import rigdda
    from rigdda.agents import fit as job
    from rigdda.agents import fit_results, run_outs, tables
    from rigdda.agents.parameters import parse

    where = rigdda.Site.load(site)
    seen, parameters = run_outs.read(observed, where), [parse(name) for name in names]
    folder = folder_for(out, f"fit-{where.name}", "site.toml", "fit.csv", "fit.png")
    with kept(folder), progress(budget) as tick:
        found = job.fit(where, seen, parameters, budget, releases, seed, tick, model)
        found.site.save(folder / "site.toml")
        fit_results.write(folder / "fit.csv", found, seen)
        fit_results.draw(folder / "fit.png", found, seen)
    show(tables.fit(fit_results.rows(found, seen)))
    click.echo(f"up to {budget} sets of values; site.toml, fit.csv and fit.png are in {folder}")


@click.command()
@count_option("--sites", 2, 512, "Random sites to train on.")
@count_option("--episodes", 0, 49152, "Episodes.")
@seed_option("Seed of all that is random.", SEED)
@out_option("train")
def train(sites: int, episodes: int, seed: int, out: Path | None) -> None:
    """Train a policy that designs a layout for a site from what it sees of it, without a search.

    Writes policy.safetensors, which `rigdda evaluate --policy` takes, and logs for TensorBoard.
    A training that was killed goes on where it stopped. Needs the extra rl.
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


@click.command()
@click.option("--designer", "names", type=click.Choice(DESIGNERS), multiple=True,
              default=("rule", "race"), show_default=True,
              help="What to try beside constant and random; repeatable.")  # fmt: skip
@click.option("--policy", type=click.Path(), help="What `train` wrote, to be tried as well.")
@click.option("--split", type=click.Choice(("train", "validation", "test")), default="test",
              show_default=True, help="Sites to learn from, to choose by, or unseen.")  # fmt: skip
@count_option("--budget", 2, 3_000, "Releases that each designer may simulate on a site.")
@count_option("--sites", 1, 6, "Sites of the split; six are one of each family.")
@count_option("--verify", 10, 2_000, "Unseen releases that each layout is verified on.")
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
    """Try designers on generated sites: how far each is behind the best, in EUR a year.

    Prints means over the sites with 95 % intervals; writes scores.csv. Layouts that a killed or
    former run has evaluated are not simulated again.
    """
    from rigdda.agents import contest, extra, tables
    from rigdda.agents.policy import load, using
    from rigdda.agents.store import Store

    tried = dict.fromkeys(("constant", "random", *names))
    designers = {name: extra.module(name).design for name in tried}
    if policy is not None:
        designers["policy"] = using(load(policy))
    posed = contest.pose(split, sites)
    folder = folder_for(out, "evaluate", "evaluations.jsonl", "scores.csv")
    store = Store(folder / "evaluations.jsonl")
    with kept(folder), progress(len(posed) * len(designers)) as tick:
        scores = contest.hold(posed, designers, budget, verify, seed, store, tick)
    tables.write_rows(folder / "scores.csv", [score.row() for score in scores])
    click.echo("EUR per metre of road and year; best: of these designers on each site")
    show(contest.table(scores))
    resumed = f", {store.resumed:,} releases taken from a former run" if store.resumed else ""
    click.echo(f"{len(posed)} sites of {split}, verified on {verify:,} releases each{resumed}; "
               f"scores.csv is in {folder}")  # fmt: skip


@click.command()
@click.option("--only", multiple=True, metavar="NAME",
              help="Run cases whose names start with NAME, slow or not; repeatable.")  # fmt: skip
@click.option("--slow", is_flag=True, help="Run the cases that take long as well.")
@seed_option("Seed of the random shapes, speeds and offsets.")
@out_option("validate")
def validate(only: tuple[str, ...], slow: bool, seed: int, out: Path | None) -> None:
    """Compare computed motions with closed forms, and the observed order of convergence.

    Writes validate.csv and convergence.csv. The exit code is 1 if a figure misses its bar. The
    last column of the table is processor time per simulated time, in microseconds a second.
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
