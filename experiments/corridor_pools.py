"""Stored outcomes of layouts, from which the experiments on corridors are computed.

For each site there are the layouts of a front, constants and the rule, each with the outcomes of
the same releases. The outcomes are kept in a folder, so that an interrupted computation continues.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

import msgspec

from rigdda import MECHANICS, Barrier, Ditch, Embankment, Fence, GravityWall, Layout, Outcome, sites
from rigdda.agents.designers import front, rule
from rigdda.agents.designers.constant import place
from rigdda.agents.designers.menu import Menu
from rigdda.barriers import from_table, to_tables
from rigdda.envs import DesignProblem
from rigdda.envs.outcome_cache import pack, unpack
from rigdda.files import atomic
from rigdda.seeds import release_seeds

FOLDER = Path("runs/corridor-pools")
"""Folder of the outcomes."""

CONSTANTS: dict[str, tuple[Barrier, float]] = {
    "small ditch": (Ditch(0.0, 1.2, 3.0), 1.0),
    "ditch": (Ditch(0.0, 2.5, 5.0), 1.0),
    "low embankment": (Embankment(0.0, 1.0, 1.0), 1.0),
    "embankment": (Embankment(0.0, 2.5, 1.0), 1.0),
    "low gravity wall": (GravityWall(0.0, 1.0, 1.0), 1.0),
    "gravity wall": (GravityWall(0.0, 2.0, 1.0), 1.0),
    "fence": (Fence(0.0, 3.0, energy_class=500), 0.5),
}
"""Barriers by name, each with its station as a fraction of the zone."""

SLOW = "shu-hwa"
"""Family of sites that are left out: a release of its jointed mass takes 450 ms."""

SEARCH = 1_000
"""Number of releases of the search for a front."""


class Pool:
    """Layouts of a site with the outcomes of the same releases.

    Parameters
    ----------
    site : str
        Name of the site.
    releases : int
        Number of releases of each layout.
    folder : path
        Folder of the outcomes.
    """

    def __init__(self, site: str, releases: int, folder: Path = FOLDER):
        self.problem = DesignProblem(site)
        self.seeds = tuple(release_seeds("report", 0, releases))
        self._folder = folder
        self._known: dict[Layout, list[Outcome]] = {}

    def outcomes(self, layout: Layout) -> list[Outcome]:
        """Return the outcomes of a layout, in the order of the seeds."""
        if layout not in self._known:
            self._known[layout] = self._read(layout)
        return self._known[layout]

    def _read(self, layout: Layout) -> list[Outcome]:
        """Return the stored outcomes of a layout, or simulate and store them."""
        file = self._file("outcomes", layout, self.seeds)
        if file.is_file():
            return unpack(file.read_bytes())
        found = list(self.problem.evaluate(layout, self.seeds).outcomes)
        with atomic(file) as part:
            part.write_bytes(pack(found))
        return found

    def front(self) -> tuple[Layout, ...]:
        """Return the layouts of the front, the cheapest first; the first one is no barrier."""
        file = self._file("front", SEARCH)
        if file.is_file():
            rows = msgspec.json.decode(file.read_bytes())
            return tuple(tuple(from_table("front", row) for row in layout) for layout in rows)
        found = front.layouts(self.problem, SEARCH)
        with atomic(file) as part:
            part.write_bytes(msgspec.json.encode([to_tables(layout) for layout in found]))
        return found

    def rule(self) -> Layout:
        """Return the layout of the engineering rule."""
        return rule.answer(self.problem).layout

    def constants(self) -> dict[str, Layout]:
        """Return the layouts of the constants by name; empty if one does not fit on the site."""
        menu = Menu(self.problem)
        found = {name: place(menu, *constant) for name, constant in CONSTANTS.items()}
        return found | {"mesh": tuple(menu.singles("mesh")[:1])}

    def _file(self, kind: str, *asked: object) -> Path:
        """Return the file of results that depend on the site and on some values."""
        key = msgspec.json.encode([MECHANICS, self.problem.key.hex(), *asked])
        self._folder.mkdir(parents=True, exist_ok=True)
        return self._folder / f"{kind}-{hashlib.sha256(key).hexdigest()[:24]}"


def family(site: str) -> str:
    """Return the family of a generated site of the kind random-N."""
    return sites.FAMILIES[int(site.rpartition("-")[2]) % len(sites.FAMILIES)]


@cache
def pools(split: str, count: int, releases: int, folder: Path = FOLDER) -> tuple[Pool, ...]:
    """Return the pools of the first sites of a split that are not of the family `SLOW`."""
    names = [name for name in sites.split(split) if family(name) != SLOW][:count]
    return tuple(Pool(name, releases, folder) for name in names)
