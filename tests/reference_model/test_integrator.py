"""The compiled integrator by itself: its order, events at the edge of rounding, long runs."""

import json
import subprocess
import sys

import numpy as np
import pytest

from reference_model import simulate


@pytest.mark.parametrize(("tolerance", "short"), [(1e-8, 6e-3), (1e-10, 1e-3), (1e-12, 2e-5)])
def test_peaks_of_the_contacts_are_those_between_the_steps(scene, tolerance, short) -> None:
    """Peak force and largest depth of the event table against samples 2e-7 s apart.

    A sample can miss the peak by a tenth of a microsecond: a force of 60 N that rises and falls in 1e-4 s by
    60 N (pi 1e-7 / 1e-4)^2 / 2 = 3e-4 N, a depth of 4e-6 m by 2e-11 m. A peak that is missed for the end of
    its step is short by the square of the step, which shrinks with the tolerance.
    """
    fine = {"drive.cycles": 0.1, "output.samples_per_cycle": 2_000_000, "output.groups": ["corners"]}
    result = simulate(scene({**fine, "solver.reference.tolerance": tolerance}))
    events, times = result.events, result.columns["time"]
    assert events["peak_force"].max() > 50.0
    for i, corner in enumerate(events["corner"]):
        first, last = np.searchsorted(times, [events["start"][i], events["end"][i]])
        force = result.columns[f"corner_{corner}_normal"][first:last].max()
        depth = -result.columns[f"corner_{corner}_gap"][first:last].min()
        assert -short < events["peak_force"][i] - force < 4e-4
        assert -1e-13 < events["largest_depth"][i] - depth < 2e-11


_LONG_RUN = """
import json, re, sys
from pathlib import Path
from reference_model import simulate
result = simulate(json.loads(sys.argv[1]))
assert result.status == "success", result.status
assert result.columns["time"].size == 1_000_001
peak = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())
print(result.events["start"].size, int(peak[1]) / 1e6)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("slider", ["clearance", "ideal"])
def test_ten_thousand_cycles_fit_into_a_gigabyte(scene, slider) -> None:
    """At 100 samples a cycle, with accelerations and corners; the peak of the whole process counts."""
    changes = {
        "drive.cycles": 10_000.0,
        "output.samples_per_cycle": 100,
        "output.groups": ["accelerations", "corners"],
        "joints.slider": slider,
    }
    run = [sys.executable, "-c", _LONG_RUN, json.dumps(scene(changes))]
    contacts, gigabytes = subprocess.run(run, capture_output=True, check=True, text=True).stdout.split()
    assert float(gigabytes) < 1.0
    # Some hundred contacts a cycle.
    assert int(contacts) > 500_000 or slider == "ideal"
