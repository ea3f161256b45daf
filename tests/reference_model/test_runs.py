"""Runs of the press by the reference: kinks of loads, refusals, scipy's solvers, long runs."""

import json
import subprocess
import sys

import corner_depths
import numpy as np
import pytest
from reference_states import EACH

from reference_model import simulate
from reference_model.parameters import SCIPY_METHODS

TOLERANCE, METHOD = "solver.reference.tolerance", "solver.reference.method"
FOUNDATION, ADAMS = {"contact.law": "foundation"}, {"contact.law": "adams-impact"}
PIN = {"joints.crank_pin": "clearance"}


@pytest.fixture
def run(scene):
    """Simulate the paper's press with dotted keys replaced; every run must succeed."""

    def simulate_press(*changes):
        result = simulate(scene({key: value for part in changes for key, value in part.items()}))
        assert result.status == "success", result.remedy
        return result

    return simulate_press


def test_what_a_step_is_not_certain_of_is_met_by_the_next_one(run):
    """In a step here friction at the pin ends its ramp while a thousand parts are not enough to be certain.

    Taken whole, the step went on with the friction of the wrong speed, which drove the pin.
    """
    changes = {"mechanism.crank_angle_deg": 300.1272168723498, "drive.speed_rpm": -269.45821244429305}
    changes |= {"drive.cycles": 1.4, "initial.slider_offset": -4.2755923669826294e-05}
    changes |= {"initial.slider_angle": 0.0006960075339710039, "clearance.slider": 0.00010866430751602273}
    changes |= {"clearance.crank_pin": 5.653914398386387e-05, "contact.youngs_modulus": 2104527271.3435643}
    changes |= {"contact.poisson": 0.19700947594894763, "contact.restitution": 0.9075010876285426}
    changes |= {"contact.corner_radius": 0.001846716329960792, "friction.coefficient": 0.7798187884448144}
    invariants = run(PIN, changes, {TOLERANCE: 1e-11}).provenance["invariants"]
    assert invariants["driving-friction"]["value"] <= invariants["driving-friction"]["bound"]


def test_friction_of_a_soft_side_goes_on_to_the_regime_that_its_own_slip_enters(run):
    """Two of these starts stopped in chatter where the corner's slip told which regime comes next."""
    changes = {"contact.youngs_modulus": 1.5e6, "contact.poisson": 0.17, "clearance.slider": 9.5e-4}
    changes |= {"contact.restitution": 0.53, "friction.coefficient": 0.63, TOLERANCE: 1e-10}
    for angle in -1.4e-3 + 2e-5 * np.arange(20):
        run(FOUNDATION, changes, {"initial.slider_angle": float(angle), "drive.cycles": 1.0})


TABLE = {"load.table": [[0.0, 0.0], [1e-3, 500.0], [1.2e-3, 50.0], [2e-3, 50.0]]}
GROUPS = {"output.groups": ["accelerations", "corners", "joints", "energy"]}


@pytest.mark.parametrize("name", EACH)
def test_the_balance_of_energy_closes_with_a_load_to_1e_8_joule(run, name):
    """Steps over the kinks would leave 1e-9 J at strict tolerance, and of a prescribed motion 0.2 J."""
    columns = run(EACH[name], TABLE, GROUPS, {TOLERANCE: 1e-14, "drive.cycles": 1.0}).columns
    assert np.abs(columns["energy_residual"]).max() <= 1e-8
    assert 0.3 < columns["energy_load"].max() < 1.0
    assert columns["energy_load"][0] == columns["energy_load"][-1] == 0.0


def test_the_ideal_mechanism_s_extrema_are_those_at_the_kinks(run):
    """The force of a table is largest at its second row, between two marks; within 1e-6 s by 0.2 N."""
    result = run(EACH["ideal"], TABLE, GROUPS, {"drive.cycles": 1.0, "output.samples_per_cycle": 1000})
    extremum = result.extrema["reaction_F_y"]
    # Two degrees around it, 900 degrees a second
    window = {"mechanism.crank_angle_deg": 111.36 + 900.0 * extremum["time_of_min"] - 1.0}
    window |= {"drive.cycles": 2.0 / 360.0, "output.samples_per_cycle": 400_000}
    least = run(EACH["ideal"], TABLE, GROUPS, window).columns["reaction_F_y"].min()
    assert extremum["min"] == pytest.approx(least, abs=0.2)
    assert result.columns["reaction_F_y"].min() > least + 1.0


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
    with pytest.raises(ValueError, match=message) as error:
        simulate(scene(changes))
    assert "\n" not in str(error.value)
    assert METHOD not in changes or all(f"'{name}'" in str(error.value) for name in SCIPY_METHODS)


def test_a_corner_pressed_deep_into_a_wall_is_stiff_and_an_implicit_method_integrates_it(run):
    """A start wedged at 0.5 rad, at rest: the damping counts by the floor of the impact speed, 1e-4 m/s."""
    wedge = {"initial.slider_offset": 0.0, "initial.slider_angle": 0.5, "drive.cycles": 0.02}
    result = run(wedge, {METHOD: "LSODA"})
    assert result.provenance["counters"]["steps"] < 1000
    # It creeps out of the wedge: both corners are still inside, and less deep.
    angle = result.columns["slider_angle"]
    assert np.all(np.diff(angle) < 0.0)
    assert angle[-1] > 0.1


@pytest.mark.parametrize("name", EACH)
def test_what_is_asked_for_beyond_the_motion_does_not_change_it(run, name):
    """Motion, its extrema and the contacts are the same without all other channels and with them."""
    part, full = (run(EACH[name], {"drive.cycles": 0.1}, group) for group in ({"output.groups": []}, GROUPS))
    assert len(part.columns) == 7
    # Of the ideal mechanism the terms have another order: rounding of 0.55 m and some m/s.
    for channel, values in part.columns.items():
        np.testing.assert_allclose(values, full.columns[channel], rtol=0, atol=1e-14)
    for channel, values in part.extrema.items():
        for end in ("min", "max"):
            assert values[end] == pytest.approx(full.extrema[channel][end], rel=0, abs=1e-14)
    for column, values in part.events.items():
        np.testing.assert_array_equal(values, full.events[column])


@pytest.mark.parametrize("gain", [0.0, 3.0])
def test_baumgarte_bounds_the_drift(run, gain):
    """Without its terms Phi grows, with the time or its square; with them it stops after 1 / alpha."""
    gains = {"solver.reference.baumgarte_alpha": gain, "solver.reference.baumgarte_beta": gain}
    common = EACH["multiplier ideal"] | gains | {METHOD: "BDF", TOLERANCE: 1e-8, "output.groups": []}
    results = [run(common, {"drive.cycles": cycles}) for cycles in (4.0, 16.0)]
    early_drift, late_drift = (result.provenance["constraints"]["position"] for result in results)
    assert (late_drift < 1.3 * early_drift) == (gain > 0.0)
    assert gain > 0.0 or 4.0 < late_drift / early_drift < 32.0


def test_a_flight_is_integrated_in_few_steps(run):
    """Eighth order: 31 steps for 500 samples."""
    flight = {"clearance.slider": 2e-2, "initial.slider_offset": 0.0, "drive.cycles": 0.5}
    assert run(flight, {TOLERANCE: 1e-13, "output.groups": []}).provenance["counters"]["steps"] < 40


QUARTER = {"drive.cycles": 0.25}
"""The first quarter cycle: twelve contacts, among them some of two corners at once."""


@pytest.mark.parametrize("method", SCIPY_METHODS)
def test_scipy_s_multiplier_form_follows_the_minimal_form(run, method):
    few = run(QUARTER, {TOLERANCE: 1e-13})
    full = run(QUARTER, EACH["multiplier"], {METHOD: method, TOLERANCE: 1e-12})
    assert full.columns.keys() == few.columns.keys()
    np.testing.assert_array_equal(full.events["corner"], few.events["corner"])
    assert len(full.events["corner"]) == 12
    # Some 2000 local errors of 1e-12 m (or rad, at an arm of 0.05 m), not all of one sign: 1e-9 m at most.
    # In the angle times 1 / 35 mm; a contact of 0.2 ms makes a velocity of it, 1e-9 m / 2e-4 s.
    errors = {"slider_x": 1e-9, "slider_y": 1e-9, "slider_angle": 3e-8, "slider_vx": 5e-6}
    # 1e-9 m at the slowest touch, 0.01 m/s: 1e-7 s. An impulse by the speed's times the 0.3 kg that a corner
    # can hit. Depths really differ by 1e-12 m, which 1.5 F / d = 1.7e7 N/m makes 2e-5 N; in either run a peak
    # that is missed for the end of its step may be short by as much.
    errors |= {"start": 1e-7, "end": 1e-7, "normal_speed": 5e-6, "impulse": 1.5e-6, "largest_depth": 1e-9}
    for name, error in (errors | {"peak_force": 1e-4}).items():
        a, b = ((of.columns if name in of.columns else of.events)[name] for of in (full, few))
        np.testing.assert_allclose(a, b, rtol=0, atol=error, err_msg=name)


def test_modes_that_hand_over_to_each_other_do_not_hang(run):
    """A tolerance of 3e-3 m/s cannot tell on which side of the friction's kink at 1e-4 m/s a step ends."""
    pin = {"clearance.crank_pin": 1e-4, "drive.cycles": 0.05}
    result = run(EACH["pin"], pin, {METHOD: "BDF", TOLERANCE: 3e-6})
    assert result.provenance["counters"]["steps"] < 10_000


@pytest.mark.parametrize("method", SCIPY_METHODS)
def test_scipy_s_solvers_start_anew_at_the_kinks_of_a_load(run, method):
    """The contacts of half a cycle magnify their errors, 1e-10 m."""
    changes = ADAMS | TABLE | {TOLERANCE: 1e-10, "drive.cycles": 0.1, "load.surface": 0.17}
    reference, columns = (run(changes, of).columns for of in ({}, {METHOD: method}))
    np.testing.assert_allclose(columns["slider_x"], reference["slider_x"], rtol=0, atol=1e-7)
    assert reference["slider_y"].min() < 0.17 - 2e-3


# The peak of this program: that of `resource` has the peak of the process which started it.
_LONG_RUN = """
import json, re, sys
from pathlib import Path
from reference_model import simulate
result = simulate(json.loads(sys.argv[1]))
assert result.columns["time"].size == 1_000_001, result.status
peak = re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())
print(result.events["start"].size, peak[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="kB on Linux alone")
def test_ten_thousand_cycles_fit_into_a_gigabyte(scene):
    """At 100 samples a cycle, with accelerations and corners; the peak of the whole process counts."""
    data = scene(
        {"drive.cycles": 1e4, "output.samples_per_cycle": 100, "output.groups": ["accelerations", "corners"]}
    )
    command = [sys.executable, "-c", _LONG_RUN, json.dumps(data)]
    contacts, peak = map(int, subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout.split())
    assert peak < 1e6
    assert contacts > 500_000  # some hundred a cycle


@pytest.mark.slow
@pytest.mark.parametrize(
    ("draws", "judge"),
    [
        (corner_depths.grazing_runs(60, seed=1), corner_depths.check_steps),
        (corner_depths.random_runs(60, seed=1), corner_depths.check_steps),
        (corner_depths.scipy_runs(4, seed=1), corner_depths.check_table),
    ],
    ids=["grazing", "random", "scipy"],
)
def test_no_contact_is_missed(draws, judge):
    """A small share of the runs of `benchmarks/corner_depths.py`."""
    assert {draw.number: result for draw in draws if (result := judge(draw)).too_deep} == {}
