"""Reactions of the joints, torque of the motor: every body's balance, with the test's own accelerations."""

import math

import numpy as np
import pytest
from closed_linkage import crank_angle, joints

pytestmark = pytest.mark.parametrize(
    "variant", ["reference-minimal", "reference-multiplier", "exudyn-index2"]
)
GROUPS = {"output.groups": ["accelerations", "joints"]}
NAMES = [f"reaction_{joint}_{axis}" for joint in "OABHCF" for axis in "xy"]


def derivatives(scene, time):
    """Each joint's position, velocity, acceleration: central differences of eighth order, dt = 1 ms.

    Round-off 1e-16 / dt^2 = 1e-10 m/s^2; dt^8 / 3150 times tenth derivatives near 1e14 is less.
    """
    dt = 1e-3

    def points(at):
        *moving, h = joints(scene, crank_angle(scene, at))
        return np.array([*moving, h + 0.0 * at])

    here, sides = points(time), [(points(time + k * dt), points(time - k * dt)) for k in (1, 2, 3, 4)]
    first, second = (4 / 5, -1 / 5, 4 / 105, -1 / 280), (8 / 5, -1 / 5, 8 / 315, -1 / 560)
    velocity = sum(c * (after - before) for c, (after, before) in zip(first, sides, strict=True)) / dt
    curvature = sum(c * (after + before) for c, (after, before) in zip(second, sides, strict=True))
    return here, velocity, (curvature - 205 / 72 * here) / dt**2


def cross(arm, force):
    return (arm.conjugate() * force).imag


def unbalanced(simulated):
    """What all balances leave, of the largest reaction; last that of power, of the torque's range."""
    scene, columns = simulated.scene, simulated.columns
    (a, b, c, h), (va, vb, vc, _), (aa, ab, ac, _) = derivatives(scene, columns["time"])
    f, vf, af = (columns[f"slider_{p}x"] + 1j * columns[f"slider_{p}y"] for p in ("", "v", "a"))
    # On the higher-numbered body; the other one bears the opposite
    force = {k: columns[f"reaction_{k}_x"] + 1j * columns[f"reaction_{k}_y"] for k in "OABHCF"}
    torque, o, weight = columns["crank_torque"], np.zeros_like(a), 1j * scene["environment"]["gravity"]
    bodies = {
        "crank": (o, a, o, va, o, aa, force["O"], -force["A"]),
        "rod2": (a, b, va, vb, aa, ab, force["A"], -force["B"]),
        "rocker": (h, c, o, vc, o, ac, force["H"], -force["C"]),
        "rod4": (c, f, vc, vf, ac, af, force["C"], -force["F"]),
    }
    left, power = {}, o.real
    for name, (start, end, v_start, v_end, a_start, a_end, at_start, at_end) in bodies.items():
        rod = scene["mechanism"][name]
        fraction, length2 = rod["centroid"] / rod["length"], rod["length"] ** 2
        # Points of a rigid rod: positions, velocities and accelerations are linear along it
        centre, acceleration = start + fraction * (end - start), a_start + fraction * (a_end - a_start)
        velocity = v_start + fraction * (v_end - v_start)
        alpha, omega = (cross(end - start, rate) / length2 for rate in (a_end - a_start, v_end - v_start))
        inertia = rod["mass"] * (acceleration + weight)
        left[name] = at_start + at_end - inertia
        moment = cross(start - centre, at_start) + cross(end - centre, at_end) - rod["inertia"] * alpha
        left[f"{name} moment"] = moment + (torque if name == "crank" else 0.0)
        if name == "rocker":
            left[name] = left[name] + force["B"]  # in its centroid: no moment
        power = power + (inertia.conjugate() * velocity).real + rod["inertia"] * alpha * omega
    inertia = scene["mechanism"]["slider"]["mass"] * (af + weight)
    if "guide_force" in columns:
        contact, left["slider moment"] = columns["guide_force"] + 0j, columns["guide_moment"]
    else:
        contact = sum(
            sign * columns[f"corner_{end}{side}_normal"] + 1j * columns[f"corner_{end}{side}_friction"]
            for end in "lu"
            for side, sign in (("l", 1), ("r", -1))
        )
    load, height = scene["load"], columns["slider_y"]
    if load["table"]:
        contact = contact + 1j * np.interp(load["surface"] - height, *np.transpose(load["table"]))
    contact = (
        contact
        + 1j * load["force"] * (np.maximum(load["surface"] - height, 0.0) / load["depth"]) ** load["exponent"]
    )
    left["slider"] = force["F"] + contact - inertia
    power = power + ((inertia - contact).conjugate() * vf).real
    left["power"] = power / (scene["drive"]["speed_rpm"] * math.pi / 30) - torque
    largest, span = max(np.abs(values).max() for values in force.values()), np.ptp(torque)
    return np.abs([*left.values()]) / np.array([[span if name == "power" else largest] for name in left])


@pytest.mark.parametrize(
    ("speed_rpm", "step", "load"), [(150.0, 1e-5, 0.0), (-90.0, 2e-5, 0.0), (150.0, 1e-5, 500.0)]
)
def test_an_ideal_slider_balances(run, variant, speed_rpm, step, load):
    cycle = {"drive.cycles": 1.0, "drive.speed_rpm": speed_rpm, "solver.exudyn.step": step}
    simulated = run(variant, "ideal", GROUPS | cycle | {"load.force": load})
    # 1.5e-8 measured of Exudyn: the differences above, and what the Newton iteration leaves
    left = unbalanced(simulated)
    assert left.max() < (1e-9 if simulated.reference else 1e-7)
    # At the start, of exact accelerations: see ``balance.correct_start`` of the Exudyn model. 7e-12 measured
    assert left[:-1, 0].max() < 1e-10
    assert np.ptp(simulated.columns["crank_torque"]) > 0.5
    assert max(simulated.columns[name].max() for name in NAMES) > 10


@pytest.mark.parametrize("name", ["rattle", "wedge", "punch"])
def test_a_slider_with_clearance_balances(run, variant, name):
    """Through hits: reactions follow the walls' force at each state."""
    simulated = run(variant, name)
    # 7e-8 measured of Exudyn, of the torque: its power is that of the second-order motion; others 1e-8
    assert unbalanced(simulated).max() < (1e-9 if simulated.reference else 5e-7)
    assert max(simulated.columns[f"corner_{k}_normal"].max() for k in ("ll", "lr", "ul", "ur")) > 5


def test_reactions_grow_with_the_square_of_the_speed(run, variant):
    """Without gravity equal steps per cycle give similar motions; their round-off grows with the forces."""

    def reactions(rpm):
        still = {"environment.gravity": 0.0, "drive.cycles": 0.2, "drive.speed_rpm": rpm}
        steps = {"solver.exudyn.step": 8e-6 * 150.0 / rpm, "solver.exudyn.tolerance": 1e-9}
        columns = run(variant, "ideal", GROUPS | still | steps).columns
        return np.array([columns[name] for name in NAMES]) / rpm**2

    slow = reactions(150.0)
    for rpm in (1500.0, 6000.0):
        # Newton's 8e-14 m/s in a step of 8e-6 s are 1e-9 of the accelerations
        assert np.abs(reactions(rpm) - slow).max() < 3e-9 * np.abs(slow).max()
