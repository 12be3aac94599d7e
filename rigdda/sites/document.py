"""Generator of the reference of site files from the classes that read them.

`python -m rigdda.sites.document` writes docs/site.md; a test fails if that file is out of date.
"""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from rigdda import sites
from rigdda.barriers import KINDS, MeshOption
from rigdda.fields import Described, described
from rigdda.files import atomic
from rigdda.ground.grounds import GROUNDS
from rigdda.ground.prices import Consequences, Prices
from rigdda.ground.surface import Interface, Surface
from rigdda.model.existing import Existing
from rigdda.model.forest import Forest
from rigdda.model.joints import JointSet
from rigdda.model.partial_factors import PartialFactors
from rigdda.model.site_tables import (
    BarrierZone,
    Event,
    Motion,
    Origin,
    Rebound,
    Road,
    Scatter,
    SiteTables,
    Slope,
    Stretch,
)
from rigdda.model.source import Source
from rigdda.model.traffic import Traffic

PATH = Path(__file__).parents[2] / "docs" / "site.md"

TABLES: tuple[tuple[str, type[msgspec.Struct]], ...] = (
    ("Top of the file", SiteTables),
    ("`[slope]`", Slope),
    ("`[[slope.surfaces]]`", Stretch),
    ("`[[sources]]`", Source),
    ("`[[sources.joints]]`", JointSet),
    ("`[[events]]`", Event),
    ("`[origin]`", Origin),
    ("`[road]`", Road),
    ("`[barrier_zone]`", BarrierZone),
    ("`[[forest]]`", Forest),
    ("`[[existing]]`", Existing),
    ("`[surfaces.NAME]`", Surface),
    ("`[[interfaces]]`", Interface),
    ("`[prices]`", Prices),
    ("`[consequences]`", Consequences),
    ("`[traffic]`", Traffic),
    ("`[[meshes]]`", MeshOption),
    ("`[rule]`", PartialFactors),
    ("`[motion]`", Motion),
    ("`[scatter]`", Scatter),
    ("`[lumped.NAME]`", Rebound),
)
"""Tables of a site file, and the class that reads each."""

GROUND_TEXT = """\
## Grounds

The key `ground` of a surface refers to this library of typical values and, in brackets, plausible
ranges. A surface takes the typical values except those that it specifies itself. The values are
those of rigid blocks with corners, not those of a point mass, whose normal restitution also depends
on the rotation of the block. Rolling resistance acts while a block touches the ground. It is the
loss of rotating blocks that friction and restitution do not cover, and the least certain of the
four properties. The restitution in the table is that of a slow impact; on `weathered_rock` and
`meadow`, it falls with the impact speed (`restitution_speed` of 9.144 m/s). If you have no
measurements of rolling resistance, design for both ends of its range.
"""

LAYOUT = """\
## Layout files

A layout file lists barriers, in TOML with a table `[[barriers]]` for each or in JSON with a list
`barriers`. Each has a `kind`, by default "wall", and the keys below. The option `--layout` reads
such a file, and the `barriers` of a study have the same keys. `rigdda design` writes its result to
`layout.toml`. A layout that breaks a siting rule is simulated nevertheless; `simulate`, `study` and
the notes of a replay then report the rule.

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

This page is the reference of the keys of site files and layout files. To write your first site
file, [begin here](howto/site_file.md).

A site file describes a slope in TOML. `rigdda design my-site.toml` designs its protection, and
`rigdda.Site.load("my-site.toml")` reads it in Python. Chainages increase downhill. Units are given
in the tables below.

A file must have the keys that are marked "needed"; all others have a default. Unknown keys and
values outside their range are rejected: the message names the key and its value, and says what to
write instead. `str` is a text in quotes, and a whole number may be given for a float. A list of
tables is written with double brackets, such as `[[events]]`, once for each table. Tables may come
in any order, but TOML requires plain keys to come before the first table.

The easiest way to start is to copy a built-in site from `rigdda/sites/`: {names}.

## Help from your editor

Editors with support for TOML, such as VS Code with the extension Even Better TOML, explain keys and
mark errors while you type if they know the schema of the file. Write the schema next to your site
file:

```
rigdda schema > site.schema.json
```

and start the site file with this line:

```toml
#:schema ./site.schema.json
```

`rigdda schema layout` does the same for layout files. A schema cannot check whether values are
consistent, for example whether the barrier zone lies uphill of the road; this is checked when the
file is read.
"""


def document() -> str:
    """Return the reference as Markdown."""
    names = ", ".join(f"`{name}`" for name in sites.names())
    parts = [HEAD.format(names=names)]
    for title, table in TABLES:
        parts.append(f"## {title}\n\n{summary(table.__doc__)}\n\n{_fields(table)}")
    parts.append(f"{GROUND_TEXT}\n{grounds()}")
    parts.append(LAYOUT)
    for name, kind in KINDS.items():
        parts.append(f'### `kind = "{name}"`\n\n{summary(kind.__doc__)}\n\n{_fields(kind)}')
    parts.append(f"## An example\n\n```toml\n{sites.text('narrow')}```\n")
    return "\n".join(parts)


def grounds() -> str:
    """Return the library of grounds as a Markdown table, followed by a list of its sources."""
    rows = [
        "| ground | friction_deg | restitution | rolling | roughness [m] | "
        "friction_sd_deg, restitution_sd, rolling_sd |",
        "|---|---|---|---|---|---|",
    ]
    sources = []
    for name, ground in GROUNDS.items():
        spans = (ground.friction_deg, ground.restitution, ground.rolling, ground.roughness)
        cells = [f"{s.typical:g} ({s.low:g} to {s.high:g})" for s in spans]
        spread = f"{ground.friction_sd_deg:g}, {ground.restitution_sd:g}, {ground.rolling_sd:g}"
        rows.append(f"| `{name}`: {ground.words} | {' | '.join(cells)} | {spread} |")
        fields = ("friction", "restitution", "rolling", "roughness")
        told = "; ".join(f"{f}: {s.source}" for f, s in zip(fields, spans, strict=True))
        sources.append(f"- `{name}`: {told}.")
    return "\n".join([*rows, "", *sources]) + "\n"


def summary(docstring: str | None) -> str:
    """Return the part of a docstring before its sections, as one paragraph."""
    text = re.split(r"\n\s*(?:Parameters|Raises)\n", docstring or "")[0]
    return re.sub(r"\s*\n\s*", " ", text).strip()


def _fields(table: type[msgspec.Struct]) -> str:
    """Return the keys of a table as a Markdown table."""
    rows = ["| key | type | unit | range | default | meaning |", "|---|---|---|---|---|---|"]
    for field in described(table):
        cells = field.kind, field.unit, field.range, _default(field), field.text
        rows.append(f"| `{field.name}` | {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def _default(field: Described) -> str:
    """Return the default of a field as it would be written in a file."""
    value = field.default
    if field.needed:
        return "needed"
    if value is msgspec.UNSET:
        return "from `return_period`" if field.name == "rate" else "that of its ground"
    if isinstance(value, msgspec.Struct):
        return "see below"
    if value in (None, (), {}, ""):
        return "none"
    if isinstance(value, dict):
        return ", ".join(f"{key}: {item:g}" for key, item in value.items())
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{item:g}' for item in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def main() -> None:
    """Write the reference to docs/site.md."""
    with atomic(PATH) as part:
        part.write_text(document(), encoding="utf-8")


if __name__ == "__main__":
    main()
