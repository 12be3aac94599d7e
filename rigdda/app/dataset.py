"""Data sets of outcomes: sites of a split with many layouts, one row per release, as Parquet.

The first layouts of a site are no barrier and the constants of `rigdda.agents.designers.constant`.
The others are, in turn, single barriers of the catalogue, random layouts (uniform in the decision
box) and neighbours of earlier layouts (another station or size of one barrier). All layouts of a
site have the same releases. There is one file per site, so that an interrupted run continues with
the next site.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
from pyarrow import parquet

from rigdda import MECHANICS, BadInput, Layout, Outcome, __version__, check, distribution, sites
from rigdda.agents.designers.constant import CONSTANTS, place
from rigdda.agents.designers.menu import Menu
from rigdda.agents.limits import JOB_RELEASES, SEED
from rigdda.agents.run_record import check_terms
from rigdda.barriers import to_tables
from rigdda.envs import DesignProblem
from rigdda.envs.forecast_table import joined
from rigdda.envs.observation import observe
from rigdda.files import atomic
from rigdda.seeds import derive, release_seeds

Tick = Callable[[int, str], None]

RECIPE = "dataset.json"
"""File that records the recipe of the parts of a folder."""

OUTCOMES = pa.schema(
    [
        ("site", pa.string()),
        ("layout_id", pa.int32()),
        ("origin", pa.string()),
        ("layout", pa.string()),
        ("kinds", pa.string()),
        ("barriers", pa.int8()),
        ("capital", pa.float64()),
        ("annual", pa.float64()),
        ("event", pa.string()),
        ("rate", pa.float64()),
        ("seed", pa.int64()),
        ("harm", pa.float64()),
        ("repair", pa.float64()),
        ("reached", pa.bool_()),
        ("failed", pa.bool_()),
        ("road_volume", pa.float64()),
        ("released_volume", pa.float64()),
        ("width", pa.float64()),
        ("debris_fraction", pa.float64()),
        ("max_energy_on_road", pa.float64()),
        ("slope_fraction", pa.float64()),
        ("held_fraction", pa.float64()),
        ("road_fraction", pa.float64()),
        ("beyond_fraction", pa.float64()),
        ("hits", pa.int32()),
        ("overtopped", pa.int32()),
        ("absorbed_energy", pa.float64()),
    ]
)
"""Columns of the outcomes, one row per release."""

PLACES = pa.schema(
    [
        ("site", pa.string()),
        ("nothing", pa.float64()),
        ("zone_start", pa.float64()),
        ("zone_end", pa.float64()),
        ("road_start", pa.float64()),
        ("observation", pa.list_(pa.float32())),
    ]
)
"""Columns of the sites, one row per site.

`observation` is that of the environments with `flat=True`: the arrays in alphabetical order."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a data set consists of.

    Parameters
    ----------
    split : str
        Split of the sites, see `rigdda.sites.split`.
    layouts : int
        Number of layouts of each site.
    releases : int
        Number of releases of each layout, over all events.
    seed : int
        Seed of the layouts and of the releases.
    max_barriers : int
        Largest number of barriers of a layout.
    """

    split: str
    layouts: int
    releases: int
    seed: int = 0
    max_barriers: int = 3

    def __post_init__(self) -> None:
        check.one_of("split", self.split, sites.SPLITS)
        check.integer("layouts", self.layouts, 1, JOB_RELEASES)
        check.integer("releases", self.releases, 1, JOB_RELEASES)
        check.integer("seed", self.seed, 0, SEED)
        check.integer("max_barriers", self.max_barriers, 1)

    def names(self, count: int) -> list[str]:
        """Return the names of the first sites.

        Raises
        ------
        BadInput
            If the split has fewer.
        """
        every = sites.split(self.split)
        return every[: check.integer("sites", count, 1, len(every))]


def write(recipe: Recipe, count: int, folder: Path, tick: Tick = lambda done, words: None) -> int:
    """Write the parts of a data set that are missing, and return the number of rows of all parts.

    Parameters
    ----------
    recipe : Recipe
        What the data set consists of.
    count : int
        Number of sites. A data set grows if it is written again with more.
    folder : path
        Folder with one part per site: outcomes/SITE.parquet and sites/SITE.parquet.
    tick : callable
        Called with the number of completed sites and a description.

    Raises
    ------
    BadInput
        If the folder contains another data set, or a number is outside its range.
    Diverged
        If a simulation diverges.
    """
    names = recipe.names(count)
    _check_folder(recipe, folder)
    missing = [name for name in names if not _files(folder, name)[1].is_file()]
    found = distribution.mapped(partial(part, recipe), missing)
    done = len(names) - len(missing)
    for name in missing:
        tick(done, name)
        for file, content in zip(_files(folder, name), next(found), strict=True):
            with atomic(file) as fresh:
                fresh.write_bytes(content)
        done += 1
    tick(done, "counting rows")
    return sum(len(_read(_files(folder, name)[0])) for name in names)


def _read(file: Path) -> pa.Table:
    """Read a part of a data set.

    Raises
    ------
    BadInput
        If the part is missing or damaged.
    """
    try:
        return parquet.read_table(file)
    except (OSError, pa.ArrowException) as error:
        hint = "this part is missing or damaged: remove the files of this site from outcomes/ and "
        hint += f"sites/, and repeat the command that wrote the data set ({str(error)[:80]})"
        raise BadInput("data set", str(file), hint) from None


def _files(folder: Path, name: str) -> tuple[Path, Path]:
    """Return the files of a site: its outcomes, and its row of the sites, which is written last."""
    return folder / "outcomes" / f"{name}.parquet", folder / "sites" / f"{name}.parquet"


def _check_folder(recipe: Recipe, folder: Path) -> None:
    """Record what a folder contains."""
    content = {**msgspec.to_builtins(recipe), "version": __version__, "mechanics": MECHANICS}
    file = folder / RECIPE
    if file.is_file():
        try:
            found = msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
        except msgspec.MsgspecError as error:
            hint = f"this is damaged: remove the data set, or name another folder ({error})"
            raise BadInput("data set", str(file), hint) from None
        check_terms(content, found, f"the data set in {folder}")
    with atomic(file) as fresh:
        fresh.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def part(recipe: Recipe, name: str) -> tuple[bytes, bytes]:
    """Return the Parquet files of the outcomes of a site and of its row of the sites."""
    problem = DesignProblem(name, recipe.max_barriers)
    own = derive(recipe.seed, *name.encode())
    seeds = release_seeds("search", own, recipe.releases)
    rows: list[dict[str, Any]] = []
    for i, (origin, layout) in enumerate(layouts(problem, recipe.layouts, own)):
        told = _of_layout(problem, layout, i, origin)
        evaluation = problem.evaluate(layout, seeds)
        pairs = zip(seeds, evaluation.outcomes, strict=True)
        rows += [{**told, **_of_outcome(problem, layout, o), "seed": seed} for seed, o in pairs]
    place = {
        "site": problem.site.name,
        "nothing": problem.nothing.objective,
        "zone_start": problem.zone.start,
        "zone_end": problem.zone.end,
        "road_start": problem.site.road.start,
        "observation": joined(observe(problem)).tolist(),
    }
    return _packed(rows, OUTCOMES), _packed([place], PLACES)


def _packed(rows: list[dict[str, Any]], schema: pa.Schema) -> bytes:
    """Return rows as a Parquet file."""
    file = io.BytesIO()
    parquet.write_table(pa.Table.from_pylist(rows, schema=schema), file, compression="zstd")
    return file.getvalue()


def layouts(problem: DesignProblem, count: int, seed: int) -> list[tuple[str, Layout]]:
    """Return different layouts of a problem, each with its origin.

    Origins are "nothing", "constant", "single", "random" and "neighbour". There may be fewer than
    `count` if the site has room for few.
    """
    rng, menu = np.random.default_rng(seed), Menu(problem)
    found: dict[Layout, str] = {(): "nothing"}
    for barrier, share in CONSTANTS:
        if barrier.kind in problem.kinds and len(found) < count:
            found.setdefault(place(menu, barrier, share), "constant")
    drawn = _drawn(problem, menu, rng, found)
    for _ in range(DRAWS_PER_LAYOUT * count):
        if len(found) >= count:
            break
        origin, layout = next(drawn)
        found.setdefault(layout, origin)
    return [(origin, layout) for layout, origin in found.items()]


DRAWS_PER_LAYOUT = 20
"""Number of draws per layout after which a site has no room for further layouts."""


def _drawn(
    problem: DesignProblem, menu: Menu, rng: np.random.Generator, known: dict[Layout, str]
) -> Iterator[tuple[str, Layout]]:
    """Yield layouts that are drawn in turn from the catalogue, at random and from neighbours."""
    lists = [menu.singles(kind) for kind in problem.kinds if kind != "wall"]
    lists = [singles for singles in lists if singles]
    step = (problem.zone.end - problem.zone.start) / 16.0
    while True:
        if lists:
            singles = lists[rng.integers(len(lists))]
            yield "single", (singles[rng.integers(len(singles))],)
        yield "random", problem.decode(rng.uniform(*problem.bounds))
        earlier = list(known)[rng.integers(len(known))]
        around = list(menu.neighbours(earlier, step, 1))
        if around:
            yield "neighbour", around[rng.integers(len(around))]


def _of_layout(problem: DesignProblem, layout: Layout, i: int, origin: str) -> dict[str, Any]:
    """Return the columns that are the same in all releases of a layout."""
    return {
        "site": problem.site.name,
        "layout_id": i,
        "origin": origin,
        "layout": json.dumps(to_tables(layout)),
        "kinds": "+".join(barrier.kind for barrier in layout),
        "barriers": len(layout),
        "capital": problem.site.capital(layout),
        "annual": problem.site.annual(layout),
    }


def _of_outcome(problem: DesignProblem, layout: Layout, outcome: Outcome) -> dict[str, Any]:
    """Return the columns of an outcome."""
    bill = problem.site.bill(layout, outcome)
    own = outcome.barriers
    same = (
        "reached", "road_volume", "released_volume", "width", "debris_fraction",
        "max_energy_on_road", "slope_fraction", "held_fraction", "road_fraction",
        "beyond_fraction",
    )  # fmt: skip
    return {
        "event": outcome.event,
        "rate": problem.site.rate(outcome.event, layout),
        "harm": bill.harm,
        "repair": bill.repair,
        "failed": any(barrier.failed for barrier in own),
        "hits": sum(barrier.hits for barrier in own),
        "overtopped": sum(barrier.overtopped for barrier in own),
        "absorbed_energy": sum(barrier.absorbed_energy for barrier in own),
        **{name: getattr(outcome, name) for name in same},
    }


def read(folder: Path | str) -> tuple[pa.Table, pa.Table]:
    """Return the tables of the outcomes and of the sites of a data set.

    Raises
    ------
    BadInput
        If the folder contains no data set, or a part of it is missing or damaged.
    """
    parts = [sorted((Path(folder) / name).glob("*.parquet")) for name in ("outcomes", "sites")]
    names = sorted({file.stem for own in parts for file in own})
    if not names:
        raise BadInput("data set", str(folder), "name a folder that `rigdda dataset` wrote")
    files = zip(*(_files(Path(folder), name) for name in names), strict=True)
    outcomes, places = (pa.concat_tables([_read(file) for file in own]) for own in files)
    return outcomes, places


def costs(outcomes: pa.Table) -> pa.Table:
    """Return Z of each layout: site, layout_id, layout, annual, z [EUR per m and year].

    Z is the annual cost of the barriers plus the sum over the events of rate times mean harm and
    repair. An event without releases is left out.
    """
    both = outcomes.append_column(
        "bill", pa.array(outcomes["harm"].to_numpy() + outcomes["repair"].to_numpy())
    )
    keys = ["site", "layout_id", "layout", "annual", "event", "rate"]
    means = both.group_by(keys).aggregate([("bill", "mean")])
    risk = pa.array(means["rate"].to_numpy() * means["bill_mean"].to_numpy())
    found = means.append_column("risk", risk).group_by(keys[:4]).aggregate([("risk", "sum")])
    z = pa.array(found["annual"].to_numpy() + found["risk_sum"].to_numpy())
    return (
        found.drop_columns(["risk_sum"])
        .append_column("z", z)
        .sort_by([("site", "ascending"), ("layout_id", "ascending")])
    )
