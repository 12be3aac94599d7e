"""A trained policy, which chooses a layout from a catalogue of relative layouts without a search.

The score of each layout of the catalogue decreases with its forecast Z (`prior`). A small neural
network, which sees the features of the forecast (`rigdda.agents.learning.forecasts`), corrects it.
The layout with the highest score is built. The network is evaluated with numpy and stored in a
safetensors file together with the catalogue. `rigdda train` makes such a file, and one ships with
the package.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout
from rigdda.agents.designers.catalogue import CrossingEnsemble
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import Designer, DesignResult, Ledger, Progress
from rigdda.agents.designers.store import Store
from rigdda.agents.learning.forecasts import FEATURES, FORECAST_Z, of_site
from rigdda.agents.learning.relative_layouts import NOTHING
from rigdda.agents.network import Network
from rigdda.envs import DesignProblem

FINAL = 64
"""Largest number of releases on which the designer evaluates its layout."""

SHIPPED = Path(__file__).parent / "policy.safetensors"
"""The policy that ships with the package, which `design` uses."""

TEMPERATURE = 0.05
"""Difference of two forecasts of Z over Z without barriers that changes the logarithm of the ratio
of their probabilities by one [-], about the error of a forecast."""

LAYOUTS = "catalogue"
"""Key of the catalogue in the notes of the network of a policy."""


def prior(features: NDArray[Any]) -> NDArray[np.float32]:
    """Return the score of each layout by its forecast alone from (..., A, F) features, (..., A)."""
    score: NDArray[np.float32] = (features[..., FORECAST_Z] / -TEMPERATURE).astype(np.float32)
    return score


@dataclass(frozen=True, slots=True, eq=False)
class Policy:
    """A policy that scores the layouts of a catalogue.

    Parameters
    ----------
    network : Network
        Network from the features of a layout to corrections of `prior`, which are averaged.
    layouts : tuple of A str
        The relative layouts as JSON.
    """

    network: Network
    layouts: tuple[str, ...]

    def scores(self, features: NDArray[Any]) -> NDArray[np.float64]:
        """Return the score of each layout from (..., A, F) features, (..., A)."""
        found: NDArray[np.float64] = self.network(features.astype(np.float32)).mean(axis=-1)
        return prior(features) + found

    def choose(self, features: NDArray[Any], mask: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the number of the best layout for (..., A, F) features and a (..., A) mask."""
        best: NDArray[np.int64] = np.where(mask, self.scores(features), -np.inf).argmax(axis=-1)
        return best

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy to a safetensors file."""
        network = self.network
        notes = dict(network.notes) | {LAYOUTS: json.dumps(self.layouts)}
        Network(network.mean, network.scale, network.layers, notes).save(path)


def using(policy: Policy) -> Designer:
    """Return a designer that builds the layout which a policy chooses.

    The designer needs at least 2 releases. At most a sixteenth of the budget is used for releases
    without barriers, and up to 64 releases for the evaluation of the layout.
    """

    def design(
        problem: DesignProblem,
        simulations: int,
        seed: int = 0,
        progress: Progress | None = None,
        store: Store | None = None,
    ) -> DesignResult:
        ledger = Ledger(problem, simulations, seed, progress, store)
        layout = decide(policy, problem, ledger.ensemble(Menu(problem).stations))
        found = ledger.evaluate(layout, "report", min(FINAL, ledger.left))
        return ledger.result(found, "start")

    return design


def decide(
    policy: Policy, problem: DesignProblem, crossings: CrossingEnsemble | None = None
) -> Layout:
    """Return the layout that a policy chooses for a problem.

    Parameters
    ----------
    policy : Policy
        The policy.
    problem : DesignProblem
        The problem. Layouts that it does not allow are left out.
    crossings : CrossingEnsemble, optional
        Releases without barriers; by default those of a table of forecasts are simulated.

    Raises
    ------
    Diverged
        If a simulation without barriers diverges.
    """
    found = of_site(problem, policy.layouts, crossings)
    layout = found.layouts[int(policy.choose(found.features, np.isfinite(found.z)))]
    assert layout is not None  # no barrier is always possible
    return layout


@lru_cache(maxsize=4)
def load(path: str | os.PathLike[str] = SHIPPED) -> Policy:
    """Return the policy in a file; the file is read once.

    Raises
    ------
    BadInput
        If there is no such file, or if it does not contain a policy of this version.
    """
    network = Network.load(path)
    notes, sizes = dict(network.notes), network.sizes
    try:
        layouts = tuple(map(str, json.loads(notes.pop(LAYOUTS, "[]"))))
    except (ValueError, TypeError):
        layouts = ()
    if not sizes or sizes[0] != FEATURES or NOTHING not in layouts:
        hint = "this is not a policy of this version: name a file policy.safetensors that "
        hint += "`rigdda train` wrote"
        raise BadInput("policy", str(path), hint)
    return Policy(Network(network.mean, network.scale, network.layers, notes), layouts)


def design(
    problem: DesignProblem,
    simulations: int,
    seed: int = 0,
    progress: Progress | None = None,
    store: Store | None = None,
) -> DesignResult:
    """Return the layout that the policy of the package chooses.

    At most a sixteenth of the budget is used for releases without barriers, and up to 64 releases
    for the evaluation of the layout. Targets are not taken into account.

    Raises
    ------
    BadInput, Diverged
        If the budget is below 2 or the seed out of range; if a simulation diverges.
    """
    return using(load())(problem, simulations, seed, progress, store)
