"""Origins of the values of a site file, as the comments in front of the values give them."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

from rigdda import Site
from rigdda.files import atomic

SURVEYED = "surveyed"
GIVEN = "given"
PLACEHOLDER = "placeholder: replace"
CHECK_DEFAULT = "default: check"
"""Origins of values."""


STORED_KEYS = {"return_period": "rate", "section_length": "rate", "volume": "area"}
"""Keys of the table "events" that are stored as others."""


class Mark(NamedTuple):
    """A value that is marked as a placeholder.

    Parameters
    ----------
    table : str
        Name of its table, such as "slope" or "sources"; empty at the top of the file.
    place : int
        Number of the table among those with this name.
    key : str
        Its key.
    """

    table: str
    place: int
    key: str

    @property
    def stored(self) -> Mark:
        """The same with the key that `Site.save` writes for it."""
        if self.table != "events":
            return self
        return self._replace(key=STORED_KEYS.get(self.key, self.key))

    @property
    def path(self) -> str:
        """The key with its table, such as "slope.toe"."""
        return f"{self.table}.{self.key}" if self.table else self.key


def marks(text: str) -> list[Mark]:
    """Return the values of a site file that are marked as placeholders.

    Templates of tables that are not used do not count.
    """
    found, marked = [], False
    for line, mark in _lines(text):
        if mark is None:
            marked = not _heads(line) and (marked or line.endswith(f"{PLACEHOLDER}."))
        elif marked:
            found.append(mark)
            marked = False
    return found


def placeholders(text: str) -> list[str]:
    """Return the paths of the values of a site file that are marked as placeholders."""
    return [mark.path for mark in marks(text)]


def marks_of(path: str | os.PathLike[str]) -> list[Mark]:
    """Return the values that are marked as placeholders in a site file; none if it is no file."""
    file = Path(path)
    if not file.is_file():
        return []
    return marks(file.read_text(encoding="utf-8", errors="replace"))


def save(site: Site, path: Path, marked: Collection[Mark]) -> None:
    """Write a site file in which some values are marked as placeholders."""
    site.save(path)
    if marked:
        stored = {mark.stored for mark in marked}
        text = with_marks(path.read_text(encoding="utf-8"), stored)
        with atomic(path) as part:
            part.write_text(text, encoding="utf-8")


def with_marks(text: str, marked: Collection[Mark]) -> str:
    """Return the text of a site file without comments, in which some values are placeholders."""
    out = []
    for line, mark in _lines(text):
        out += [f"# {PLACEHOLDER}."] if mark in marked else []
        out.append(line)
    return "\n".join(out) + "\n"


def _heads(line: str) -> re.Match[str] | None:
    """Return the match of a line that begins a table."""
    return re.fullmatch(r"\[+([^\[\]]+)\]+", line.strip())


def _lines(text: str) -> Iterator[tuple[str, Mark | None]]:
    """Yield each line of a site file, with its value if one begins in it."""
    table, counts = "", Counter[str]()
    for line in text.splitlines():
        if re.match(r"#\s*#", line):
            continue
        if head := _heads(line):
            table = head[1]
            counts[table] += 1
        key = re.match(r"([\w-]+)\s*=", line)
        yield line, Mark(table, max(counts[table] - 1, 0), key[1]) if key else None


def accepted(text: str) -> str:
    """Return the text of a site file in which the placeholders are marked as given values."""
    lines = text.split("\n")
    return "\n".join(given(line) if re.match(r"#(?!\s*#)", line) else line for line in lines)


def given(comment: str) -> str:
    """Return the comment of a placeholder as that of a given value."""
    end = f"{PLACEHOLDER}."
    return comment.removesuffix(end) + f"{GIVEN}." if comment.endswith(end) else comment
