"""Sites by name: built-in ones, each a TOML file in this folder, and generated ones."""

from __future__ import annotations

from rigdda.model.site import Site
from rigdda.model.site_names import (
    FAMILIES,
    SPLITS,
    WIDE_FAMILIES,
    family_of,
    names,
    part_of,
    split,
    text,
)

__all__ = [
    "FAMILIES",
    "SPLITS",
    "WIDE_FAMILIES",
    "design_names",
    "family_of",
    "load",
    "names",
    "part_of",
    "split",
    "text",
]


def design_names() -> list[str]:
    """Return the names of the built-in design sites, one per family of the first version."""
    return list(FAMILIES)


def load(name: str) -> Site:
    """Return a built-in or generated site by its name.

    Names of generated sites are such as "bench-17" (of a family) or "random-17" (of any family),
    and with wide ranges "wide-bench-17" or "wide-17", see `split`. The same name always gives the
    same site.

    Raises
    ------
    BadInput
        If there is no site of that name.
    """
    return Site.named(name)
