"""The command `rigdda exam`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.agents import limits
from rigdda.agents.limits import SEED
from rigdda.app.terminal import (
    Stopped,
    WholeNumber,
    counted,
    executor_option,
    finding,
    folder_for,
    note,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
)


@click.command(short_help="Score an optimiser or a policy on sites of the exam.")
@click.option("--entry", required=True, metavar="MODULE:FUNCTION",
              help="Function that receives a task and returns a layout, such as "
              "mymodule:design.")  # fmt: skip
@click.option("--corridor-entry", default="", metavar="MODULE:FUNCTION",
              help="Function for corridors, which returns one layout for each section.  [default: "
              "the entry, with the same money for every metre of road]")  # fmt: skip
@click.option("--spec", type=click.Path(path_type=Path), metavar="FILE",
              help="Specification of another exam.  [default: the one of the package]")  # fmt: skip
@click.option("--sites", type=WholeNumber(1), metavar="N",
              help="Use only the first N sites, and no corridor unless --corridors is "
              "given.")  # fmt: skip
@click.option("--corridors", type=WholeNumber(0), metavar="N",
              help="Use only the first N corridors.")  # fmt: skip
@click.option("--budget", "budgets", type=WholeNumber(0, limits.JOB_RELEASES), multiple=True,
              metavar="N", help="Releases per section. May be repeated.  [default: those of the "
              "specification]")  # fmt: skip
@click.option("--verify", type=WholeNumber(10, limits.JOB_RELEASES), metavar="N",
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
    """Score an optimiser or a policy on sites and corridors that are not used for training.

    The entry runs in a process of its own and simulates only through its task, which counts the
    releases. Its layouts are verified on releases whose seeds follow from the layouts. The score is
    1 for the recorded reference and 0 for random layouts. Entries that break a rule are flagged,
    and the exit code is then 1.

    Writes results.csv (a row for each task), summary.csv (interquartile means with intervals) and
    score.png. An interrupted exam continues where it stopped.
    """
    from rigdda.app.exam import ranking, scorer, specification

    asked = specification.load(spec)
    references = specification.references(asked, spec)
    part = specification.part(asked, sites, corridors, budgets, verify, seed)
    specification.check_references(part, references)
    scorer.check_names({"--entry": entry, "--corridor-entry": corridor_entry})
    folder = folder_for(out, f"exam-{entry.rpartition(':')[2]}", *ranking.FILES)
    with recorded_run(folder), progress(part.size) as tick:
        job = scorer.Scorer(part, references, entry, corridor_entry, folder, tick)
        scores = job.run()
        found = ranking.write(folder, scores, part, entry)
    click.echo(
        "score: 1 for the reference, 0 for random layouts; distance: 0 for the reference, 1 for no "
        "barrier"
    )
    show(ranking.table(found))
    for line in ranking.remarks(part, references):
        note(line)
    if job.resumed:
        note(
            f"the layouts of {counted(job.resumed, 'task')} are those of an earlier run in this "
            "folder; name another folder if the entry reads a file that has changed, such as a "
            "model"
        )
    click.echo(f"{counted(part.size, 'task')}, verified on {part.verification:,} releases each; "
               f"{', '.join(ranking.FILES)} are in {folder}")  # fmt: skip
    flags = ranking.broken(scores)
    for line in flags:
        finding(line)
    if flags:
        raise Stopped(f"{entry} is disqualified: {counted(len(flags), 'broken rule')}", 1)
