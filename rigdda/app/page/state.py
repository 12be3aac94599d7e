"""Project: the site file, the layout file and the alternatives of a page, with undo and redo.

Everything that a page shows is in files. Each edit is checked, written to disk and added to the
history, which is a file, too: a server that was killed loses nothing. A file that another program
has changed is read again; an edit that would overwrite such a change is refused.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec
import tomli_w

from rigdda import BadInput, Error, Layout, Site, load_layout
from rigdda.app.page import edits, parts
from rigdda.barriers.layout import parse_layout, to_tables
from rigdda.files import atomic, is_file, is_folder, read
from rigdda.model import site_names

SITE, LAYOUT, ALTERNATIVES, HISTORY = "site.toml", "layout.toml", "layouts", "history.json"
"""Names of the files of a project and of the folder of its alternatives."""

BESIDE = ".page"
"""Ending of the folder of a project beside a site file that is not called `SITE`."""

KEPT = 100
"""Number of steps that can be undone."""

NAME = re.compile(r"[\w][\w (),+-]{0,59}")
"""Name of an alternative, which is that of its file."""


class Snapshot(msgspec.Struct, frozen=True):
    """The texts of the site file and the layout file; `site` is empty before there is a site."""

    site: str
    layout: str
    words: str = ""
    """What was done, such as "moved the road"."""


class _History(msgspec.Struct):
    """The file of the history."""

    steps: list[Snapshot]
    at: int


class Conflict(Error):
    """An edit was refused because another program has changed a file of the project."""


class Place(NamedTuple):
    """Where a project is."""

    site: Path
    """The site file, which may not exist yet."""
    folder: Path
    """The folder of all other files."""


def place(target: str | os.PathLike[str] | None) -> Place:
    """Return where the project is that a user names.

    Parameters
    ----------
    target : str, path or None
        A folder, a site file, or the name of a built-in or generated site, which is copied to
        runs/page-NAME. None is the current folder.

    Raises
    ------
    BadInput
        If there is no such file, folder or site.
    """
    path = Path("." if target is None else target)
    if is_folder(path):
        return Place(path / SITE, path)
    if path.suffix == ".toml":
        if not is_file(path):
            raise BadInput("SITE", str(path), "name an existing site file, or its folder")
        beside = path.parent if path.name == SITE else path.with_suffix(BESIDE)
        return Place(path, beside)
    name = str(target)
    if path.suffix or os.sep in name:
        hint = "name a site, a site file (.toml) or a folder; a survey is imported on the page"
        raise BadInput("SITE", name, hint)
    site = Site.named(name)
    folder = Path("runs") / f"page-{name}"
    file = folder / SITE
    if not file.is_file():
        if name in site_names.names():
            with atomic(file) as part:
                part.write_text(site_names.text(name), encoding="utf-8")
        else:
            site.save(file)
    return Place(file, folder)


class Project:
    """A site, a layout and named alternatives on disk, with a history.

    All methods may be called from several threads.

    Parameters
    ----------
    where : Place
        The site file and the folder of the other files, see `place`.

    Attributes
    ----------
    revision : int
        Number that grows with each change of the site or the layout.

    Raises
    ------
    BadInput
        If the site file or the layout file is not valid.
    """

    def __init__(self, where: Place):
        self.where = where
        self.revision = 0
        self.lock = threading.RLock()
        self._layout_file = where.folder / LAYOUT
        self._parsed: tuple[str, str, Site | None, Layout] | None = None
        found = Snapshot(*self._texts(), "opened")
        self._parse(found)
        self._disk = (found.site, found.layout)
        self._steps, self._at = [found], 0
        self._read_history(found)

    @classmethod
    def open(cls, target: str | os.PathLike[str] | None) -> Project:
        """Return the project that a user names, see `place`."""
        return cls(place(target))

    @property
    def folder(self) -> Path:
        """The folder of the project."""
        return self.where.folder

    @property
    def current(self) -> Snapshot:
        """The texts of the site and the layout as they are."""
        return self._steps[self._at]

    @property
    def has_site(self) -> bool:
        """Whether there is a site yet."""
        return bool(self.current.site)

    @property
    def site(self) -> Site:
        """The site.

        Raises
        ------
        BadInput
            If there is none yet.
        """
        with self.lock:
            site, _ = self._parse(self.current)
        if site is None:
            raise BadInput("site", None, "import a survey first")
        return site

    @property
    def layout(self) -> Layout:
        """The layout; empty without barriers."""
        with self.lock:
            return self._parse(self.current)[1]

    @property
    def undoes(self) -> str:
        """What `undo` takes back, in words; empty if there is nothing."""
        return self.current.words if self._at > 0 else ""

    @property
    def redoes(self) -> str:
        """What `redo` does again, in words; empty if there is nothing."""
        later = self._steps[self._at + 1 :]
        return later[0].words if later else ""

    def change_site(self, change: Callable[[str], str], words: str) -> None:
        """Change the text of the site file.

        Parameters
        ----------
        change : callable
            Function of the present text that returns the new text, see `edits`.
        words : str
            What is done, for the history.

        Raises
        ------
        BadInput
            If the new text is not a valid site; nothing is changed then.
        Conflict
            If another program has changed a file.
        """
        with self.lock:
            now = self.current
            self._step(Snapshot(change(now.site), now.layout, words))

    def set_value(self, path: edits.Path, value: object, words: str = "") -> None:
        """Set one value of the site file; None removes it. See `change_site`."""
        self.set_values({tuple(path): value}, words or f"set {edits.dotted(path)}")

    def set_values(self, values: Mapping[tuple[str | int, ...], object], words: str) -> None:
        """Set several values of the site file; None removes one. See `change_site`."""
        self.change_site(lambda text: parts.with_values(text, self.site, values), words)

    def change_layout(self, layout: Layout, words: str) -> None:
        """Replace the layout; it may break siting rules.

        Raises
        ------
        Conflict
            If another program has changed a file.
        """
        with self.lock:
            self._step(Snapshot(self.current.site, layout_text(layout), words))

    def undo(self) -> None:
        """Take back the last change, if there is one.

        Raises
        ------
        Conflict
            If another program has changed a file.
        """
        self._go(-1)

    def redo(self) -> None:
        """Do again what was taken back last, if there is such a change.

        Raises
        ------
        Conflict
            If another program has changed a file.
        """
        self._go(1)

    def refresh(self) -> bool:
        """Read the files again if another program has changed them; return whether one had.

        The change is a step of the history, so that it can be undone.

        Raises
        ------
        BadInput
            If a file is no longer valid; the page keeps what it has.
        """
        with self.lock:
            texts = self._texts()
            if texts == self._disk:
                return False
            found = Snapshot(*texts, "changed by another program")
            self._parse(found)
            self._disk = texts
            self._push(found)
            return True

    def keep_mine(self) -> None:
        """Write the site and the layout of the page over what another program wrote."""
        with self.lock:
            self._disk = self._texts()
            self._write(self.current)

    @property
    def alternatives(self) -> dict[str, Layout]:
        """The layouts that were kept, by name; a file that is not a layout is left out."""
        found = {}
        for file in sorted((self.folder / ALTERNATIVES).glob("*.toml")):
            try:
                found[file.stem] = load_layout(file)
            except Error:
                continue
        return found

    def keep(self, name: str) -> Path:
        """Keep the layout as an alternative, and return its file.

        Raises
        ------
        BadInput
            If the name cannot be that of a file.
        """
        file = self._alternative(name)
        with atomic(file) as part:
            part.write_text(self.current.layout, encoding="utf-8")
        return file

    def take(self, name: str) -> None:
        """Make an alternative the layout.

        Raises
        ------
        BadInput
            If there is no such alternative.
        Conflict
            If another program has changed a file.
        """
        self.change_layout(load_layout(self._alternative(name)), f"took {name}")

    def drop(self, name: str) -> None:
        """Remove an alternative.

        Raises
        ------
        BadInput
            If the name cannot be that of a file.
        """
        self._alternative(name).unlink(missing_ok=True)

    def _alternative(self, name: str) -> Path:
        if not NAME.fullmatch(name):
            hint = "use letters, digits, spaces, commas, -, + and _, at most 60"
            raise BadInput("name of the alternative", name, hint)
        return self.folder / ALTERNATIVES / f"{name}.toml"

    def _texts(self) -> tuple[str, str]:
        """Return the texts of the site file and the layout file on disk; empty if missing."""
        site = read("site file", self.where.site) if self.where.site.is_file() else ""
        layout = read("layout", self._layout_file) if self._layout_file.is_file() else ""
        return site, layout

    def _parse(self, one: Snapshot) -> tuple[Site | None, Layout]:
        """Return the site and the layout of two texts; the last ones are remembered."""
        known = self._parsed
        if known is not None and known[:2] == (one.site, one.layout):
            return known[2], known[3]
        if known is not None and known[0] == one.site:
            site = known[2]
        else:
            site = Site.parse(one.site, self.where.site.name) if one.site else None
        layout = parse_layout(one.layout, LAYOUT) if one.layout.strip() else ()
        self._parsed = one.site, one.layout, site, layout
        return site, layout

    def _step(self, new: Snapshot) -> None:
        """Check a new state, write it and add it to the history."""
        now = self.current
        if (new.site, new.layout) == (now.site, now.layout):
            return
        self._parse(new)
        self._write(new)
        self._push(new)

    def _push(self, new: Snapshot) -> None:
        self._steps = [*self._steps[: self._at + 1], new][-KEPT:]
        self._at = len(self._steps) - 1
        self._write_history()
        self.revision += 1

    def _go(self, way: int) -> None:
        with self.lock:
            at = self._at + way
            if 0 <= at < len(self._steps):
                self._parse(self._steps[at])
                self._write(self._steps[at])
                self._at = at
                self._write_history()
                self.revision += 1

    def _write(self, new: Snapshot) -> None:
        """Write the files that differ, unless another program has changed one of them."""
        if self._texts() != self._disk:
            raise Conflict(
                "another program has changed a file of this project: read it again, or keep what "
                "the page shows"
            )
        for file, old, text in (
            (self.where.site, self._disk[0], new.site),
            (self._layout_file, self._disk[1], new.layout),
        ):
            if text != old:
                _put(file, text)
        self._disk = new.site, new.layout

    def _write_history(self) -> None:
        with atomic(self.folder / HISTORY) as part:
            part.write_bytes(msgspec.json.encode(_History(self._steps, self._at)))

    def _read_history(self, found: Snapshot) -> None:
        """Take up the history of an earlier server; a file that is not one is ignored."""
        file = self.folder / HISTORY
        if not file.is_file():
            return
        try:
            known = msgspec.json.decode(file.read_bytes(), type=_History)
        except (OSError, msgspec.DecodeError):
            return
        if not 0 <= known.at < len(known.steps):
            return
        self._steps, self._at = known.steps, known.at
        if (self.current.site, self.current.layout) != (found.site, found.layout):
            self._push(Snapshot(found.site, found.layout, "changed by another program"))


def layout_text(layout: Layout) -> str:
    """Return the text of a layout file; empty for no barriers."""
    return tomli_w.dumps({"barriers": to_tables(layout)}) if layout else ""


def _put(file: Path, text: str) -> None:
    """Write a file, or remove it if there is no text."""
    if not text:
        file.unlink(missing_ok=True)
        return
    with atomic(file) as part:
        part.write_text(text, encoding="utf-8")
