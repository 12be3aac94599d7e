"""Pages of the repository in the site, and links as a code host follows them.

Every page links relative to its own file, so that it can be read on a code host. In the site, links
to files that have a page lead there, other files are copied beside the pages, and a link to a
folder is left as its words.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent

SHOWN = {
    "benchmarks": "experiments/README.md",
    "contributing": "CONTRIBUTING.md",
    "changelog": "CHANGELOG.md",
}
"""Files outside this folder by the page that shows them."""

PAGES = {ROOT / path: DOCS / f"{page}.md" for page, path in SHOWN.items()} | {
    ROOT / "README.md": DOCS / "index.md"
}

LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s:#]+)(#[^()\s]*)?\)")


def read(app: Sphinx, page: str, source: list[str]) -> None:
    """Put the text that a page shows in place of its own, with links as the site has them."""
    file = ROOT / SHOWN[page] if page in SHOWN else Path(app.env.doc2path(page))
    if file.suffix != ".md":
        return
    if page in SHOWN:
        app.env.note_dependency(str(file))
        source[0] = file.read_text(encoding="utf-8")
    target = Path(app.env.doc2path(page)).parent
    source[0] = LINK.sub(lambda link: relinked(link, file.parent, target), source[0])


def relinked(link: re.Match[str], folder: Path, target: Path) -> str:
    """Return a link of a file in a folder as one of a page in the folder `target`."""
    words, path, anchor = link[1], link[2], link[3] or ""
    wanted = Path(os.path.normpath(folder / path))
    if wanted.is_dir():
        return words
    if not wanted.is_file():
        return link[0]
    to = os.path.relpath(PAGES.get(wanted, wanted), target)
    if wanted.suffix == ".md" and wanted not in PAGES and DOCS not in wanted.parents:
        return f"{{download}}`{words} <{to}>`"
    return f"[{words}]({to}{anchor})"


def setup(app: Sphinx) -> dict[str, bool]:
    """Have every page read so."""
    app.connect("source-read", read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
