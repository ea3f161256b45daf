"""A fault of each kind breaks its own invariant."""

import shutil
import sys
from importlib import import_module
from pathlib import Path

import pytest

import exudyn_model

TREE = {"solver.exudyn.formulation": "tree", "solver.exudyn.method": "dopri5"}
SETTINGS = {"tree": TREE | {"solver.exudyn.step": 1e-4, "solver.exudyn.tolerance": 1e-9}, "full": {}}


def violations(result):
    invariants = result.provenance["invariants"]
    return {name for name, invariant in invariants.items() if invariant["value"] > invariant["bound"]}


# Places in the sources, as they are and with a fault
FAULTS = [
    # A corner that is never looked at (tree), and contacts that begin too deep (five bodies)
    ("tree/steps.py", "range(0 if press.has_guide", "range(1 if press.has_guide"),
    ("five_bodies/contact.py", "(contact.impact_speed > 0.0) == (gap < 0.0):",
     "(contact.impact_speed > 0.0) == (gap < -5e-7 * (contact.impact_speed == 0.0)):"),
    ("laws.py", "return max(force, 0.0)", "return force"),
    ("laws.py", "force: float = -law.friction * min(", "force: float = law.friction * min("),
    ("tree/steps.py", "after.value <= ROUNDED and after.rate < 0.0:", "after.value <= ROUNDED:"),
    ("tables.py", "np.isinf(end), now, end)", "np.isinf(end), now, end + 0.1)"),
]  # fmt: skip


@pytest.fixture(scope="module")
def faulty_model(tmp_path_factory):
    """``simulate`` of a copy of the package with these faults: kernels are compiled from a copy alone."""
    folder, name = tmp_path_factory.mktemp("copy"), "faulty_exudyn_model"
    package = Path(exudyn_model.__file__).parent
    shutil.copytree(package, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file, old, new in FAULTS:
        text = (folder / name / file).read_text("utf-8")
        assert text.count(old) == 1, (file, old)
        (folder / name / file).write_text(text.replace(old, new), "utf-8")
    for path in (folder / name).rglob("*.py"):
        path.write_text(path.read_text("utf-8").replace("exudyn_model", name), "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", str(folder / "kernels"))
        patch.syspath_prepend(folder)
        yield import_module(name).simulate
    for module in [module for module in sys.modules if module.startswith(name)]:
        del sys.modules[module]


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["tree", "full"])
def test_each_fault_breaks_its_invariant(scene, faulty_model, formulation):
    result = faulty_model(scene(SETTINGS[formulation] | {"drive.cycles": 0.1}))
    assert result.status == "invariant-violated"
    expected = {"open-depth", "driving-friction", "overlap", "start-gap"}
    if formulation == "tree":
        expected.add("leaving-start")
    assert violations(result) == expected
    # In the wall, and out of it much faster than the least impact speed
    release = {"initial.slider_offset": 2.02e-4, "initial.slider_vx": -0.05, "drive.cycles": 0.002}
    assert "pull" in violations(faulty_model(scene(SETTINGS[formulation] | release)))
