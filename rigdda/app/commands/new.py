"""The command `rigdda new`."""

from __future__ import annotations

from pathlib import Path

import click

from rigdda.app.terminal import (
    CHAINAGE,
    counted,
    note,
)


@click.command()
@click.argument("name")
@click.option("--profile", type=click.Path(path_type=Path), required=True, metavar="FILE",
              help="Surveyed profile: a CSV file with columns such as chainage and elevation, or a "
              "DXF drawing with a polyline (extra `dxf`).")  # fmt: skip
@click.option("--layer", metavar="LAYER", help="Layer of the polyline in a DXF drawing.")
@click.option("--road", type=CHAINAGE, nargs=2, metavar="START END", help="Edges of the road.")
@click.option("--toe", type=CHAINAGE, metavar="X", help="Foot of the slope.")
@click.option(
    "--zone", type=CHAINAGE, nargs=2, metavar="START END", help="Where barriers may stand."
)
@click.option("--ground", "grounds", multiple=True, metavar="NAME:START-END",
              help="Stretch of a ground of the library, such as talus:12-30, or only its name for "
              "all other ground. May be repeated.")  # fmt: skip
@click.option("--source", "sources", multiple=True, metavar="NAME:START-END",
              help="Band of the slope where loose rock lies. May be repeated.")  # fmt: skip
@click.option("--mass", "masses", multiple=True, metavar="NAME:START-END:DIP",
              help="Jointed mass that is taken out of the ground between two chainages: it has a "
              "vertical crack at its upper end and rests on a plane that dips downhill by DIP "
              "degrees to its lower end. May be repeated.")  # fmt: skip
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.toml",
              help="Site file to write.  [default: NAME.toml]")  # fmt: skip
def new(
    name: str,
    profile: Path,
    layer: str | None,
    road: tuple[float, float] | None,
    toe: float | None,
    zone: tuple[float, float] | None,
    grounds: tuple[str, ...],
    sources: tuple[str, ...],
    masses: tuple[str, ...],
    out: Path | None,
) -> None:
    """Write a site file for the surveyed profile of a slope.

    All chainages are those of the survey. If the survey has the coordinates of a grid, an offset is
    subtracted and stored in the file. The comment on each value says whether it was surveyed or
    given, or is a placeholder to replace.
    """
    from rigdda.app import new_site, value_origins

    request = new_site.SiteRequest(road or None, toe, zone or None, grounds, sources, masses, layer)
    file = new_site.file_of(name, out)
    text, found = new_site.compose(name, profile, request)
    new_site.write(file, text)
    for words in found.notes:
        note(words)
    count = counted(len(value_origins.placeholders(text)), "placeholder")
    click.echo(
        f"{len(found.points)} points; {file} is written, with {count} to replace. "
        f"To draw and check it: rigdda check {file}"
    )
