"""What holds exactly along every motion: lengths of rods, the energy's balance."""

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

RATES = {"x": ("vx", "ax"), "y": ("vy", "ay"), "angle": ("omega", "alpha")}
AUDITED = pytest.mark.parametrize("variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"])
LOSSLESS = {"contact.restitution": 1.0, "friction.coefficient": 0.0}


def rocker_tip(scene, time):
    """Joint C as a complex number: two circles meet in B, the rocker turns H B by its length."""
    m = scene["mechanism"]
    angle = math.radians(m["crank_angle_deg"]) + scene["drive"]["speed_rpm"] * math.pi / 30.0 * time
    a, h = m["crank"]["length"] * np.exp(1j * angle), complex(*m["rocker_pivot"])
    # B from H: turned from the direction towards A by the triangle's angle at H.
    distance, arm = np.abs(a - h), m["rocker"]["centroid"]
    at_h = np.arccos((distance**2 + arm**2 - m["rod2"]["length"] ** 2) / (2.0 * distance * arm))
    return h + m["rocker"]["length"] * (a - h) / distance * np.exp(-1j * m["rocker_branch"] * at_h)


def test_rod_4_keeps_its_length(short, request) -> None:
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


def test_rates_are_the_derivatives(short) -> None:
    """Velocities sum up to positions, accelerations to velocities: radians, not degrees, and right limits."""
    for position, (rate, second) in RATES.items():
        for name, of in ((position, rate), (rate, second)):
            values, slopes = short.columns[f"slider_{name}"], short.columns[f"slider_{of}"]
            summed = cumulative_trapezoid(slopes, short.columns["time"], initial=0.0)
            # Fifty samples a hit: each is summed to some 1e-3 of itself. Angular velocities change by 2 rad/s
            # in it, of a range of that size; a motion knows nothing of hits but kinks in its rate.
            assert np.abs(values - values[0] - summed).max() <= 1e-3 * np.ptp(values), name


@AUDITED
@pytest.mark.parametrize("name", ["rattle", "wedge"])
def test_the_balance_of_energy_closes(run, variant, name) -> None:
    found = run(variant, name)
    parts = {key: found.columns[f"energy_{key}"] for key in ("drive", "gravity", "damping", "friction")}
    lost = parts["damping"] + parts["friction"]
    # Integrated with the motion at 1e-12; by the trapezoidal rule over steps of 2e-6 s through hits of
    # 1.5e-4 s, (1/75)^2 of what they take.
    assert lost[-1] > 1e-5
    residual = np.abs(found.columns["energy_residual"]).max()
    assert residual <= (1e-8 if found.reference else 1e-3) * lost[-1]
    assert np.all(np.diff(parts["friction"]) >= 0.0)
    assert all(values[0] == 0.0 for values in parts.values())  # counted from t = 0
    for part in ("kinetic", "contact"):
        assert found.result.extrema[f"energy_{part}"]["min"] >= 0.0
        assert np.all(found.columns[f"energy_{part}"] >= 0.0)


@AUDITED
def test_nothing_is_lost_without_damping_and_friction(run, variant) -> None:
    found = run(variant, "rattle", LOSSLESS)
    assert found.result.events["start"].size >= 10
    assert not found.columns["energy_damping"].any()
    assert not found.columns["energy_friction"].any()
    stored = found.columns["energy_contact"].max()
    assert stored > 1e-5
    # Of what the walls store at most: the solver's own error, by second order in the step for Exudyn.
    assert np.abs(found.columns["energy_residual"]).max() <= (1e-7 if found.reference else 1e-2) * stored


def test_an_elastic_frictionless_hit_of_one_corner_returns_the_approach_speed(run, variant) -> None:
    """Restitution 1: a hit of one corner reverses its normal velocity, but for what the drive does."""
    found = run(variant, "rattle", LOSSLESS)
    time, events, checked = found.columns["time"], found.result.events, 0
    for corner in ("ll", "lr", "ul", "ur"):
        leaving = -found.corner(corner)[5]
        for contact in found.contacts(corner):
            start, end = contact["start"], contact["end"]
            alone = ((events["start"] < end) & (events["end"] > start)).sum() == 1
            if alone and start > 0.0 and end < time[-1]:
                # The drive accelerates the corner by less than 50 m/s^2 all the while.
                speed = np.interp(end, time, leaving)
                allowed = 50.0 * (end - start) + 6e-3 * speed
                assert speed == pytest.approx(contact["normal_speed"], abs=allowed)
                checked += 1
    assert checked >= 5
