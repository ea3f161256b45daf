"""No cycle of imports anywhere; documented names."""

from graphlib import TopologicalSorter

import grimp

PACKAGES = ("reference_model", "exudyn_model", "comparison")


def test_no_modules_import_one_another():
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert imported
    TopologicalSorter(imported).prepare()  # CycleError names the cycle


def test_documented_imports_work():
    """Those of the README, the docs and the packages' entry points."""
    from comparison.cli import main
    from comparison.compare import Runs, compare
    from comparison.pytest_plugin import assert_agree
    from comparison.scene import load_scene
    from comparison.tables.table import Table

    assert all(map(callable, (main, compare, Runs, assert_agree, load_scene, Table)))
