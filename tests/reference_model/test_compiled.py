"""The cache of compiled kernels notices a change in a module that is only called."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import reference_model
from reference_model import compiled, contact, forces, formulations, peaks, recording
from reference_model.constants import (
    FOUNDATION,
    Constants,
    Formulation,
    as_record,
    formulation_of,
    has_sides,
    less_marked,
)

SOURCES = Path(reference_model.__file__).parent
RUN = """
import numpy as np
from reference_model.forces import CONTACTS, MODES
from reference_model.formulations import right_hand_side, state_size
from reference_model.constants import Constants, Formulation, as_record

c = as_record(Constants(*np.full(len(Constants._fields), 0.5)), Formulation.SLIDER)
modes = np.zeros((MODES, CONTACTS))
modes[0, :4] = 1.0
modes[1, :4] = 2.0
dy, contacts = np.empty(state_size(c)), np.zeros((5, CONTACTS))
right_hand_side(c, 0.0, np.zeros(state_size(c)), modes, dy, contacts)
print(repr(float(dy[2])))
"""


def run(folder: Path, cache: Path, first: str = "") -> float:
    environment = os.environ | {"PYTHONPATH": str(folder), "SIXBAR_CACHE_DIR": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", first + RUN], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def test_a_change_in_a_called_kernel_is_seen(tmp_path: Path) -> None:
    folder, cache = tmp_path / "src", tmp_path / "cache"
    shutil.copytree(SOURCES, folder / "reference_model", ignore=shutil.ignore_patterns("__pycache__"))
    before = run(folder, cache)
    assert run(folder, cache) == before
    friction = folder / "reference_model" / "friction.py"
    friction.write_text(friction.read_text().replace("return -c.c_f", "return -3.0 * c.c_f"))
    assert run(folder, cache) != before
    assert len(list((cache / "numba").iterdir())) == 2


def test_the_second_start_takes_everything_from_the_cache(tmp_path: Path) -> None:
    run(SOURCES.parent, tmp_path)
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb*")}
    assert files
    run(SOURCES.parent, tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb*")} == files


@pytest.mark.parametrize(
    "changes", [{}, {"joints.crank_pin": "clearance"}, {"solver.reference.formulation": "multiplier"}]
)
def test_nothing_is_compiled_after_the_first_report_of_progress(scene, changes, monkeypatch) -> None:
    """Then processes that wait for what this one compiles begin: what is still to be compiled each would."""
    called: list[str | float] = []

    def call(kernel: compiled.Kernel, *arguments: object) -> object:
        called.append(kernel.function.__qualname__)
        return kernel.compiled(*arguments)

    def prepare(kernel: compiled.Kernel, *arguments: object) -> None:
        called.append(kernel.function.__qualname__)
        whole(kernel, *arguments)

    whole = compiled.Kernel.prepare
    monkeypatch.setattr(compiled.Kernel, "__call__", call)
    monkeypatch.setattr(compiled.Kernel, "prepare", prepare)
    # One that no test before has had compiled.
    end = compiled.Kernel(recording._finish.function, inline=False, counts=True)
    monkeypatch.setattr(recording, "_finish", end)
    settings = {"solver.reference.formulation": "auto", "solver.reference.tolerance": 1e-7}
    result = reference_model.simulate(scene(settings | changes), progress=called.append)
    assert result.status == "success"
    first = next(n for n, each in enumerate(called) if isinstance(each, float))
    before, after = called[:first], [each for each in called[first:] if isinstance(each, str)]
    assert "advance" in after
    assert set(after) <= set(before)
    assert len(end.compiled.overloads) == 1  # what was prepared is what was called


def test_a_numba_that_always_counts_references_gives_the_same(tmp_path: Path) -> None:
    """One that has dropped its internal option `_nrt`, and so refuses it."""
    dropped = "from numba.core.options import DefaultOptions\ndel DefaultOptions._nrt\n"
    assert run(SOURCES.parent, tmp_path, dropped) == run(SOURCES.parent, tmp_path / "other")


def test_a_numba_without_what_nested_code_extends_gives_the_same(tmp_path: Path) -> None:
    missing = "import numba.core.codegen\ndel numba.core.codegen.JITCodeLibrary\n"
    shown = "import reference_model.compiler as used\nassert bool(used._NESTED) is {}\n"
    extended = run(SOURCES.parent, tmp_path, shown.format(True))
    assert run(SOURCES.parent, tmp_path / "other", missing + shown.format(False)) == extended


def test_only_what_python_calls_is_stored(tmp_path: Path) -> None:
    run(SOURCES.parent, tmp_path)
    stored = {path.name.partition("-")[0] for path in tmp_path.rglob("*.nbi")}
    assert stored == {"formulations.right_hand_side", "formulations.state_size"}


def test_numba_still_imports_blas_where_code_needs_it() -> None:
    """The kernels' compiler leaves out numba's look for it."""
    code = """
import sys
from reference_model import compiler
import numba, numpy as np
assert "scipy.linalg" not in sys.modules

@numba.njit
def total(a, b):
    return np.dot(a, b) + np.correlate(a, b)[0] + np.linalg.solve(np.eye(3), b)[0]

print(total(np.arange(3.0), np.ones(3)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 7.0


def test_what_two_processes_compiled_for_two_formulations_has_no_symbol_in_common() -> None:
    """A process that loads both ran the one's code in place of the other's, where the symbols were equal.

    numba names record types by their number among the types of a process, which is that of any formulation
    that a process compiles first.
    """
    code = """
import sys
import numba, numpy as np
from reference_model import compiler
from reference_model.constants import Constants, Formulation, as_record

for formulation in sys.argv[1:]:
    record = as_record(Constants(*np.zeros(len(Constants._fields))), Formulation[formulation])
    print(formulation, *numba.typeof(record).mangling_args)
"""
    names = [each.name for each in Formulation]
    found = [
        set(subprocess.check_output([sys.executable, "-c", code, *order], text=True).splitlines())
        for order in (names, names[::-1], names[2:])
    ]
    assert found[0] == found[1] > found[2]
    assert len({line.split(maxsplit=1)[1] for line in found[0]}) == len(names)


@pytest.mark.parametrize(
    ("kernel", "decides"),
    [
        (contact.elastic_force, set()),
        (forces.slider_forces, {"law"}),
        (peaks.deepest, {"formulation"}),
        (formulations.right_hand_side, {"formulation"}),
        (formulations.derivative, {"formulation"}),
        (peaks.force_at, {"formulation", "law"}),
    ],
)
def test_what_decides_a_kernel_s_code_is_what_it_calls_at_any_depth(kernel, decides) -> None:
    assert compiled._decisive(kernel.function) == decides


def test_a_kernel_for_all_formulations_cannot_ask_for_one() -> None:
    """So that one whose dependence went unseen is not compiled: it would run the code of another law."""
    sides = Constants(*np.zeros(len(Constants._fields)))._replace(law=FOUNDATION)

    def fields(formulation: Formulation, constants: Constants = sides) -> list[str]:
        return list(as_record(constants, formulation).dtype.names)

    full = fields(Formulation.BOTH)
    assert formulation_of(full) is Formulation.BOTH
    of_law, of_none = less_marked(full, with_law=True), less_marked(full, with_law=False)
    assert has_sides(full)
    assert has_sides(of_law)
    assert of_law == less_marked(fields(Formulation.PIN), with_law=True)
    corners = fields(Formulation.SLIDER, sides._replace(law=0.0))
    assert not has_sides(corners)
    assert of_none == less_marked(corners, with_law=False)
    for names in (of_law, of_none):
        with pytest.raises(ValueError, match="for_any"):
            formulation_of(names)
    with pytest.raises(ValueError, match="law"):
        has_sides(of_none)
