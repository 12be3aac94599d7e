"""Kernels are compiled by numba as it is where its internal parts are not those of today."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.caching import FunctionCache
from numba.core.codegen import CPUCodeLibrary
from numba.core.options import DefaultOptions
from numba.core.targetconfig import TargetConfig

from rigdda import kernel, numba_internals

ROOT = Path(kernel.__file__).parents[1]

TINY = """
from rigdda.kernel import INTERNALS, Direct, arithmetic_kernel, entry_kernel, inlined, kernel, stage


@arithmetic_kernel
def add(x: float, y: float) -> float:
    return x + y


@inlined
def twice(x: float) -> float:
    return add(x, x)


@kernel
def thrice(x: float) -> float:
    return x + twice(x)


@stage
def whole(x: float) -> float:
    return thrice(x)


@entry_kernel
def triple(x: float) -> float:
    return whole(x)


direct = Direct(triple)
print(INTERNALS is None, direct.call(2.0), direct.call(3.0), sum(triple.stats.cache_hits.values()))
"""

SPOILT = {
    "without a class": "import numba.core.codegen as c; del c.JITCodeLibrary",
    "without a module": "import sys; sys.modules['numba.core.targetconfig'] = None",
    "without an option": "import numba.core.options as o; del o.DefaultOptions._nrt",
    "with another signature": (
        "from numba.core.caching import FunctionCache as c; save = c.save_overload; "
        "c.save_overload = lambda self, *given: save(self, *given)"
    ),
}
"""Code that makes numba another one before `rigdda.kernel` is imported."""


def run(arguments: list[str], cache: Path | None = None, plain: bool = False) -> str:
    """Run Python in a process of its own; return what it prints."""
    env = {**os.environ, "PYTHONPATH": str(ROOT)} | ({kernel.PLAIN: "1"} if plain else {})
    if cache is not None:
        env["XDG_CACHE_HOME"] = str(cache)
    done = subprocess.run(
        [sys.executable, *arguments], env=env, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_internal_parts_of_this_numba_are_as_expected() -> None:
    assert numba_internals.unexpected() == []
    assert kernel.INTERNALS is numba_internals


def test_parts_that_are_missing_or_different_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(CPUCodeLibrary, "_finalize_dynamic_globals")
    monkeypatch.delattr(DefaultOptions, "_nrt")
    monkeypatch.setattr(FunctionCache, "save_overload", lambda self, signature, data: None)
    monkeypatch.setattr(TargetConfig, "__init__", lambda self, copy_from=None: None)
    assert numba_internals.unexpected() == [
        "JITCodeLibrary._finalize_dynamic_globals",
        "FunctionCache.save_overload",
        "DefaultOptions._nrt",
        "TargetConfig._values",
    ]


def test_numba_is_left_as_it_is_on_request(tmp_path: Path) -> None:
    (tmp_path / "tiny.py").write_text(TINY)
    first, second = (run([str(tmp_path / "tiny.py")], tmp_path, plain=True) for _ in range(2))
    assert first.split() == ["True", "6.0", "9.0", "0"]
    assert second.split() == ["True", "6.0", "9.0", "1"]
    assert [path.name[:6] for path in (tmp_path / "rigdda").iterdir()] == ["plain-"]


@pytest.mark.parametrize("spoil", SPOILT)
def test_another_numba_is_used_as_it_is_with_a_warning(spoil: str, tmp_path: Path) -> None:
    start = "import numba\n" if spoil == "without a module" else ""
    (tmp_path / "tiny.py").write_text(f"{start}{SPOILT[spoil]}\n{TINY}")
    out = run([str(tmp_path / "tiny.py")], tmp_path)
    assert out.startswith("True 6.0 9.0 0\n") and "RuntimeWarning: numba " in out


DIGEST = """
from experiments.outcomes import outcomes_of
from rigdda import Ditch, Site
site = Site.load("quick")
print(*(outcomes_of(site, (Ditch(29.5, 1.0, 4.0),), event) for event in site.event_names))
"""

PHYSICS = ("test_lone_block.py", "test_restitution.py", "test_gravity_walls.py")


@pytest.mark.slow
def test_physics_and_outcomes_are_the_same_with_numba_as_it_is() -> None:
    assert run(["-c", DIGEST], plain=True) == run(["-c", DIGEST])
    files = [f"tests/physics/{name}" for name in PHYSICS]
    run(["-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *files], plain=True)
