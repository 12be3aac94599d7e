"""The structure of the package: no circles of imports, and no class name twice in a package."""

import ast
import importlib.util
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("rigdda", cache_dir=None)  # imports for type checkers included


def test_no_module_imports_itself_in_a_circle(graph: grimp.ImportGraph) -> None:
    # the package itself loads its names lazily from a stub, so that it heads every import
    modules = graph.modules - {"rigdda"}
    imports = {name: graph.find_modules_directly_imported_by(name) & modules for name in modules}
    order = list(TopologicalSorter(imports).static_order())  # raises CycleError on a circle
    assert len(order) == len(modules) > 100


def packages(graph: grimp.ImportGraph) -> dict[str, list[str]]:
    """Return the modules of each package of `rigdda`, such as `rigdda.envs`, that have code."""
    found: dict[str, list[str]] = {}
    for name in sorted(graph.modules - {"rigdda"}):
        found.setdefault(".".join(name.split(".")[:2]), []).append(name)
    return found


def test_no_class_name_occurs_twice_in_a_package(graph: grimp.ImportGraph) -> None:
    found_packages = packages(graph)
    assert len(found_packages["rigdda.envs"]) > 10
    for package, modules in found_packages.items():
        found = Counter[str]()
        for name in modules:
            module = importlib.util.find_spec(name)
            assert module is not None and module.origin is not None
            tree = ast.parse(Path(module.origin).read_text(encoding="utf-8"))
            found.update(node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
        assert package != "rigdda.barriers" or found["Barrier"] == 1
        assert [name for name, count in found.items() if count > 1] == [], package
