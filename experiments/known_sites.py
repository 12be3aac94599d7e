"""Precomputed properties of sites without barriers, shipped with the package.

`python -m experiments.known_sites` computes the ensembles and envelopes of the built-in sites, of
the sites of the exam, and of the generated sites of some splits, and writes them to the file of
`rigdda.envs.site_store`. The first `reset` on such a site reads them instead of simulating two
thousand releases. The sites of Ritchie's tests are left out, as their masses take hours and no
design starts there. Values in the user's cache are not computed again.

The values of the present file are kept if they are of the current version of the mechanics. Some of
its sites are computed again, and the command fails if their values have changed: then the version
has to change, too. Means of deposits may differ in the last bit, because libraries of linear
algebra sum up in an order that depends on the processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import msgspec
import numpy as np

from experiments.script import say
from rigdda import Site, sites
from rigdda.app.exam import specification
from rigdda.envs import ensemble, envelope, outcome_cache, site_store
from rigdda.files import atomic

SPLITS = ("validation", "test")

EXAM = specification.load()
ALWAYS = (
    "quick",
    *dict.fromkeys((*sites.design_names(), *sites.WIDE_FAMILIES)),
    *EXAM.sites,
    *(name for corridor in EXAM.corridors for name in corridor.sites),
)
"""Built-in sites and those of the exam."""


@click.command(help=__doc__)
@click.option("--split", "splits", multiple=True, default=SPLITS, show_default=True,
              type=click.Choice(sites.SPLITS), help="May be repeated.")  # fmt: skip
@click.option("--sites", "count", type=click.IntRange(1), default=60, show_default=True,
              help="Number of sites of each split.")  # fmt: skip
@click.option("--checked", type=click.IntRange(0), default=6, show_default=True,
              help="Number of sites of the present file that are computed again.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), default=site_store.SHIPPED,
              show_default=True, help="The file.")  # fmt: skip
def main(splits: tuple[str, ...], count: int, checked: int, out: Path) -> None:
    """Compute and write the file."""
    generated = (name for split in splits for name in sites.split(split)[:count])
    names = [*ALWAYS, *generated]
    kept = kept_values(out)
    check(names, kept, checked)
    values: dict[str, Any] = {}
    for name in names:
        site = Site.load(name)
        wanted = keys(site)
        if all(key in kept for key in wanted):
            values |= {key: kept[key] for key in wanted}
        else:
            values |= statistics(site)
            say(name)
    with atomic(out) as part:
        part.write_bytes(site_store.pack(values))
    say(f"{len(values) // 2} sites, {out.stat().st_size / 1e3:.0f} kB")


def keys(site: Site) -> tuple[str, str]:
    """Return the keys of the values of a site."""
    key = outcome_cache.fingerprint(site).hex()
    return f"{ensemble.STORED_AS}-{key}", f"{envelope.STORED_AS}-{key}"


def statistics(site: Site) -> dict[str, Any]:
    """Return the ensemble and the envelope of a site by key."""
    found = ensemble.of(site, outcome_cache.fingerprint(site))
    seen = envelope.StoredEnvelope.of(envelope.envelope(site))
    return dict(zip(keys(site), (found, seen), strict=True))


def kept_values(file: Path) -> dict[str, msgspec.Raw]:
    """Return the values of a file; none if they are of another version of the mechanics."""
    if not file.is_file():
        return {}
    try:
        content = site_store.unpack(file.read_bytes())
    except ValueError:  # damaged, or of another form
        return {}
    return content.values if content.current else {}


def check(names: Sequence[str], values: dict[str, msgspec.Raw], count: int) -> None:
    """Compute some of the sites with known values again; fail if one of them has changed."""
    found = [name for name in names if all(key in values for key in keys(Site.load(name)))]
    for i in np.unique(np.linspace(0, len(found) - 1, min(count, len(found))).astype(int)):
        with site_store.ignored():
            now = statistics(Site.load(found[i]))
        if not all(same(values[key], encoded(own)) for key, own in now.items()):
            mend = "change rigdda.MECHANICS, see CONTRIBUTING.md"
            raise click.ClickException(f"the values of {found[i]} have changed: {mend}")
        say(f"{found[i]} is the same")


def encoded(value: Any) -> msgspec.Raw:
    """Return a value as the file holds it."""
    return msgspec.Raw(msgspec.msgpack.encode(value))


def same(one: msgspec.Raw, other: msgspec.Raw) -> bool:
    """Return whether two values of the file are the same but for the time of their simulation."""
    a, b = msgspec.msgpack.decode(one), msgspec.msgpack.decode(other)
    if isinstance(a, dict):  # an ensemble
        a["nothing"]["seconds"] = b["nothing"]["seconds"] = 0.0
        return bool(a == b)
    *exact, deposit = zip(a, b, strict=True)
    return all(x == y for x, y in exact) and np.allclose(*deposit, rtol=1e-12, atol=1e-15)


if __name__ == "__main__":
    main()
