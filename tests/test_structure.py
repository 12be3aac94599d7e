"""The structure of the package: no circles of imports, no name twice."""

from collections import Counter
from graphlib import TopologicalSorter

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


def test_no_file_name_occurs_twice(graph: grimp.ImportGraph) -> None:
    files = [name for name in graph.modules if not graph.find_children(name)]
    assert any(name.startswith("rigdda.envs.") for name in files)
    names = Counter(name.rpartition(".")[2] for name in files)
    assert [name for name, count in names.items() if count > 1] == []
