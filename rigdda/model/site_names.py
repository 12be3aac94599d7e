"""Names of the built-in sites and of those that `rigdda.model.site_generator` makes of them."""

from __future__ import annotations

from importlib import resources

from rigdda import check
from rigdda.errors import BadInput

FAMILIES = ("verge", "bench", "talus", "narrow", "cliff", "shu-hwa")
"""Families of sites to design on, each with a built-in site of its name."""

SPLITS = {
    "train": range(1200),
    "validation": range(10**6, 10**6 + 60),
    "test": range(10**9, 10**9 + 60),
}
"""Numbers of the generated sites to train on, to select by, and to test on, which nothing is
selected by. There are too many training sites for any to be learnt by heart, and few enough that
releases without barriers need not be simulated again and again."""

FOLDER = resources.files("rigdda") / "sites"
"""Folder of the files of built-in sites."""


def names() -> list[str]:
    """Return the names of the built-in sites."""
    files = FOLDER.iterdir()
    return sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml"))


def text(name: str) -> str:
    """Return the TOML text of a built-in site."""
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def instance(name: str) -> tuple[str, int]:
    """Return the family and the number of a generated site by its name, such as "bench-17".

    Raises
    ------
    BadInput
        If it is not the name of one.
    """
    family, _, number = name.rpartition("-")
    if family in (*FAMILIES, "random") and number.isdecimal() and number == str(int(number)):
        return family, int(number)
    known = ", ".join((*names(), "random-N", *(f"{family}-N" for family in FAMILIES)))
    raise BadInput("site", name, f"choose one of {known}")


def built_in(family: str, number: int) -> str:
    """Return the built-in site of an instance; those of the family "random" take turns."""
    return FAMILIES[number % len(FAMILIES)] if family == "random" else family


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
