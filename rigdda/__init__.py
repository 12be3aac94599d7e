"""Rigid-block discontinuous deformation analysis for the design of rockfall protection."""

from rigdda import sites
from rigdda.errors import BadInput, Diverged, Error
from rigdda.loads import BodyForce, LineLoad, PointLoad
from rigdda.outcome import BarrierOutcome, Outcome
from rigdda.release import release, release_many
from rigdda.run import Run
from rigdda.scene import Block, Layout, Scene, Surface, Terrain, Wall
from rigdda.settings import Settings
from rigdda.simulation import Simulation, simulate_many
from rigdda.site import Site, load_layout, save_layout
from rigdda.supports import Bolt, FixedPoint

__version__ = "0.1.0"

__all__ = [
    "BadInput",
    "BarrierOutcome",
    "Block",
    "BodyForce",
    "Bolt",
    "Diverged",
    "Error",
    "FixedPoint",
    "Layout",
    "LineLoad",
    "Outcome",
    "PointLoad",
    "Run",
    "Scene",
    "Settings",
    "Simulation",
    "Site",
    "Surface",
    "Terrain",
    "Wall",
    "load_layout",
    "release",
    "release_many",
    "save_layout",
    "simulate_many",
    "sites",
]
