"""Every code block of the README and of the documentation runs.

The blocks of a page run in their order in a folder of their own: Python in one namespace, commands
of `rigdda` with budgets that are small. A file that a page tells the reader to save ("Save this as
`NAME`", or "the result" of a change of the site) is there for what follows. A block that no rule
covers fails. Cells of notebooks run when the documentation is built.
"""

from __future__ import annotations

import re
import shlex
import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path

import pytest
import tomli_w

import rigdda
from rigdda import BadInput
from rigdda.app import browser, cli, studies

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "PYPI.md",
    *sorted(p for p in DOCS.rglob("*.md") if "_build" not in p.parts),
]

BLOCK = re.compile(r"^(?:```|~~~)(\S*)[^\n]*\n(.*?)^(?:```|~~~)$", re.MULTILINE | re.DOTALL)
SAVED = re.compile(r"[Ss]ave\s+(?:this|the\s+result)\s+as\s+`([\w.-]+)`")

SMALL = {
    "design": ["--budget", "60", "--verify", "20", "--ground-samples", "1"],
    "corridor": ["--releases", "200"],
    "exam": ["--sites", "1", "--budget", "20", "--verify", "10"],
    "dataset": ["--sites", "2", "--layouts", "4", "--releases", "10"],
    "evaluate": ["--budget", "30", "--sites", "1", "--verify", "20"],
    "fidelity": ["--releases", "10"],
    "fit": ["--budget", "8", "--releases", "10"],
    "sensitivity": ["--samples", "2", "--releases", "10"],
    "simulate": ["--releases", "4"],
    "train": ["--compare", "1", "--verify", "20"],
    "validate": ["--only", "free flight"],
}
"""Options that come last, and so count, in place of those of the page."""

ELSEWHERE = (
    "python3 -m venv",  # README's second command is the first line of .ci/run
    ". .venv/bin/activate",
    "pip install ",
    ".venv/bin/pip install ",
    "sphinx-build ",  # .ci/run builds the documentation
)
"""Beginnings of commands that set up a machine."""

FEWER = {
    "releases=300)": "releases=200)",
    "model.learn(256)": "model.learn(8)",
    "n_steps=4, batch_size=16": "n_steps=4, batch_size=8",
    '", 16, site': '", 2, site',
    "simulations=2000": "simulations=60",
    "simulations=600": "simulations=60",
    "simulations=500": "simulations=60",
    "simulations=300": "simulations=60",
}
"""What is shorter in the Python of a page than the reader has it."""

SLOW = {
    "PYPI.md",
    "README.md",
    "docs/environments/Corridor-v0.md",
    "docs/howto/checks.md",
    "docs/howto/compare_layouts.md",
    "docs/howto/corridor.md",
    "docs/howto/exam.md",
    "docs/howto/fit.md",
    "docs/howto/long_study.md",
    "docs/howto/precision.md",
    "docs/howto/report.md",
    "docs/howto/sensitivity.md",
    "docs/howto/stations.md",
    "docs/howto/step_and_fidelity.md",
    "docs/howto/traffic.md",
    "docs/howto/what_if.md",
    "docs/tutorials/engineer.md",
    "docs/tutorials/researcher.md",
}
"""Pages that take much processor time."""

SKIPPED = {"", "text", "{toctree}", "{eval-rst}", "{code-cell}"}
"""Blocks that are no code, and cells, which run when the documentation is built."""


@dataclass(frozen=True)
class Block:
    """A block of a page: its language, its text, and the name of the file that it is saved as."""

    language: str
    text: str
    name: str | None


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page in their order."""
    text, out, end = page.read_text(encoding="utf-8"), [], 0
    for found in BLOCK.finditer(text):
        names = SAVED.findall(text[end : found.start()])
        out.append(Block(found[1], found[2], names[-1] if names else None))
        end = found.end()
    return out


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def parameter(page: Path):
    """Return a page as a parameter of a test, marked if it takes minutes."""
    marks = [pytest.mark.slow] if name(page) in SLOW else []
    return pytest.param(page, id=name(page), marks=marks)


def with_code(page: Path) -> bool:
    return any(block.language not in SKIPPED for block in blocks(page))


def run_python(text: str, made: dict[str, object]) -> None:
    for long, short in FEWER.items():
        text = text.replace(long, short)
    text = re.sub(r"seeds=range\(\d+\)", "seeds=range(12)", text)
    exec(compile(text, "block", "exec"), made)


def run_shell(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for line in text.strip().splitlines():
        for command in line.split(" && "):
            run_command(command, monkeypatch)


def has_browser() -> bool:
    """Return whether a browser that prints is installed; a fresh machine may have none."""
    try:
        browser.find()
    except BadInput:
        return False
    return True


def run_command(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a command of `rigdda`; one that would open a window must name a replay."""
    if command.startswith(ELSEWHERE) or command.endswith("bin/pytest"):
        return
    program, *arguments = shlex.split(command)
    assert program.removeprefix(".venv/bin/") == "rigdda", f"no rule for: {command}"
    if "--pdf" in arguments and not has_browser():
        arguments.remove("--pdf")
    opened: list[Path] = []
    monkeypatch.setattr("rigdda.replay.viewer.open_viewer", opened.append)
    assert cli.main([*arguments, *SMALL.get(arguments[0], [])]) == 0, command
    assert all(path.is_file() for path in opened)


def read_toml(block: Block, site: str) -> str:
    """Read a file: a site, study, layout, corridor or tables of a site; return the site so far."""
    tables = tomllib.loads(block.text)
    if "layouts" in tables:
        assert block.name
        assert studies.load(block.name).size > 0
    elif "table" in tables:
        example = Path("examples/corridor/pass-road.toml")
        assert tables == tomllib.loads(example.read_text(encoding="utf-8"))
        assert rigdda.Corridor.load(example).length > 0.0
    elif "sections" in tables:
        assert block.name
        Path(block.name).write_text(block.text, encoding="utf-8")
        assert rigdda.Corridor.load(block.name).length > 0.0
    elif "barriers" in tables:
        Path("layout-of-page.toml").write_text(block.text, encoding="utf-8")
        assert rigdda.load_layout("layout-of-page.toml")
    else:
        site = block.text if "slope" in tables else extended(site, tables)
        rigdda.Site.parse(site, "block")
        if block.name:
            Path(block.name).write_text(site, encoding="utf-8")
    return site


def extended(site: str, more: dict) -> str:
    """Return a site with tables of a page put in; lists of tables grow."""
    data = tomllib.loads(site)
    for key, value in more.items():
        if key == "surfaces" and isinstance(value, list):  # stretches, which are under [slope]
            data["slope"]["surfaces"] = value
        elif isinstance(value, list):
            data[key] = [*data.get(key, []), *value]
        else:
            data[key] = {**data.get(key, {}), **value}
    return tomli_w.dumps(data)


@pytest.mark.filterwarnings("ignore::rigdda.DoubtfulInput")
@pytest.mark.parametrize("page", [parameter(p) for p in PAGES if with_code(p)])
def test_every_block_runs(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if re.search(
        r"stable_baselines3|sb3_vec_env|^rigdda train", page.read_text("utf-8"), re.MULTILINE
    ):
        pytest.importorskip("stable_baselines3", reason="needs the extra rl")
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    made: dict[str, object] = {"__name__": "block"}
    site = rigdda.sites.text("narrow")
    for block in blocks(page):
        if block.name:
            few = re.sub(r"^releases = \d+", "releases = 2", block.text, flags=re.MULTILINE)
            Path(block.name).write_text(few, encoding="utf-8")
        if block.language == "python":
            run_python(block.text, made)
        elif block.language in ("sh", "bash"):
            run_shell(block.text, monkeypatch)
        elif block.language == "toml":
            site = read_toml(block, site)
        else:
            assert block.language in SKIPPED, f"no rule for a block of {block.language!r}"
    capsys.readouterr()


def test_pages_have_code_to_run() -> None:
    found = {name(page) for page in PAGES if with_code(page)}
    assert {"README.md", "docs/tutorials/engineer.md", "docs/tutorials/researcher.md"} <= found
    pages = {name(page) for page in (DOCS / "howto").glob("*.md")} - {"docs/howto/index.md"}
    assert pages <= found


def test_every_fence_belongs_to_a_block() -> None:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        fences = re.findall(r"^(?:```|~~~)", text, re.MULTILINE)
        assert len(fences) == 2 * len(blocks(page)), name(page)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_page_begins_with_its_title(page: Path) -> None:
    text = re.sub(r"\A---\n.*?\n---\n", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert text.lstrip().startswith("# ")


def test_every_public_name_is_in_the_reference() -> None:
    listed = "\n".join(p.read_text(encoding="utf-8") for p in (DOCS / "api").glob("*.md"))
    named = set(re.findall(r"^   ([\w.]+)$", listed, re.MULTILINE))
    modules = {"sites", "limit_equilibrium", "grounds"}  # by their functions, or on another page
    aliases = {"Barrier", "Layout"}
    assert set(rigdda.__all__) - modules - aliases <= named
    assert set(rigdda.envs.__all__) <= named
    assert {f"{name}.design" for name in rigdda.agents.DESIGNERS} <= named


LINK = re.compile(r"\]\(([^()\s:#]+)(?:#[^()\s]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_to_files_of_the_repository(page: Path) -> None:
    text = re.sub(BLOCK, "", page.read_text(encoding="utf-8"))
    for target in LINK.findall(text):
        assert (page.parent / target).exists(), f"{name(page)}: {target}"
