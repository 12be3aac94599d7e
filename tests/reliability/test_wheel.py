"""A wheel that is built from the source distribution does its work outside the checkout.

It is installed into an environment of its own, which finds the packages that it depends on in that
of the tests, and used in a folder whose owner has packages `envs` and `agents`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest

import rigdda

ROOT = Path(rigdda.__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGE = (ROOT / "PYPI.md").read_text(encoding="utf-8")
SCRIPTS = "Scripts" if os.name == "nt" else "bin"

pytestmark = pytest.mark.slow

PROGRAM = """
import multiprocessing

import agents
import envs
import gymnasium
import rigdda.agents
import rigdda.envs


def reward(seed: int) -> float:
    env = gymnasium.make("rigdda/BarrierDesign-v0", site="quick", releases=1)
    env.action_space.seed(seed)
    env.reset(seed=seed)
    return float(env.step(env.action_space.sample())[1])


if __name__ == "__main__":
    assert (envs.OWNER, agents.OWNER) == ("user", "user")
    vector = gymnasium.make_vec("rigdda/BarrierDesign-v0", num_envs=2, site="quick", releases=1)
    vector.reset(seed=0)
    rewards = vector.step(vector.action_space.sample())[1]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map(reward, [0, 1])
    print(rewards.shape, there == [reward(0), reward(1)], rigdda.__file__)
"""

TYPED = """
import rigdda
from rigdda.agents import race
from rigdda.envs import DesignProblem


def spend(name: str) -> float:
    problem = DesignProblem(rigdda.Site.load(name))
    return race.design(problem, simulations=100, seed=0).evaluation.objective


fence = rigdda.Fence(x={x}, height=3.0, energy_class=1000)
"""


@dataclass(frozen=True)
class Installed:
    """A wheel in an environment, and a folder of a user to work in.

    `run` runs a program of the environment there and returns what it writes.
    """

    python: Path
    folder: Path
    variables: dict[str, str]

    def run(self, program: str, *arguments: str, code: int = 0) -> str:
        """Run a program of the environment in the user's folder."""
        command = [str(self.python.parent / program), *arguments]
        done = subprocess.run(
            command, cwd=self.folder, env=self.variables, capture_output=True, text=True
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a source distribution and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("build")
    passed = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "dist", "runs")
    shutil.copytree(ROOT, folder / "source", symlinks=True, ignore=passed)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder / "dist")]
    done = subprocess.run([*command, str(folder / "source")], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "dist"


@pytest.fixture(scope="module")
def wheel(built: Path) -> Path:
    """Return the wheel."""
    (found,) = built.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Return the wheel in an environment and a folder with packages `envs` and `agents`."""
    home, folder = tmp_path_factory.mktemp("environment"), tmp_path_factory.mktemp("user")
    venv.create(home, with_pip=False)
    python = home / SCRIPTS / Path(sys.executable).name
    variables = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PYTEST"))}
    variables["XDG_CACHE_HOME"] = str(home / "cache")
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--no-index", str(wheel)], env=variables, check=True)
    (packages,) = home.rglob("site-packages")
    others = [path for path in sys.path if "site-packages" in Path(path).parts]
    (packages / "others.pth").write_text("\n".join(others) + "\n", encoding="utf-8")
    for name in ("envs", "agents"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text('OWNER = "user"\n', encoding="utf-8")
    return Installed(python, folder, variables)


def sources() -> set[str]:
    """Return the files of the package in the checkout."""
    kept = (".py", ".pyi", ".toml", ".json", ".jinja", ".css", ".safetensors", ".xz", "py.typed")
    return {
        (Path(folder) / name).relative_to(ROOT).as_posix()
        for folder, _, names in os.walk(ROOT / "rigdda")
        for name in names
        if name.endswith(kept)
    }


def test_the_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        names = [name for name in file.namelist() if ".dist-info/" not in name]
        (metadata,) = (name for name in file.namelist() if name.endswith("/METADATA"))
        told = file.read(metadata).decode()
    assert len(names) == len(set(names))
    assert set(names) == sources()
    assert f"\nVersion: {rigdda.__version__}\n" in told and "# rigdda" in told


def test_the_source_distribution_holds_files_and_no_links(built: Path) -> None:
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as file:
        members = file.getmembers()
    assert all(member.isfile() or member.isdir() for member in members)
    names = {member.name.partition("/")[2] for member in members if member.isfile()}
    assert sources() | {"CHANGELOG.md", "CITATION.cff", "LICENSE", "PYPI.md"} <= names
    assert not any(name.startswith(("tests/", "experiments/")) for name in names)


def test_the_command_line_answers(installed: Installed) -> None:
    assert installed.run("rigdda", "--version").strip() == f"rigdda {rigdda.__version__}"
    told = installed.run("rigdda", "--help")
    assert all(name in told for name in ("sites", "simulate", "design", "replay"))
    assert "shu-hwa" in installed.run("rigdda", "sites")


def test_environments_are_made_beside_the_users_own_packages(installed: Installed) -> None:
    """By name alone, vectorised, and in a process that is started afresh."""
    by_name = "import gymnasium; gymnasium.make('rigdda.envs:rigdda/BarrierDesign-v0')"
    installed.run("python", "-c", by_name)
    (installed.folder / "program.py").write_text(PROGRAM, encoding="utf-8")
    shape, same, place = installed.run("python", "program.py").strip().rsplit(" ", 2)
    assert (shape, same) == ("(2,)", "True")
    assert Path(place).is_relative_to(installed.python.parents[1])


def test_a_users_file_is_checked_against_the_types_of_the_wheel(installed: Installed) -> None:
    good, bad = installed.folder / "good.py", installed.folder / "bad.py"
    good.write_text(TYPED.format(x="17.0"), encoding="utf-8")
    bad.write_text(TYPED.format(x='"far"'), encoding="utf-8")
    mypy = ("python", "-m", "mypy", "--strict", "--cache-dir", "types")
    assert installed.run(*mypy, "good.py").startswith("Success")
    told = installed.run(*mypy, "bad.py", code=1)
    assert 'Argument "x" to "Fence" has incompatible type "str"' in told


def test_examples_of_the_package_page_run(installed: Installed) -> None:
    examples = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    assert len(examples) == 2
    for example in examples:
        installed.run("python", "-c", example)


def test_the_first_command_of_the_readme_designs_barriers(installed: Installed) -> None:
    """Word for word, but for the installation of the checkout."""
    line = re.search(r"\.venv/bin/rigdda (design .+)$", README, re.M)
    assert line is not None and f"rigdda {line[1]}\n" in PAGE
    told = installed.run("rigdda", *line[1].split())
    assert "optimised (race)" in told and "rock shed" in told
    written = {path.name for path in (installed.folder / "results").iterdir()}
    assert {"layout.toml", "evaluations.csv", "section.png", "cost.png", "episode.rrd"} <= written
    load = "import rigdda; print(len(rigdda.load_layout('results/layout.toml')) > 0)"
    assert installed.run("python", "-c", load).strip() == "True"
