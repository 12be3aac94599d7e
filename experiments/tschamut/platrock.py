"""PlatRock for comparison, in a separate process: see `platrock_server`."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from rigdda import Site
from rigdda.app.uncertainty.parameters import Floats, Parameter

PYTHON = "PLATROCK_PYTHON"
"""Environment variable with the Python that has PlatRock installed; without it, PlatRock is
skipped."""

PARAMETERS = (
    Parameter("R_n", 0.0, 0.8),
    Parameter("R_t", 0.4, 0.95),
    Parameter("roughness", 0.0, 0.5),
    Parameter("mu_r", 0.1, 1.2),
)
"""Fitted parameters of PlatRock: restitutions, roughness [m] and rolling coefficient."""

MASSES = {"block 1": 69.0, "block 2": 79.0, "block 4": 40.0}
"""Masses of the blocks [kg]."""

DENSITY = 2650.0


class PlatRock:
    """PlatRock's 2D model on a site, as a context manager.

    Parameters
    ----------
    python : str
        Python with PlatRock installed, 3.11 or newer.
    site : Site
        The site, for its ground and the starting positions of blocks.
    """

    def __init__(self, python: str, site: Site):
        self._site = site
        self._errors = tempfile.TemporaryFile("w+")
        server = Path(__file__).with_name("platrock_server.py").resolve()
        self._process = subprocess.Popen(
            [python, "-P", str(server)],  # keep this folder off its path
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )
        self.cpu = 0.0
        """Its processor time so far [s]."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()
        self._errors.close()

    def run_outs(self, values: Floats, seeds: range) -> Mapping[str, Floats]:
        """Return the run-outs of each block [m], one per seed.

        Raises
        ------
        RuntimeError
            If PlatRock stops, with its error output.
        """
        source = self._site.sources[0]
        asked = {p.path: float(v) for p, v in zip(PARAMETERS, values, strict=True)} | {
            "points": self._site.slope.points,
            "volumes": [mass / DENSITY for mass in MASSES.values()],
            "density": DENSITY,
            "band": source.band,
            "speed": 0.5 * sum(source.speed),
            "releases": len(seeds),
            "seed": seeds.start,
        }
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        try:
            stdin.write(json.dumps(asked) + "\n")
            stdin.flush()
            line = stdout.readline()
        except OSError:
            line = ""
        if not line:
            self._process.wait()
            self._errors.seek(0)
            raise RuntimeError(f"PlatRock stopped: {self._errors.read()}")
        answer = json.loads(line)
        self.cpu = answer["cpu"]
        return dict(zip(MASSES, map(np.array, answer["run_outs"]), strict=True))
