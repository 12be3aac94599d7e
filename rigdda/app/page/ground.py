"""Ground: observations of a project, how well computed releases match them, and the fit.

Observations are files in a folder of the project: those of `rigdda fit`, and impact marks. A thread
computes releases of the site on the page and compares them with the observations as the fit does.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
import threading
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Error, Site, check
from rigdda.app.page.loading import IMPORTING
from rigdda.app.reports.wording import survey_grid
from rigdda.app.uncertainty import observations
from rigdda.app.uncertainty.observations import DataSets
from rigdda.app.uncertainty.parameters import Parameter
from rigdda.files import atomic, read

Floats = NDArray[np.float64]

FOLDER = "observed"
"""Folder of the observations of a project."""

NAME = re.compile(r"[\w][\w ()+-]{0,59}\.csv")
"""Name of a file of observations."""

MARK = "impact_m"
"""Column of a file of impact marks: their chainages [m]. They are shown and not fitted."""

ROUNDS = (25, 50, 100, 150)
"""Numbers of releases of each event after each round."""

BUDGET, RELEASES = 40, 100
"""Usual numbers of parameter sets of a fit on the page, and of releases of each event for one."""


class Observations(NamedTuple):
    """What was observed on a slope."""

    sets: DataSets
    """Observations that are compared with computed ones; empty if there are none."""
    marks: Floats
    """Chainages of impact marks [m]."""
    files: tuple[Path, ...]
    """The files of `sets`."""


def files(folder: Path) -> list[Path]:
    """Return the files of observations of a project."""
    return sorted((folder / FOLDER).glob("*.csv"))


def observed(paths: Sequence[Path], site: Site) -> Observations:
    """Return what is in files of observations.

    Raises
    ------
    BadInput
        If a file is neither a table of observations (see `rigdda fit`) nor one of impact marks, or
        does not agree with the site.
    """
    marks = {path: _marks(path, site) for path in paths}
    own = tuple(path for path, found in marks.items() if found is None)
    sets = observations.read(own, site) if own else {}
    every = [found for found in marks.values() if found is not None]
    return Observations(sets, np.concatenate(every) if every else np.zeros(0), own)


def _marks(path: Path, site: Site) -> Floats | None:
    """Return the impact marks in a file; None if it has no column of them."""
    try:
        rows = list(csv.DictReader(io.StringIO(read("observed", path), newline="")))
    except csv.Error as error:
        raise BadInput("observed", path.name, f"repair the table: {error}") from None
    if not rows or MARK not in rows[0]:
        return None
    low, high = site.slope.points[0][0], site.slope.points[-1][0]
    found = []
    for k, row in enumerate(rows):
        where = f"observed {path} row {k + 1} {MARK}"
        try:
            value = check.parsed(row[MARK] or "")
        except ValueError:
            raise BadInput(where, row[MARK], "give a number") from None
        found.append(check.number(where, value, low, high))
    return np.array(found)


def keep(folder: Path, name: str, content: bytes, site: Site) -> Path:
    """Keep a file of observations in a project, if it can be read, and return its path.

    Raises
    ------
    BadInput
        If its name cannot be that of a file, or its content is not valid, see `observed`.
    """
    if not NAME.fullmatch(name):
        hint = "give a file NAME.csv; use letters, digits, spaces, -, + and _, at most 60"
        raise BadInput("file of observations", name, hint)
    file = folder / FOLDER / name
    before = file.read_bytes() if file.is_file() else None
    with atomic(file) as part:
        part.write_bytes(content)
    try:
        observed(files(folder), site)
    except BadInput as bad:
        file.unlink()
        if before is not None:
            with atomic(file) as part:
                part.write_bytes(before)
        grid = survey_grid(site)
        hint = f"{bad.hint}. Chainages are those of the page. {grid}" if grid else bad.hint
        raise BadInput(bad.field, bad.value, hint) from None
    return file


class Compared(NamedTuple):
    """Computed values beside the observed ones."""

    releases: int
    """Releases of each event of which the values are."""
    score: float
    """Mean score of the observed values, as the fit minimises it."""
    observed: Mapping[str, Floats]
    computed: Mapping[str, Floats]
    """Values of each set of observations, by its name."""


def compared(site: Site, sets: DataSets, releases: int) -> Compared:
    """Compare releases of a site with observations, as `rigdda fit` does.

    Raises
    ------
    BadInput, Diverged
        As the fit does.
    """
    with IMPORTING:
        from rigdda.app.uncertainty import fit  # heavy: imported by the thread

    seeds = range(releases)
    real = fit.observed_values(site, sets, seeds)
    made = fit.computed(site, sets, "blocks", seeds)
    scale = fit.units(sets)
    each = [fit.scores(made[name], real[name]) / scale[name] for name in sets]
    return Compared(releases, float(np.concatenate(each).mean()), real, made)


class Match:
    """Comparisons of a site with its observations that a thread computes.

    Attributes
    ----------
    found : Compared or None
        The last comparison of the site that was asked for last; None before the first.
    fault : str
        Why there is none; empty if there is no reason.
    """

    def __init__(self) -> None:
        self.found: Compared | None = None
        self.fault = ""
        self._generation = 0
        self._thread: threading.Thread | None = None
        self._lock = threading.Lock()

    def ask(self, site: Site, sets: DataSets) -> None:
        """Compare a site from now on; the comparison of another site ends."""
        with self._lock:
            self._generation += 1
            self.found, self.fault = None, ""
            generation = self._generation
        if sets:
            self._thread = threading.Thread(
                target=self._work, args=(site, sets, generation), name="match", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """End after the releases that are being computed."""
        with self._lock:
            self._generation += 1

    def join(self) -> None:
        """Wait until the comparison has ended."""
        if self._thread is not None:
            self._thread.join()

    def _work(self, site: Site, sets: DataSets, generation: int) -> None:
        fault = ""
        for releases in ROUNDS:
            found = None
            try:
                found = compared(site, sets, releases)
            except Error as error:
                fault = str(error)
            except Exception as error:  # shown on the page
                traceback.print_exc()
                fault = f"{type(error).__name__}: {error}"
            with self._lock:
                if generation != self._generation:
                    return
                if found is not None:
                    self.found, fault = found, ""
                self.fault = fault
            if fault:
                return


def fit_arguments(
    site: Path,
    seen: Observations,
    fitted: Sequence[Parameter],
    budget: int,
    releases: int,
    folder: Path,
    text: str,
) -> list[str]:
    """Return the arguments of the fit of some numbers of a site.

    Parameters
    ----------
    site : path
        The site file.
    seen : Observations
        The observations.
    fitted : sequence of Parameter
        The numbers to fit, within their limits.
    budget, releases : int
        Number of parameter sets, and of releases of each event for each of them.
    folder : path
        Folder of the project, in which the results get a folder of their own.
    text : str
        Text of the site file, which decides on the name of that folder.

    Raises
    ------
    BadInput
        If there are no observations to fit to, or no numbers to fit.
    """
    if not seen.files:
        raise BadInput("observations", None, "add a file of observations first")
    if not fitted:
        raise BadInput("parameters", [], "choose at least one number to fit")
    asked = [str(path) for path in seen.files]
    for one in fitted:
        asked += ["--parameters", f"{one.path}={one.low:g}:{one.high:g}"]
    asked += ["--budget", str(budget), "--releases", str(releases), "--seed", "0"]
    texts = [path.read_text(encoding="utf-8") for path in seen.files]
    key = hashlib.sha256("\0".join([text, *texts, *asked]).encode()).hexdigest()
    return ["fit", str(site), *asked, "--out", str(folder / f"fit-{key[:8]}")]


class Row(NamedTuple):
    """A fitted number."""

    path: tuple[str, ...]
    fitted: float
    low: float
    high: float
    """Its value and its 95 % interval."""
    identified: bool
    """Whether the observations determine it."""


def fit_rows(folder: Path) -> list[Row]:
    """Return the fitted numbers in the results folder of a fit; empty before it has ended."""
    try:
        with (folder / "fit.csv").open(newline="", encoding="utf-8") as file:
            table: list[dict[str, Any]] = list(csv.DictReader(file))
    except OSError:
        return []
    return [
        Row(
            tuple(row["what"].split(".")), float(row["fitted"]), float(row["low"]),
            float(row["high"]), row["identified"] == "yes",
        )
        for row in table
        if row["identified"]
    ]  # fmt: skip


def tried(folder: Path) -> int:
    """Return how many parameter sets a fit that is running has computed."""
    with IMPORTING:
        from rigdda.files import UNFINISHED

    return len(list((folder / UNFINISHED).glob("*.npz")))
