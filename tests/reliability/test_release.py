"""What a release says of itself: one version and date, and a page that needs no checkout."""

from __future__ import annotations

import re
import tomllib
from datetime import date
from pathlib import Path

import rigdda

ROOT = Path(rigdda.__file__).parents[1]


def text(name: str) -> str:
    """Return the text of a file of the checkout."""
    return (ROOT / name).read_text(encoding="utf-8")


def changelog() -> list[tuple[str, date]]:
    """Return the versions of the changelog, the newest first, each with its date."""
    entries = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - (\S+)$", text("CHANGELOG.md"), re.M)
    return [(version, date.fromisoformat(day)) for version, day in entries]


def test_the_newest_entry_of_the_changelog_is_this_version() -> None:
    entries = changelog()
    assert entries[0][0] == rigdda.__version__
    assert entries == sorted(entries, key=lambda entry: entry[1], reverse=True)


def test_the_citation_names_this_version_and_its_date() -> None:
    fields = dict(re.findall(r"^([\w-]+): (.+)$", text("CITATION.cff"), re.M))
    version, day = changelog()[0]
    assert fields["version"] == version
    assert date.fromisoformat(fields["date-released"]) == day
    assert fields["license"] == project()["license"]


def project() -> dict:
    """Return the table `project` of pyproject.toml."""
    return tomllib.loads(text("pyproject.toml"))["project"]


def test_the_long_description_has_no_relative_link() -> None:
    page = text(project()["readme"])
    assert re.findall(r"\]\((?!https?://)[^)]*\)", page) == []


def test_every_extra_that_the_long_description_names_exists() -> None:
    extras = project()["optional-dependencies"]
    named = re.findall(r"rigdda\[([\w,]+)\]", text(project()["readme"]))
    assert named
    assert {name for names in named for name in names.split(",")} <= extras.keys()


def test_constraints_pin_every_dependency() -> None:
    """Names are compared as pip does: without case, and with - for _.

    EngiBench needs an older pyarrow than the constraints have.
    """

    def names(lines: list[str]) -> set[str]:
        found = (re.match(r"[\w.-]+", line) for line in lines)
        return {re.sub(r"[-_.]+", "-", match[0]).lower() for match in found if match}

    asked = names(project()["dependencies"])
    for lines in project()["optional-dependencies"].values():
        asked |= names(lines)
    assert asked - {"rigdda", "engibench"} <= names(text("constraints.txt").splitlines())
