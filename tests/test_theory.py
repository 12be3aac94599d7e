"""docs/theory.md names functions that are there."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

from rigdda import Settings

PAGE = (Path(__file__).parents[1] / "docs" / "theory.md").read_text(encoding="utf-8")


def test_every_function_that_is_named_is_there() -> None:
    named = re.findall(r"`?\b([a-z_/]+):([A-Za-z_.]+)\b", PAGE.replace("module:function", ""))
    assert len(named) > 30
    for module, path in named:
        found = import_module("rigdda.dynamics." + module.replace("/", "."))
        for name in path.split("."):
            found = getattr(found, name)
        assert callable(found)


def test_every_module_and_setting_that_is_named_is_there() -> None:
    for name in re.findall(r"`(rigdda[a-z_.]+)`", PAGE):
        try:
            import_module(name)
        except ModuleNotFoundError:
            module, _, function = name.rpartition(".")
            assert callable(getattr(import_module(module), function))
    names = re.findall(r"Settings(?:\(|\.)([a-z_]+)", PAGE)
    assert names
    assert set(names) <= set(Settings.__dataclass_fields__)
