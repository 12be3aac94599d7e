"""Files with random faults: each is read, or refused by one line with the field, value and mend.

A fault replaces, removes or renames a value of a sound file, or cuts or garbles its text. The
command line refuses with exit code 2 and one line on standard error.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from rigdda import BadInput, Corridor, Site, load_layout
from rigdda.app import cli, new_site, studies
from rigdda.app.uncertainty import observations

SITE = """
name = "cut"
description = "A cut of 20 m beside a road."

[slope]
points = [[-15.0, 27.0], [0.0, 20.0], [5.0, 0.0], [12.0, 0.0], [21.0, 0.0], [60.0, -2.0]]
toe = 5.0
surfaces = [{ start = 5.0, end = 12.0, surface = "soil" }]

[origin]
chainage = 1000.0
elevation = 500.0
reversed = false

[[sources]]
name = "face"
band = [1.0, 3.0]
corners = [5, 8]

[[sources]]
name = "mass"
polygon = [[-10.0, 24.7], [-6.0, 22.9], [-6.0, 24.5], [-10.0, 26.5]]
joints = [
    { dip_deg = 70.0, spacing = 1.0, scatter = 0.2 },
    { dip_deg = -20.0, spacing = 1.0, scatter = 0.2 },
]

[[events]]
name = "block"
source = "face"
return_period = 5.0
section_length = 200.0
volume = [0.1, 1.0]
number = [1, 3]
width = 4.0
design = true

[[events]]
name = "mass"
source = "mass"
rate = 0.01

[[existing]]
kind = "fence"
x = 6.0
height = 2.0
energy_class = 100
condition = 0.6
removable = true
removal = 80.0

[[meshes]]
name = "net"
price = 60.0
area = 20.0
factors = { block = 0.3 }

[traffic]
vehicles_per_day = 4000.0
section_length = 300.0
speed = 22.0

[road]
start = 12.0
end = 21.0

[barrier_zone]
start = 4.0
end = 11.5
max_height = 4.0

[surfaces.rock]
ground = "hard_rock"
rolling = 0.2

[surfaces.soil]
ground = "hard_soil"

[prices]
fence = { 100 = 150.0, 250 = 200.0 }
lives = { fence = 25.0 }
interest = 0.03

[consequences]
closure = 20000.0

[rule]
risk = 1.1

[motion]
duration = 20.0
dt = 0.01
"""
LAYOUT = """
[[barriers]]
kind = "fence"
x = 7.0
height = 3.0
energy_class = 250

[[barriers]]
kind = "ditch"
x = 9.0
depth = 1.0
width = 2.0
"""
STUDY = """
site = "quick"
releases = 4

[[layouts]]
name = "nothing"

[[layouts]]
name = "fence"
barriers = [{ kind = "fence", x = 17.0, height = 3.0, energy_class = 1000 }]
"""
CORRIDOR = """
name = "valley"
budget = [20000.0, 60000.0]

[[sections]]
site = "quick"
length = 120.0

[[sections]]
name = "second"
site = "verge"
length = 80.0

[prices]
interest = 0.02
"""
SURVEY = """chainage,elevation
2683400.0,1892.0
2683410.0,1890.0
2683422.0,1860.0
2683472.0,1820.0
2683504.0,1804.5
2683512.0,1804.0
2683521.0,1804.0
2683561.0,1800.0
"""
OBSERVED = "event,run_out_m\nblock,30.5\nblock,31.0\nblock,36.5\ngroup,33.0\n"

WRONG: tuple[Any, ...] = (
    -1, 0, 1, 2.5, -1e-12, 1e9, 1e308, -1e308, float("nan"), float("inf"), 10**30, True, False,
    "", "fence", "x\ny", "\N{SNOWMAN}" * 200, [], [1.0], [[1.0, 2.0]], [3.0, 1.0], ["a", None],
    {}, {"a": 1}, [[]], [{}], "2026-01-01", "1,5",
)  # fmt: skip
"""Values for any field; most are wrong."""

Reader = Callable[[Path], object]

FILES: dict[str, tuple[str, Reader, Callable[[str], list[str]]]] = {
    "site.toml": (SITE, Site.load, lambda f: ["check", f]),
    "layout.toml": (LAYOUT, load_layout, lambda f: ["simulate", "quick", "--layout", f]),
    "study.toml": (STUDY, studies.load, lambda f: ["study", f]),
    "corridor.toml": (CORRIDOR, Corridor.load, lambda f: ["corridor", f]),
    "survey.csv": (
        SURVEY,
        lambda path: new_site.compose("a", path, new_site.SiteRequest()),
        lambda f: ["new", "a", "--profile", f],
    ),
    "observed.csv": (
        OBSERVED,
        lambda path: observations.read([path], Site.load("quick")),
        lambda f: ["fit", "quick", f, "--parameters", "surfaces.soil.rolling"],
    ),
}
"""Sound text of a file, what reads it, and a command that does."""


def places(table: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of all values in a table, tables and lists included."""
    inner = table.items() if isinstance(table, dict) else enumerate(table)
    found = []
    for key, value in inner:
        found.append((*path, key))
        if isinstance(value, dict | list):
            found += places(value, (*path, key))
    return found


def with_fault(text: str, rng: np.random.Generator) -> bytes:
    """Return a TOML file with one to three faulty values."""

    table = copy.deepcopy(tomllib.loads(text))
    for _ in range(rng.integers(1, 4)):
        paths = places(table)
        if not paths:
            break
        *above, last = paths[rng.integers(len(paths))]
        holder: Any = table
        for key in above:
            holder = holder[key]
        match rng.integers(5):
            case 0:
                del holder[last]
            case 1 if isinstance(holder, dict):
                holder[f"{last}s"] = holder.pop(last)
            case 2 if isinstance(holder, list):
                holder.append(copy.deepcopy(holder[last]))
            case _:
                holder[last] = copy.deepcopy(WRONG[rng.integers(len(WRONG))])
    try:
        return tomli_w.dumps(table).encode()
    except (TypeError, ValueError):  # None and the like have no TOML
        return garbled(text, rng)


def garbled(text: str, rng: np.random.Generator) -> bytes:
    """Return a text with a part cut out, repeated, or overwritten by random bytes."""
    raw = text.encode()
    start = int(rng.integers(len(raw)))
    end = min(len(raw), start + int(rng.integers(1, 40)))
    match rng.integers(4):
        case 0:
            return raw[:start] + raw[end:]
        case 1:
            return raw[:end] + raw[start:]
        case 2:
            return raw[:start] + rng.bytes(end - start) + raw[end:]
        case _:
            odd = ["nan", "-", ",,", ";", '"', "[[", "1e999", "\x00", "=", "x", "#", "0x", "\n\n"]
            return raw[:start] + odd[rng.integers(len(odd))].encode() + raw[end:]


def refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str], count: int, seed: int) -> int:
    """Read `count` faulty files, check every refusal, and return how many were refused."""
    rng, refused = np.random.default_rng(seed), 0
    for i in range(count):
        name = list(FILES)[i % len(FILES)]
        text, read, command = FILES[name]
        toml = name.endswith(".toml") and rng.random() < 0.75
        path = tmp_path / name
        path.write_bytes(with_fault(text, rng) if toml else garbled(text, rng))
        try:
            read(path)
        except BadInput as error:
            refused += 1
            assert error.field and len(error.mend) > 5, str(error)
            assert "\n" not in str(error) and len(str(error)) < 700, str(error)
            if refused % 5 == 0:  # the command says the same
                out = [] if name == "survey.csv" else ["--out", str(tmp_path / "out")]
                assert cli.main([*command(str(path)), *out]) == 2
                told = capsys.readouterr().err.strip()
                assert told.count("\n") == 0 and error.mend[:20] in told, told
        except Exception as error:
            raise AssertionError(f"{type(error)} of {path.read_bytes()!r}") from error
    assert not (tmp_path / "out").exists()
    return refused


def test_sound_files_are_read(tmp_path: Path) -> None:
    for name, (text, read, _) in FILES.items():
        (tmp_path / name).write_text(text)
        assert read(tmp_path / name)


def test_faulty_files_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusals(tmp_path, capsys, 600, 1) >= 300


@pytest.mark.slow
def test_many_faulty_files_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusals(tmp_path, capsys, 8000, 2) >= 5000
