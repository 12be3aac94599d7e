"""Commands of `rigdda`, in this process or in one of their own, and what they write."""

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
from unittest.mock import patch

import rigdda
from rigdda.app import cli


def rig(*arguments: object, folder: Path, stderr: int = subprocess.PIPE) -> subprocess.Popen[str]:
    """Start a process of its own."""
    command = [sys.executable, "-m", "rigdda.app.cli", *map(str, arguments)]
    root = Path(rigdda.__file__).parents[1]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = os.environ | {"PYTHONPATH": path, "PYTHONWARNINGS": "error", "COLUMNS": "80"}
    return subprocess.Popen(
        command, cwd=folder, env=env, stdout=subprocess.PIPE, stderr=stderr, text=True
    )


def run_process(*arguments: object, folder: Path) -> str:
    """Run to success in a process of its own; return standard output."""
    process = rig(*arguments, folder=folder)
    out, err = process.communicate(timeout=300)
    return _success(process.returncode, out, err)[0]


def run(*arguments: object, folder: Path) -> str:
    """Run to success in this process, in which imports and kernels are loaded; return its output.

    Standard error is no terminal, so that only progress is told, now and then.
    """
    return run_told(*arguments, folder=folder)[0]


def run_told(*arguments: object, folder: Path) -> tuple[str, list[str]]:
    """Run to success; return standard output and the answers that were told before the end."""
    return _success(*called(*arguments, folder=folder))


def refused(*arguments: object, folder: Path) -> str:
    """Ask for what is refused, in this process; return the one line on standard error."""
    code, out, line = called(*arguments, folder=folder)
    assert (code, out) == (2, ""), line
    assert line.count("\n") == 1 and line.endswith("\n") and "Traceback" not in line
    return line


def called(*arguments: object, folder: Path) -> tuple[int, str, str]:
    """Run a command in this process; return its exit code and what it wrote on both streams."""
    out, err = io.StringIO(), io.StringIO()
    with (
        patch.dict(os.environ, COLUMNS="80"),
        chdir(folder),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        code = cli.main(list(map(str, arguments)))
    return code, out.getvalue(), err.getvalue()


def _success(code: int, out: str, err: str) -> tuple[str, list[str]]:
    """Check that a command succeeded; return its output and the answers before the end."""
    told = [line for line in err.splitlines() if not re.search(r": [\d,]+ of [\d,]+$", line)]
    other = [line for line in told if not line.startswith("so far, with ")]
    assert (code, other) == (0, [])
    return out, told


def png_size(file: Path) -> tuple[int, int]:
    head = file.read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    return struct.unpack(">II", head[16:24])


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))
