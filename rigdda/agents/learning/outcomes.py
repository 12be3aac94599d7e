"""Simulated outcomes of promising layouts of a catalogue, with common random numbers.

All layouts of a site are simulated on the same releases. The forecast of the layout with the best
forecast is on average too optimistic, and a policy that learns from forecasts alone repeats their
errors. Outcomes correct both.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS, BadInput, Layout
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.surrogate import MORE, SPREAD
from rigdda.agents.learning.forecasts import Tick, problem
from rigdda.agents.learning.relative_layouts import placed
from rigdda.agents.value_training import outcomes as simulated_shares
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import largest
from rigdda.envs.forecast_table import ForecastTable
from rigdda.files import atomic

Floats = NDArray[np.float64]


def corrected(table: ForecastTable, row: int, count: int) -> Floats:
    """Return Z over Z without barriers of the layouts of a site, corrected by simulation, (A,).

    The `count` layouts with the least forecast Z are simulated. Their forecast and their outcome
    are weighted with their precision. All others keep their forecast, so that a policy still learns
    to avoid them; NaN for layouts that cannot be built.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    posed = problem(table.names[row])
    menu, forecast = Menu(posed), table.z[row].astype(np.float64)
    order = np.argsort(np.where(np.isfinite(forecast), forecast, np.inf), kind="stable")
    chosen = [i for i in order.tolist() if np.isfinite(forecast[i]) and i > 0][:count]
    layouts: list[Layout] = [(), *(placed(menu, table.layouts[i]) or () for i in chosen)]
    sizes = {name: largest(posed.site, name) for name in posed.site.event_names}
    shares, variances = simulated_shares(posed, layouts, sizes)
    out = forecast.copy()
    for k, i in enumerate(chosen, 1):
        annual = posed.site.annual(layouts[k]) / max(posed.nothing.objective, 1e-9)
        out[i] = annual + _remaining(posed, shares[k], variances[k], forecast[i] - annual)
    return out


def _remaining(problem: DesignProblem, share: Floats, variance: Floats, forecast: float) -> float:
    """Return the remaining risk over Z without barriers from outcomes and the forecast.

    An event that is not simulated has the share of the forecast.
    """
    by_event = np.array([problem.nothing.by_event[name] for name in problem.site.event_names])
    weight = by_event / max(problem.nothing.objective, 1e-9)
    whole = max(float(weight.sum()), 1e-9)
    known = np.isfinite(share)
    mean = float(np.where(known, share, forecast / whole) @ weight)
    noise = float(np.where(known, variance, 0.0) @ weight**2)
    m = min(max(forecast / whole, 0.0), 1.0)
    prior = (whole * (SPREAD + MORE * m * (1.0 - m))) ** 2
    return (prior * mean + noise * forecast) / (prior + noise)


def collect(table: ForecastTable, count: int, folder: Path, tick: Tick) -> Floats:
    """Return corrected Z over Z without barriers of the training sites of a table, (n, A).

    Sites of which the outcomes are in files of the folder are read.

    Raises
    ------
    BadInput
        If a file in the folder is damaged or of another version.
    Diverged
        If a simulation diverges.
    """
    found = []
    for i, row in enumerate(table.rows("train").tolist()):
        name = table.names[row]
        tick(i, name)
        path = folder / f"{name}-outcomes.npz"
        if not path.is_file():
            z = corrected(table, row, count)
            with atomic(path) as part, part.open("wb") as file:
                np.savez_compressed(file, z=z, mechanics=MECHANICS)
        found.append(_read(path, len(table.layouts)))
    return np.array(found)


def _read(path: Path, layouts: int) -> Floats:
    hint = "remove this file and repeat the command"
    try:
        with np.load(path) as file:
            z, made = np.asarray(file["z"], dtype=np.float64), str(file["mechanics"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise BadInput("outcomes", str(path), f"this is damaged: {hint} ({error})") from None
    if made != MECHANICS or z.shape != (layouts,):
        raise BadInput("outcomes", str(path), f"this is of another version: {hint}")
    return z
