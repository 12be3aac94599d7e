"""Tables of forecasts: the value network's forecast of every relative layout on many sites.

The forecast of a site uses releases without barriers only, see `rigdda.agents.designers.forecast`.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS, BadInput, Layout
from rigdda.agents.designers import catalogue as station_crossings
from rigdda.agents.designers.catalogue import CrossingEnsemble
from rigdda.agents.designers.forecast import LAYOUT_FEATURES as EVENT_FEATURES
from rigdda.agents.designers.forecast import Forecast, forecast_seeds, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.learning.relative_layouts import NOTHING, placed
from rigdda.envs import DesignProblem
from rigdda.envs.forecast_table import ForecastTable, joined
from rigdda.envs.observation import BOUND, observe
from rigdda.envs.site_sampling import SAMPLED_KINDS, problem_of
from rigdda.files import atomic

Floats = NDArray[np.float64]
Tick = Callable[[int, str], None]

FEATURES = 3 + EVENT_FEATURES
"""Number of features of a layout: the annual cost of its barriers, the forecast remaining risk and
the forecast Z, each over Z without barriers, and the mean over the events of the inputs of the
value network. An event has the weight of its share of the risk without barriers. Features are
limited to `BOUND`."""

FORECAST_Z = 2
"""Number of the feature that is the forecast Z over Z without barriers."""

SOFT = 0.05
"""Scale of the soft minimum by which a catalogue is chosen [-], about the error of a forecast."""

LAYOUTS = 48
"""Default number of layouts of a catalogue."""

LEAST_COST = 30.0
"""Z without barriers below which a site is left out [EUR per metre of road and year]. Hardly any
barrier costs less, so that there is nothing to decide, and relative figures mean little."""

SLOTS = 3
"""Largest number of barriers of the problems of a table."""


@dataclass(frozen=True, slots=True, eq=False)
class LayoutForecasts:
    """Forecasts of A relative layouts on one site.

    Parameters
    ----------
    layouts : tuple of A (Layout or None)
        The layouts on the site; None if they cannot be built.
    features : (A, F) array
        Features of each layout.
    z : (A,) array
        Forecast Z over Z without barriers [-]; NaN for layouts that cannot be built.
    """

    layouts: tuple[Layout | None, ...]
    features: Floats
    z: Floats


@dataclass(frozen=True, slots=True, eq=False)
class SiteForecasts:
    """The row of a site in a table, which a file stores.

    Parameters
    ----------
    observation : (W,) array
        Observation of the site, see `ForecastTable`.
    features : (A, F) array
        Features of each layout.
    z : (A,) array
        Forecast Z over Z without barriers [-]; NaN for layouts that cannot be built.
    nothing : float
        Z without barriers [EUR per metre of road and year].
    """

    observation: NDArray[np.float32]
    features: Floats
    z: Floats
    nothing: float

    def save(self, path: Path, catalogue: Sequence[str]) -> None:
        """Write the numbers to a file, with the catalogue that they belong to."""
        with atomic(path) as part, part.open("wb") as file:
            np.savez_compressed(
                file, observation=self.observation, features=self.features, z=self.z,
                nothing=self.nothing, catalogue=json.dumps(list(catalogue)), mechanics=MECHANICS,
            )  # fmt: skip

    @classmethod
    def load(cls, path: Path, catalogue: Sequence[str]) -> SiteForecasts:
        """Read the numbers from a file.

        Raises
        ------
        BadInput
            If the file is damaged or belongs to another catalogue or version of the mechanics.
        """
        hint = "remove this file and repeat the command"
        try:
            with np.load(path) as file:
                nothing = float(file["nothing"])
                found = cls(file["observation"], file["features"], file["z"], nothing)
                made = str(file["mechanics"]), json.loads(str(file["catalogue"]))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise BadInput("forecasts", str(path), f"this is damaged: {hint} ({error})") from None
        if made != (MECHANICS, list(catalogue)):
            raise BadInput("forecasts", str(path), f"this is of another version: {hint}")
        return found


def of_site(
    problem: DesignProblem, catalogue: Sequence[str], crossings: CrossingEnsemble | None = None
) -> LayoutForecasts:
    """Return the forecasts of the relative layouts of a catalogue on the site of a problem.

    Parameters
    ----------
    problem : DesignProblem
        The problem.
    catalogue : sequence of A str
        The relative layouts.
    crossings : CrossingEnsemble, optional
        Releases without barriers; by default those of `forecast_seeds` are simulated.

    Raises
    ------
    Diverged
        If a simulation without barriers diverges.
    """
    site, menu = problem.site, Menu(problem)
    if crossings is None:
        crossings = station_crossings.ensemble(site, forecast_seeds(site), menu.stations)
    forecast = Forecast(problem, crossings, value_network())
    without = problem.nothing
    scale = max(without.objective, 1e-9)
    by_event = np.array([without.by_event[name] for name in site.event_names])
    weight = by_event / max(float(by_event.sum()), 1e-300)
    layouts = tuple(placed(menu, relative) for relative in catalogue)
    features, z = np.zeros((len(layouts), FEATURES)), np.full(len(layouts), np.nan)
    for i, layout in enumerate(layouts):
        if layout is None:
            continue
        inputs = forecast.features(layout)
        left = value_network()(inputs) if layout else np.ones(len(weight))
        annual, risk = site.annual(layout) / scale, float(by_event @ left) / scale
        z[i] = annual + risk
        features[i] = annual, risk, z[i], *(weight @ inputs)
    return LayoutForecasts(layouts, np.clip(features, -BOUND, BOUND), z)


def problem(name: str) -> DesignProblem:
    """Return the problem of a site of a table, with all kinds of barrier that the site offers."""
    whole = problem_of(name, SLOTS, None, "full")
    offered = tuple(kind for kind in SAMPLED_KINDS if kind != "mesh" or whole.site.meshes)
    return problem_of(name, SLOTS, offered, "full")


def collect(
    names: Sequence[str], catalogue: Sequence[str], folder: Path, tick: Tick
) -> dict[str, SiteForecasts]:
    """Return the forecasts of many sites; those that are in files of the folder are read.

    Sites where Z without barriers is below `LEAST_COST` are left out.

    Raises
    ------
    BadInput
        If a file in the folder is damaged or of another version.
    Diverged
        If a simulation without barriers diverges.
    """
    found = {}
    for i, name in enumerate(names):
        tick(i, name)
        path = folder / f"{name}.npz"
        if not path.is_file():
            posed = problem(name)
            own, nothing = of_site(posed, catalogue), posed.nothing.objective
            SiteForecasts(joined(observe(posed)), own.features, own.z, nothing).save(
                path, catalogue
            )
        row = SiteForecasts.load(path, catalogue)
        if row.nothing >= LEAST_COST:
            found[name] = row
    return found


def table(
    found: Mapping[str, SiteForecasts], catalogue: Sequence[str], kept: Sequence[int],
    notes: dict[str, str],
) -> ForecastTable:  # fmt: skip
    """Return the table of some sites and of the kept layouts of a catalogue."""
    rows = found.values()
    return ForecastTable(
        tuple(found),
        tuple(catalogue[i] for i in kept),
        np.array([own.observation for own in rows], dtype=np.float32),
        np.array([own.features[kept] for own in rows], dtype=np.float32),
        np.array([own.z[kept] for own in rows], dtype=np.float32),
        notes | {"mechanics": MECHANICS},
    )


def choose(z: Floats, catalogue: Sequence[str], count: int) -> list[int]:
    """Return the indices of a catalogue that serves many sites, in ascending order.

    Layouts are added one by one, beginning with no barrier. Each lowers the mean over the sites of
    the soft minimum -T log sum exp(-Z / T) the most, with T = `SOFT`. A soft minimum also rewards
    alternatives to the best layout, of which the forecast may be wrong.

    Parameters
    ----------
    z : (S, A) array
        Forecast Z over Z without barriers [-]; NaN for layouts that cannot be built.
    catalogue : sequence of A str
        The relative layouts.
    count : int
        Number of layouts to choose.
    """
    weight = np.exp(-np.where(np.isfinite(z), z, np.inf) / SOFT)
    chosen = [list(catalogue).index(NOTHING)]
    total = weight[:, chosen].sum(axis=1)
    while len(chosen) < min(count, z.shape[1]):
        gain = np.log(total[:, None] + weight).mean(axis=0)
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        total = total + weight[:, best]
    return sorted(chosen)
