"""Engines and their settings."""

from __future__ import annotations

from typing import Any, NamedTuple

from experiments.bench.engines import adapter
from experiments.outcome_cost.cases import Case
from experiments.outcome_cost.sample import Core, Peer, Points

CORE, LUMPED = "rigdda", "lumped mass"


class Setting(NamedTuple):
    """An engine, its step [s] and its options."""

    engine: str
    dt: float
    options: tuple[tuple[str, Any], ...] = ()

    def __str__(self) -> str:
        words = "".join(f", {name} {value:g}" for name, value in self.options)
        return f"{self.engine} {1e3 * self.dt:g} ms{words}" if self.dt else self.engine

    def load(self, case: Case) -> Core | Peer | Points:
        """Return an object that computes releases of a case."""
        if self.engine == LUMPED:
            return Points(case)
        if self.engine == CORE:
            return Core(case, self.dt, dict(self.options))
        module = adapter(ADAPTERS[self.engine])
        return Peer(module, case, self.dt, module.OPTIONS[0] | dict(self.options))


ADAPTERS = {"Box2D": "box2d", "pymunk": "chipmunk", "MuJoCo": "mjc"}
"""Adapter module of each other block engine."""


def box2d(dt: float, substeps: int, hertz: float) -> Setting:
    """Return a setting of Box2D."""
    return Setting("Box2D", dt, (("substeps", substeps), ("hertz", hertz)))


def pymunk(dt: float, iterations: int, slop: float) -> Setting:
    """Return a setting of pymunk."""
    return Setting("pymunk", dt, (("iterations", iterations), ("slop", slop)))


REFERENCE = Setting(CORE, 1e-3, (("sweep_tolerance", 1e-3), ("open_close_iterations", 50)))
"""Setting that is the reference for bias."""

OURS = {
    "highway": (5e-3, 10e-3, 20e-3, 25e-3),
    "quick": (5e-3, 10e-3, 20e-3, 25e-3),
    "tschamut": (2.5e-3, 5e-3, 10e-3),
}
"""Steps of this core [s]; it divides longer ones."""

PEERS = (
    box2d(20e-3, 1, 120.0),
    box2d(20e-3, 2, 120.0),
    box2d(10e-3, 2, 120.0),
    box2d(5e-3, 4, 240.0),
    box2d(2.5e-3, 4, 480.0),
    pymunk(20e-3, 10, 1e-2),
    pymunk(20e-3, 3, 1e-3),
    pymunk(10e-3, 3, 1e-3),
    pymunk(10e-3, 10, 1e-3),
    pymunk(2.5e-3, 10, 1e-3),
    Setting("MuJoCo", 20e-3),
)

FINE = {"tschamut": (box2d(1e-3, 4, 960.0), pymunk(1e-3, 10, 1e-3))}
"""Settings with shorter steps for blocks of a tenth of a square metre."""


def settings(case: str) -> tuple[Setting, ...]:
    """Return all settings for a case, the reference first."""
    ours = tuple(Setting(CORE, dt) for dt in OURS[case])
    return (REFERENCE, *ours, *PEERS, *FINE.get(case, ()), Setting(LUMPED, 0.0))
