"""Runs of the press: convergence, energy, events and peaks, laws, starts at walls, what ends a run, refusals.

What either model has to fulfil, this one too, is in tests/contract.
"""

import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import brentq

from reference_model import simulate
from reference_model.linkage import ideal_motion
from reference_model.parameters import SCIPY_METHODS, read_parameters

TOLERANCE, METHOD = "solver.reference.tolerance", "solver.reference.method"
FOUNDATION, ADAMS = {"contact.law": "foundation"}, {"contact.law": "adams-impact"}
ELASTIC = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
UNDAMPED = {"contact.damping": 0.0, "friction.coefficient": 0.0}
CLIPS = {"contact.damping": 2600.0}
"""Ten times what the mean hit would need to lose as much as by Eqs. 9-11."""
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


@pytest.mark.parametrize(
    ("changes", "bound"),
    [
        (FOUNDATION | {TOLERANCE: 1e-11}, 1e-9),
        (FOUNDATION | ELASTIC | {TOLERANCE: 1e-11}, 1e-9),
        (ADAMS, 1e-9),
        (ADAMS | CLIPS, 1e-9),
        (ADAMS | UNDAMPED | {TOLERANCE: 1e-11}, 1e-9),
        (PIN | ADAMS | {"drive.cycles": 0.1}, 1e-7),
        (PIN | FOUNDATION | {"drive.cycles": 0.1}, 1e-8),
    ],
)
def test_energy_is_lost_by_damping_and_friction_and_accounted_for(run, changes, bound):
    """Where the run is predictable; a force that jumped, as the literal switch does, would be off by 1e-3."""
    usual = {"drive.cycles": 0.3, TOLERANCE: 1e-10, "output.groups": ["energy", "corners"]}
    result = run(usual, changes)
    columns = result.columns
    assert np.abs(columns["energy_residual"]).max() < bound
    assert columns["energy_contact"].min() >= 0.0
    assert ("pin" in result.events["corner"]) == (changes.keys() >= PIN.keys())
    # Of 0.3 cycles damping takes 1e-5 J and friction 1e-4 J at least.
    for part, least in (("damping", 1e-5), ("friction", 1e-5 if changes.keys() >= PIN.keys() else 1e-4)):
        assert np.all(np.diff(columns[f"energy_{part}"]) >= -1e-15)
        lossless = ELASTIC.items() <= changes.items() or UNDAMPED.items() <= changes.items()
        assert (columns[f"energy_{part}"][-1] > least) == (not lossless)


def test_what_a_step_is_not_certain_of_is_met_by_the_next_one(run):
    """In a step here friction at the pin ends its ramp while a thousand parts are not enough to be certain.

    Taken whole, the step went on with the friction of the wrong speed, which drove the pin.
    """
    rolling = {
        "mechanism.crank_angle_deg": 300.1272168723498,
        "drive.speed_rpm": -269.45821244429305,
        "drive.cycles": 1.4,
        "initial.slider_offset": -4.2755923669826294e-05,
        "initial.slider_angle": 0.0006960075339710039,
        "clearance.slider": 0.00010866430751602273,
        "clearance.crank_pin": 5.653914398386387e-05,
        "contact.youngs_modulus": 2104527271.3435643,
        "contact.poisson": 0.19700947594894763,
        "contact.restitution": 0.9075010876285426,
        "contact.corner_radius": 0.001846716329960792,
        "friction.coefficient": 0.7798187884448144,
    }
    invariants = run(PIN, rolling, {TOLERANCE: 1e-11}).provenance["invariants"]
    assert invariants["driving-friction"]["value"] <= invariants["driving-friction"]["bound"]


def test_adams_impact_without_damping_is_hertz_without_it(run):
    """C = 0 and c = 0, with the same K: the same formulas, to the last bit; damped they part at once."""
    short = {"drive.cycles": 0.3, TOLERANCE: 1e-10}
    elastic, impact = run(short, ELASTIC), run(short, ADAMS, UNDAMPED)
    assert elastic.events["start"].size > 3
    for of in ("columns", "events", "pulses"):
        for name, values in getattr(elastic, of).items():
            np.testing.assert_array_equal(getattr(impact, of)[name], values, err_msg=name)
    damped, impact = run(short).events, run(short, ADAMS).events
    assert all(damped[name][0] == impact[name][0] for name in ("corner", "start", "normal_speed"))
    assert damped["end"][0] != impact["end"][0]


@pytest.mark.parametrize("exponent", [1.5, 2.2])
def test_adams_impact_acts_as_its_formula_says_and_is_clipped_where_it_would_pull(run, exponent):
    """At every sample within a contact, from its gap and the gap's rate.

    With n > 2 a hit ends clipped, as c(d) falls with d^2 and the elastic force faster.
    """
    changes = ADAMS | CLIPS | DENSE | {"contact.exponent": exponent, "output.groups": ["corners"]}
    changes |= {"contact.stiffness": 4.6e9 * 5e-6 ** (1.5 - exponent)}
    result, ended_clipped = run(changes), 0
    events, columns = result.events, result.columns
    assert result.provenance["counters"]["switches"] < 5 * events["start"].size
    for name, start, end in zip(events["corner"], events["start"], events["end"], strict=True):
        during = slice(*np.searchsorted(columns["time"], [start, end]))
        depth, force = -columns[f"corner_{name}_gap"][during], columns[f"corner_{name}_normal"][during]
        s, rate = np.minimum(depth / 1e-5, 1.0), np.gradient(depth, columns["time"][during])
        exact = changes["contact.stiffness"] * depth**exponent + 2600.0 * s**2 * (3.0 - 2.0 * s) * rate
        # Central differences of some 1e3 samples a hit, whose acceleration has kinks at other touches.
        np.testing.assert_allclose(force[1:-1], np.maximum(exact, 0.0)[1:-1], rtol=0, atol=1e-3 * force.max())
        ended_clipped += force[-1] == 0.0
        assert exponent > 2.0 or np.all(force > 0.0)
    assert (ended_clipped >= 3) == (exponent > 2.0)


def test_a_corner_that_leaves_deep_and_fast_is_clipped_and_pushes_again_before_it_is_out(run):
    """k d^1.5 > c(d) v below some depth d, at the speed v = 1 m/s that nothing changes in 1e-5 s."""
    thrown = {"initial.slider_offset": 2.1e-4, "initial.slider_vx": -1.0, "drive.cycles": 5e-5}
    thrown |= {"output.samples_per_cycle": 40_000_000, "contact.stiffness": 4.6e9}
    result = run(ADAMS, thrown)
    depth, force = (-result.columns["corner_lr_gap"], result.columns["corner_lr_normal"])
    turn = brentq(lambda d: 4.6e9 * d**1.5 - 260.0 * (d / 1e-5) ** 2 * (3.0 - 2e5 * d), 1e-8, 5e-6)
    inside = depth > 0.0
    # The speed changes by the force's 0.3 N on 0.02 kg in 1e-6 s and by gravity's like, 1e-4 of it.
    assert np.all(force[depth > 1.01 * turn] == 0.0)
    assert np.all(force[inside & (depth < 0.99 * turn)] > 0.0)
    assert np.count_nonzero(inside & (depth < 0.99 * turn)) > 10


@pytest.mark.parametrize(
    ("changes", "short", "missed"),
    [
        *(({TOLERANCE: tolerance}, n, 4e-4) for tolerance, n in ((1e-8, 6e-3), (1e-10, 1e-3), (1e-12, 2e-5))),
        (ADAMS | {TOLERANCE: 1e-10}, 1e-3, 4e-4),
    ],
)
def test_peaks_and_impulses_of_the_event_table_are_those_between_the_steps(run, changes, short, missed):
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
        assert -short < events["peak_force"][i] - force.max() < missed
        assert -1e-13 < events["largest_depth"][i] + gap.min() < 2e-11
        assert np.trapezoid(force, columns["time"][during]) == pytest.approx(events["impulse"][i], rel=0.01)


@pytest.mark.parametrize(
    "other",
    [{"solver.reference.formulation": "multiplier"}, {METHOD: "LSODA"}, {METHOD: "scipy-DOP853"}],
)
def test_other_formulations_and_solvers_find_a_foundation_s_run(run, other):
    """Over the first contacts; the solvers' own errors, 1e-10 m, are not yet magnified much."""
    short = FOUNDATION | {"drive.cycles": 0.05, TOLERANCE: 1e-10}
    usual, computed = run(short), run(short, other)
    np.testing.assert_allclose(computed.columns["slider_x"], usual.columns["slider_x"], rtol=0, atol=1e-8)
    assert computed.events["corner"].tolist() == usual.events["corner"].tolist()
    for what in ("start", "end"):
        np.testing.assert_allclose(computed.events[what], usual.events[what], rtol=0, atol=1e-6)
    for what in ("normal_speed", "impulse", "peak_force", "largest_depth"):
        np.testing.assert_allclose(computed.events[what], usual.events[what], rtol=1e-2)


def test_friction_of_a_soft_side_goes_on_to_the_regime_that_its_own_slip_enters(run):
    """Two of these starts stopped in chatter where the corner's slip told which regime comes next."""
    soft = {"contact.youngs_modulus": 1.5e6, "contact.poisson": 0.17, "clearance.slider": 9.5e-4}
    soft |= {"contact.restitution": 0.53, "friction.coefficient": 0.63, TOLERANCE: 1e-10}
    for angle in -1.4e-3 + 2e-5 * np.arange(20):
        run(FOUNDATION, soft, {"initial.slider_angle": float(angle), "drive.cycles": 1.0})


def test_pulses_are_the_forces_of_the_contacts(run, monkeypatch):
    """Sorted, within their contacts, up to the peak; what finds no room changes nothing else."""
    monkeypatch.setattr("reference_model.running.ROWS_AT_ONCE", 5)
    changes = {"drive.cycles": 0.3}, FOUNDATION
    whole = run(*changes)
    row, time, force = (whole.pulses[name] for name in ("row", "time", "force"))
    events = whole.events
    assert np.all(np.diff(row) >= 0)
    assert np.all((time > events["start"][row]) & (time <= events["end"][row]))
    assert np.all(force <= events["peak_force"][row] * (1.0 + 1e-12))
    assert np.all(np.diff(time)[np.diff(row) == 0] > 0.0)
    largest = np.array([force[row == i].max(initial=0.0) for i in range(events["start"].size)])
    assert np.median(largest / events["peak_force"]) > 0.95
    sizes = np.bincount(row)
    # Some five rows are taken at once, fewer than a contact has: the room mostly ends within one.
    for room in (30, 35, 40, 45):
        monkeypatch.setattr("reference_model.observation._NOTES", room)
        cut = run(*changes)
        for name, column in events.items():
            np.testing.assert_array_equal(cut.events[name], column)
        rows, kept = np.unique(cut.pulses["row"], return_counts=True)
        assert 0 < rows.size < sizes.size
        np.testing.assert_array_equal(kept, sizes[rows])


@pytest.mark.parametrize("speed", [1e-5, 1e-3])
@pytest.mark.parametrize("clearance", [2e-4, 2e-4 * (1.0 + 1e-12)], ids=["on it", "2e-16 m off"])
def test_a_start_on_a_wall_and_into_it_is_a_contact_from_the_start(run, clearance, speed):
    """The slider turns within the first step: its gap is open at both ends, and in the wall between.

    At 1e-5 m/s it is 1.2e-11 m deep: the wall's force is negligible there beside what the drive makes of its
    acceleration a, 4.29 m/s^2, and it is in the wall for 2 v / a = 4.66e-6 s.
    """
    changes = {"initial.slider_offset": 2e-4, "initial.slider_vx": speed, "clearance.slider": clearance}
    events = run(changes, {"drive.cycles": 0.01}).events
    assert set(events["corner"][:2]) == {"lr", "ur"}
    # 2e-16 m are passed in 2e-11 s, and change the speed by less than the acceleration times that.
    assert events["start"][:2] == pytest.approx(0.0, abs=1e-10)
    assert events["normal_speed"][:2] == pytest.approx(max(speed, 1e-4), rel=1e-6)
    if speed == 1e-5:  # as exact as the acceleration is given
        assert events["end"][:2] == pytest.approx(2.0 * speed / 4.29, rel=1e-3)


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
        ({"drive.speed_rpm": 0.0}, "drive.speed_rpm = 0.0 must not be zero"),
        ({"contact.law": "glue"}, "contact.law = 'glue'"),
        ({"contact.law": "strip"}, "contact.law = 'strip' .* use 'foundation'"),
        ({"load.force": 1.0, "load.table": [[0.0, 0.0], [1.0, 1.0]]}, r"load\.table .* give one of both"),
        *(
            ({"load.table": rows}, r"load\.table must begin with \[0, 0\]")
            for rows in ([[0.0, 1.0]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 0.0], [1.0, -1.0]])
        ),
        ({"load.force": 1.0, "load.exponent": 0.5}, r"load\.exponent = 0\.5 at least 1"),
        ({"output.groups": ["colours"]}, "output.groups = 'colours'"),
        ({"mechanism.crank.length": 0.5}, "cannot be assembled over a whole revolution"),
        ({"mechanism.rod4.length": 0.04}, "rod 4 is too short"),
        ({"mechanism.rod4.length": 0.04, "joints.slider": "ideal"}, "rod 4 is too short"),
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


def test_where_rod_4_does_not_reach_there_is_no_number_and_no_warning(scene):
    """Warnings are errors here."""
    p = read_parameters(scene({"mechanism.rod4.length": 0.02, "mechanism.rod4.centroid": 0.01}))
    assert np.isnan(ideal_motion(p.mechanism, np.linspace(0.0, p.period, 100))[3, 2]).any()


@pytest.mark.parametrize(
    ("limit", "changes", "words"),
    [
        ("STEPS_PER_CYCLE_LIMIT", {}, "drive.cycles"),
        ("SCIPY_STEPS_PER_CYCLE_LIMIT", {METHOD: "BDF"}, "solver.reference.method = 'dop853'"),
    ],
)
def test_too_much_work_ends_with_a_status_and_keeps_what_was_computed(
    scene, monkeypatch, limit, changes, words
):
    monkeypatch.setattr(f"reference_model.simulation.{limit}", 300)
    result = simulate(scene({"drive.cycles": 1.0, **changes}))
    assert result.status == result.provenance["status"] == "work-limit"
    assert words in result.remedy
    assert 10 < result.columns["time"].size < 1000
    assert all(np.isfinite(column).all() for column in result.columns.values())
    assert result.events["start"].size > 0


def test_a_corner_pressed_deep_into_a_wall_is_stiff_and_an_implicit_method_integrates_it(
    scene, run, monkeypatch
):
    """A start wedged at 0.5 rad, at rest: the damping counts by the floor of the impact speed, 1e-4 m/s."""
    monkeypatch.setattr("reference_model.simulation.STEPS_PER_CYCLE_LIMIT", 50_000)
    wedged = {"initial.slider_offset": 0.0, "initial.slider_angle": 0.5, "drive.cycles": 0.02}
    result = simulate(scene(wedged))
    assert result.status == "work-limit"
    assert "solver.reference.method = 'LSODA'" in result.remedy
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
