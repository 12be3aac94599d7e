"""The frozen specification of the exam, and the recorded references to which scores refer."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec

from rigdda import MECHANICS, BadInput, Corridor, Layout, Site, check, fields
from rigdda.agents.limits import SEED
from rigdda.app.exam.messages import TaskOrder
from rigdda.barriers import from_table, to_tables
from rigdda.envs import DesignProblem
from rigdda.fields import about
from rigdda.files import atomic, read
from rigdda.model.corridor import CorridorSection

SHIPPED = Path(__file__).parent / "specification.toml"
"""Specification that ships with the package."""


class ExamCorridor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A corridor of the exam."""

    name: Annotated[str, about("Name of the corridor.")]
    money: Annotated[float, about("Budget per metre of road.", "EUR/m", gt=0.0)]
    sites: Annotated[tuple[str, ...], about("Sites of the sections.", least=1)]
    lengths: Annotated[tuple[float, ...], about("Lengths of the sections.", "m", least=1)]

    def corridor(self) -> Corridor:
        """Return the corridor with its budget for construction [EUR]."""
        pairs = zip(self.sites, self.lengths, strict=True)
        sections = tuple(CorridorSection(Site.load(name), at, name) for name, at in pairs)
        return Corridor(self.name, sections, (self.money * sum(self.lengths),))


class Specification(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The exam: sites, corridors, budgets, and the mechanics of the references."""

    version: Annotated[int, about("Version of the exam.", least=None)]
    mechanics: Annotated[str, about("Version of the mechanics that computed the references.")]
    budgets: Annotated[tuple[int, ...], about("Releases that an entry may use per section.")]
    verification: Annotated[int, about("Releases for the verification of each layout.", ge=10)]
    max_barriers: Annotated[int, about("Largest number of barriers of a layout.", ge=1)]
    references: Annotated[str, about("JSON file with the references, beside this file.")]
    reference_releases: Annotated[int, about("Releases of the search for a reference.", ge=200)]
    sites: Annotated[tuple[str, ...], about("Names or files of the sites.", least=1)]
    corridors: Annotated[tuple[ExamCorridor, ...], about("The corridors.")] = ()

    @property
    def current(self) -> bool:
        """Whether this installation has the mechanics of the references."""
        return self.mechanics == MECHANICS

    @property
    def key(self) -> str:
        """Hash of all values that determine the releases.

        The references are left out, so that better ones do not change the releases of the
        verification.
        """
        own = msgspec.structs.asdict(self)
        for name in ("references", "reference_releases"):
            del own[name]
        return hashlib.sha256(msgspec.json.encode(own)).hexdigest()[:16]

    @property
    def content(self) -> str:
        """Hash of all sites, including those of the corridors: they may be files that change."""
        names = [*self.sites, *(site for road in self.corridors for site in road.sites)]
        keys = [self.problem(name).key for name in names]
        return hashlib.sha256(b"".join(keys)).hexdigest()[:16]

    def problem(self, site: str) -> DesignProblem:
        """Return the design problem of a site."""
        return DesignProblem(site, self.max_barriers)


class Anchor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Recorded values of a site or corridor to which its score refers.

    Parameters
    ----------
    layouts : list of layouts
        The reference, one layout for each section, as the tables of layout files.
    reference, reference_ci : float, (float, float)
        Annual cost of the reference on releases that no search used, and its 95 % interval.
        [EUR per metre and year] for a site, [EUR/year] for a corridor.
    random : float
        Mean annual cost of random layouts, in the same unit.
    nothing : float
        Annual cost without barriers, in the same unit.
    releases : int
        Number of releases per section that the search for the reference might use. If it is below
        `Specification.reference_releases`, the reference is provisional.
    """

    layouts: list[list[dict[str, Any]]]
    reference: float
    reference_ci: tuple[float, float]
    random: float
    nothing: float
    releases: int

    def built(self) -> tuple[Layout, ...]:
        """Return the layouts of the reference."""
        return tuple(
            tuple(from_table(f"layouts[{i}]", table) for table in own)
            for i, own in enumerate(self.layouts)
        )


def tables(layouts: tuple[Layout, ...]) -> list[list[dict[str, Any]]]:
    """Return layouts as the tables of layout files."""
    return [to_tables(layout) for layout in layouts]


class References(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The recorded references of a specification, by name of the site or corridor."""

    mechanics: str
    anchors: dict[str, Anchor]

    def provisional(self, specification: Specification) -> list[str]:
        """Return the names of the references whose search had fewer releases than specified."""
        least = specification.reference_releases
        return [name for name, anchor in self.anchors.items() if anchor.releases < least]

    def save(self, path: Path) -> None:
        """Write the references to a JSON file."""
        with atomic(path) as part:
            part.write_bytes(msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n")


def load(path: str | os.PathLike[str] | None = None) -> Specification:
    """Return the specification in a TOML file, by default the one that ships with the package.

    Raises
    ------
    BadInput
        If the file is missing or invalid.
    """
    file = SHIPPED if path is None else Path(path)
    found = fields.read(Specification, fields.parse("spec", str(file), read("spec", file)))
    if not found.budgets or any(budget < 0 for budget in found.budgets):
        raise BadInput("budgets", found.budgets, "give at least one number of releases from 0")
    for corridor in found.corridors:
        if len(corridor.sites) != len(corridor.lengths):
            hint = f"give {len(corridor.sites)}, one for each site"
            raise BadInput("corridors.lengths", corridor.lengths, hint)
    return found


def file_of_references(
    specification: Specification, path: str | os.PathLike[str] | None = None
) -> Path:
    """Return the file of references, which is beside the file of the specification."""
    return (SHIPPED if path is None else Path(path)).parent / specification.references


def references(
    specification: Specification, path: str | os.PathLike[str] | None = None
) -> References:
    """Return the recorded references of a specification.

    Raises
    ------
    BadInput
        If the file is missing or invalid.
    """
    file = file_of_references(specification, path)
    hint = "record it: python -m experiments.exam_reference --spec FILE"
    try:
        return msgspec.json.decode(file.read_bytes(), type=References)
    except OSError as error:
        raise BadInput("references", str(file), f"{hint} ({error.strerror})") from None
    except msgspec.MsgspecError as error:
        raise BadInput("references", str(file), f"{hint} ({error})") from None


class ExamPart(msgspec.Struct, frozen=True):
    """The part of an exam that is run.

    Parameters
    ----------
    specification : Specification
        The exam.
    sites, corridors : int
        Number of sites and of corridors, the first ones.
    budgets : tuple of int
        Releases per section.
    verification : int
        Releases of each layout.
    seed : int
        Seed of the tasks.
    """

    specification: Specification
    sites: int
    corridors: int
    budgets: tuple[int, ...]
    verification: int
    seed: int

    @property
    def complete(self) -> bool:
        """Whether the results may enter the leaderboard.

        Nothing but budgets may be left out, and the seed must be 0: the best of several seeds would
        be better by chance.
        """
        whole = self.specification
        return (
            whole.current
            and self.sites == len(whole.sites)
            and self.corridors == len(whole.corridors)
            and set(self.budgets) <= set(whole.budgets)
            and self.verification >= whole.verification
            and self.seed == 0
        )

    def orders(self, budget: int) -> list[TaskOrder]:
        """Return the tasks with a budget."""
        whole, most = self.specification, self.specification.max_barriers
        found = [
            TaskOrder(site, [site], [1.0], None, most, budget, self.seed)
            for site in whole.sites[: self.sites]
        ]
        for corridor in whole.corridors[: self.corridors]:
            money = corridor.money * sum(corridor.lengths)
            lists = list(corridor.sites), list(corridor.lengths)
            found.append(TaskOrder(corridor.name, *lists, money, most, budget, self.seed))
        return found

    @property
    def size(self) -> int:
        """Number of tasks."""
        return len(self.budgets) * (self.sites + self.corridors)


def part(
    specification: Specification,
    sites: int | None = None,
    corridors: int | None = None,
    budgets: Sequence[int] = (),
    verification: int | None = None,
    seed: int = 0,
) -> ExamPart:
    """Return a part of an exam, by default all of it.

    If only `sites` is given, no corridor is used.

    Raises
    ------
    BadInput
        If a number is outside its range.
    """
    most = len(specification.sites), len(specification.corridors)
    count = most[0] if sites is None else check.integer("sites", sites, 1, most[0])
    usual = most[1] if sites is None else 0
    roads = usual if corridors is None else check.integer("corridors", corridors, 0, most[1])
    asked = sorted({check.integer("budget", b, 0) for b in budgets or specification.budgets})
    drawn = specification.verification if verification is None else verification
    return ExamPart(
        specification, count, roads, tuple(asked), check.integer("verify", drawn, 10),
        check.integer("seed", seed, 0, SEED),
    )  # fmt: skip


def check_references(asked: ExamPart, references: References) -> None:
    """Check that there is a reference for each task.

    Raises
    ------
    BadInput
        If one is missing, or random layouts are as good as it.
    """
    for order in asked.orders(asked.budgets[0]):
        anchor = references.anchors.get(order.name)
        if anchor is None or not anchor.reference < min(anchor.random, anchor.nothing):
            hint = "record one that is better: python -m experiments.exam_reference"
            raise BadInput("references", order.name, hint)
