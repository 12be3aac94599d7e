"""Sites by their names: the built-in ones, one TOML file each here, and generated ones."""

from __future__ import annotations

from rigdda.model.site import Site
from rigdda.model.site_names import FAMILIES, SPLITS, names, split, text

__all__ = ["FAMILIES", "SPLITS", "design_names", "load", "names", "split", "text"]


def design_names() -> list[str]:
    """Return the names of the six built-in sites to design on, one a family."""
    return list(FAMILIES)


def load(name: str) -> Site:
    """Return a built-in site, or a generated one: "bench-17" of a family, "random-17" of any.

    A generated site is always the same.

    Raises
    ------
    BadInput
        If there is no site of that name.
    """
    return Site.named(name)
