"""The pages on the environments say what their spaces are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rigdda.envs import corridor_environment
from rigdda.envs.observation import BOUND, FIELDS, LAYOUT_FIELDS

DOCS = Path(__file__).parents[2] / "docs/environments"
ROW = re.compile(
    r"^\| `(\w+)` \| ([^|]+) \| ([-\d.]+) \| ([-\d.]+) \| ([-\d.]+) \| ([^|]+) \|$", re.M
)
SIZES = {0: "size of all slots", -1: "`max_barriers`"}


@pytest.mark.parametrize(
    "page, fields",
    [
        ("BarrierDesign-v0", FIELDS),
        ("BarrierPlacement-v0", LAYOUT_FIELDS),
        ("Corridor-v0", corridor_environment.CORRIDOR_FIELDS),
    ],
)
def test_every_array_is_documented(page: str, fields: dict) -> None:
    told = ROW.findall((DOCS / f"{page}.md").read_text())
    rows = []
    for name, field in fields.items():
        bound = 1.0 if name == "layout" else BOUND
        size = SIZES.get(field.size, str(field.size))
        rows.append(
            (name, size, f"{bound:g}", f"{field.centre:g}", f"{field.spread:g}", field.entries)
        )
    assert told == rows
