"""The package needs no symbolic link: `envs` and `agents` at the top level only lead to it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rigdda

ROOT = Path(rigdda.__file__).parents[1]
PROGRAM = """
import rigdda
from rigdda.agents import rule
from rigdda.envs import DesignProblem

problem = DesignProblem(rigdda.Site.load("quick"))
print(rigdda.__file__, len(problem.encode(())), rule.__name__)
"""


def answer(checkout: Path) -> list[str]:
    """Return what PROGRAM prints with the package of a checkout."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": str(checkout)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_clone_without_symbolic_links_works(tmp_path: Path) -> None:
    """Git writes text files in place of links, as it does on Windows by default."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a clone")
    clone = tmp_path / "clone"
    command = ["git", "clone", "-q", "-c", "core.symlinks=false", str(ROOT), str(clone)]
    subprocess.run(command, check=True)
    for name in ("envs", "agents"):
        assert (clone / name).is_file() and not (clone / name).is_symlink()
        assert (clone / name).read_text() == f"rigdda/{name}"
    place, numbers, designer = answer(clone)
    assert Path(place).is_relative_to(clone)
    assert int(numbers) > 0 and designer == "rigdda.agents.designers.rule"


def test_the_package_works_without_the_links(tmp_path: Path) -> None:
    passed = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "rigdda", tmp_path / "rigdda", ignore=passed)
    assert not any(path.is_symlink() for path in (tmp_path / "rigdda").rglob("*"))
    assert Path(answer(tmp_path)[0]).is_relative_to(tmp_path)
