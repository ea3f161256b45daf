"""The compiled integrator by itself: its order, events at the edge of rounding, long runs."""

import json
import subprocess
import sys

import numpy as np
import pytest

from reference_model import integrate, simulate
from reference_model.constants import Formulation
from reference_model.dop853 import NODES, ROWS, STAGES, dense, error_norm, prepare_dense, take_step
from reference_model.forces import CONTACTS, MODES, no_contacts
from reference_model.formulations import DRIVEN, right_hand_side, state_size
from reference_model.integrate import CHATTER, REACHED, advance
from reference_model.linkage import TIP_ROWS, rocker_tip, rocker_tips
from reference_model.progress import ENDED, SWITCHES, begin
from reference_model.reading import read_parameters
from reference_model.recording import samples_of
from reference_model.start import start
from reference_model.switching import contact_state

HALF_CYCLE = 0.2
"""s, at 150 rpm."""
EXACT_STEPS = 400


def free_flight(scene, steps):
    """Integrate half a cycle without walls in equal steps.

    Returns the states at the steps' ends and, by dense output, in their middles: shapes (steps, 4).
    """
    c, y0 = start(read_parameters(scene()), Formulation.SLIDER)
    size, h = state_size(c), HALF_CYCLE / steps
    y, (y1, scratch, state) = np.zeros(size), np.empty((3, size))
    y[:4] = y0
    k, f, modes, contacts = (
        np.zeros((ROWS, size)),
        np.empty((7, size)),
        np.zeros((MODES, CONTACTS)),
        no_contacts(),
    )
    ends, middles = np.empty((2, steps, 4))
    table, stages = np.empty((DRIVEN, NODES.size)), np.zeros((STAGES + 1, *contacts.shape))
    for i in range(steps):
        right_hand_side(c, i * h, y, modes, k[0], contacts)
        take_step(c, i * h, h, y, modes, k, y1, stages, table)
        prepare_dense(c, i * h, h, y, y1, modes, k, table, 4, scratch, contacts, f)
        dense(y, f, 0.5, 4, state)
        ends[i], middles[i] = y1[:4], state[:4]
        y[:] = y1
    return ends, middles


@pytest.mark.parametrize("stage", [0, 5, 11])
def test_a_step_whose_stages_are_absurd_is_never_accepted(stage) -> None:
    """In a stiff contact they grew until their squares were infinite, and an error over infinity was 0.

    The step was taken for exact, and a corner 1 mm off its wall began a contact in it.
    """
    k, weights = np.zeros((ROWS, 4)), np.full(4, 1e10)
    assert error_norm(1e-6, k, weights) == 0.0
    for size in (*np.geomspace(1e3, 1e300, 2000), np.inf, np.nan):
        k[stage] = size
        assert not error_norm(1e-6, k, weights) <= 1.0, size


def test_the_rocker_at_many_times_at_once_is_the_rocker_at_each(scene) -> None:
    """To the last bit: how a step groups its stages is no matter of accuracy."""
    c, _ = start(read_parameters(scene()), Formulation.SLIDER)
    rng = np.random.default_rng(5)
    for count in (1, 2, 7, 12, 100):
        t, h, shares = rng.uniform(0.0, 0.4), 10.0 ** rng.uniform(-9.0, -2.0), rng.uniform(size=count)
        out = np.empty((TIP_ROWS, count))
        rocker_tips(c, t, h, shares, out)
        np.testing.assert_array_equal(out[:6].T, [rocker_tip(c, t + share * h) for share in shares])


def test_order_on_a_stretch_without_contacts(scene) -> None:
    """Eighth order at the steps' ends and, its local error being of that order, of the dense output."""
    exact, _ = free_flight(scene, EXACT_STEPS)

    def order(counts, error):
        return -np.polyfit(np.log(counts), np.log([error(steps) for steps in counts]), 1)[0]

    def at_ends(steps):
        return np.abs(free_flight(scene, steps)[0][-1] - exact[-1]).max()

    def between(steps):
        stride = EXACT_STEPS // steps
        return np.abs(free_flight(scene, steps)[1] - exact[stride // 2 - 1 :: stride]).max()

    # From where the leading term rules to where errors of some 1e-14 meet the rounding of 400 steps.
    assert order([4, 5, 8, 10], at_ends) == pytest.approx(8.0, abs=0.3)
    assert order([10, 20, 25, 40], between) == pytest.approx(8.0, abs=0.3)


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


@pytest.mark.parametrize("speed", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["left", "right"])
def test_a_gap_rounded_to_the_wrong_side_does_not_chatter(scene, side, speed) -> None:
    """A corner that left its wall by rounding only, slowly, with a step far longer than its flight.

    Seen in a long run: gap -2e-16 m and opening, an 8 ms step that comes back deep inside the wall. It
    touched and left at that instant for ever. Two contacts of each side and some bounces is what physics has.
    """
    p = read_parameters(scene({"initial.slider_offset": side * 2e-4, "initial.slider_vx": -side * speed}))
    c, y0 = start(p, Formulation.SLIDER)
    for _ in range(20):  # the start's own rounding decides the last digit
        if contact_state(c, 0 if side < 0 else 1, 0.0, y0)[0] < 0.0:
            break
        y0[0] -= np.spacing(y0[0]) * side
    progress = begin(c, y0, 1e-3)
    progress.modes[:] = 0.0
    gap = contact_state(c, 0 if side < 0 else 1, 0.0, progress.y)[0]
    assert -1e-15 < gap < 0.0
    progress.clock[1] = p.period / 50
    status = advance(c, progress, 0.01, 0.01, 1e-7, p.period / 50, 10**6, samples_of((), np.empty(0)))
    assert status == REACHED
    assert progress.counters[ENDED] < 40


def test_endless_switching_at_one_instant_is_stopped(scene, monkeypatch) -> None:
    """Forced in the uncompiled kernel: every step is said to end a mode at its very start."""
    monkeypatch.setattr(integrate, "step_may_switch", lambda *_: True)
    monkeypatch.setattr(integrate, "first_switch", lambda *_: (0.0, 0, 0))
    p = read_parameters(scene())
    c, y0 = start(p, Formulation.SLIDER)
    progress = begin(c, y0, 1e-6)
    nothing = samples_of((), np.empty(0))
    assert advance.py_func(c, progress, 1.0, 1.0, 1e-9, p.period / 50, 10**6, nothing) == CHATTER
    assert progress.clock[0] == 0.0
    assert progress.counters[SWITCHES] < 200


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
