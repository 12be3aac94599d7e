"""Built-in sites, one TOML file each."""

from __future__ import annotations

from importlib import resources


def names() -> list[str]:
    """Return the names of the built-in sites."""
    files = resources.files("rigdda.sites").iterdir()
    return sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml"))


def text(name: str) -> bytes:
    """Return the TOML text of a built-in site."""
    return (resources.files("rigdda.sites") / f"{name}.toml").read_bytes()
