"""Outcomes of short runs, which are the same to nine digits on every type of machine.

Processors differ in the last bit of a result, for example because some round a product and a sum
together. Collisions amplify such a difference, by a factor of ten or more each, until nothing but
statistics remains. These runs end before: between a processor that fuses products and sums and one
that does not (`NUMBA_CPU_NAME=generic`), they differ by 2e-11 at most.

They tell within seconds, and anywhere, whether results have changed and `rigdda.MECHANICS` has not.
`python -m experiments.outcomes --record` records them (`results/outcomes/short_outcomes.csv`).
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from experiments.script import write
from rigdda import Ditch, Embankment, Fence, Forest, GravityWall, Layout, Outcome, Site
from rigdda.envs.cost import judge
from rigdda.model.site_tables import Drawn
from rigdda.releases import Batch
from rigdda.validation.case import evaluate
from rigdda.validation.suite import CASES

TABLE = Path("outcomes/short_outcomes.csv")
"""The record, relative to the folder of results."""

TOLERANCE = 1e-9
"""Difference of a quantity, relative to its value or to 1, up to which it is the same."""

LAYOUTS: dict[str, Layout] = {
    "nothing": (),
    "fence": (Fence(20.0, 2.0, energy_class=100),),
    "embankment": (Embankment(27.0, 2.0, 1.0),),
    "embankment of talus": (Embankment(82.0, 3.0, 1.5),),
    "ditch": (Ditch(29.5, 1.0, 4.0),),
    "gravity wall": (GravityWall(31.0, 2.0, 1.0),),
}

RELEASES: tuple[tuple[str, str, str, tuple[int, ...], float], ...] = (
    ("shu-hwa", "nothing", "block, top", (0, 1, 2), 3.0),
    ("shu-hwa", "nothing", "large block, top", (1, 2), 20.0),
    ("shu-hwa", "nothing", "block, lower", (0, 2, 3), 20.0),
    ("shu-hwa", "nothing", "group", (1, 2), 5.0),
    ("talus", "nothing", "block, cliff", (0, 1), 3.0),
    ("talus", "nothing", "group", (1,), 3.0),
    ("talus", "embankment of talus", "block, talus", (2, 3), 20.0),
    ("talus", "embankment of talus", "large, cliff", (1,), 20.0),
    ("quick", "nothing", "block", (0, 1), 20.0),
    ("quick", "nothing", "group", (1,), 3.0),
    ("quick", "fence", "block", (0, 1, 2), 3.0),
    ("quick", "fence", "block", (0,), 20.0),
    ("quick", "embankment", "block", (0, 1), 20.0),
    ("quick", "ditch", "block", (0, 1), 3.0),
    ("quick", "gravity wall", "block", (0, 1), 5.0),
    ("wooded", "nothing", "block", (0, 1, 3), 5.0),
)
"""Site, layout, event, seeds and duration [s] of the releases."""

DRAWN, GENERATED = range(100, 104), ("bench-7", "cliff-8", "talus-9", "verge-10")
"""Seeds of releases that are drawn and not simulated, and sites that are generated."""

CASE_NAMES = (
    "slide-35-34-2s", "joints-35-20", "joint-shear", "16-gon", "tipping", "restitution-0.5",
    "crest-blocks", "wall-slides", "wall-overturns", "fence-eccentric", "bolt-drop", "arch-falls",
)  # fmt: skip
"""Cases of `rigdda.validation`."""


def numbers(value: Any) -> list[float]:
    """Return all numbers in nested sequences, in order; None is left out."""
    if isinstance(value, list | tuple | np.ndarray):
        return [number for part in value for number in numbers(part)]
    return [] if value is None else [float(value)]


def load(name: str) -> Site:
    """Return a site by name; `wooded` is `quick` with a forest."""
    if name != "wooded":
        return Site.load(name)
    wood = Forest(8.0, 30.0, stems=500.0, dbh=0.3)
    return msgspec.structs.replace(Site.load("quick"), forest=(wood,))


def releases(
    name: str, layout: str, event: str, seeds: Sequence[int], duration: float
) -> list[float]:
    """Return numbers of the outcomes of releases."""
    site = load(name)
    motion = msgspec.structs.replace(site.motion, duration=duration)
    batch = Batch(msgspec.structs.replace(site, motion=motion), LAYOUTS[layout])
    return numbers([_of_outcome(batch.outcome(seed, event)) for seed in seeds])


def _of_outcome(o: Outcome) -> tuple[Any, ...]:
    barriers = [(b.hits, b.max_energy, b.absorbed_energy, b.impact_heights, b.overtopped, b.caught,
                 b.displacement, b.thrust, b.left_height) for b in o.barriers]  # fmt: skip
    parts = o.slope_fraction, o.held_fraction, o.road_fraction, o.beyond_fraction
    road = o.road_volume, o.max_energy_on_road
    return o.released_mass, road, o.reach, o.run_out, parts, barriers


def drawn(site: Site, event: str) -> list[float]:
    """Return numbers of releases that are not simulated."""
    return numbers([_of_drawn(site.draw(seed, event)) for seed in DRAWN])


def _of_drawn(found: Drawn) -> tuple[Any, ...]:
    corners = np.concatenate([block.vertices for block in found.blocks])
    return (
        found.width,
        found.friction_deg,
        len(found.blocks),
        corners[[0, -1]],
        corners.mean(axis=0),
    )


def generated(site: Site) -> list[float]:
    """Return numbers of a site."""
    rock = [(s.friction_deg, s.restitution, s.rolling) for s in site.surfaces.values()]
    prices = site.prices.removal, site.consequences.closure
    zone, road = site.barrier_zone, site.road
    ends = zone.start, zone.end, road.start, road.end
    return numbers([site.slope.points, ends, rock, prices, [(e.rate, e.area) for e in site.events]])


def costs(site: Site, layout: Layout) -> list[float]:
    """Return the evaluation of a layout for invented outcomes of every event."""
    usual, outcomes = Batch(site, layout).outcome(0, "block"), list[Outcome]()
    for event in site.event_names:
        for i in range(4):
            volume = 7.0 * i / 3.0
            outcomes.append(replace(usual, event=event, road_volume=volume, reached=i > 0))
    z = judge(site, layout, outcomes, {}, {})
    return numbers([z.objective, z.capital, z.harm, z.repair, z.cost, z.debris])


def computed() -> Iterator[tuple[str, list[float]]]:
    """Yield the description and the numbers of every computation."""
    for name, layout, event, seeds, duration in RELEASES:
        what = f"{name}, {layout}, {event}, seeds {seeds}, {duration:g} s"
        yield what, releases(name, layout, event, seeds, duration)
    for name in ("shu-hwa", "talus", "quick"):
        site = Site.load(name)
        for event in site.event_names:
            yield f"rock of {name}, {event}", drawn(site, event)
    for name in GENERATED:
        yield f"site {name}", generated(Site.load(name))
    for name in ("fence", "gravity wall"):
        yield f"costs of quick, {name}", costs(Site.load("quick"), LAYOUTS[name])
    for case in CASES:
        if case.name in CASE_NAMES:
            yield f"case {case.name}", [result.computed for result in evaluate(case)]


def record(out: Path) -> None:
    """Record the numbers."""
    rows = [{"what": what, "numbers": " ".join(map(repr, found))} for what, found in computed()]
    write(out / TABLE, rows)


def recorded(out: Path) -> dict[str, list[float]]:
    """Return the recorded numbers, empty without a record."""
    path = out / TABLE
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {row["what"]: list(map(float, row["numbers"].split())) for row in rows}


def changed(out: Path) -> list[str]:
    """Return the descriptions of recorded computations whose numbers have changed."""
    now = dict(computed())
    return [
        what
        for what, known in recorded(out).items()
        if len(now.get(what, ())) != len(known)
        or not np.allclose(now[what], known, rtol=TOLERANCE, atol=TOLERANCE, equal_nan=True)
    ]
