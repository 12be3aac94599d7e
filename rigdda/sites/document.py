"""The reference of site files, written from the classes that read them.

`python -m rigdda.sites.document` writes docs/site.md; a test says when it is stale.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import msgspec

from rigdda import sites
from rigdda.barriers import KINDS, MeshOption
from rigdda.files import atomic
from rigdda.model.grounds import GROUNDS
from rigdda.model.joints import JointSet
from rigdda.model.prices import Consequences, Prices
from rigdda.model.site_tables import (
    BarrierZone,
    Event,
    Motion,
    Rebound,
    Road,
    Scatter,
    SiteTables,
    Slope,
    Stretch,
)
from rigdda.model.source import Source
from rigdda.model.surface import Interface, Surface

PATH = Path(__file__).parents[2] / "docs" / "site.md"

TABLES: tuple[tuple[str, type[msgspec.Struct]], ...] = (
    ("Top of the file", SiteTables),
    ("`[slope]`", Slope),
    ("`[[slope.surfaces]]`", Stretch),
    ("`[[sources]]`", Source),
    ("`[[sources.joints]]`", JointSet),
    ("`[[events]]`", Event),
    ("`[road]`", Road),
    ("`[barrier_zone]`", BarrierZone),
    ("`[surfaces.NAME]`", Surface),
    ("`[[interfaces]]`", Interface),
    ("`[prices]`", Prices),
    ("`[consequences]`", Consequences),
    ("`[[meshes]]`", MeshOption),
    ("`[motion]`", Motion),
    ("`[scatter]`", Scatter),
    ("`[lumped.NAME]`", Rebound),
)
"""Every table of a site file and the class that reads it."""

GROUND_TEXT = """\
## Grounds

The library that `ground` of a surface refers to: typical values and, in brackets, plausible ranges.
A surface takes the typical values and overrides what is known of it. The values are those of rigid
blocks with corners, not those of a point mass, whose normal restitution also depends on how the
block turns. Damping acts while a block touches the ground, and for 0.1 s after; it is the loss that
friction and restitution leave out, and it is the least known of the four. Where nothing is known,
design with both ends of its range.
"""

LAYOUT = """\
## Layout files

What `--layout` and the `barriers` of a study take: a table `[[barriers]]` for each barrier in TOML
(or a list `barriers` in JSON), with its `kind` (without one
it is a wall) and the keys below. `rigdda design` writes one,
`layout.toml`. A layout that may not be built is computed as it is given, and `simulate`, `study`
and the notes of a replay say so.

```toml
[[barriers]]
kind = "fence"
x = 66.0
height = 3.0
energy_class = 1000
```
"""

HEAD = """\
# Site files

<!-- Written by `python -m rigdda.sites.document` from the classes that read the files. -->

A site is a TOML file: what an engineer knows about a slope. `rigdda design my-site.toml` designs
its protection, `rigdda.Site.load("my-site.toml")` reads it. Lengths in m, angles in degrees where a
name ends in `_deg`, money in EUR; x grows downhill, everything is per metre of road unless said.
A key that is not listed here is refused, and so is a value that cannot be meant; the message names
both and says how to mend it. The smallest file has what has no default. Begin with one of the
built-in sites ({names}), all of which are files in `rigdda/sites/`.

The order of tables in a file is free but for one rule of TOML: plain keys come before the first
table.
"""


def document() -> str:
    """Return the reference as Markdown."""
    names = ", ".join(f"`{name}`" for name in sites.names())
    parts = [HEAD.format(names=names)]
    for title, table in TABLES:
        parts.append(f"## {title}\n\n{summary(table)}\n\n{_fields(table)}")
    parts.append(f"{GROUND_TEXT}\n{grounds()}")
    parts.append(LAYOUT)
    for name, kind in KINDS.items():
        parts.append(f'### `kind = "{name}"`\n\n{summary(kind)}\n\n{_fields(kind)}')
    parts.append(f"## An example\n\n```toml\n{sites.text('narrow')}```\n")
    return "\n".join(parts)


def grounds() -> str:
    """Return the library of grounds as a Markdown table and a list of its sources."""
    rows = [
        "| ground | friction_deg | restitution | damping [1/s] | roughness [m] | "
        "friction_sd_deg, restitution_sd, damping_sd |",
        "|---|---|---|---|---|---|",
    ]
    sources = []
    for name, ground in GROUNDS.items():
        spans = (ground.friction_deg, ground.restitution, ground.damping, ground.roughness)
        cells = [f"{s.typical:g} ({s.low:g} to {s.high:g})" for s in spans]
        spread = f"{ground.friction_sd_deg:g}, {ground.restitution_sd:g}, {ground.damping_sd:g}"
        rows.append(f"| `{name}`: {ground.words} | {' | '.join(cells)} | {spread} |")
        fields = ("friction", "restitution", "damping", "roughness")
        told = "; ".join(f"{f}: {s.source}" for f, s in zip(fields, spans, strict=True))
        sources.append(f"- `{name}`: {told}.")
    return "\n".join([*rows, "", *sources]) + "\n"


def summary(table: type) -> str:
    """Return what a docstring says before its sections, as one paragraph."""
    text = (inspect.getdoc(table) or "").split("\nParameters\n")[0]
    return re.sub(r"\s*\n\s*", " ", text).strip()


def meanings(table: type) -> dict[str, tuple[str, str]]:
    """Return type and meaning of each parameter that a docstring lists."""
    text = (inspect.getdoc(table) or "").split("\nParameters\n----------\n")[-1]
    text = re.split(r"\n\n\w+\n-+\n", text)[0]
    found: dict[str, tuple[str, str]] = {}
    for entry in re.split(r"\n(?=\S)", text):
        head, _, body = entry.partition("\n")
        names, _, kind = head.partition(" : ")
        for name in names.split(","):
            found[name.strip()] = kind.strip(), re.sub(r"\s*\n\s*", " ", body).strip()
    return found


def _fields(table: type[msgspec.Struct]) -> str:
    """Return the keys of a table as a Markdown table."""
    said = meanings(table)
    rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
    for field in msgspec.structs.fields(table):
        kind, meaning = said[field.name]
        rows.append(f"| `{field.name}` | {kind} | {_default(field)} | {meaning} |")
    return "\n".join(rows) + "\n"


def _default(field: Any) -> str:
    """Return the default of a field as it would be in a file."""
    value = field.default
    if field.default_factory is not msgspec.NODEFAULT:
        value = field.default_factory()
    if value is msgspec.NODEFAULT:
        return "needed"
    if value is msgspec.UNSET:
        return "its ground's"
    if isinstance(value, msgspec.Struct):
        return "see below"
    if value is None or value == () or value == "":
        return "none"
    if isinstance(value, dict):
        return ", ".join(f"{key}: {item:g}" for key, item in value.items())
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{item:g}' for item in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def main() -> None:
    """Write the reference."""
    with atomic(PATH) as part:
        part.write_text(document(), encoding="utf-8")


if __name__ == "__main__":
    main()
