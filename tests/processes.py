"""Commands of `rigdda` as real processes, and what they write."""

from __future__ import annotations

import csv
import io
import os
import re
import struct
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import rigdda
from rigdda.app import cli


def rig(*arguments: object, folder: Path, stderr: int = subprocess.PIPE) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "rigdda.app.cli", *map(str, arguments)]
    root = Path(rigdda.__file__).parents[1]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = os.environ | {"PYTHONPATH": path, "PYTHONWARNINGS": "error", "COLUMNS": "80"}
    return subprocess.Popen(
        command, cwd=folder, env=env, stdout=subprocess.PIPE, stderr=stderr, text=True
    )


def run(*arguments: object, folder: Path) -> str:
    """Run to success; return standard output. In a pipe only progress is told, now and then."""
    return run_told(*arguments, folder=folder)[0]


def run_told(*arguments: object, folder: Path) -> tuple[str, list[str]]:
    """Run to success; return standard output and the answers that were told before the end."""
    process = rig(*arguments, folder=folder)
    out, err = process.communicate(timeout=300)
    told = [line for line in err.splitlines() if not re.search(r": [\d,]+ of [\d,]+$", line)]
    other = [line for line in told if not line.startswith("so far, with ")]
    assert (process.returncode, other) == (0, [])
    return out, told


def refused(*arguments: object, folder: Path) -> str:
    """Ask for what is refused, in this process; return the one line on standard error."""
    out, err = io.StringIO(), io.StringIO()
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        code = cli.main(list(map(str, arguments)))
    assert (code, out.getvalue()) == (2, ""), err.getvalue()
    line = err.getvalue()
    assert line.count("\n") == 1 and line.endswith("\n") and "Traceback" not in line
    return line


def png_size(file: Path) -> tuple[int, int]:
    head = file.read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    return struct.unpack(">II", head[16:24])


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))
