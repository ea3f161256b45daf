"""Runs of the press: convergence, energy, events and peaks, laws, starts at walls, what ends a run, refusals.

What either model has to fulfil, this one too, is in tests/contract.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

from reference_model import simulate
from reference_model.parameters import SCIPY_METHODS

TOLERANCE, METHOD = "solver.reference.tolerance", "solver.reference.method"
FOUNDATION, ADAMS = {"contact.law": "foundation"}, {"contact.law": "adams-impact"}
PIN = {"joints.crank_pin": "clearance"}
DENSE = {"drive.cycles": 0.1, "output.samples_per_cycle": 2_000_000}
"""Samples 2e-7 s apart."""


def test_error_follows_the_tolerance(run):
    """First-cycle error of x over five decades: fitted slope 0.9-1.4, no point tenfold off the fit.

    The median of five starts 10 nm apart: one run can be right by chance, or miss a contact that grazes.
    Below 1e-11 rounding, which a cycle's contacts magnify to some 5e-12 m, hides what the tolerance does.
    """
    tolerances = 10.0 ** -np.arange(6.0, 11.1, 0.5)
    errors = []
    for offset in 5e-5 + 1e-8 * np.arange(5):
        cycle = {"drive.cycles": 1.0, "initial.slider_offset": offset}
        exact, *others = (run(cycle, {TOLERANCE: t}).columns["slider_x"] for t in (1e-13, *tolerances))
        errors.append([np.abs(x - exact).max() for x in others])
    middle = np.log10(np.median(errors, axis=0))
    fit = np.polynomial.Polynomial.fit(np.log10(tolerances), middle, 1).convert()
    assert 0.9 < fit.coef[1] < 1.4
    assert np.abs(middle - fit(np.log10(tolerances))).max() < 1.0


def test_what_a_step_is_not_certain_of_is_met_by_the_next_one(run):
    """In a step here friction at the pin ends its ramp while a thousand parts are not enough to be certain.

    Taken whole, the step went on with the friction of the wrong speed, which drove the pin.
    """
    rolling = {"mechanism.crank_angle_deg": 300.1272168723498, "drive.speed_rpm": -269.45821244429305}
    rolling |= {"drive.cycles": 1.4, "initial.slider_offset": -4.2755923669826294e-05}
    rolling |= {"initial.slider_angle": 0.0006960075339710039, "clearance.slider": 0.00010866430751602273}
    rolling |= {"clearance.crank_pin": 5.653914398386387e-05, "contact.youngs_modulus": 2104527271.3435643}
    rolling |= {"contact.poisson": 0.19700947594894763, "contact.restitution": 0.9075010876285426}
    rolling |= {"contact.corner_radius": 0.001846716329960792, "friction.coefficient": 0.7798187884448144}
    invariants = run(PIN, rolling, {TOLERANCE: 1e-11}).provenance["invariants"]
    assert invariants["driving-friction"]["value"] <= invariants["driving-friction"]["bound"]


@pytest.mark.parametrize(
    ("changes", "short"),
    [({TOLERANCE: 1e-8}, 6e-3), ({TOLERANCE: 1e-12}, 2e-5), (ADAMS | {TOLERANCE: 1e-10}, 1e-3)],
)
def test_peaks_and_impulses_of_the_event_table_are_those_between_the_steps(run, changes, short):
    """Against samples: a peak missed for the end of its step is short by a power of the step, N of some 60.

    A sample misses the peak by a tenth of a microsecond: a force of 60 N that rises and falls in 1e-4 s by
    60 N (pi 1e-7 / 1e-4)^2 / 2 = 3e-4 N, a depth of 4e-6 m by 2e-11 m.
    """
    result = run(DENSE, changes)
    events, columns = result.events, result.columns
    assert events["peak_force"].max() > 50.0
    for i, corner in enumerate(events["corner"]):
        during = slice(*np.searchsorted(columns["time"], [events["start"][i], events["end"][i]]))
        force, gap = (columns[f"corner_{corner}_{what}"][during] for what in ("normal", "gap"))
        assert -short < events["peak_force"][i] - force.max() < 4e-4
        assert -1e-13 < events["largest_depth"][i] + gap.min() < 2e-11
        assert np.trapezoid(force, columns["time"][during]) == pytest.approx(events["impulse"][i], rel=0.01)


def test_friction_of_a_soft_side_goes_on_to_the_regime_that_its_own_slip_enters(run):
    """Two of these starts stopped in chatter where the corner's slip told which regime comes next."""
    soft = {"contact.youngs_modulus": 1.5e6, "contact.poisson": 0.17, "clearance.slider": 9.5e-4}
    soft |= {"contact.restitution": 0.53, "friction.coefficient": 0.63, TOLERANCE: 1e-10}
    for angle in -1.4e-3 + 2e-5 * np.arange(20):
        run(FOUNDATION, soft, {"initial.slider_angle": float(angle), "drive.cycles": 1.0})


def test_pulses_are_the_forces_of_the_contacts(run):
    """Sorted, within their contacts, up to the peak."""
    whole = run({"drive.cycles": 0.3}, FOUNDATION)
    row, time, force = (whole.pulses[name] for name in ("row", "time", "force"))
    events = whole.events
    assert np.all(np.diff(row) >= 0)
    assert np.all((time > events["start"][row]) & (time <= events["end"][row]))
    assert np.all(force <= events["peak_force"][row] * (1.0 + 1e-12))
    assert np.all(np.diff(time)[np.diff(row) == 0] > 0.0)
    largest = np.array([force[row == i].max(initial=0.0) for i in range(events["start"].size)])
    assert np.median(largest / events["peak_force"]) > 0.95


def test_a_grazing_touch_within_one_step_is_seen_but_by_scipy_s_events(run):
    """The turning point of a first flight lies 1e-9 m inside the wall, for a hundredth of a step.

    `solve_ivp` looks at the ends of steps, as is said of it, and a graze lies between them.
    """
    wide = {"clearance.slider": 5e-4, "initial.slider_vx": 0.02, "drive.cycles": 0.025}
    free = run(wide, {"output.samples_per_cycle": 200_000})
    assert free.events["start"].size == 0
    turn = free.columns["slider_x"].max() + 0.55
    grazing = {**wide, "clearance.slider": turn - 1e-9, TOLERANCE: 3e-6}
    touched = run(grazing).events
    assert set(touched["corner"]) == {"lr", "ur"}
    # The sampled turning point is off by at most a sample's fall, (2e-6 s)^2 * 10 m/s^2 = 4e-11 m.
    assert touched["largest_depth"].max() == pytest.approx(1e-9, rel=0.05)
    assert run(grazing, {METHOD: "scipy-DOP853"}).events["start"].size == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contact.law": "glue"}, "contact.law = 'glue'"),
        ({"output.groups": ["colours"]}, "output.groups = 'colours'"),
        ({TOLERANCE: 1e-30}, "must be at least 1e-14"),
        ({TOLERANCE: 1e-5}, "must be at most 8.3e-06 rad, 1% of the angle"),
        *(({METHOD: name}, f"{METHOD} = '{name}'.*'dop853'.*'BDF'") for name in ("bdf", "DOP853", "euler")),
        (PIN | {"solver.reference.formulation": "multiplier"}, "has ideal revolutes only"),
    ],
)
def test_scenes_outside_the_model_are_refused_in_one_line(scene, changes, message):
    with pytest.raises(ValueError, match=message) as caught:
        simulate(scene(changes))
    assert "\n" not in str(caught.value)
    assert METHOD not in changes or all(f"'{name}'" in str(caught.value) for name in SCIPY_METHODS)


def test_a_corner_pressed_deep_into_a_wall_is_stiff_and_an_implicit_method_integrates_it(run):
    """A start wedged at 0.5 rad, at rest: the damping counts by the floor of the impact speed, 1e-4 m/s."""
    wedged = {"initial.slider_offset": 0.0, "initial.slider_angle": 0.5, "drive.cycles": 0.02}
    implicit = run(wedged, {METHOD: "LSODA"})
    assert implicit.provenance["counters"]["steps"] < 1000
    # It creeps out of the wedge: both corners are still inside, and less deep.
    angle = implicit.columns["slider_angle"]
    assert np.all(np.diff(angle) < 0.0)
    assert angle[-1] > 0.1


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
def test_ten_thousand_cycles_fit_into_a_gigabyte(scene, slider):
    """At 100 samples a cycle, with accelerations and corners; the peak of the whole process counts."""
    changes = {"drive.cycles": 10_000.0, "output.samples_per_cycle": 100, "joints.slider": slider}
    data = scene(changes | {"output.groups": ["accelerations", "corners"]})
    command = [sys.executable, "-c", _LONG_RUN, json.dumps(data)]
    contacts, gigabytes = subprocess.run(command, capture_output=True, check=True, text=True).stdout.split()
    assert float(gigabytes) < 1.0
    assert int(contacts) > 500_000 or slider == "ideal"  # some hundred contacts a cycle
