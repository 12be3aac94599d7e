"""Rigid-block discontinuous deformation analysis for the design of rockfall protection."""

from rigdda.errors import BadInput, Diverged, Error
from rigdda.run import Run
from rigdda.scene import Block, Layout, Scene, Surface, Terrain, Wall
from rigdda.settings import Settings
from rigdda.simulation import Simulation, simulate_many

__version__ = "0.1.0"

__all__ = [
    "BadInput",
    "Block",
    "Diverged",
    "Error",
    "Layout",
    "Run",
    "Scene",
    "Settings",
    "Simulation",
    "Surface",
    "Terrain",
    "Wall",
    "simulate_many",
]
