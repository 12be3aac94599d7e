# Names of the package by the module that defines them: `__init__.py` imports each when it is first
# used, and type checkers read them here.

from . import limit_equilibrium, sites
from .barriers import (
    Barrier,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    MeshOption,
    Removal,
    Wall,
)
from .barriers.layout import load_layout, save_layout
from .dynamics.run import Run
from .dynamics.simulation import Simulation, simulate_many
from .errors import BadInput, Diverged, DoubtfulInput, Error, SoftContacts
from .ground import grounds
from .ground.prices import Bill, Consequences, Prices
from .ground.surface import Surface
from .ground.terrain import Terrain
from .lumped_mass import Points, lumped
from .model.block import Block
from .model.corridor import Corridor, CorridorSection
from .model.existing import Existing
from .model.forest import Forest
from .model.loads import BodyForce, Bolt, FixedPoint, LineLoad, PointLoad
from .model.outcome import BarrierOutcome, Outcome
from .model.scene import Scene
from .model.settings import Settings
from .model.site import Site
from .model.site_tables import Drawn, Event
from .model.source import Source
from .model.traffic import Toll, Traffic
from .releases import release, release_many, release_outcome
from .trajectory import Trajectories, trajectories, trajectory_parts

MECHANICS: str
__version__: str

__all__ = [
    "BadInput",
    "Barrier",
    "BarrierOutcome",
    "Bill",
    "Block",
    "BodyForce",
    "Bolt",
    "Consequences",
    "Corridor",
    "CorridorSection",
    "Ditch",
    "Diverged",
    "DoubtfulInput",
    "Drawn",
    "Embankment",
    "Error",
    "Event",
    "Existing",
    "Fence",
    "FixedPoint",
    "Forest",
    "GravityWall",
    "Layout",
    "LineLoad",
    "Mesh",
    "MeshOption",
    "Outcome",
    "PointLoad",
    "Points",
    "Prices",
    "Removal",
    "Run",
    "Scene",
    "Settings",
    "Simulation",
    "Site",
    "SoftContacts",
    "Source",
    "Surface",
    "Terrain",
    "Toll",
    "Traffic",
    "Trajectories",
    "Wall",
    "grounds",
    "limit_equilibrium",
    "load_layout",
    "lumped",
    "release",
    "release_many",
    "release_outcome",
    "save_layout",
    "simulate_many",
    "sites",
    "trajectories",
    "trajectory_parts",
]
