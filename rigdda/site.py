"""What an engineer knows about a site, as a TOML file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import shapely
import tomli_w

from rigdda import check, sites
from rigdda.barriers import (
    Barrier,
    Ditch,
    Earthwork,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    as_layout,
    earthworks,
    from_table,
    section,
    to_tables,
)
from rigdda.errors import BadInput
from rigdda.files import atomic, read
from rigdda.geometry import overlap
from rigdda.scene import Block, Scene, Surface
from rigdda.settings import Settings
from rigdda.source import NEAR, Point, Source
from rigdda.terrain import Terrain

STEEPEST_DEG = 85.0
"""Friction angle up to which scatter may raise that of a surface [deg]."""


class Slope(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The ground: corners from the crest down to beyond the road, x growing downhill [m].

    It may have overhangs, as the base of a toppling slope has; earthworks need ground without.
    `surface` names the surface of every segment, `toe` is the chainage where the slope ends [m].
    """

    points: tuple[Point, ...]
    toe: float
    surface: str = "rock"


class Road(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The road: chainage of its uphill and its downhill edge [m]."""

    start: float
    end: float


class BarrierZone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where barriers may stand [m] and how large they may be.

    Height of all kinds but ditches [m]; thickness of walls, the width of an embankment's crest
    included [m]; capacity of fences [J per metre of width]; depth and width of ditches [m].
    """

    start: float
    end: float
    max_height: float = 4.0
    min_thickness: float = 0.5
    max_thickness: float = 2.0
    min_capacity: float = 1e5
    max_capacity: float = 5e6
    max_depth: float = 2.0
    min_width: float = 2.0
    max_width: float = 6.0


class Costs(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Prices of barriers per metre of slope width, in relative units: a user's table.

    ============  =========================================================================
    wall          (base + square height^2) (1 + thickness) / 2: it rises faster than height
    gravity wall  base + gravity_wall height thickness: by its concrete
    fence         base + fence height^2 (capacity / 1 MJ)^0.45: posts bend as height^2
    ditch         base + ditch area: by what is dug out [m2]
    embankment    base + embankment area: by what is filled in [m2]
    ============  =========================================================================

    All times `off_toe` uphill of the toe, where access is dear. `limit` is the budget of a layout.
    Prices of fences rise about as E^0.45 (150, 270, 430, 600 per m2 at 0.25, 1, 3, 5 MJ, from
    memory); the others are plausible beside them: one unit is what a square metre of a 1 MJ fence
    costs that is 3 m high.
    """

    base: float = 1.0
    square: float = 1.0
    off_toe: float = 1.5
    limit: float = 40.0
    gravity_wall: float = 1.5
    fence: float = 0.35
    ditch: float = 0.5
    embankment: float = 0.3


class Motion(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How releases are computed: damping [1/s], simulated time [s] and time step [s]."""

    damping: float = 0.0
    damping_when: str = "always"
    duration: float = 25.0
    dt: float = 5e-3


class Scatter(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What varies at random from release to release, beside the joints.

    Standard deviation of the friction angles [deg], all surfaces together.
    """

    friction_deg: float = 0.0


class Site(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A slope, its loose rock, the road below, and where barriers may stand.

    Raises
    ------
    BadInput
        If a field is unknown, of the wrong type or at odds with another; the message names it.
    """

    name: str
    description: str
    slope: Slope
    source: Source
    road: Road
    barrier_zone: BarrierZone
    surfaces: dict[str, Surface]
    costs: Costs = Costs()
    motion: Motion = Motion()
    scatter: Scatter = Scatter()

    def __post_init__(self) -> None:
        self._check_slope()
        self._check_source()
        self._check_zone()
        for group, label in ((self.costs, "costs"), (self.motion, "motion")):
            for field in group.__struct_fields__:
                value = getattr(group, field)
                if field != "damping_when":
                    check.number(f"{label}.{field}", value, 0.0)
        check.number("costs.limit", self.costs.limit, 0.0, open_low=True)
        check.one_of("motion.damping_when", self.motion.damping_when, ("always", "contact"))
        check.number("motion.duration", self.motion.duration, 0.0, open_low=True)
        check.number("scatter.friction_deg", self.scatter.friction_deg, 0.0, 10.0)
        self.settings()

    def _check_slope(self) -> None:
        points = check.points("slope.points", self.slope.points, 2)
        x, (low, high) = points[:, 0], points[[0, -1], 0]
        if not (low < high and (low <= x).all() and (x <= high).all()) or (
            points[0, 1] <= points[-1, 1]
        ):
            raise BadInput(
                "slope.points",
                f"{len(points)} points",
                "list them downhill, the one of least x first, the one of greatest x last",
            )
        check.number("slope.toe", self.slope.toe, low, high)
        check.number("road.start", self.road.start, low, high)
        check.number("road.end", self.road.end, low, high)
        if self.road.end <= self.road.start:
            raise BadInput("road.end", self.road.end, f"put it beyond road.start {self.road.start}")
        for where, name in (("slope", self.slope.surface), ("source", self.source.surface)):
            check.one_of(f"{where}.surface", name, self.surfaces)

    def _check_source(self) -> None:
        chain = self.profile.points
        deep = chain[:, 1].min() - 1.0
        ground = shapely.Polygon([*chain, (chain[-1, 0], deep), (chain[0, 0], deep)])
        for where, piece in self.source.pieces():
            rock = shapely.Polygon(piece)
            left, _, right, _ = rock.bounds
            if left < chain[0, 0]:
                raise BadInput(where, piece, f"put it beyond the crest at {chain[0, 0]:g}")
            if right >= self.road.start:
                raise BadInput(where, piece, f"put it uphill of the road at {self.road.start:g}")
            sunk = overlap(rock, ground)
            if sunk > NEAR * rock.length:
                corners = shapely.points(piece)
                depth = shapely.distance(ground.exterior, corners) * ground.contains(corners)
                corner = int(depth.argmax())
                raise BadInput(
                    f"{where}[{corner}]",
                    piece[corner],
                    f"raise it out of the ground, in which {sunk:g} m2 of the rock are",
                )

    def _check_zone(self) -> None:
        zone = self.barrier_zone
        check.number("barrier_zone.start", zone.start, self.slope.points[0][0])
        check.number("barrier_zone.end", zone.end, zone.start, self.road.start, open_low=True)
        check.number("barrier_zone.max_height", zone.max_height, 0.5, open_low=True)
        check.number("barrier_zone.min_thickness", zone.min_thickness, 0.0, open_low=True)
        check.number("barrier_zone.max_thickness", zone.max_thickness, zone.min_thickness)
        check.number("barrier_zone.min_capacity", zone.min_capacity, 0.0, open_low=True)
        check.number("barrier_zone.max_capacity", zone.max_capacity, zone.min_capacity)
        check.number("barrier_zone.max_depth", zone.max_depth, 0.5, open_low=True)
        check.number("barrier_zone.min_width", zone.min_width, 0.0, open_low=True)
        check.number("barrier_zone.max_width", zone.max_width, zone.min_width)
        ground, corners = self.profile, {float(x) for x, _ in self.slope.points}
        x = sorted({zone.start, zone.end} | {at for at in corners if zone.start < at < zone.end})
        foot = [(at, ground.height(at)) for at in x]
        over = [(at, y + zone.max_height) for at, y in reversed(foot)]
        room = shapely.Polygon([*foot, *over])
        for where, piece in self.source.pieces():
            taken = shapely.intersection(room, shapely.Polygon(piece))
            if taken.area > NEAR * taken.length:
                mend = f"put it beyond {taken.bounds[2]:g}: {where} is where barriers may stand"
                raise BadInput("barrier_zone.start", zone.start, mend)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Site:
        """Read a site from a TOML file, or a built-in one by its name.

        Raises
        ------
        BadInput
            If there is no such file or name, or the file is not a sound site.
        """
        if not isinstance(source, str | os.PathLike):
            raise BadInput("site", source, "name a TOML file or a built-in site")
        path = Path(source)
        if path.suffix == ".toml" or path.is_file():
            if not path.is_file():
                raise BadInput("site", str(source), "name an existing TOML file")
            text = read("site file", path)
        else:
            text = sites.text(check.one_of("site", str(source), sites.names()))
        try:
            return msgspec.toml.decode(text, type=cls)
        except msgspec.ValidationError as error:
            if isinstance(error.__cause__, BadInput):
                raise error.__cause__ from None
            raise BadInput("site file", str(source), str(error)) from None
        except (msgspec.DecodeError, RecursionError) as error:
            raise BadInput("site file", str(source), f"mend its TOML: {error}") from None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the site as TOML; `load` gives it back."""
        with atomic(path) as part:
            part.write_text(tomli_w.dumps(msgspec.to_builtins(self)), encoding="utf-8")

    @property
    def profile(self) -> Terrain:
        """The ground as a terrain."""
        return _ground(tuple(map(tuple, self.slope.points)), self.slope.surface)

    def settings(self) -> Settings:
        """Return the numerical settings of this site's releases."""
        return Settings(dt=self.motion.dt)

    def realise(self, layout: Sequence[Barrier] = (), seed: int = 0) -> Scene:
        """Return the scene of one release: the joints and friction that `seed` draws.

        The release is the same for every layout.

        Raises
        ------
        BadInput
            If a barrier does not stand on the slope or the seed is not a whole number >= 0.
        """
        shift, blocks = _drawn(msgspec.json.encode(self.source), check.integer("seed", seed, 0))
        shift *= self.scatter.friction_deg
        return Scene(
            terrain=self.profile,
            blocks=blocks,
            surfaces={
                name: Surface(
                    min(max(s.friction_deg + shift, 0.0), max(s.friction_deg, STEEPEST_DEG)),
                    s.cohesion,
                    s.tension,
                    s.restitution,
                )
                for name, s in self.surfaces.items()
            },
            barriers=as_layout(layout),
            damping=self.motion.damping,
            damping_when=self.motion.damping_when,
        )

    def cost(self, layout: Sequence[Barrier]) -> float:
        """Return the price of a layout per metre of slope width, in the units of `costs`.

        Raises
        ------
        BadInput
            If a ditch or an embankment does not fit.
        """
        standing = as_layout(layout)
        _, moved = earthworks(self.profile, standing, self.slope.surface)
        off_toe = self.costs.off_toe
        return float(
            sum(
                self._price(b, section(moved[b]) if isinstance(b, Earthwork) else 0.0)
                * (off_toe if b.x < self.slope.toe else 1.0)
                for b in standing
            )
        )

    def _price(self, barrier: Barrier, area: float) -> float:
        """Return the price of a barrier at the toe; `area` of earth is moved for it [m2]."""
        c = self.costs
        match barrier:
            case GravityWall():
                return c.base + c.gravity_wall * barrier.height * barrier.thickness
            case Fence():
                return c.base + c.fence * barrier.height**2 * (barrier.capacity / 1e6) ** 0.45
            case Ditch():
                return c.base + c.ditch * area
            case Embankment():
                return c.base + c.embankment * area
        return (c.base + c.square * barrier.height**2) * (1.0 + barrier.thickness) / 2.0


@lru_cache(maxsize=256)
def _ground(points: tuple[Point, ...], surface: str) -> Terrain:
    """Return the terrain of a slope; it is asked for several times in every episode."""
    return Terrain(points, (surface,) * (len(points) - 1))


@lru_cache(maxsize=4096)
def _drawn(source: bytes, seed: int) -> tuple[float, tuple[Block, ...]]:
    """Return what a seed draws: a standard normal number and the blocks of a source, as JSON.

    Cutting takes as long as simulating a small release, and a search asks for the same releases
    again and again; one takes about 10 kB.
    """
    rng, rock = np.random.default_rng(seed), msgspec.json.decode(source, type=Source)
    normal = rng.standard_normal()
    cells = rock.draw(rng)
    return normal, tuple(Block(c, density=rock.density, surface=rock.surface) for c in cells)


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Read a layout from a TOML or JSON file with one table `barriers` a barrier.

    Each table has the parameters of its class, and `kind` = "wall" (the default), "gravity_wall",
    "fence", "ditch" or "embankment".

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput("layout", str(path), "name an existing TOML or JSON file")
    decode = msgspec.json.decode if file.suffix == ".json" else msgspec.toml.decode
    try:
        tables = decode(read("layout", file), type=_LayoutFile).barriers
        return tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(tables))
    except msgspec.ValidationError as error:
        raise BadInput("layout", str(path), str(error)) from None
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadInput("layout", str(path), f"mend the file: {error}") from None


def save_layout(layout: Sequence[Barrier], path: str | os.PathLike[str]) -> None:
    """Write a layout as TOML, or as JSON if the path ends in .json."""
    data = {"barriers": to_tables(as_layout(layout))}
    with atomic(path) as part:
        if str(path).endswith(".json"):
            part.write_bytes(msgspec.json.format(msgspec.json.encode(data)))
        else:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")


class _LayoutFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    barriers: tuple[dict[str, Any], ...] = ()
