"""What all tabs of the page share: the project, the computing, and what a tab may ask for."""

from __future__ import annotations

import os
import shlex
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import tomli_w

from rigdda.app.page.jobs import Job
from rigdda.app.page.live import Live
from rigdda.app.page.loading import IMPORTING
from rigdda.app.page.replays import Viewing
from rigdda.app.page.state import LAYOUT, Project
from rigdda.app.page.theme import Theme
from rigdda.files import atomic

if TYPE_CHECKING:
    from rigdda.app.page.falls import Release

AHEAD = 1.0
"""Longest time for which releases that are drawn go before the figures of the layout [s]."""

STUDY = "study.toml"
"""File of the study that computes the figures of the page."""


class Worker(Protocol):
    """What computes for a tab in a thread; the server ends it before it ends itself."""

    def stop(self) -> None:
        """End after what is being computed."""

    def join(self) -> None:
        """Wait until nothing is being computed."""


class Workspace:
    """What all tabs of the browser share: the project and the computing.

    Parameters
    ----------
    project : Project
        The project.
    """

    def __init__(self, project: Project):
        self.project = project
        self.live = Live()
        self.search = Job(project.folder, "search")
        self.study = Job(project.folder, "study")
        self.report = Job(project.folder, "report")
        self.fit = Job(project.folder, "fit")
        self.viewing = Viewing(project.folder)
        self.workers: weakref.WeakSet[Worker] = weakref.WeakSet()
        self._first: tuple[Release, float] | None = None
        self._study = ""

    def draw_first(self, release: Release) -> None:
        """Let the releases that are drawn go before the figures of the layout, for a moment."""
        self._first = release, time.monotonic() + AHEAD
        self.workers.add(release)
        self.live.rest()

    @property
    def draws(self) -> bool:
        """Whether releases that are drawn go before the figures of the layout."""
        if self._first is None:
            return False
        release, latest = self._first
        return release.running and time.monotonic() < latest

    @property
    def study_file(self) -> Path:
        """The study file of the figures of the layout."""
        return self.project.folder / STUDY

    @property
    def study_arguments(self) -> list[str]:
        """Arguments of the command that computes the figures of the layout."""
        out = str(self.study_folder)
        return ["study", str(self.study_file), "--seed", "0", "--out", out]

    @property
    def study_folder(self) -> Path:
        """The results folder of the figures of the layout."""
        return self.project.folder / "study"

    @property
    def study_command(self) -> str:
        """The command that computes the figures of the layout."""
        return shlex.join(["rigdda", *self.study_arguments])

    @property
    def report_folder(self) -> Path:
        """The folder of the report."""
        return self.project.folder / "report"

    @property
    def design_folder(self) -> Path | None:
        """The results folder of the last search; None before the first."""
        return _results(self.search)

    @property
    def fit_folder(self) -> Path | None:
        """The results folder of the last fit; None before the first."""
        return _results(self.fit)

    def write_study(self) -> None:
        """Write the study file of the figures that are known, if it has changed."""
        found, project = self.live.figures, self.project
        if found is None or not found.releases or found.layout != project.layout:
            return
        with IMPORTING:
            from rigdda.app.page.figures import study_table

        site = os.path.relpath(project.where.site, project.folder)
        table = study_table(site, found.layout, LAYOUT, found.releases)
        text = tomli_w.dumps(table)
        if text != self._study:
            with atomic(self.study_file) as part:
                part.write_text(text, encoding="utf-8")
            self._study = text

    def __enter__(self) -> Workspace:
        return self

    def __exit__(self, *_: object) -> None:
        self.live.close()
        for worker in (workers := list(self.workers)):
            worker.stop()
        for worker in workers:
            worker.join()
        for job in (self.search, self.study, self.report, self.fit, self.viewing):
            job.close()


def _results(job: Job) -> Path | None:
    """Return the results folder of the last command of a job; None before the first."""
    folder = job.option("--out")
    return Path(folder) if folder else None


class Host(Protocol):
    """The page as its tabs see it."""

    workspace: Workspace
    project: Project
    theme: Theme

    def act(self, do: Callable[[], object]) -> bool:
        """Do something to the project, and show its error or what has changed."""

    def say(self, words: str) -> None:
        """Show a message in the head of the page."""


class Tab(Protocol):
    """A tab of the page."""

    panel: Any

    def __init__(self, page: Host): ...

    def show(self) -> None:
        """Show the site and the layout as they are now."""

    def tick(self) -> None:
        """Show what has been computed meanwhile."""
