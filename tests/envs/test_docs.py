"""The pages on the environments say what their spaces are."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from rigdda.envs import corridor_environment, forecast_table
from rigdda.envs.forecast_table import NAMES
from rigdda.envs.observation import BOUND, FIELDS, LAYOUT_FIELDS

DOCS = Path(__file__).parents[2] / "docs/environments"
ROW = re.compile(
    r"^\| `(\w+)` \| ([^|]+) \| ([-\d.]+) \| ([-\d.]+) \| ([-\d.]+) \| ([^|]+) \|$", re.M
)
ENDS = np.cumsum([FIELDS[name].size for name in NAMES])[:-1]
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


def test_the_spread_of_the_entries_is_that_of_the_table_of_forecasts() -> None:
    table = forecast_table.load()
    spread = dict(zip(NAMES, np.split(table.observation.std(axis=0), ENDS), strict=True))
    every = np.concatenate([*spread.values()])
    assert every.min() == spread["incline"][-1] and every.max() == spread["closure"].item()
    words = " ".join((DOCS / "BarrierDesign-v0.md").read_text().split())
    assert f"over the {len(table.names)} sites of the table" in words
    assert f"its median is {np.median(every):.1f}, and" in words
    assert f"{(every < 0.5).sum()} of the {len(every)} entries have less than 0.5" in words
    assert f"`incline`, has {every.min():.2f}; `closure` has {every.max():.1f})" in words
