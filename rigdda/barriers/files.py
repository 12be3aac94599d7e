"""Layout files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import tomli_w

from rigdda.barriers.layout import Barrier, Layout, as_layout, from_table, to_tables
from rigdda.errors import BadInput
from rigdda.files import atomic, read
from rigdda.mistyped import mistyped


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Read a layout from a TOML or JSON file with one table `barriers` a barrier.

    Each table has the parameters of its class, and `kind` = "wall" (the default), "gravity_wall",
    "fence", "ditch", "embankment" or "mesh".

    Raises
    ------
    BadInput
        If the file is missing, a field is unknown or a value is outside its range.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput("layout", str(path), "name an existing TOML or JSON file")
    decode = msgspec.json.decode if file.suffix == ".json" else msgspec.toml.decode
    try:
        tables = decode(read("layout", file), type=_LayoutFile).barriers
        return tuple(from_table(f"barriers[{i}]", table) for i, table in enumerate(tables))
    except msgspec.ValidationError as error:
        bad = mistyped(str(error), decode(read("layout", file)))
        raise bad or BadInput("layout", str(path), str(error)) from None
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadInput("layout", str(path), f"mend the file: {error}") from None


def save_layout(layout: Sequence[Barrier], path: str | os.PathLike[str]) -> None:
    """Write a layout as TOML, or as JSON if the path ends in .json."""
    data = {"barriers": to_tables(as_layout(layout))}
    with atomic(path) as part:
        if str(path).endswith(".json"):
            part.write_bytes(msgspec.json.format(msgspec.json.encode(data)))
        else:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")


class _LayoutFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An empty file is no layout; `barriers = []` is one without barriers."""

    barriers: tuple[dict[str, Any], ...]
