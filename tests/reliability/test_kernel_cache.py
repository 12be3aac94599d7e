"""A cache of compiled kernels that cannot be written or read costs time and nothing else."""

from __future__ import annotations

import gc
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from rigdda import kernel, numba_internals
from rigdda.errors import Error

SOURCE = """
from rigdda.kernel import arithmetic_kernel, entry_kernel, kernel, stage


@arithmetic_kernel
def add(x: float, y: float) -> float:
    return x + y


@kernel
def twice(x: float) -> float:
    return add(x, x)


@stage
def whole(x: float) -> float:
    return twice(x)


@entry_kernel
def double(x: float) -> float:
    return whole(x)
"""


@pytest.fixture
def places(tmp_path, monkeypatch):
    """Give the process a cache and a temporary folder of its own; returns both."""
    cache, temporary = tmp_path / "cache", tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    monkeypatch.setattr(kernel, "source_hash", lambda: "0")
    kernel._process_home.cache_clear()
    yield cache, temporary
    kernel._process_home.cache_clear()


@pytest.fixture
def double(places, tmp_path):
    """Return a function that loads the tiny kernel anew, as another process would."""
    (tmp_path / "tiny.py").write_text(SOURCE)

    def load():
        spec = importlib.util.spec_from_file_location("tiny", tmp_path / "tiny.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.double

    return load


def hits(entry) -> int:
    """Return how many versions of a kernel came from the cache."""
    return sum(entry.stats.cache_hits.values())


def test_only_entry_kernels_become_machine_code(double):
    entry = double()
    assert entry(3.0) == 6.0 and hits(entry) == 0
    inner = entry.py_func.__globals__["twice"].overloads
    assert [type(part.library) for part in inner.values()] == [numba_internals.LinkedLibrary]
    again = double()
    assert again(3.0) == 6.0 and hits(again) == 1


@pytest.mark.parametrize("collecting", [True, False])
def test_compilation_leaves_garbage_collection_as_it_was(double, collecting):
    before = gc.isenabled()
    try:
        (gc.enable if collecting else gc.disable)()
        double()(3.0)
        assert gc.isenabled() is collecting
    finally:
        (gc.enable if before else gc.disable)()


def test_the_users_cache_is_taken_where_it_can_be_written(places):
    cache, temporary = places
    assert kernel.cache_directory() == cache / "rigdda" / "kernels-0"
    assert not list(temporary.iterdir())


def test_without_a_place_of_its_own_the_cache_is_below_home(places, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", lambda: places[0])
    assert kernel.cache_directory() == places[0] / ".cache" / "rigdda" / "kernels-0"


def without_home(cache, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")

    def home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", home)


def with_a_file_for_the_cache(cache, monkeypatch):
    cache.write_text("")


def with_a_file_for_the_folder(cache, monkeypatch):
    (cache / "rigdda").mkdir(parents=True)
    (cache / "rigdda" / "kernels-0").write_text("")


def refuse(monkeypatch, refused):
    """Let temporary files be refused in some folders, as for one without the right to write."""
    make = tempfile.TemporaryFile

    def made(*arguments, dir=None, **options):
        if refused(Path(dir)):
            raise PermissionError(13, "Permission denied", str(dir))
        return make(*arguments, dir=dir, **options)

    monkeypatch.setattr(tempfile, "TemporaryFile", made)


def with_a_folder_of_root(cache, monkeypatch):
    refuse(monkeypatch, lambda folder: folder.name == "kernels-0" and cache in folder.parents)


def with_a_folder_of_root_inside(cache, monkeypatch):
    (cache / "rigdda" / "kernels-0" / "dynamics_1").mkdir(parents=True)
    refuse(monkeypatch, lambda folder: folder.name == "dynamics_1")


@pytest.mark.parametrize(
    "spoil",
    [
        without_home,
        with_a_file_for_the_cache,
        with_a_file_for_the_folder,
        with_a_folder_of_root,
        with_a_folder_of_root_inside,
    ],
)
def test_else_it_is_in_a_temporary_folder_of_the_user(places, double, monkeypatch, spoil):
    cache, temporary = places
    spoil(cache, monkeypatch)
    folder = kernel.cache_directory()
    own = f"rigdda-{os.getuid()}" if hasattr(os, "getuid") else "rigdda"
    assert folder == temporary / own / "kernels-0" and folder.is_dir()
    assert double()(3.0) == 6.0
    again = double()
    assert again(3.0) == 6.0 and hits(again) == 1


def test_users_without_a_number_have_one_temporary_folder(places, monkeypatch):
    without_home(places[0], monkeypatch)
    monkeypatch.delattr(os, "getuid", raising=False)
    assert kernel.cache_directory() == places[1] / "rigdda" / "kernels-0"


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users have no numbers")
def test_a_temporary_folder_of_another_user_is_not_taken(places, monkeypatch):
    cache, temporary = places
    without_home(cache, monkeypatch)
    (temporary / "rigdda-12345").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: 12345)  # who does not own what was just made
    folder = kernel.cache_directory()
    assert folder.parent.parent == temporary and folder.parent.name != "rigdda-12345"
    assert kernel.cache_directory() == folder  # throughout the process


def test_without_any_folder_it_says_what_to_set(places, monkeypatch):
    refuse(monkeypatch, lambda folder: True)
    with pytest.raises(Error, match="XDG_CACHE_HOME or TMPDIR"):
        kernel.cache_directory()


def truncate(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path):
    path.write_bytes(b"")


def fill_with_zeros(path):
    path.write_bytes(bytes(path.stat().st_size))


def zero_the_middle(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 3 : 2 * len(data) // 3] = bytes(2 * len(data) // 3 - len(data) // 3)
    path.write_bytes(data)


def replace_by_nonsense(path):
    path.write_bytes(b"nonsense" * 100)


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "spoil", [truncate, empty, fill_with_zeros, zero_the_middle, replace_by_nonsense, Path.unlink]
)
def test_spoilt_files_are_compiled_again(places, double, spoil, ending):
    assert double()(3.0) == 6.0
    (file,) = places[0].rglob(f"*.{ending}")
    spoil(file)
    mended = double()
    assert mended(3.0) == 6.0 and hits(mended) == 0
    again = double()
    assert again(3.0) == 6.0 and hits(again) == 1


def test_kernels_that_cannot_be_kept_are_compiled_all_the_same(places, double, monkeypatch):
    entry = double()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(numba_internals.CheckedFile, "save", full)
    with pytest.warns(RuntimeWarning, match="No space left on device"):
        assert entry(3.0) == 6.0


@pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0 or shutil.which("setpriv") is None,
    reason="needs root, who alone can run as a user without an entry",
)
def test_a_user_without_an_entry_whose_home_is_of_root(tmp_path):
    """The real thing: a process of user 54321, with a home folder that it may not write."""
    reader = ["setpriv", "--reuid=54321", "--regid=54321", "--clear-groups"]
    if subprocess.run([*reader, sys.executable, "-c", "import numba"], check=False).returncode:
        pytest.skip("another user may not read this Python")
    (tmp_path / "home").mkdir()
    temporary = Path(tempfile.mkdtemp(dir="/tmp"))
    temporary.chmod(0o777)
    code = "from rigdda.kernel import cache_directory; print(cache_directory().parent)"
    root = str(Path(kernel.__file__).parents[1])
    kept = {name: value for name, value in os.environ.items() if name != "XDG_CACHE_HOME"}
    try:
        for home in ({"HOME": str(tmp_path / "home")}, {}):
            env = {**kept, "PYTHONPATH": root, "TMPDIR": str(temporary)}
            env = {**{k: v for k, v in env.items() if k != "HOME"}, **home}
            command = [*reader, sys.executable, "-c", code]
            done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            assert done.stdout.strip() == str(temporary / "rigdda-54321")
    finally:
        shutil.rmtree(temporary)
