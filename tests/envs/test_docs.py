"""The pages on the environments say what their spaces are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from envs.observation import FIELDS, PLACEMENT_FIELDS

DOCS = Path(__file__).parents[2] / "docs"
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+) \| ([-\d.]+) \| ([-\d.]+) \|", re.MULTILINE)


@pytest.mark.parametrize(
    ("page", "fields"),
    [
        ("BarrierDesign-v0", FIELDS),
        ("BarrierPlacement-v0", {n: PLACEMENT_FIELDS[n] for n in PLACEMENT_FIELDS.keys() - FIELDS}),
    ],
)
def test_every_array_is_documented(page: str, fields: dict) -> None:
    told = {
        name: (size.strip(), float(low), float(high))
        for name, size, low, high in ROW.findall((DOCS / f"{page}.md").read_text())
    }
    expected = {name: (str(size), low, high) for name, (size, low, high) in fields.items()}
    if "layout" in expected:
        expected["layout"] = ("size of all slots", *expected["layout"][1:])
    assert told == expected
