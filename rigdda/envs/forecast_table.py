"""Table of forecasts: the forecast Z of each layout of a catalogue on each site.

`rigdda.agents.learning.forecasts` computes the rows with the value network, and the environment
`rigdda/BarrierForecast-v0` reads them. A file of a table is in the safetensors format.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from rigdda import BadInput, sites
from rigdda.envs.observation import FIELDS
from rigdda.files import atomic

Floats = NDArray[np.float32]
Rows = NDArray[np.int64]

SHIPPED = Path(__file__).parent / "forecasts.safetensors"
"""The table that ships with the package, made by `python -m experiments.known_forecasts`."""

WIDE = "wide-"
"""Beginning of the names of the splits with wide ranges and of their sites."""

NAMES = tuple(sorted(FIELDS))
"""Arrays of the observation of a site in the order in which a table concatenates them."""

WIDTH = sum(FIELDS[name].size for name in NAMES)
"""Number of entries of the observation of a site."""


@dataclass(frozen=True, slots=True, eq=False)
class ForecastTable:
    """Forecasts for S sites and a catalogue of A layouts with F features each.

    Parameters
    ----------
    names : tuple of S str
        Names of the sites.
    layouts : tuple of A str
        The relative layouts of the catalogue as JSON. The first is no barrier.
    observation : (S, WIDTH) array
        Observation of each site, the arrays of `NAMES` in this order.
    features : (S, A, F) array
        Features of each layout on each site, from -10 to 10; see
        `rigdda.agents.learning.forecasts.FEATURES`.
    z : (S, A) array
        Forecast Z of each layout over Z without barriers [-]; NaN if it cannot be built.
    notes : mapping of str to str
        How the table was made.
    """

    names: tuple[str, ...]
    layouts: tuple[str, ...]
    observation: Floats
    features: Floats
    z: Floats
    notes: Mapping[str, str]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Whether each layout can be built on each site, (S, A)."""
        return np.isfinite(self.z)

    @property
    def reward(self) -> NDArray[np.float64]:
        """Forecast relative reduction of Z, (S, A); 0 for a layout that cannot be built."""
        return np.where(self.mask, 1.0 - self.z.astype(np.float64), 0.0)

    def rows(self, site: str | Sequence[str]) -> Rows:
        """Return the rows of a site, of a split or of a sequence of sites.

        The rows of "train", "validation" and "test" are those of both versions of the splits, those
        of "wide-train", "wide-validation" and "wide-test" those of the version with wide ranges.

        Raises
        ------
        BadInput
            If the table contains none of the sites of a split, or lacks a site that is named.
        """
        place = {name: row for row, name in enumerate(self.names)}
        split = "train" if site == "random" else site
        if isinstance(split, str) and split in sites.SPLITS:
            part = split.removeprefix(WIDE)
            version = WIDE if split != part else ""  # beginning of the names of its sites
            found = [
                row
                for row, name in enumerate(self.names)
                if sites.part_of(name) == part and name.startswith(version)
            ]
            if not found:
                raise BadInput("site", site, "the table of forecasts has no site of this split")
            return np.array(found)
        given = [site] if isinstance(site, str) else site
        if not isinstance(given, Sequence) or not given:
            raise BadInput(
                "site", site, "give a site of the table, a split, or a sequence of sites"
            )
        for name in given:
            if name not in place:
                some = ", ".join(self.names[:3])
                hint = f"the table of forecasts has other sites ({some}, ...): name one of them, "
                hint += "or a split, or make a table with `rigdda train --sites N`"
                raise BadInput("site", name, hint)
        return np.array([place[name] for name in given])

    def rounded(self) -> ForecastTable:
        """Return the table with the features in half precision, as `load` reads it from a file."""
        features = self.features.astype(np.float16).astype(np.float32)
        return replace(self, features=features)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table to a safetensors file, with the features in half precision."""
        arrays = {
            "observation": self.observation.astype(np.float32),
            "features": self.features.astype(np.float16),
            "z": self.z.astype(np.float32),
        }
        told = dict(self.notes) | {
            "names": json.dumps(self.names),
            "layouts": json.dumps(self.layouts),
        }
        content = save({name: np.ascontiguousarray(a) for name, a in arrays.items()}, told)
        with atomic(path) as part:
            part.write_bytes(header_sorted(content))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ForecastTable:
        """Read a table from a file.

        Raises
        ------
        BadInput
            If there is no such file or if it does not contain a table of this version.
        """
        hint = "name a file forecasts.safetensors that `rigdda train` wrote"
        if os.path.isdir(path):
            raise BadInput("table", str(path), f"this is a folder: {hint}")
        try:
            with safe_open(path, framework="numpy") as file:
                notes = dict(file.metadata() or {})
                names, layouts = (tuple(json.loads(notes.pop(k))) for k in ("names", "layouts"))
                arrays = [file.get_tensor(name) for name in ("observation", "features", "z")]
        except (OSError, SafetensorError, KeyError, ValueError) as error:
            raise BadInput("table", str(path), f"{hint} ({error})") from None
        seen, features, z = (array.astype(np.float32) for array in arrays)
        shape = len(names), len(layouts)
        fits = seen.shape == (shape[0], WIDTH) and features.shape[:2] == z.shape == shape
        if not fits or not shape[0] or not np.isfinite(z[:, 0]).all():
            raise BadInput("table", str(path), f"this is not a table of this version: {hint}")
        return cls(names, layouts, seen, features, z, notes)


def header_sorted(raw: bytes) -> bytes:
    """Return a safetensors file with a sorted header, so that the bytes are reproducible."""
    size = int.from_bytes(raw[:8], "little")
    header = json.dumps(json.loads(raw[8 : 8 + size]), sort_keys=True).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + raw[8 + size :]


def joined(seen: Mapping[str, NDArray[Any]]) -> Floats:
    """Return the (WIDTH,) entries of the observation of a site in the order of `NAMES`."""
    return np.concatenate([seen[name] for name in NAMES]).astype(np.float32)


@lru_cache(maxsize=4)
def load(path: str | None = None) -> ForecastTable:
    """Return the table in a file, or the one that ships; each file is read once.

    Raises
    ------
    BadInput
        As `ForecastTable.load` does.
    """
    return ForecastTable.load(SHIPPED if path is None else path)
