"""The main job: `rigdda design SITE`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rigdda.agents.limits import SEED
from rigdda.agents.names import DEFAULT, DESIGNERS
from rigdda.agents.options import count_option, out_option, seed_option
from rigdda.agents.terminal import folder_for, kept, progress, show

if TYPE_CHECKING:
    from rigdda.agents.job import Study
    from rigdda.agents.store import Store
    from rigdda.envs import DesignProblem

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


@click.command()
@click.argument("site")
@click.option("--designer", type=click.Choice(DESIGNERS), default=DEFAULT, show_default=True,
              help="How to search.")  # fmt: skip
@click.option("--kinds", callback=_kinds, metavar="KIND,...",
              help="Kinds to choose from: fence, ditch, embankment, gravity_wall, mesh, wall.  "
              "[default: all but wall]")  # fmt: skip
@click.option("--target", type=click.FloatRange(0.0, 1.0, min_open=True), metavar="P",
              help="Meet this: P that a block of a design event reaches the road.")  # fmt: skip
@click.option("--failure", type=click.FloatRange(0.0, 1.0, min_open=True), metavar="P",
              help="Meet this: P that a barrier fails in a design event.")  # fmt: skip
@click.option("--zone", type=float, nargs=2, metavar="A B",
              help="Barriers may stand from A to B [m].  [default: the site's]")  # fmt: skip
@count_option("--budget", 2, BUDGET, "Releases that the search may simulate.")
@count_option("--verify", 10, RELEASES, "Unseen releases that each layout is verified on.")
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
    """Design the barriers of SITE (a name or a TOML file) and verify them on unseen releases.

    Least Z: capital and upkeep, harm on the road, and repair, in EUR per metre of road and year.
    Writes layout.toml, evaluations.csv, section.png, cost.png and episode.rrd. Layouts that a
    killed or former run has evaluated are in evaluations.jsonl and are not simulated again; a
    folder that holds a design of another problem (problem.json) is refused.
    """
    from rigdda.agents import job, results
    from rigdda.agents.claim import FILE, claim

    problem = _pose(site, kinds, target, failure, zone)
    folder = folder_for(out, f"design-{problem.site.name}", *results.FILES, FILE)
    claim(folder, problem, *results.FILES)
    with kept(folder):
        with progress(budget + CASES * verify) as tick:
            done, store = job.study(problem, designer, budget, seed, verify, folder, tick)
            tick(budget + CASES * verify, "pictures")
            results.write(done, folder, seed)
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


def _tell(done: Study, store: Store, verify: int, folder: Path) -> None:
    """Print the tables, the layout to order, what limits it, and what it took."""
    from rigdda.agents import findings, verdict
    from rigdda.agents.results import FILES
    from rigdda.agents.wording import order

    chosen, result = done.chosen.evaluation, done.result
    click.echo(
        "Z and its parts in EUR per metre of road and year; to build in EUR per metre;\n"
        "rule: UNI 11211-4; debris: of what comes onto the road without barriers"
    )
    show(verdict.costs(done))
    chances = verdict.chances(done)
    if chances is not None:
        click.echo("chances in each design event, with their 95 % upper bounds")
        show(chances)
    else:
        click.echo("no design events: the site names none (design = true)")
    from_start = " (what the search began with)" if result.origin == "start" else ""
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
    resumed = f"; {store.resumed:,} taken from a former run" if store.resumed else ""
    click.echo(
        f"search: {result.simulations:,} releases, {result.seconds:.0f} s of processor time; "
        f"verification: {verify:,} unseen ones each{resumed}\n"
        f"{', '.join(FILES)} are in {folder}"
    )
