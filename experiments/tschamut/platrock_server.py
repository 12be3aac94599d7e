"""Run-outs by PlatRock 2D: one JSON request per line on stdin, one JSON answer per line on stdout.

It needs a Python environment of its own, because PlatRock 0.4.6 requires older numpy and numba than
`rigdda` (and is licensed under GPL-3, so that this project does not import any of it):

    python -m venv VENV && VENV/bin/pip install "numpy<2.1" cython setuptools poetry-core
    VENV/bin/pip install --no-build-isolation platrock==0.4.6

PlatRock requires the system library GDAL to start, and downloads data on trees for each simulation.
The 2D model without forest uses neither; substitutes are set up here.
"""

import json
import os
import sys
import tempfile
import time
import types
from pathlib import Path


def main() -> None:
    """Answer requests until stdin is closed."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # PlatRock prints to stdout
    os.chdir(tempfile.mkdtemp())  # and writes logs to the current folder
    stand_in_for_gdal()
    import platrock
    from platrock.Common import BounceModels, Debug
    from platrock.TwoD import Objects, Simulations

    Debug.init(Debug.ERROR)
    platrock.SICONOS_FOUND = False  # only needed for polygonal blocks; set by its main program
    BounceModels.Toe_Tree_2022.__init__ = lambda self: None  # downloads
    for line in sys.stdin:
        asked = json.loads(line)
        found = [run(Objects, Simulations, asked, volume) for volume in asked["volumes"]]
        answer = {"run_outs": found, "cpu": time.process_time()}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def stand_in_for_gdal() -> None:
    """Provide a substitute for GDAL that PlatRock can import."""
    command = Path("gdal-config")
    command.write_text("#!/bin/sh\necho 0\n", encoding="utf-8")
    command.chmod(0o755)
    os.environ["PATH"] = f"{Path.cwd()}{os.pathsep}{os.environ['PATH']}"
    osgeo = types.ModuleType("osgeo")
    osgeo.__version__ = "0"
    for name in ("gdal", "ogr", "osr"):
        part = types.ModuleType(f"osgeo.{name}")
        part.UseExceptions = lambda: None
        setattr(osgeo, name, part)
        sys.modules[f"osgeo.{name}"] = part
    sys.modules["osgeo"] = osgeo


def run(objects, simulations, asked: dict, volume: float) -> list[float]:
    """Return the run-outs of blocks of a volume [m3], as chainages of the profile [m]."""
    points = asked["points"]
    shift = points[0][0]  # PlatRock's chainages begin at 0
    lines = [f"{x - shift}\t{z}\n" for x, z in points]
    Path("terrain.csv").write_text("X\tZ\n" + "".join(lines), encoding="utf-8")
    low, high = (x - shift for x in asked["band"])
    start = {
        "nb_rocks": asked["releases"],
        "rocks_volume": volume,
        "rocks_density": asked["density"],
        "rocks_min_x": low,
        "rocks_max_x": high,
        "rocks_min_z": 0.1,
        "rocks_max_z": 0.3,
        "rocks_vx": asked["speed"],
        "rocks_vz": 0.0,
        "rocks_angVel": 0.0,
    }
    simulation = simulations.Simulation(
        terrain=objects.Terrain("terrain.csv"),
        rocks_start_params=start,
        random_seed=asked["seed"],
        enable_forest=False,
    )
    simulation.override_rebound_params = True
    simulation.override_bounce_model_number = 0  # normal and tangential restitution
    for name in ("R_n", "R_t", "roughness", "mu_r"):
        setattr(simulation, f"override_{name}", asked[name])
    os.makedirs(simulation.get_dir(), exist_ok=True)
    simulation.run()
    ends = [simulation.output.get_contacts_pos(i)[-1, 0] for i in range(asked["releases"])]
    return [float(x + shift) for x in ends]


if __name__ == "__main__":
    main()
