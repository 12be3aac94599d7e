"""Values of another type than a field of a file asks for: where they are, and what to write."""

from __future__ import annotations

import re
from typing import Any

from rigdda.errors import BadInput

TOLD = re.compile(r"Expected `(?P<asked>[^`]+)`, got `(?P<given>[^`]+)` - at `\$(?P<path>[^`]*)`")
"""What msgspec says of such a value; in the path keys of tables with names of their own are
`[...]`."""

STEP = re.compile(r"\.(?P<name>\w+)|\[(?P<place>\d+)\]|\[\.\.\.\]")

WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}
KINDS = {bool: "bool", int: "int", float: "float", str: "str", list: "array", dict: "object"}

Tables = Any
"""What a TOML or JSON file holds: tables, lists and values."""


def mistyped(told: str, tables: Tables) -> BadInput | None:
    """Return the error of a value of another type, None if msgspec told of something else.

    Parameters
    ----------
    told : str
        Text of a `msgspec.ValidationError`.
    tables : dict
        What the file holds.
    """
    found = TOLD.fullmatch(told)
    if found is None:
        return None
    steps = [(match["name"], match["place"]) for match in STEP.finditer(found["path"])]
    where = _find(tables, steps, found["given"])
    if where is None:
        return None
    asked = [WORDS.get(kind, kind) for kind in found["asked"].split(" | ") if kind != "null"]
    return BadInput(where[0].lstrip("."), where[1], "give " + " or ".join(asked))


def _find(
    value: Tables, steps: list[tuple[str | None, str | None]], given: str
) -> tuple[str, Tables] | None:
    """Return the path of a value of a type and the value, the first one where names are open."""
    if not steps:
        return ("", value) if KINDS.get(type(value)) == given else None
    (name, place), rest = steps[0], steps[1:]
    inner: list[tuple[str, Tables]] = []
    if isinstance(value, dict):
        inner = [(f".{key}", v) for key, v in value.items() if name in (None, key)]
    elif isinstance(value, list):
        inner = [(f"[{i}]", v) for i, v in enumerate(value) if place in (None, str(i))]
    for path, one in inner:
        found = _find(one, rest, given)
        if found is not None:
            return path + found[0], found[1]
    return None
