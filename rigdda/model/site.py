"""Site: the description of a slope and a road, its releases, its prices and its file format."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
import tomli_w
from numpy.typing import NDArray

from rigdda import check, display, fields, seeds
from rigdda.barriers import (
    Barrier,
    Built,
    Layout,
    Mesh,
    Removal,
    as_layout,
    describe,
    earthworks,
    standing,
)
from rigdda.errors import BadInput, DoubtfulInput
from rigdda.files import atomic, is_file, read
from rigdda.geometry import polygon_properties
from rigdda.ground.grounds import GROUNDS, OTHER, USUAL
from rigdda.ground.prices import ACCESS_HEIGHT, Bill
from rigdda.ground.surface import Surface, smaller
from rigdda.ground.terrain import Roughness
from rigdda.model import existing, forest, loose_blocks, site_names
from rigdda.model.block import Block
from rigdda.model.outcome import Outcome
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings, site_step
from rigdda.model.site_generator import NARROW, WIDE, generate
from rigdda.model.site_tables import Drawn, Event, SiteTables
from rigdda.model.soundness import check_site
from rigdda.model.source import Source
from rigdda.model.survey import SURVEYS
from rigdda.model.traffic import TrafficConsequences

Value = TypeVar("Value")

ENCODING_ROUNDING = 1e-9
"""Tolerance for the overlap of barriers and loose rock [m]; encoded layouts lose their last
digits."""

FARTHEST = 2.5
"""Standard deviations at which random normal numbers of the ground are truncated."""

STEEPEST_DEG = 85.0
"""Upper limit of friction angles after random variation [deg]."""


CORRIDOR_KEYS = ("sections", "table")
"""Keys of the file of a corridor, one of which it needs and which a site does not have."""


class Site(SiteTables, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Description of a site: the tables of its file, checked for consistency.

    The parameters are those of `SiteTables`.

    Raises
    ------
    BadInput
        If a field is unknown, of the wrong type or inconsistent with another; the message names it.
    """

    def __post_init__(self) -> None:
        fields.check(self)
        if not self.events:
            usual = tuple(Event(s.name, 1.0, s.name) for s in self.sources if s.band is None)
            if not usual:
                raise BadInput("events", (), "give at least one event with its rate")
            msgspec.structs.force_setattr(self, "events", usual)
        check_site(self)
        if not self.rooms:
            hint = "leave room for barriers: bands of loose rock cover the whole zone"
            raise BadInput("barrier_zone.end", self.barrier_zone.end, hint)
        if self.existing:
            _check_existing(self)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Site:
        """Read a site from a TOML file, or return a built-in or generated site by its name.

        Raises
        ------
        BadInput
            If there is no such file or name, or the file is not a valid site.
        """
        if not isinstance(source, str | os.PathLike):
            raise BadInput("site", source, "name a TOML file or a built-in site")
        path = Path(source)
        if path.suffix.lower() in SURVEYS:
            hint = f"make a site file of this survey: rigdda new NAME --profile {source}"
            raise BadInput("site", str(source), hint)
        if path.suffix != ".toml" and not is_file(path):
            return cls.named(str(source))
        if not is_file(path):
            raise BadInput("site", str(source), "name an existing TOML file")
        return cls.parse(read("site file", path), str(source))

    @classmethod
    def parse(cls, text: str, name: str) -> Site:
        """Return the site of a TOML text; `name` identifies the file in error messages.

        Raises
        ------
        BadInput
            If it is not a valid site.

        Warns
        -----
        DoubtfulInput
            If a surface has neither a ground nor a coefficient of rolling resistance.
        """
        tables = fields.parse("site file", name, text)
        if not tables.keys().isdisjoint(CORRIDOR_KEYS):
            raise BadInput("site", name, "this is the file of a corridor: use `rigdda corridor`")
        found = fields.checked(cls, tables)
        found["surfaces"] = _with_rolling(found["surfaces"], tables["surfaces"])
        return cls(**found)

    @classmethod
    def named(cls, name: str) -> Site:
        """Return a built-in or generated site by its name, see `rigdda.sites.load`."""
        if name in site_names.names():
            return cls.parse(site_names.text(name), name)
        family, number, wide = site_names.instance(name)
        return generate(cls.named(family), name, number, WIDE if wide else NARROW)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the site as TOML; the inverse of `load`.

        Raises
        ------
        BadInput
            If a surface has restitution None (plain penalty contact), which TOML cannot represent.
        """
        data = msgspec.to_builtins(self)
        if data["traffic"] is None:  # TOML has no null
            del data["traffic"]
        for table in (
            *data["sources"],
            *data["events"],
            data["motion"],
            data["origin"],
            data.get("traffic", {}),
            *data["existing"],
        ):
            for name in [name for name, value in table.items() if value is None]:
                del table[name]
        laws = {f"surfaces.{name}": table for name, table in data["surfaces"].items()}
        laws |= {f"interfaces[{i}]": table for i, table in enumerate(data["interfaces"])}
        for where, table in laws.items():
            if table.get("ground") in GROUNDS:
                for name, value in GROUNDS[table["ground"]].values.items():
                    if table.get(name) == value:
                        del table[name]
                if table.get("restitution_speed", 0.0) is None:
                    hint = "give a number: a file without it means that of the ground"
                    raise BadInput(f"{where}.restitution_speed", None, hint)
            if table.get("restitution", 0.0) is None:
                hint = "give a number: None (plain contact) is possible in Python only"
                raise BadInput(f"{where}.restitution", None, hint)
            for name in ("rolling", "restitution_speed"):
                if table.get(name, 0.0) is None:
                    del table[name]
        with atomic(path) as part:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")

    def pick(self, seed: int) -> str:
        """Return the name of the event that a seed selects at random in proportion to the rates.

        Raises
        ------
        BadInput
            If the seed is invalid, or a rate is that of arrivals, see `Event.release_rate`.
        """
        rates = np.array([event.release_rate for event in self.events])
        rng = seeds.event_generator(check.integer("seed", seed, 0), len(rates))
        return self.events[rng.choice(len(rates), p=rates / rates.sum())].name

    @property
    def rooms(self) -> tuple[tuple[float, float], ...]:
        """Intervals of the zone in which barriers may stand [m]: those without loose rock.

        Around each band, a margin as wide as the reach of its largest block is excluded.
        """
        start, end = self.barrier_zone.start, self.barrier_zone.end
        found = []
        for low, high in sorted(_taken(self)):
            if start < min(low, end):
                found.append((start, min(low, end)))
            start = max(start, high)
        return (*found, (start, end)) if start < end else tuple(found)

    def settings(self, scene: Scene) -> Settings:
        """Return the numerical settings for the scene of a release.

        The time step is that of the site, divided for small blocks
        (`rigdda.model.settings.site_step`).
        """
        areas = [polygon_properties(b.vertices)[0] for b in scene.blocks if not b.fixed]
        gravity = math.hypot(*scene.gravity_vector)
        return Settings(dt=site_step(self.motion.dt, np.array(areas), gravity))

    def draw(self, seed: int = 0, event: str | None = None) -> Drawn:
        """Return the random properties of a release of an event.

        Their random streams are in `rigdda.seeds`.

        Parameters
        ----------
        seed : int
            Seed of the release.
        event : str, optional
            Name of the event; by default the seed selects one, with probabilities proportional to
            rates.

        Raises
        ------
        BadInput
            If there is no such event, or the seed is not a whole number >= 0.
        """
        seed = check.integer("seed", seed, 0)
        name = self.pick(seed) if event is None else event
        index = self.index(name)
        what = self.events[index]
        rock = self.source(what.source)
        areas: list[float] = []
        if rock.band is None:
            normal, blocks = _cut(msgspec.json.encode(rock), seed, index)
        else:
            rng = seeds.generator(seed, index)
            normal = rng.standard_normal()
            areas, drawn = loose_blocks.draw(rng, rock, what, loose_blocks.line(self.slope.points))
            blocks = tuple(drawn)
        shift = normal * self.scatter.friction_deg
        width, ground = what.width_of(areas), _ground(self, seed, index)
        return Drawn(name, blocks, width, shift, *ground, _stems(self, blocks, seed, index))

    def built(self, layout: Sequence[Barrier], width: float) -> tuple[Built, ...]:
        """Return the barriers of a layout in a scene, adapted to the width of an event [m].

        Existing barriers are part of the scene only if `as_built` added them to the layout.

        Raises
        ------
        BadInput
            If a barrier overlaps loose rock, or a mesh is not one of the options.
        """
        found: list[Built] = []
        taken = _taken(self)
        for i, barrier in enumerate(as_layout(layout)):
            if isinstance(barrier, Mesh):
                self.mesh(barrier.option)
            if not isinstance(barrier, Built):
                continue
            start, end = barrier.works(self.profile) if taken else (0.0, 0.0)
            for low, high in taken:
                if start < high - ENCODING_ROUNDING and end > low + ENCODING_ROUNDING:
                    hint = f"put it outside the loose rock at x = {low:.2f} to {high:.2f}"
                    raise BadInput(f"barriers[{i}].x", barrier.x, hint)
            found.append(barrier.for_width(width))
        return tuple(found)

    def as_built(self, layout: Sequence[Barrier]) -> Layout:
        """Return a layout with the existing barriers that it neither removes nor replaces.

        They come after the barriers of the layout. A layout that has them already is not changed.

        Raises
        ------
        BadInput
            If the layout removes what may not be removed, or a barrier stands in an existing one.
        """
        own = as_layout(layout)
        if not self.existing and not any(isinstance(barrier, Removal) for barrier in own):
            return own
        return (*own, *existing.remaining(self.existing, self.profile, own))

    def standing(self, layout: Sequence[Barrier] = ()) -> tuple[Built, ...]:
        """Return all barriers that stand with a layout, in the order of `Outcome.barriers`.

        These are the barriers of the layout, without mesh and removals, and the existing ones.

        Raises
        ------
        BadInput
            As `as_built` does.
        """
        return standing(self.as_built(layout))

    @property
    def existing_barriers(self) -> tuple[Built, ...]:
        """The barriers that stand already, as they are today."""
        return existing.barriers(self.existing)

    @property
    def removals(self) -> tuple[Removal, ...]:
        """A removal of each existing barrier that may be removed."""
        return tuple(Removal(one.x) for one in self.existing if one.removable)

    def labels(self, layout: Sequence[Barrier] = ()) -> tuple[str, ...]:
        """Return the labels of the barriers that stand with a layout, see `standing`."""
        old = self.existing_barriers
        built = self.standing(layout)
        return tuple(f"existing {b.label}" if b in old else b.label for b in built)

    def removal_price(self, x: float) -> float:
        """Return the cost of removing the existing barrier at a chainage [EUR/m].

        Raises
        ------
        BadInput
            If there is none that may be removed.
        """
        existing.remaining(self.existing, self.profile, (Removal(x),))
        near = min(self.existing, key=lambda one: abs(one.x - x))
        return near.removal or 0.0

    def scene(self, drawn: Drawn, barriers: Sequence[Built] = ()) -> Scene:
        """Return the scene of a drawn release, with barriers as returned by `built`."""
        surfaces, interfaces = self.strength(drawn)
        return Scene(
            terrain=self.profile,
            blocks=drawn.blocks,
            surfaces=surfaces,
            interfaces=interfaces,
            barriers=tuple(barriers),
            damping=self.motion.damping,
            damping_when=self.motion.damping_when,
            roughness=drawn.roughness,
            stems=drawn.stems,
        )

    def realise(
        self, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
    ) -> Scene:
        """Return the scene of one release.

        Blocks and friction depend on seed and event only, not on the layout. Mesh is not part of a
        scene.

        Parameters
        ----------
        layout : sequence of Barrier
            The barriers in addition to the existing ones, see `as_built`.
        seed : int
            Seed of the release.
        event : str, optional
            Name of the event; by default the seed selects one, with probabilities proportional to
            rates.

        Raises
        ------
        BadInput
            If a barrier does not stand on the slope or overlaps loose rock, there is no such event,
            or the seed is not a whole number >= 0.
        """
        drawn = self.draw(seed, event)
        return self.scene(drawn, self.built(self.as_built(layout), drawn.width))

    def strength(self, drawn: Drawn) -> tuple[dict[str, Surface], dict[tuple[str, str], Surface]]:
        """Return the surfaces and the interfaces of a release, with its random variation."""
        surfaces, normals = self.surfaces, drawn.strengths
        if normals:
            each = zip(surfaces.items(), normals, strict=True)
            surfaces = {name: _varied(s, *normal) for (name, s), normal in each}
        if drawn.friction_deg != 0.0:
            surfaces = {name: _shifted(s, drawn.friction_deg) for name, s in surfaces.items()}
        found = pairs(self, surfaces)
        for pair in self.interfaces:
            ends = pair.first, pair.second
            usual = found.pop(ends[::-1], None) or found.get(ends)
            usual = usual or smaller(surfaces[pair.first], surfaces[pair.second])
            meets = _shifted(pair.surface, drawn.friction_deg)
            if pair.rolling is None:
                meets = msgspec.structs.replace(meets, rolling=usual.rolling)
            found[ends] = meets
        return surfaces, found

    def access(self, x: float) -> float:
        """Return the price factor for access at a chainage [-].

        It grows linearly with the height above the road.
        """
        rise = self.profile.height(x) - self.profile.height(self.road.start)
        return 1.0 + self.prices.access * max(rise, 0.0) / ACCESS_HEIGHT

    def rate(self, event: str, layout: Sequence[Barrier] = ()) -> float:
        """Return the rate of an event with the mesh of a layout [1/year per metre of slope].

        Raises
        ------
        BadInput
            If there is no such event or mesh option, the layout has an option twice, or the rate is
            that of arrivals, see `Event.release_rate`.
        """
        often = self.event(event).release_rate / 100.0
        for barrier in as_layout(layout):
            if isinstance(barrier, Mesh):
                often *= self.mesh(barrier.option).factors.get(event, 1.0)
        return often

    def capitals(self, layout: Sequence[Barrier]) -> list[float]:
        """Return the capital cost of each barrier of a layout [EUR per metre of road].

        It includes the cost of removing an existing barrier that the barrier replaces. An existing
        barrier has no capital cost.

        Raises
        ------
        BadInput
            If a barrier has no price, or an earthwork does not fit.
        """
        barriers = as_layout(layout)
        found = self.values(barriers)
        if not self.existing:
            return [found[barrier] for barrier in barriers]
        old, gone = self.existing_barriers, existing.replaced(self.existing, self.profile, barriers)
        return [(0.0 if b in old else found[b]) + gone.get(b, 0.0) for b in barriers]

    def values(self, layout: Sequence[Barrier]) -> dict[Barrier, float]:
        """Return the price of building each barrier as it stands with a layout [EUR per metre].

        Existing barriers have the price of new ones. The price of a removal is its cost.

        Raises
        ------
        BadInput
            If a barrier has no price, or an earthwork does not fit.
        """
        barriers = self.as_built(layout)
        _, moved = earthworks(self.profile, barriers, self.soil)
        return {
            b: b.price(self, moved.get(b)) * (1.0 if isinstance(b, Removal) else self.access(b.x))
            for b in barriers
        }

    def capital(self, layout: Sequence[Barrier]) -> float:
        """Return the capital cost of a layout [EUR per metre of road].

        Raises
        ------
        BadInput
            If an earthwork does not fit, or a barrier has no price.
        """
        return float(sum(self.capitals(layout)))

    def annual(self, layout: Sequence[Barrier]) -> float:
        """Return the annual cost of a layout, including upkeep [EUR per metre of road and year].

        Existing barriers cost their upkeep, a share of the price of a new one, unless the layout
        removes or replaces them.

        Raises
        ------
        BadInput
            As `capital` does.
        """
        barriers = as_layout(layout)
        worth, old = self.values(barriers), self.existing_barriers
        new = (b for b in barriers if b not in old)
        annual = float(sum(worth[b] * self.prices.annual(b.kind, b.upkeep) for b in new))
        if old:
            kept = (b for b in self.standing(barriers) if b in old)
            annual += sum(worth[b] * self.prices.upkeep_of(b.kind, b.upkeep) for b in kept)
            gone = existing.replaced(self.existing, self.profile, barriers)
            annual += float(self.prices.annuity("removal") * sum(gone.values()))
        return annual

    def bill(self, layout: Sequence[Barrier], outcome: Outcome) -> Bill:
        """Return the cost of a release with a layout [EUR per occurrence of its event].

        Failed barriers are rebuilt over the width of the event, but at least over one panel or
        element. Rock held by barriers is removed. Parts of a gravity wall on the road block it like
        rock.
        """
        layout = as_layout(layout)
        repair = self.prices.removal * outcome.held_fraction * outcome.released_volume
        if any(found.failed for found in outcome.barriers):
            cost = _values_of(self, layout)
            for barrier, found in zip(self.standing(layout), outcome.barriers, strict=True):
                if found.failed:
                    repair += cost[barrier] * max(outcome.width, barrier.repaired)
        volume, reached = self.on_road(layout, outcome)
        harm = self.consequences.harm(volume, reached)
        if self.traffic is not None and self.traffic.fatality_value:
            harm += float(self.traffic.price(self.traffic_consequences(layout, outcome).fatalities))
        return Bill(harm, repair)

    def on_road(self, layout: Sequence[Barrier], outcome: Outcome) -> tuple[float, bool]:
        """Return the volume on the road [m3], with that of failed walls, and whether any is."""
        volume, reached = outcome.road_volume, outcome.reached
        if any(found.failed for found in outcome.barriers):
            built = self.standing(layout)
            for barrier, found in zip(built, outcome.barriers, strict=True):
                if found.failed:
                    volume += found.road_area * max(outcome.width, barrier.repaired)
                    reached = reached or found.road_area > 0.0
        return volume, reached

    def traffic_consequences(
        self, layout: Sequence[Barrier], outcome: Outcome
    ) -> TrafficConsequences:
        """Return the expected consequences for the traffic of the rock of a release.

        A wall that was pushed onto the road does not count; its harm is part of `bill`.

        Raises
        ------
        BadInput
            If the site has no `[traffic]`.
        """
        if self.traffic is None:
            raise BadInput("traffic", None, f"add the table [traffic] to site {self.name}")
        lies = outcome.debris_on_road > 0.0
        energy = outcome.max_energy_on_road * outcome.width
        width, volume = outcome.width, outcome.road_volume
        return self.traffic.consequences(outcome.reached, lies, width, volume, energy)

    def shed(self) -> float:
        """Return the annual cost of a rock shed over the road [EUR per metre of road and year].

        It serves as a reference: no rock reaches the road under a shed.
        """
        return self.prices.shed * self.prices.annual("shed")

    def section(self, layout: Sequence[Barrier] = ()) -> display.Section:
        """Return the section of the slope, with the barriers of a layout, for an image.

        Raises
        ------
        BadInput
            If a barrier does not stand on the slope or overlaps loose rock.
        """
        # barriers stand at the same place in each event, and rates may not be known
        scene, old = self.realise(layout, event=self.event_names[0]), self.existing_barriers
        barriers = [
            display.Outline(
                scene.outline(i), words + describe(barrier), barrier.drawn != "line", bool(words)
            )
            for i, (barrier, words) in enumerate(
                (b, "existing " if b in old else "") for b in self.standing(layout)
            )
        ]
        ground, sources = self.profile.points, []
        for source in self.sources:
            if source.band is None:
                pieces = [np.array(piece, dtype=np.float64) for _, piece in source.pieces()]
                sources += [np.concatenate([piece, piece[:1]]) for piece in pieces]
            else:
                sources.append(self.ground_between(*source.band))
        road = self.ground_between(self.road.start, self.road.end)
        zone = self.ground_between(self.barrier_zone.start, self.barrier_zone.end)
        return display.Section(ground, road, zone, sources, barriers=barriers)

    def _repr_png_(self) -> bytes:
        """Return an image of the slope for notebooks."""
        return display.png(self.section(), self.name)


def _with_rolling(
    surfaces: Mapping[str, Surface], tables: Mapping[str, Mapping[str, object]]
) -> dict[str, Surface]:
    """Return surfaces in which a missing rolling resistance is that of their usual ground.

    `tables` are the tables of the surfaces in the site file.

    Warns
    -----
    DoubtfulInput
        For each surface without ground and rolling resistance.
    """
    found = dict(surfaces)
    for name, surface in surfaces.items():
        if not surface.ground and "rolling" not in tables[name]:
            ground = USUAL.get(name, OTHER)
            value = GROUNDS[ground].rolling.typical
            warnings.warn(
                f"neither surfaces.{name}.rolling nor .ground is given: rolling resistance "
                f"{value:g} is used, which is typical of {ground!r}; set one of them",
                DoubtfulInput,
                stacklevel=4,
            )
            found[name] = msgspec.structs.replace(surface, rolling=value)
    return found


@lru_cache(maxsize=4096)
def _cut(source: bytes, seed: int, event: int) -> tuple[float, tuple[Block, ...]]:
    """Return the random properties of a jointed mass: a standard normal number and its blocks.

    `source` is JSON. Results are cached (about 10 kB each), because cutting takes as long as
    simulating a small release and searches repeat the same releases.
    """
    rng, rock = seeds.generator(seed, event), msgspec.json.decode(source, type=Source)
    normal = rng.standard_normal()
    outlines = rock.cut(rng)
    starts = rock.disturbed(rng, len(outlines))
    return normal, tuple(
        Block(corners, rock.density, rock.surface, velocity)
        for corners, velocity in zip(outlines, starts, strict=True)
    )


def _ground(
    site: Site, seed: int, index: int
) -> tuple[tuple[tuple[float, float, float], ...], Roughness | None]:
    """Return the random properties of the ground: `Drawn.strengths` and `Drawn.roughness`.

    They have their own random streams, so that blocks do not depend on variations of the ground.
    """
    strengths: tuple[tuple[float, float, float], ...] = ()
    if any(surface.varies for surface in site.surfaces.values()):
        rng = seeds.generator(seed, index, "strengths")
        drawn = rng.standard_normal((len(site.surfaces), 3)).tolist()
        strengths = tuple((_cut_off(a), _cut_off(b), _cut_off(c)) for a, b, c in drawn)
    amplitude = {name: s.roughness for name, s in site.surfaces.items() if s.roughness > 0.0}
    if not amplitude:
        return strengths, None
    event = site.events[index]
    spacing = event.block_size(site.source(event.source))
    return strengths, Roughness(spacing, amplitude, seeds.entropy(seed, index, "pits"))


def _stems(
    site: Site, blocks: Sequence[Block], seed: int, index: int
) -> tuple[NDArray[np.float64], ...]:
    """Return the stems that each block strikes, `Drawn.stems`.

    They have their own random stream, so that blocks and ground do not depend on the forest.
    """
    if not site.forest:
        return ()
    rng, found = seeds.generator(seed, index, "stems"), []
    for block in blocks:
        area, centre, _ = polygon_properties(block.vertices)
        found.append(forest.stems(rng, site.forest, float(centre[0]), math.sqrt(area)))
    return tuple(found)


def _cut_off(normal: float) -> float:
    """Return a normal number, clipped to the range from -`FARTHEST` to `FARTHEST`."""
    return min(max(normal, -FARTHEST), FARTHEST)


def pairs(site: Site, surfaces: Mapping[str, Value]) -> dict[tuple[str, str], Value]:
    """Return the value for each pair of a rock and a ground surface: that of the ground."""
    grounds = {site.slope.surface, *(s.surface for s in site.slope.surfaces)}
    if "soil" in site.surfaces:
        grounds.add("soil")  # embankments count as ground
    rocks = {source.surface for source in site.sources}
    return {(r, g): surfaces[g] for r in sorted(rocks) for g in sorted(grounds) if r != g}


def _check_existing(site: Site) -> None:
    """Check the existing barriers of a site.

    Raises
    ------
    BadInput
        If one does not fit the slope, overlaps loose rock or another one, or has no price.
    """
    old = existing.check_existing(site.existing, site.profile, site.soil, site.road.start)
    for i, barrier in enumerate(old):
        try:
            site.built((barrier,), 1.0)
            site.values((barrier,))
        except BadInput as bad:
            field = bad.field.replace("barriers[0]", f"existing[{i}]")
            field = field if field.startswith("existing") else f"existing[{i}]: {field}"
            raise BadInput(field, bad.value, bad.hint) from None


def _taken(site: Site) -> list[tuple[float, float]]:
    """Return the intervals that loose blocks of bands may occupy [m]."""
    found = []
    for source in site.sources:
        if source.band is not None:
            reaches = (loose_blocks.reach(source, event) for event in site.events_of(source))
            reach = max(reaches, default=0.0)
            found.append((source.band[0] - reach, source.band[1] + reach))
    return found


def _varied(surface: Surface, friction: float, restitution: float, rolling: float) -> Surface:
    """Return a surface whose values deviate by the given numbers of standard deviations."""
    if not surface.varies:
        return surface
    rebound = surface.restitution
    angle = surface.friction_deg + friction * surface.friction_sd_deg
    return msgspec.structs.replace(
        surface,
        friction_deg=min(max(angle, 0.0), max(surface.friction_deg, STEEPEST_DEG)),
        restitution=None
        if rebound is None
        else min(max(rebound + restitution * surface.restitution_sd, 0.0), 1.0),
        rolling=min(max(surface.rolling + rolling * surface.rolling_sd, 0.0), 1.0),
    )


def _shifted(surface: Surface, shift: float) -> Surface:
    """Return a surface with its friction angle shifted [deg]."""
    if shift == 0.0:
        return surface
    angle = min(surface.friction_deg + shift, max(surface.friction_deg, STEEPEST_DEG))
    return msgspec.structs.replace(surface, friction_deg=max(angle, 0.0))


_last: tuple[Site, Layout, dict[Barrier, float]] | None = None


def _values_of(site: Site, layout: Layout) -> dict[Barrier, float]:
    """Return `Site.values`, cached for the last layout.

    A layout is evaluated with thousands of releases, and pricing earthworks takes longer than
    simulating one block.
    """
    global _last
    known = _last
    if known is None or known[0] is not site or known[1] != layout:
        known = site, layout, site.values(layout)
        _last = known
    return known[2]
