"""Many scenes at once."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from rigdda import check
from rigdda.dynamics.run import Run
from rigdda.dynamics.simulation import Simulation
from rigdda.dynamics.stations import chainages
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings


def simulate_many(
    scenes: Sequence[Scene],
    settings: Settings | None = None,
    duration: float = 25.0,
    every: float = 0.05,
    stations: Sequence[float] = (),
    watch: tuple[float, float] | None = None,
) -> list[Run]:
    """Run independent scenes over all cores, in threads; each gives what running it alone gives.

    Raises
    ------
    BadInput, Diverged
        As `Simulation` and `Simulation.run` do.
    """
    lines = tuple(chainages(stations))

    def one(scene: Scene) -> Run:
        return Simulation(scene, settings, lines, watch).run(duration, every)

    each = check.sequence("scenes", scenes, Scene, "rigdda.Scene")
    with ThreadPoolExecutor() as pool:
        return list(pool.map(one, each))
