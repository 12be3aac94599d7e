"""Built-in sites, one TOML file each, and those that `rigdda.sites.generator` makes."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

from rigdda import check
from rigdda.errors import BadInput

if TYPE_CHECKING:
    from rigdda.model.site import Site

FAMILIES = ("verge", "bench", "talus", "narrow", "cliff", "shu-hwa")
"""Families of sites to design on, each with a built-in site of its name."""

SPLITS = {
    "train": range(1200),
    "validation": range(10**6, 10**6 + 60),
    "test": range(10**9, 10**9 + 60),
}
"""Numbers of the generated sites to learn from, to choose by, and that nothing is chosen by. So
many to learn from that none can be learnt by heart, and few enough that what falls without barriers
need not be simulated again and again."""


def names() -> list[str]:
    """Return the names of the built-in sites."""
    files = resources.files("rigdda.sites").iterdir()
    return sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml"))


def design_names() -> list[str]:
    """Return the names of the six built-in sites to design on, one a family."""
    return list(FAMILIES)


def text(name: str) -> str:
    """Return the TOML text of a built-in site."""
    return (resources.files("rigdda.sites") / f"{name}.toml").read_text(encoding="utf-8")


def load(name: str) -> Site:
    """Return a built-in site, or a generated one: "bench-17" of a family, "random-17" of any.

    A generated site is always the same.

    Raises
    ------
    BadInput
        If there is no site of that name.
    """
    from rigdda.model.site import Site  # needs the names above
    from rigdda.sites.generator import generate

    if name in names():
        return Site.parse(text(name), name)
    family, _, number = name.rpartition("-")
    if family in (*FAMILIES, "random") and number.isdecimal() and number == str(int(number)):
        return generate(name, family, int(number))
    known = ", ".join((*names(), "random-N", *(f"{family}-N" for family in FAMILIES)))
    raise BadInput("site", name, f"choose one of {known}")


def split(name: str, family: str = "random") -> list[str]:
    """Return the names of generated sites of a split: "train", "validation" or "test".

    Of one family, or by default of all in turn. No site is in two splits.

    Raises
    ------
    BadInput
        If there is no such split or family.
    """
    numbers = SPLITS[check.one_of("split", name, SPLITS)]
    check.one_of("family", family, (*FAMILIES, "random"))
    return [f"{family}-{number}" for number in numbers]
