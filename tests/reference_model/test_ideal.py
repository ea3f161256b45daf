"""The ideal mechanism: the kernels' sources over all times at once, and without the compiler."""

import subprocess
import sys

import numpy as np
import pytest

from comparison.scene import load_scene
from reference_model import simulate
from reference_model.bodies import ideal_motion
from reference_model.compiled import kernel, over_arrays
from reference_model.constants import Formulation, as_record
from reference_model.energy import height_energy, kinetic_energy
from reference_model.linkage import four_bar, reaches_line
from reference_model.reactions import REACTIONS, reactions
from reference_model.reading import read_parameters

GROUPS = ["accelerations", "joints", "energy"]
RUN = f"""
import sys
from comparison.scene import load_scene
from reference_model import simulate
simulate(load_scene("ideal", {{"output.groups": {GROUPS}}}).data)
sys.exit("numba" in sys.modules)
"""


def test_an_ideal_run_imports_no_compiler():
    """Which takes longer than the run: 0.5 s of processor time where it was written."""
    assert subprocess.run([sys.executable, "-c", RUN], check=False).returncode == 0


@pytest.mark.parametrize("times", [np.linspace(0.0, 0.7, 301), np.array([0.123])])
def test_over_arrays_a_kernel_gives_what_it_does_compiled(times):
    p = read_parameters(load_scene("ideal").data)
    c = as_record(p.constants, Formulation.IDEAL)
    motion, forces = ideal_motion(p.constants, times), np.empty((len(REACTIONS), times.size))
    over_arrays(reactions)(p.constants, motion, 0.0, 0.0, True, True, (0.0, 0.0, 0.0, 0.0), forces)
    energies = [over_arrays(energy)(p.constants, motion, 0, 5) for energy in (kinetic_energy, height_energy)]
    linkage = over_arrays(four_bar)(p.constants, times)
    for i, t in enumerate(times):
        # To one rounding of sine or cosine, which numpy's own may have elsewhere than the C library's.
        close = {"rtol": 1e-12, "atol": 1e-12}
        np.testing.assert_allclose([part[i] for part in linkage], four_bar(c, t), **close)
        bodies, out = np.ascontiguousarray(motion[..., i]), np.empty(len(REACTIONS))
        reactions(c, bodies, 0.0, 0.0, True, True, (0.0, 0.0, 0.0, 0.0), out)
        np.testing.assert_allclose(forces[:, i], out, rtol=1e-9, atol=1e-9 * np.abs(out).max())
        compiled = [kinetic_energy(c, bodies, 0, 5), height_energy(c, bodies, 0, 5)]
        np.testing.assert_allclose([energy[i] for energy in energies], compiled, rtol=1e-12)


def test_where_rod_4_does_not_reach_there_is_no_number_and_no_warning():
    """As compiled, which warns of nothing; warnings are errors here."""
    data = load_scene("ideal").data
    data["mechanism"]["rod4"] |= {"length": 0.02, "centroid": 0.01}
    p = read_parameters(data)
    times = np.linspace(0.0, p.period, 100)
    angles = ideal_motion(p.constants, times)[3, 2]
    assert np.isnan(angles).any()
    reached = [reaches_line(as_record(p.constants, Formulation.IDEAL), times[[i]]) for i in range(times.size)]
    np.testing.assert_array_equal(np.isnan(angles), ~np.array(reached))
    with pytest.raises(ValueError, match="rod 4 is too short"):
        simulate(data)


def test_a_kernel_keeps_its_name_and_is_compiled_once():
    @kernel
    def doubled(x):
        """Return 2 x."""
        return 2.0 * x

    assert (doubled.__name__, doubled.__doc__) == ("doubled", "Return 2 x.")
    assert doubled(3.0) == 6.0
    assert doubled.compiled is doubled.compiled
    assert [len(doubled.signatures), doubled.py_func(1.0)] == [1, 2.0]
