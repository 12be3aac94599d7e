"""Files of studies: a site, releases, and named layouts."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

import rigdda
from rigdda import BadInput, Layout, Site, check
from rigdda.agents import limits
from rigdda.barriers import from_table
from rigdda.files import read
from rigdda.mistyped import mistyped


@dataclass(frozen=True, slots=True)
class Study:
    """Named layouts on one site.

    Parameters
    ----------
    site : Site
        Where.
    releases : int
        Releases of each event with each layout.
    layouts : dict of str to Layout
        What stands, by its name.
    """

    site: Site
    releases: int
    layouts: dict[str, Layout]

    @property
    def size(self) -> int:
        """Releases in all."""
        return self.releases * len(self.layouts) * len(self.site.events)


class _LayoutTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    name: str
    barriers: tuple[dict[str, Any], ...] = ()
    file: str | None = None


class _StudyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    site: str
    layouts: tuple[_LayoutTable, ...]
    releases: int = 16


def load(path: str | os.PathLike[str]) -> Study:
    """Read a study from a TOML file; files that it names lie relative to it.

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput("study", str(path), "name an existing TOML file")
    try:
        data = msgspec.toml.decode(read("study", file), type=_StudyFile)
    except msgspec.ValidationError as error:
        bad = mistyped(str(error), msgspec.toml.decode(read("study", file)))
        raise bad or BadInput("study", str(path), str(error)) from None
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadInput("study", str(path), f"mend its TOML: {error}") from None
    near = file.parent / data.site
    site = Site.load(near if near.suffix == ".toml" else data.site)
    layouts: dict[str, Layout] = {}
    for i, table in enumerate(data.layouts):
        if table.name in layouts or not table.name:
            raise BadInput(f"layouts[{i}].name", table.name, "give each layout a name of its own")
        try:
            layouts[table.name] = _layout(table, file.parent)
            site.realise(layouts[table.name])  # what cannot be built is said before all
            check.number("capital", site.capital(layouts[table.name]))
        except BadInput as bad:
            raise BadInput(f"layouts[{i}].{bad.field}", bad.value, bad.mend) from None
    if not layouts:
        raise BadInput("layouts", 0, "give at least one table [[layouts]]")
    most = limits.RELEASES // len(layouts) // len(site.events)
    releases = check.integer("releases", data.releases, 1, most)
    return Study(site, releases, layouts)


def _layout(table: _LayoutTable, folder: Path) -> Layout:
    """Return the layout of one table."""
    if table.file is None:
        return tuple(from_table(f"barriers[{i}]", row) for i, row in enumerate(table.barriers))
    if table.barriers:
        raise BadInput("file", table.file, "give either a file or barriers, not both")
    return rigdda.load_layout(folder / table.file)
