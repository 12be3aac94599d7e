"""Whose folder it is: a folder of results belongs to one problem, which is written into it."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import msgspec

from rigdda import BadInput
from rigdda.envs import DesignProblem
from rigdda.files import atomic

FILE = "problem.json"


def claim(folder: Path, problem: DesignProblem, *files: str) -> None:
    """Write `problem.json` into a folder, so that it is known again.

    Parameters
    ----------
    folder : path
        Where results are to be written.
    problem : DesignProblem
        What they answer.
    files : str
        Names of results that would be written over.

    Raises
    ------
    BadInput
        If the folder holds results of another problem, or of one that it does not tell.
    """
    file, asked = folder / FILE, posed(problem)
    if file.exists():
        known = _read(file)
        other = _differ(known, asked) if known else f"{FILE}, which is damaged"
    else:
        found = [name for name in files if (folder / name).exists()]
        other = f"{found[0]} of a problem that it does not tell" if found else ""
    if other:
        raise BadInput("--out", str(folder), f"it holds {other}: name another folder")
    with atomic(file) as part:
        part.write_text(json.dumps(asked, indent=2) + "\n", encoding="utf-8")


def posed(problem: DesignProblem) -> dict[str, Any]:
    """Return all that makes a problem another one, as plain values.

    `content` is a hash of the site with its prices and rates.
    """
    return {
        "site": problem.site.name,
        "kinds": list(problem.kinds),
        "zone": [problem.zone.start, problem.zone.end],
        "targets": msgspec.to_builtins(problem.targets),
        "max_barriers": problem.max_barriers,
        "fidelity": problem.fidelity,
        "content": hashlib.sha256(msgspec.json.encode(problem.site)).hexdigest()[:16],
    }


def _read(file: Path) -> dict[str, Any]:
    """Return what a folder says that it is of, nothing if that cannot be read."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, OSError):
        return {}
    return found if isinstance(found, dict) else {}


def _differ(known: dict[str, Any], asked: dict[str, Any]) -> str:
    """Return in words what a folder holds instead of what is asked; nothing if it is the same."""
    if known == asked:
        return ""
    for name, value in asked.items():
        if known.get(name) != value:
            if name == "content":
                return f"a design of site {asked['site']!r} with other contents"
            return f"a design of {name} {known.get(name)!r}, not {value!r}"
    return "a design of another problem"
