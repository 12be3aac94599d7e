"""Printing of a page to PDF by a browser that is installed: Chromium, Chrome or Edge."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from rigdda import BadInput, Error
from rigdda.files import atomic

PROGRAMS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)
"""Names of programs that can print to PDF, in the order in which they are sought."""

APPLICATIONS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
"""Where they are on macOS, where they are not on the search path."""

PATIENCE = 120.0
"""Longest time that a browser may take to print [s]."""


def find() -> str:
    """Return the path of a browser that can print to PDF.

    Raises
    ------
    BadInput
        If none is installed.
    """
    for name in PROGRAMS:
        if found := shutil.which(name):
            return found
    for name in APPLICATIONS:
        if Path(name).is_file():
            return name
    mend = (
        "no browser was found that can print: install Chromium, Chrome or Edge, or open "
        "report.html and print it from there"
    )
    raise BadInput("--pdf", True, mend)


def arguments(folder: str) -> list[str]:
    """Return the options of a browser without a window, with its profile in a folder."""
    found = ["--headless", "--disable-gpu", "--no-first-run", f"--user-data-dir={folder}"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:  # Chromium refuses its sandbox to root
        found.append("--no-sandbox")
    return found


def print_pdf(program: str, page: Path) -> Path:
    """Print a page to a PDF file beside it, and return the path of the file.

    Raises
    ------
    Error
        If the browser fails or takes too long.
    """
    target = page.with_suffix(".pdf")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, atomic(target) as part:
        made = Path(folder) / "page.pdf"
        command = [program, *arguments(folder), "--no-pdf-header-footer",
                   f"--print-to-pdf={made}", page.resolve().as_uri()]  # fmt: skip
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise Error(f"{program} could not print {page}: {error}") from None
        if not made.is_file() or made.stat().st_size == 0:
            last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
            raise Error(f"{program} could not print {page}: code {done.returncode}: {last}")
        shutil.copyfile(made, part)
    return target
