"""What holds exactly along every motion: lengths of rods, the energy's balance."""

import math

import numpy as np
import pytest
from closed_linkage import crank_angle, joints
from scipy.integrate import cumulative_trapezoid

RATES = {"x": ("vx", "ax"), "y": ("vy", "ay"), "angle": ("omega", "alpha")}
AUDITED = pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0}


def rocker_tip(scene, time):
    """Joint C as a complex number."""
    return joints(scene, crank_angle(scene, time))[2]


def test_rod_4_keeps_its_length(short, request):
    """|F - C| = L4 and (F - C) . (vF - vC) = 0 at every sample, with vC by differences of the closed form."""
    time, step = short.columns["time"], 1e-5
    tip = rocker_tip(short.scene, time)
    rod = short.columns["slider_x"] + 1j * short.columns["slider_y"] - tip
    bound = {
        "reference-minimal": 1e-15,  # by construction, to the rounding of 0.5 m
        "exudyn-tree": 1e-15,
        "reference-multiplier": 1e-12,  # held by Baumgarte's terms against a tolerance of 1e-12
        # Exudyn solves the constraints of position to Newton's 1e-7 in mixed units; its time is a sum of
        # 2e4 steps, rounded at 1e-14 s with C at 2 m/s.
        "exudyn-full": 1e-11,
        # Of velocity alone: the trapezoidal rule leaves (omega h)^2 / 12 of the path a cycle at 2e-6 s.
        "exudyn-index2": 1e-9,
    }[request.getfixturevalue("variant")]
    assert np.abs(np.abs(rod) - short.scene["mechanism"]["rod4"]["length"]).max() <= bound
    assert np.all(rod.imag < 0)  # the branch: the slider hangs below the rocker's tip
    rate = (rocker_tip(short.scene, time + step) - rocker_tip(short.scene, time - step)) / (2.0 * step)
    speed = short.columns["slider_vx"] + 1j * short.columns["slider_vy"] - rate
    # Differences: step^2 / 6 times the third derivative, 16^3 * 0.1 m: 7e-9 m/s. Generalized-alpha satisfies
    # the constraints at position level, velocities follow to its second order in 2e-6 s.
    assert np.abs((rod.conjugate() * speed).real).max() <= 0.24 * 2e-8 + (0.0 if short.reference else 1e-7)


def test_rates_are_the_derivatives(short):
    """Velocities sum up to positions, accelerations to velocities: radians, not degrees, and right limits."""
    for position, (rate, second) in RATES.items():
        for name, of in ((position, rate), (rate, second)):
            values, slopes = short.columns[f"slider_{name}"], short.columns[f"slider_{of}"]
            summed = cumulative_trapezoid(slopes, short.columns["time"], initial=0.0)
            # Fifty samples a hit: each is summed to some 1e-3 of itself. Angular velocities change by 2 rad/s
            # in it, of a range of that size; a motion knows nothing of hits but kinks in its rate.
            assert np.abs(values - values[0] - summed).max() <= 1e-3 * np.ptp(values), name


@AUDITED
@pytest.mark.parametrize("name", ["rattle", "wedge", "punch"])
def test_the_balance_of_energy_closes(run, variant, name):
    simulated = run(variant, name)
    parts = {key: simulated.columns[f"energy_{key}"] for key in ("drive", "gravity", "damping", "friction")}
    lost = parts["damping"] + parts["friction"]
    # Integrated with the motion at 1e-12; by the trapezoidal rule over steps of 2e-6 s through hits of
    # 1.5e-4 s, (1/75)^2 of what they take.
    assert lost[-1] > 1e-5
    residual = np.abs(simulated.columns["energy_residual"]).max()
    bound = (1e-8 if simulated.reference else 1e-3) * lost[-1]
    assert residual <= bound
    assert np.all(np.diff(parts["friction"]) >= 0.0)
    if name != "wedge":
        power = simulated.columns["crank_torque"] * simulated.scene["drive"]["speed_rpm"] * math.pi / 30.0
        work = cumulative_trapezoid(power, simulated.columns["time"], initial=0.0)
        # Samples of 4e-6 s through hits of 2e-4 s: (1/50)^2 / 12 of what the torque does in them.
        assert np.abs(work - parts["drive"]).max() <= 1e-4 * np.ptp(work)
    assert all(values[0] == 0.0 for values in parts.values())  # counted from t = 0
    if name == "punch":
        # The force between the table's rows, over the slider's way: sums of straight pieces, 1e-8 of it.
        height, rows = simulated.columns["slider_y"], np.transpose(simulated.scene["load"]["table"])
        force = np.interp(simulated.scene["load"]["surface"] - height, *rows)
        stored = -cumulative_trapezoid(force, height, initial=0.0)
        energy = simulated.columns["energy_load"]
        assert np.abs(energy - energy[0] - stored).max() <= 1e-7 * stored[-1]
        # What is stored at the start is not counted; 4 N/mm over 0.1 mm.
        assert energy[0] == pytest.approx(0.5 * force[0] ** 2 / 4e3, rel=1e-9)
        assert energy[0] > 3.0 * bound
        assert stored[-1] > 0.1 > lost[-1]
    for part in ("kinetic", "contact"):
        assert simulated.result.extrema[f"energy_{part}"]["min"] >= 0.0
        assert np.all(simulated.columns[f"energy_{part}"] >= 0.0)


@AUDITED
def test_a_cycle_of_the_ideal_mechanism_returns_all_work(run, variant):
    cycle = {"output.groups": ["energy"], "drive.cycles": 1.0, "solver.exudyn.step": 2e-5}
    columns = run(variant, "ideal", cycle).columns
    for name in ("drive", "gravity"):
        work = columns[f"energy_{name}"]
        assert np.ptp(work) > 0.5
        # The trapezoidal rule over a period is exact to round-off; the Newton iteration leaves 1e-12
        assert abs(work[-1]) < 1e-10
    kinetic = columns["energy_kinetic"]
    assert kinetic[-1] == pytest.approx(kinetic[0], rel=1e-9)
    # Within the cycle second order in Exudyn's step: 2e-8 J of 1 J measured
    assert np.max(np.abs(columns["energy_residual"])) < 4e-8
    for name in ("contact", "damping", "friction"):
        assert not columns[f"energy_{name}"].any()


@AUDITED
def test_nothing_is_lost_without_damping_and_friction(run, variant):
    simulated = run(variant, "rattle", LOSSLESS)
    assert simulated.result.events["start"].size >= 10
    assert not simulated.columns["energy_damping"].any()
    assert not simulated.columns["energy_friction"].any()
    stored = simulated.columns["energy_contact"].max()
    assert stored > 1e-5
    # Of what the walls store at most: the solver's own error, of Exudyn 5e-4 measured.
    residual = np.abs(simulated.columns["energy_residual"]).max()
    assert residual <= (1e-7 if simulated.reference else 1e-3) * stored
