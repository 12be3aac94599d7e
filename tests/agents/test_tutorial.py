"""The tutorial says what works: its commands parse, its shorter scripts run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import rigdda
from rigdda.agents.cli import cli

TEXT = (Path(rigdda.__file__).parents[1] / "docs/tutorial.md").read_text()
COMMANDS = re.findall(r"^(?:.*`)?(rigdda [a-z]+.*?)(?:`.*)?$", TEXT, re.MULTILINE)
SCRIPTS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("line", COMMANDS)
def test_its_commands_are_taken(line: str) -> None:
    name, *arguments = shlex.split(line)[1:]
    cli.commands[name].make_context(name, arguments)


def test_it_has_commands_for_the_whole_way() -> None:
    assert {line.split()[1] for line in COMMANDS} >= {
        "sites",
        "simulate",
        "design",
        "study",
        "train",
        "evaluate",
    }


@pytest.mark.parametrize("number", [0, 1])
def test_its_short_scripts_run(number: int, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(SCRIPTS[number], "tutorial", "exec"), {})
    assert capsys.readouterr().out


def test_its_training_script_learns_with_fewer_steps() -> None:
    script = SCRIPTS[2].replace("16, site", "2, site").replace("1024", "8")
    made: dict[str, object] = {}
    exec(compile(script.replace("batch_size=16", "batch_size=8"), "tutorial", "exec"), made)
    assert made["model"].num_timesteps == 8  # type: ignore[attr-defined]
