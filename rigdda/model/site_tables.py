"""The tables of a site file, and what is looked up in them."""

from __future__ import annotations

from functools import lru_cache

import msgspec

from rigdda.barriers import Mesh, MeshOption
from rigdda.errors import BadInput
from rigdda.model.economy import Consequences, Prices
from rigdda.model.events import Event
from rigdda.model.place import BarrierZone, Motion, Rebound, Road, Scatter
from rigdda.model.slope import Slope, Stretch
from rigdda.model.source import Point, Source
from rigdda.model.surface import Interface, Surface
from rigdda.model.terrain import Terrain

STEEP_SIDES, FLAT_SIDE = {"rock": 0.25}, 0.67
"""Side slope of a ditch, run over rise [-], by the surface that it is cut in: 4:1 stands in rock;
all else is taken for soil."""


class SiteTables(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A slope, its loose rock and how often it falls, the road below, and what protection costs.

    Parameters
    ----------
    name : str
        Its name.
    description : str
        What it is, and what of it is assumed.
    family : str
        Family of sites that it belongs to; "paper" for scenes of publications.
    slope : table
        The ground.
    sources : tables
        Where rock starts.
    events : tables
        What comes down and how often. By default each source that is no band, once a year on
        100 m of slope.
    road : table
        The road.
    barrier_zone : table
        Where barriers may stand.
    surfaces : tables
        The surfaces, by name. "soil" is that of
        embankments, "concrete" that of walls and fences, and of embankments where "soil" is
        missing; "rock" where they are missing.
    interfaces : tables
        How two surfaces meet.
    prices : table
        What barriers cost.
    consequences : table
        What rock on the road costs.
    meshes : tables
        Mesh that may be hung over the face.
    motion : table
        How releases are computed.
    scatter : table
        What varies at random.
    lumped : tables
        How points of the lumped-mass model rebound, by the name of the surface.
    """

    name: str
    description: str
    family: str = ""
    slope: Slope
    sources: tuple[Source, ...]
    events: tuple[Event, ...] = ()
    road: Road
    barrier_zone: BarrierZone
    surfaces: dict[str, Surface]
    interfaces: tuple[Interface, ...] = ()
    prices: Prices = msgspec.field(default_factory=Prices)
    consequences: Consequences = Consequences()
    meshes: tuple[MeshOption, ...] = ()
    motion: Motion = Motion()
    scatter: Scatter = Scatter()
    lumped: dict[str, Rebound] = {}

    @property
    def profile(self) -> Terrain:
        """The ground as a terrain, with a corner wherever its surface changes."""
        return _ground(self.slope.points, self.slope.surface, self.slope.surfaces)

    @property
    def friction_varies(self) -> bool:
        """Whether friction is drawn for each release."""
        own = any(surface.friction_sd_deg > 0.0 for surface in self.surfaces.values())
        return own or self.scatter.friction_deg > 0.0

    @property
    def pit_spacing(self) -> float:
        """Greatest spacing of pits in the ground in any event [m], 0 where the ground is smooth."""
        if all(surface.roughness == 0.0 for surface in self.surfaces.values()):
            return 0.0
        return max(event.block_size(self.source(event.source)) for event in self.events)

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of the events."""
        return tuple(event.name for event in self.events)

    def event(self, name: str) -> Event:
        """Return an event by its name.

        Raises
        ------
        BadInput
            If there is none.
        """
        return self.events[self.index(name)]

    def index(self, name: str) -> int:
        """Return the place of an event among the events. Raises as `event` does."""
        names = self.event_names
        if not isinstance(name, str) or name not in names:
            raise BadInput("event", name, "choose one of " + ", ".join(names))
        return names.index(name)

    def source(self, name: str) -> Source:
        """Return a source by its name.

        Raises
        ------
        BadInput
            If there is none.
        """
        for source in self.sources:
            if source.name == name:
                return source
        raise BadInput("source", name, "choose one of " + ", ".join(s.name for s in self.sources))

    def events_of(self, source: Source) -> list[Event]:
        """Return the events that come from a source."""
        return [event for event in self.events if event.source == source.name]

    @property
    def soil(self) -> str:
        """Name of the surface of embankments."""
        usual = "concrete" if "concrete" in self.surfaces else "rock"
        return "soil" if "soil" in self.surfaces else usual

    def ditch_side(self, x: float, width: float) -> float:
        """Return the side slope of a ditch [-], the flattest of the ground that it is cut in."""
        points, names = self.slope.chain()
        ends = zip(points, points[1:], names, strict=False)
        spanned = {name for (a, _), (b, _), name in ends if a < x + width and b > x}
        return max((STEEP_SIDES.get(name, FLAT_SIDE) for name in spanned), default=FLAT_SIDE)

    def mesh(self, mesh: Mesh) -> MeshOption:
        """Return the option that a mesh is.

        Raises
        ------
        BadInput
            If the site has no such option.
        """
        for option in self.meshes:
            if option.name == mesh.option:
                return option
        known = ", ".join(option.name for option in self.meshes) or "none: this site has no mesh"
        raise BadInput("mesh option", mesh.option, f"choose one of {known}")


@lru_cache(maxsize=256)
def _ground(points: tuple[Point, ...], surface: str, stretches: tuple[Stretch, ...]) -> Terrain:
    """Return the terrain of a slope; it is asked for several times in every episode."""
    return Terrain(*Slope(points, 0.0, surface, stretches).chain())
