"""The command `rigdda report`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    Folder,
    folder_for,
)

GENERATOR = '<meta name="generator" content="rigdda'
"""Beginning of a line of every report, by which it is told from a file of the user."""


def _check_own(page: Path, pdf: Path | None) -> None:
    """Check that files of the names of a report and of its print belong to a report.

    A print is taken as one of rigdda if there is a report beside it.

    Raises
    ------
    BadInput
        If one is another file.
    """
    from rigdda import BadInput

    own = page.is_file() and GENERATOR in page.read_text("utf-8", "replace")[:1000]
    for file in filter(None, (page, pdf)):
        if file.is_file() and not own:
            hint = "this file is not a report of rigdda: move it away or name another folder"
            raise BadInput("--out", str(file), hint)


@click.command()
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--out", type=Folder(file_okay=False, path_type=Path),
              help="Folder to write into.  [default: the first of RESULTS]")  # fmt: skip
@click.option("--pdf", is_flag=True, help="Print the report to report.pdf as well. Needs Chromium, "
              "Chrome or Edge.")  # fmt: skip
@click.option("--serve", is_flag=True, help="Serve the report on this machine beside the replay "
              "of RESULTS, which begins at the first impact. Ctrl-C ends the command.")  # fmt: skip
def report(results: tuple[Path, ...], out: Path | None, pdf: bool, serve: bool) -> None:
    """Write one report, report.html, about results folders.

    RESULTS are folders that design, simulate, study, reprice, check, fit, sensitivity or corridor
    wrote. The page needs no other file and no network, and it prints on A4. It contains a summary,
    the site, the assumptions with their sources, the simulated rockfall, the comparison of layouts,
    the limits of the method, and the commands, seeds and versions with which the results can be
    repeated.
    """
    from rigdda.app import browser
    from rigdda.app.reports import html_blocks, html_report

    folders = html_blocks.open_all(results)
    program = browser.find() if pdf else None
    replay = html_blocks.replay_of(folders) if serve else None
    page = html_report.compose(folders)
    files = (html_report.REPORT_FILE, "report.pdf") if pdf else (html_report.REPORT_FILE,)
    folder = folder_for(out or results[0], "", *files)
    _check_own(folder / html_report.REPORT_FILE, folder / "report.pdf" if pdf else None)
    file = html_report.write_report(page, folder)
    click.echo(file)
    if program is not None:
        click.echo(browser.print_pdf(program, file))
    if replay is not None:
        from rigdda.app.report_server import serve as show_both

        show_both(file, replay, click.echo)
