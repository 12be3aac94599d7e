"""JSON Schema of site and layout files, with which editors show what keys mean and mark mistakes.

It follows from the declarations of the fields (`rigdda.fields`), and is written in the features of
draft 7, which the TOML plug-ins of editors understand.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from rigdda.barriers import Barrier
from rigdda.fields import about
from rigdda.model.site_tables import SiteTables
from rigdda.sites.document import summary


class _Layout(msgspec.Struct, forbid_unknown_fields=True):
    """A layout of barriers."""

    barriers: Annotated[tuple[Barrier, ...], about("The barriers; there may be none.")]


FILES: dict[str, type[msgspec.Struct]] = {"site": SiteTables, "layout": _Layout}
"""What each kind of file holds."""


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of "site" or "layout" files."""
    _, tables = msgspec.json.schema_components([FILES[name]], ref_template="#/definitions/{name}")
    if name == "layout":
        tables["Wall"]["required"].remove("kind")  # a barrier without a kind is a wall
    whole = _plain(tables.pop(FILES[name].__name__))
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        **whole,
        "title": f"A {name} file of rigdda",
        "description": summary(FILES[name].__doc__),
        "definitions": {title: _plain(table) for title, table in tables.items()},
    }


def _plain(part: Any) -> Any:
    """Return a part of a schema without null, which TOML lacks, and in the features of draft 7."""
    if isinstance(part, list):
        return [_plain(one) for one in part]
    if not isinstance(part, dict):
        return part
    found = {key: _plain(one) for key, one in part.items() if one is not None}
    if isinstance(found.get("description"), str):  # of a table it is its docstring
        found["description"] = summary(found["description"])
    kinds = [one for one in found.get("anyOf", ()) if one != {"type": "null"}]
    if len(kinds) == 1:
        del found["anyOf"]
        found = kinds[0] | found
    if "prefixItems" in found:  # all members are of one type
        found["items"] = found.pop("prefixItems")[0]
    if "$ref" in found and len(found) > 1:  # draft 7 ignores what stands beside a reference
        found["allOf"] = [{"$ref": found.pop("$ref")}]
    return found
