"""Rigid-block discontinuous deformation analysis for the design of rockfall protection."""

from rigdda import limit_equilibrium, sites
from rigdda.barriers import (
    Barrier,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    MeshOption,
    Wall,
)
from rigdda.barriers.files import load_layout, save_layout
from rigdda.dynamics.many import simulate_many
from rigdda.dynamics.run import Run
from rigdda.dynamics.simulation import Simulation
from rigdda.errors import BadInput, Diverged, DoubtfulInput, Error, SoftContacts
from rigdda.lumped import Points, lumped
from rigdda.model import grounds
from rigdda.model.block import Block
from rigdda.model.economy import Bill, Consequences, Prices
from rigdda.model.events import Drawn, Event
from rigdda.model.loads import BodyForce, LineLoad, PointLoad
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings
from rigdda.model.site import Site
from rigdda.model.source import Source
from rigdda.model.supports import Bolt, FixedPoint
from rigdda.model.surface import Surface
from rigdda.model.terrain import Terrain
from rigdda.release import release, release_many, release_outcome
from rigdda.results.barrier_outcome import BarrierOutcome
from rigdda.results.outcome import Outcome

__version__ = "0.1.0"

__all__ = [
    "BadInput",
    "Barrier",
    "BarrierOutcome",
    "Bill",
    "Block",
    "BodyForce",
    "Bolt",
    "Consequences",
    "Ditch",
    "Diverged",
    "DoubtfulInput",
    "Drawn",
    "Embankment",
    "Error",
    "Event",
    "Fence",
    "FixedPoint",
    "GravityWall",
    "Layout",
    "LineLoad",
    "Mesh",
    "MeshOption",
    "Outcome",
    "PointLoad",
    "Points",
    "Prices",
    "Run",
    "Scene",
    "Settings",
    "Simulation",
    "Site",
    "SoftContacts",
    "Source",
    "Surface",
    "Terrain",
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
]
