"""Tables and pictures of releases that `rigdda simulate` writes into its folder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigdda import Layout, Site
from rigdda.app.reports import pictures, station_pictures, stations
from rigdda.app.reports.stations import Passing, Rows
from rigdda.passages import check_stations, ends

Floats = NDArray[np.float64]

TABLES = ("stations", "along_slope", "passages", "run_out", "stopping", "stops")
"""Names of the tables, each written as CSV and as Parquet."""

WAY, MOST = 60, 150
"""Intervals of stations between the highest source and the road, and greatest number along a
slope."""


def files(asked: Sequence[float]) -> list[str]:
    """Return the names of all files for some stations [m]."""
    pictured = ("section", "along_slope", "run_out", *map(_picture, asked))
    return [
        "outcomes.csv",
        "run.npz",
        *(f"{name}.{kind}" for name in TABLES for kind in ("csv", "parquet")),
        *(f"{name}.png" for name in pictured),
    ]


def _picture(station: float) -> str:
    return f"station_{station:.10g}m"


def along(site: Site) -> Floats:
    """Return evenly spaced stations from the highest source to the end of the profile [m]."""
    left, right = ends(site)
    left = max(left, min(pictures.reach(piece)[0] for piece in pictures.sources(site)))
    spacing = max((site.road.end - left) / WAY, (right - left) / MOST)
    return np.linspace(left, right, math.ceil((right - left) / spacing) + 1)[1:-1]


def lines(site: Site, asked: Floats) -> Floats:
    """Return the stations along the slope and those asked for, ascending [m]."""
    return check_stations(site, [*along(site).tolist(), *asked.tolist()])


def write(folder: Path, passing: Passing, layout: Layout, asked: Floats) -> tuple[Rows, Rows]:
    """Write the tables and pictures of releases; return those of the stations and of stopping.

    Raises
    ------
    Diverged
        If a simulation for the trajectories of the pictures diverges.
    """
    places = np.searchsorted(passing.found.stations, asked).tolist()
    even = np.searchsorted(passing.found.stations, along(passing.site)).tolist()
    rows, slope = stations.summary(passing, places), stations.summary(passing, even)
    reached, rest = stations.run_out(passing), stations.stopping(passing)
    fields = stations.raw_fields(passing.site)
    stations.write(folder / "stations", rows)
    stations.write(folder / "along_slope", slope)
    stations.write(folder / "passages", stations.raw(passing, places), fields)
    stations.write(folder / "run_out", reached)
    stations.write(folder / "stopping", rest)
    stations.write(folder / "stops", stations.stops(passing))
    pictures.released(folder / "section.png", passing, layout, slope)
    station_pictures.along_slope(folder / "along_slope.png", passing, slope)
    station_pictures.run_out(folder / "run_out.png", passing, reached)
    for place, x in zip(places, asked.tolist(), strict=True):
        station_pictures.station(folder / f"{_picture(x)}.png", passing, place, rows)
    return rows, rest
