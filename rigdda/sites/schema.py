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
    found = {key: _plain(one) for key, one in part.items() if one is not None}
    if isinstance(found.get("description"), str):  # that of a table is its docstring
        found["description"] = summary(found["description"])
    kinds = [one for one in found.get("anyOf", ()) if one != {"type": "null"}]
    if len(kinds) == 1:
        del found["anyOf"]
        found = kinds[0] | found
    if "prefixItems" in found:  # all members are of one type
        found["items"] = found.pop("prefixItems")[0]
    if "$ref" in found and len(found) > 1:  # draft 7 ignores the siblings of a reference
        found["allOf"] = [{"$ref": found.pop("$ref")}]
    return found
