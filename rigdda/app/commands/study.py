"""The command `rigdda study`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    TRAFFIC_HEADING,
    WholeNumber,
    executor_option,
    finding,
    folder_for,
    note,
    out_option,
    progress,
    recorded_run,
    seed_option,
    show,
    warn_of_placeholders,
)
from rigdda.files import remove_results


@click.command()
@click.argument("file", metavar="STUDY.toml")
@seed_option("Seed of the first release. Later releases use the seeds that follow.")
@click.option("--worst", "worst", type=WholeNumber(0, 12), default=0, show_default=True,
              metavar="K", help="Number of worst releases of each layout in worst.csv and "
              "worst.png: those with the most energy on the road, and those in which a barrier "
              "fails.")  # fmt: skip
@out_option("study-NAME")
@executor_option
def study(file: str, seed: int, worst: int, out: Path | None) -> None:
    """Compare the layouts of STUDY.toml on the same releases.

    The file gives a `site`, the number of `releases` of each event, and `layouts`. Each layout has
    a `name` and either `barriers`, as in a layout file, or the name of a layout `file`.

    Writes study.csv (one row for each release), layouts.csv (Z and its parts), events.csv
    (probabilities and energies), differences.csv (the difference in Z of each pair of layouts, on
    common releases), sections.png, costs.png and, for a site with traffic, risk.csv; with --worst
    also worst.csv and worst.png. An interrupted study continues from study.csv.
    """
    from dataclasses import replace

    from rigdda.app import studies, worst_releases
    from rigdda.app.released import released
    from rigdda.app.reports import findings, study_report, tables

    asked = studies.load(file)
    asked = replace(asked, site=released(asked.site))
    files = "study.csv", *study_report.STUDY_FILES, tables.RISKS, *worst_releases.WORST_FILES
    folder = folder_for(out, f"study-{Path(file).stem}", *files)
    _check_same_study(folder, file)
    with recorded_run(folder, asked.site), progress(asked.size) as tick:
        resumed = studies.run(asked, seed, folder / "study.csv", tick)
        tick(asked.size, "tables and pictures")
        found = studies.results(asked, folder / "study.csv")
        study_report.write(folder, found, seed)
        if worst:
            rows = studies.releases(asked, folder / "study.csv")
            worst_releases.write(folder, asked, rows, worst)
        else:
            remove_results(folder, worst_releases.WORST_FILES)
    click.echo("Z, capital, harm, repair: EUR per metre and year; to build: EUR per metre")
    show(study_report.costs(found))
    click.echo(
        "probabilities with 95 % upper bounds in brackets; largest energy of a block on the road\n"
        "and of a hit: 95 % quantile of the releases with one, in kJ per metre of width"
    )
    show(study_report.events(found))
    risks = study_report.risks(found)
    if risks is not None:
        click.echo(TRAFFIC_HEADING.format(asked.site.traffic))
        show(risks)
    for line in study_report.sentences(found):
        finding(line)
    for name, layout in asked.layouts.items():
        if words := findings.unbuildable(asked.site, layout):
            note(f"the layout {name!r} {words}")
        if words := findings.removed(asked.site, layout):
            note(f"layout {name!r}: {words}")
    warn_of_placeholders(asked.source)
    words = f", {resumed} from an earlier run" if resumed else ""
    click.echo(f"{asked.size:,} releases{words}; tables and pictures are in {folder}")


def _check_same_study(folder: Path, file: str) -> None:
    """Check that a folder has no results of a study file of another name.

    The path may differ, because folders are moved.

    Raises
    ------
    BadInput
        If the study file had another name.
    """
    from rigdda import BadInput
    from rigdda.agents.run_record import read

    earlier = read(folder).get("study")
    if earlier is not None and Path(earlier.options["file"]).name != Path(file).name:
        hint = f"it has the results of the study {earlier.options['file']}: name another folder"
        raise BadInput("--out", str(folder), hint)
