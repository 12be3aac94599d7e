"""JSON Schema of site and layout files, which editors use to explain keys and to mark errors.

It is generated from the declarations of the fields (`rigdda.fields`) and restricted to the features
of draft 7, which the TOML extensions of editors support.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Any

import msgspec

from rigdda.barriers import KINDS
from rigdda.model.site_tables import SiteTables
from rigdda.sites.document import summary


def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of "site" or "layout" files."""
    held: Any = SiteTables if name == "site" else list[reduce(or_, KINDS.values())]  # type: ignore[misc]
    (whole,), tables = msgspec.json.schema_components([held], ref_template="#/definitions/{name}")
    if name == "site":
        whole = tables.pop(SiteTables.__name__)
    else:
        tables["Wall"]["required"].remove("kind")  # a barrier without a kind is a wall
        whole = {
            "description": "A layout of barriers, possibly empty.",
            "type": "object",
            "properties": {"barriers": whole},
            "required": ["barriers"],
            "additionalProperties": False,
        }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        **_plain(whole),
        "title": f"A {name} file of rigdda",
        "definitions": {title: _plain(table) for title, table in tables.items()},
    }


def _plain(part: Any) -> Any:
    """Return part of a schema without null, which TOML lacks, restricted to draft 7."""
    if isinstance(part, list):
        return [_plain(one) for one in part]
    if not isinstance(part, dict):
        return part
    plain = {key: _plain(one) for key, one in part.items() if one is not None}
    if isinstance(plain.get("description"), str):  # that of a table is its docstring
        plain["description"] = summary(plain["description"])
    kinds = [one for one in plain.get("anyOf", ()) if one != {"type": "null"}]
    if len(kinds) == 1:
        del plain["anyOf"]
        plain = kinds[0] | plain
    if "prefixItems" in plain:  # all members are of one type
        plain["items"] = plain.pop("prefixItems")[0]
    if "$ref" in plain and len(plain) > 1:  # draft 7 ignores the siblings of a reference
        plain["allOf"] = [{"$ref": plain.pop("$ref")}]
    return plain
