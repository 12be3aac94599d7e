"""Built-in sites, one TOML file each, and random ones."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigdda.site import Site

TRAIN_SEEDS = range(1024)
"""Seeds of the random sites to train on. So many that a policy cannot learn them by heart, and few
enough that what falls without barriers need not be simulated again and again."""

TEST_SEEDS = range(10**9, 10**9 + 20)
"""Seeds of the random sites that training never sees."""


def names() -> list[str]:
    """Return the names of the built-in sites."""
    files = resources.files("rigdda.sites").iterdir()
    return sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml"))


def text(name: str) -> str:
    """Return the TOML text of a built-in site."""
    return (resources.files("rigdda.sites") / f"{name}.toml").read_text(encoding="utf-8")


def random(seed: int) -> Site:
    """Return the random site of a seed, always the same; see `rigdda.sites.generator`.

    20 to 40 blocks of 1.5 to 3.5 m2 on a slope of 20 to 75 m, with up to two benches.

    Raises
    ------
    BadInput
        If the seed is not a whole number of at least 0.
    """
    from rigdda import check
    from rigdda.sites.generator import generate  # needs Site, which needs the names above

    return generate(check.integer("seed", seed, 0))


def test_sites() -> list[Site]:
    """Return the 20 random sites that training never sees, those of `TEST_SEEDS`."""
    return [random(seed) for seed in TEST_SEEDS]
