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
"""Their places on macOS, where they are not on the search path."""

LONGEST_PRINTING = 120.0
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
    hint = (
        "no browser was found that can print: install Chromium, Chrome or Edge, or open "
        "report.html and print it from there"
    )
    raise BadInput("--pdf", True, hint)


def arguments(folder: str) -> list[str]:
    """Return the options of a browser without a window, with its profile in a folder."""
    found = ["--headless", "--disable-gpu", "--no-first-run", f"--user-data-dir={folder}"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:  # Chromium refuses its sandbox to root
        found.append("--no-sandbox")
    return found


def print_pdf(program: str, page: Path) -> Path:
    """Print a page to a PDF file beside it, and return the path of the file.

    The browser reads a copy of the page and writes the PDF in a temporary folder (`TMPDIR`).

    Raises
    ------
    Error
        If the browser fails, takes too long, or cannot see the temporary folder.
    """
    target = page.with_suffix(".pdf")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, atomic(target) as part:
        made, copy = Path(folder) / "page.pdf", Path(folder) / "page.html"
        if page.is_file():  # the browser tells of a page that is not there
            shutil.copyfile(page, copy)
        command = [program, *arguments(folder), "--no-pdf-header-footer",
                   f"--print-to-pdf={made}", copy.resolve().as_uri()]  # fmt: skip
        try:
            done = subprocess.run(
                command, capture_output=True, timeout=LONGEST_PRINTING, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise Error(f"{program} could not print {page}: {error}") from None
        if not made.is_file() or made.stat().st_size == 0:
            last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
            words = f"{program} could not print {page}: code {done.returncode}: {last}"
            if done.returncode == 0 or _from_snap(program):
                words = (
                    f"{program} could not print {page}: it wrote no file into {folder} that can be "
                    "seen here, because a browser from a snap has its own temporary folder: set "
                    "TMPDIR to a folder in your home directory that is not hidden, such as "
                    f"{Path.home() / 'tmp'}, or install Chromium as a Debian package or Chrome"
                )
            raise Error(words)
        shutil.copyfile(made, part)
    return target


def _from_snap(program: str) -> bool:
    """Return whether a program is that of a snap, or a script that starts one, as on Ubuntu."""
    path = Path(program).resolve()
    if "snap" in path.parts or path.name == "snap":
        return True
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError:
        return False
    return head.startswith(b"#!") and b"/snap/bin/" in head
