"""Every module of `experiments` can be imported; most of their long runs have no test."""

from __future__ import annotations

import importlib
import pkgutil

import pytest

import experiments

MODULES = sorted(
    found.name for found in pkgutil.walk_packages(experiments.__path__, "experiments.")
)


@pytest.mark.parametrize("name", MODULES)
def test_module_can_be_imported(name: str) -> None:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        own = (error.name or "").split(".")[0] in ("experiments", "rigdda")
        if own:
            raise
        pytest.skip(f"needs {error.name}")
