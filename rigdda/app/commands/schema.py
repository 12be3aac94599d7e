"""The command `rigdda schema`."""

from __future__ import annotations

import click


@click.command()
@click.argument("file", type=click.Choice(("site", "layout")), default="site")
def schema(file: str) -> None:
    """Print the JSON Schema of site files, or of layout files.

    With the schema, an editor explains the keys of a file and marks mistakes. Write it to a file,
    for example site.schema.json, and begin your site file with the line
    "#:schema ./site.schema.json".
    """
    import json

    from rigdda.sites.schema import schema as of

    click.echo(json.dumps(of(file), indent=2))
