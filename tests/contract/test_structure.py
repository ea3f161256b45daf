"""No cycle of imports anywhere."""

from graphlib import TopologicalSorter

import grimp

PACKAGES = ("reference_model", "exudyn_model", "comparison", "sixbar")


def test_no_modules_import_one_another():
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert imports
    TopologicalSorter(imports).prepare()  # CycleError names the cycle
