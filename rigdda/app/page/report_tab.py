"""The tab Report: a report of the results in the project, as HTML and PDF."""

from __future__ import annotations

import csv
import html
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import panel as pn

from rigdda import BadInput
from rigdda.agents import run_record
from rigdda.app.page.forms import button, heading, paragraph, text
from rigdda.app.page.jobs import FAILED, FINISHED, RUNNING
from rigdda.app.page.known_layout import CURRENT, NOTHING
from rigdda.app.page.replays import replay_arguments
from rigdda.app.page.state import LAYOUT
from rigdda.app.worst_releases import WORST_FILES

if TYPE_CHECKING:
    from rigdda.app.page.workspace import Host

WORST = 3
"""Number of the worst releases of each layout and reason."""

PAGES = ("report.html", "report.pdf")
"""Files that a report may have."""

CONTENTS = {
    "design": "search for the best layout", "fit": "fit of the ground",
    "study": "figures of the layout", "simulate": "releases",
}  # fmt: skip
"""What commands write, in words."""

SLOW = 10
"""Number of looks of the page between two looks at the report."""


class ReportTab:
    """The tab Report."""

    def __init__(self, page: Host):
        self.page, self.project, self.theme = page, page.project, page.theme
        self.job, self.study = page.workspace.report, page.workspace.study
        self._count = 0
        self._results = pn.widgets.CheckBoxGroup(label="Results", options={})
        self._pdf = pn.widgets.Checkbox(label="Print it to PDF as well", value=True)
        self._worst = pn.widgets.Checkbox(
            label=f"With the {WORST} worst releases and failures of barriers of each", value=True
        )
        self._listed: list[dict[str, str]] = []
        self._replays = pn.Column(sizing_mode="stretch_width")
        self._viewed = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._write = button("Write the report", self._begin, primary=True)
        self._again = button("Compute the results of this layout", self._compute)
        self._status = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self.panel = pn.Column(
            heading("What goes into the report"),
            text("Results are in folders of the project. A search writes one; the button computes "
                 "another of the present layout, compared with the slope without it."),
            self._worst, self._again, self._results, self._pdf, self._write, self._status,
            self._replays, self._viewed, sizing_mode="stretch_width",
        )  # fmt: skip

    def show(self) -> None:
        """Show the results that there are."""
        own = self.page.workspace.report_folder.name
        files = sorted(self.project.folder.glob(f"*/{run_record.RECORD_FILE}"))
        folders = [file.parent for file in files if file.parent.name != own]
        found = {f"{one.name}: {words}": one.name for one in folders if (words := _content(one))}
        before = self._results.options
        if before != found:
            new = [name for name in found.values() if name not in before.values()]
            kept = [name for name in self._results.value if name in found.values()]
            self._results.options = found
            self._results.value = kept + new
        self._look()

    def tick(self) -> None:
        """Show whether the report is written."""
        self._count += 1
        if self._count % SLOW == 0:
            self.show()

    def _compute(self) -> None:
        def start() -> None:
            workspace = self.page.workspace
            if not workspace.study_file.is_file():
                raise BadInput("results", None, "wait until the tab Barriers shows figures")
            worst = ["--worst", str(WORST)] if self._worst.value else []
            self.study.start([*workspace.study_arguments, *worst])

        self.page.act(start)

    def _begin(self) -> None:
        def start() -> None:
            if not self._results.value:
                raise BadInput("results", [], "choose at least one folder of results")
            folders = [str(self.project.folder / name) for name in self._results.value]
            out = self.page.workspace.report_folder
            pdf = ["--pdf"] if self._pdf.value else []
            self.job.start(["report", *folders, "--out", str(out), *pdf])

        self.page.act(start)

    def _look(self) -> None:
        lines = []
        for job, words in ((self.study, "the results of this layout"), (self.job, "the report")):
            state = job.state
            if state == RUNNING:
                lines.append(paragraph(f"Computing {words}. {job.line}"))
            elif state == FAILED:
                lines.append(paragraph(f"{words.capitalize()} failed: {job.words}"))
        if self.job.state == FINISHED:
            lines += [self._link(self.page.workspace.report_folder / name) for name in PAGES]
        if self.job.command:
            lines.append(f"<code>{html.escape(self.job.command)}</code>")
        self._status.object = "".join(lines)
        self._show_worst()
        self._viewed.object = paragraph(self.page.workspace.viewing.look())
        self._write.disabled = self.job.state == RUNNING
        self._again.disabled = self.study.state == RUNNING

    def _show_worst(self) -> None:
        """List the worst releases of the results of the layout, each with its replay."""
        found = _rows(self.page.workspace.study_folder / WORST_FILES[0])
        found = [row for row in found if row["layout"] in (CURRENT, NOTHING)]
        if found == self._listed:
            return
        self._listed = found
        rows: list[Any] = [heading("The worst releases")] if found else []
        for row in found:
            layout = "with the layout" if row["layout"] == CURRENT else row["layout"]
            words = f"{layout}, {row['why']}: {row['event']}, seed {row['seed']}, "
            words += f"{float(row['energy_on_road']):,.0f} kilojoules per metre on the road"
            see = button("Open in rerun", partial(self._open, row), width=130)
            rows.append(pn.Row(see, text(words), sizing_mode="stretch_width"))
        self._replays[:] = rows

    def _open(self, row: dict[str, str]) -> None:
        """Record a release and open it in the rerun viewer."""
        project, now = self.project, self.project.current
        layout = project.folder / LAYOUT if row["layout"] == CURRENT else None
        asked = replay_arguments(project.where.site, layout, row["event"], int(row["seed"]))
        texts = f"{now.site}\0{now.layout}"
        self.page.act(lambda: self.page.workspace.viewing.open(asked, texts))

    def _link(self, file: Path) -> str:
        """Return a link to a file of the report, if there is one."""
        if not file.is_file():
            return ""
        stamp: Any = file.stat().st_mtime_ns
        style = f"color:{self.theme.accent}"
        return (
            f"<p><a style='{style}' target='_blank' rel='noopener' "
            f"href='report/{file.name}?{stamp}'>Open {file.name}</a></p>"
        )


def _content(folder: Path) -> str:
    """Return in words what is in a results folder; empty if a command in it has not ended."""
    try:
        records = run_record.read(folder)
    except (BadInput, OSError):
        return ""
    if not all(record.ended for record in records.values()):
        return ""
    return "; ".join(
        f"{CONTENTS.get(record.command, record.command)}, {record.ended[:16].replace('T', ' ')} UTC"
        for record in records.values()
    )


def _rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a table; none if it is not there."""
    try:
        with file.open(newline="", encoding="utf-8") as opened:
            return list(csv.DictReader(opened))
    except OSError:
        return []
