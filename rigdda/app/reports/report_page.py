"""The report of results folders: one HTML page that needs no other file and no network."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rigdda.app.reports import report_sections
from rigdda.app.reports.results_folder import ResultsFolder
from rigdda.files import atomic

FILE = "report.html"
"""Name of the page in its folder."""

HERE = Path(__file__).parent


def compose(folders: Sequence[ResultsFolder]) -> str:
    """Return the page.

    Raises
    ------
    BadInput
        If a file of a folder is damaged.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    sections = report_sections.filled(folders)
    environment = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"unbroken": unbroken, "together": together}
    page = environment.get_template("report.html.jinja")
    site = next((folder.site for folder in folders if folder.site is not None), None)
    subject = folders[0].label if site is None else site.name
    return page.render(
        title=f"Rockfall protection: {subject}",
        made=datetime.now(UTC).strftime("%d %B %Y"),
        style=Markup((HERE / "report.css").read_text(encoding="utf-8")),
        sections=sections,
        folders=folders,
        version=next(iter(folders[0].records.values())).versions.rigdda,
        trusted=Markup,
    )


UNITS = re.compile(r"(?<=[\d?]) (?=(?:%|‰|m|kJ|MJ|t|kg|deg|EUR|m2|m3|m²|m³|m/s|years?)(?:\W|$))")
"""Space between a number and its unit."""


def unbroken(text: str) -> str:
    """Return a text whose lines do not break between a number and its unit."""
    return UNITS.sub("\u00a0", text)


BRACKET = re.compile(r"\([^()]*\)")
"""An interval or a bound in brackets."""


def together(text: str) -> str:
    """Return the text of a number whose interval in brackets stays on one line."""
    return BRACKET.sub(lambda found: found[0].replace(" ", "\u00a0"), unbroken(text))


def write(page: str, out: str | os.PathLike[str]) -> Path:
    """Write a page into a folder, and return its path."""
    file = Path(out) / FILE
    with atomic(file) as part:
        part.write_text(page, encoding="utf-8")
    return file
