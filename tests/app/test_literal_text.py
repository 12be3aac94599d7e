"""Names that a user gives are shown as they are: rich markup and mathematical text are not read."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest
from processes import png_size

import rigdda
from rigdda import Site
from rigdda.app import site_check, site_picture
from rigdda.app.reports import tables
from rigdda.app.site_check import Trial
from rigdda.app.terminal import progress, show

NAMES = (
    "km 3 [/b]",
    "[north]",
    "[link=x]y[/link]",
    ":smile:",
    "back\\[slash]",
    "[bold]north[/bold]",
    "{task.total}",
)
"""Names that rich would read as markup, as an emoji or as an escape."""

replace = msgspec.structs.replace


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let rich take the captured streams for terminals that are wide enough and have no colours."""
    for name, value in (("FORCE_COLOR", "1"), ("NO_COLOR", "1"), ("COLUMNS", "160")):
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("TERM", "xterm")


def plain(text: str) -> str:
    """Return a text without the control sequences of a terminal."""
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text)


def called(name: str) -> Site:
    """Return the site `quick` with a name for itself, its first source and its first event."""
    site = rigdda.sites.load("quick")
    source, event = replace(site.sources[0], name=name), replace(site.events[0], name=name)
    events = tuple(replace(one, source=name) if one.source == "face" else one
                   for one in (event, *site.events[1:]))  # fmt: skip
    sources = (source, *site.sources[1:])
    return replace(site, name=name, sources=sources, events=events, meshes=())


@pytest.mark.usefixtures("terminal")
@pytest.mark.parametrize("name", NAMES)
def test_the_progress_bar_shows_a_name_as_it_is(name: str, capsys: pytest.CaptureFixture[str]):
    with progress(3) as tick:
        tick(1, f"searching {name}")
        tick(3, f"evaluating\n{name}")
    shown = plain(capsys.readouterr().err)
    assert f"evaluating {name} " in shown and "3/3" in shown


@pytest.mark.usefixtures("terminal")
@pytest.mark.parametrize("name", NAMES)
def test_tables_show_a_name_as_it_is(name: str, capsys: pytest.CaptureFixture[str]):
    site = called(name)
    trials = [Trial(event.name, 0.1, False) for event in site.events]
    for table in (tables.sites([site]), site_check.table(site, trials), tables.empty_table([name])):
        show(table)
        assert name in plain(capsys.readouterr().out)


@pytest.mark.parametrize("name", [" ".join(NAMES), "$\\frac{x$", "from $5 to $6", "a_b^c"])
def test_the_picture_of_a_check_takes_any_name(name: str, tmp_path: Path):
    site_picture.draw(tmp_path / "site.png", called(name))
    assert min(png_size(tmp_path / "site.png")) > 100
