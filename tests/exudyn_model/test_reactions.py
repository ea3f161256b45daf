"""Reactions of the joints, torque of the motor: every body's balance, with the test's own accelerations."""

import math

import numpy as np
import pytest

JOINTS = {
    "output.groups": ["accelerations", "corners", "joints"],
    "solver.exudyn.method": "trapezoidal-index2",
}
IDEAL = {"joints.slider": "ideal"}
GRAVITY = -9.81j


def derivatives(linkage_points, scene, times):
    """Each joint's position, velocity, acceleration: central differences of eighth order, dt = 1 ms.

    Round-off 1e-16 / dt^2 = 1e-10 m/s^2; dt^8 / 3150 times tenth derivatives near 1e14 is less.
    """
    dt = 1e-3
    drive = scene["mechanism"]["crank_angle_deg"], scene["drive"]["speed_rpm"] * 6

    def points_at(at):
        a, b, c, h = linkage_points(scene, np.radians(drive[0] + drive[1] * at))
        return np.array([a, b, c, h + 0 * a])

    here = points_at(times)
    sides = [(points_at(times + k * dt), points_at(times - k * dt)) for k in (1, 2, 3, 4)]
    first, second = (4 / 5, -1 / 5, 4 / 105, -1 / 280), (8 / 5, -1 / 5, 8 / 315, -1 / 560)
    velocity = sum(c * (after - before) for c, (after, before) in zip(first, sides, strict=True)) / dt
    curvature = sum(c * (after + before) for c, (after, before) in zip(second, sides, strict=True))
    return here, velocity, (curvature - 205 / 72 * here) / dt**2


def cross(arm, force):
    return (arm.conjugate() * force).imag


def unbalanced(linkage_points, scene, columns):
    """What is left of force and moment balances of all five bodies, and of the motor's power."""
    (a, b, c, h), (va, vb, vc, _), (aa, ab, ac, _) = derivatives(linkage_points, scene, columns["time"])
    f, vf, af = (columns[f"slider_{p}x"] + 1j * columns[f"slider_{p}y"] for p in ("", "v", "a"))
    # On the higher-numbered body; the other one bears the opposite
    force = {k: columns[f"reaction_{k}_x"] + 1j * columns[f"reaction_{k}_y"] for k in "OABHCF"}
    torque, o = columns["crank_torque"], np.zeros_like(a)
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
        alpha = cross(end - start, a_end - a_start) / length2
        velocity = v_start + fraction * (v_end - v_start)
        omega = cross(end - start, v_end - v_start) / length2
        inertia = rod["mass"] * (acceleration - GRAVITY)
        left[name] = at_start + at_end - inertia
        moment = cross(start - centre, at_start) + cross(end - centre, at_end) - rod["inertia"] * alpha
        if name == "crank":
            moment = moment + torque
        if name == "rocker":
            left[name] = left[name] + force["B"]  # in its centroid: no moment
        left[name + " moment"] = moment
        power = power + (inertia.conjugate() * velocity).real + rod["inertia"] * alpha * omega
    slider = scene["mechanism"]["slider"]
    inertia = slider["mass"] * (af - GRAVITY)
    if "guide_force" in columns:
        contact = columns["guide_force"] + 0j
        left["slider moment"] = columns["guide_moment"]
    else:
        contact = sum(
            sign * columns[f"corner_{end}{side}_normal"] + 1j * columns[f"corner_{end}{side}_friction"]
            for end in "lu"
            for side, sign in (("l", 1), ("r", -1))
        )
    left["slider"] = force["F"] + contact - inertia
    power = power + ((inertia - contact).conjugate() * vf).real
    left["power / omega"] = power / (scene["drive"]["speed_rpm"] * math.pi / 30) - torque
    return left, max(np.max(np.abs(values)) for values in force.values()), np.ptp(torque)


@pytest.mark.parametrize("speed_rpm", [150.0, -90.0])
@pytest.mark.parametrize("step", [2e-5, 1e-5])
def test_ideal_slider_balances(run, make_scene, linkage_points, speed_rpm, step):
    changes = JOINTS | IDEAL | {"drive.cycles": 1.0, "drive.speed_rpm": speed_rpm, "solver.exudyn.step": step}
    left, largest, torque = unbalanced(linkage_points, make_scene(changes), run(changes).columns)
    for name, values in left.items():
        scale = torque if name == "power / omega" else largest
        # 1.5e-8 measured: the differences above, and what the Newton iteration leaves
        assert np.max(np.abs(values)) < 1e-7 * scale, name
    assert torque > 0.5
    assert largest > 10


def test_reactions_at_the_start_are_those_of_exact_accelerations(run, make_scene, linkage_points):
    """Exudyn's own initial accelerations leave 1.5e-9, which lasts: see ``balance.correct_start``."""
    changes = JOINTS | IDEAL | {"drive.cycles": 0.01}
    columns = {name: values[:1] for name, values in run(changes).columns.items()}
    left, largest, _ = unbalanced(linkage_points, make_scene(changes), columns)
    for name, values in left.items():
        # 7e-12 measured: round-off of the differences above
        assert abs(values[0]) < 1e-10 * largest, name


def test_slider_with_clearance_balances(run, make_scene, linkage_points):
    """The first 0.04 s with seven contacts: reactions follow the contact's force at each state."""
    changes = JOINTS | {"drive.cycles": 0.1, "output.samples_per_cycle": 20_000}
    columns = run(changes).columns
    left, largest, torque = unbalanced(linkage_points, make_scene(changes), columns)
    for name, values in left.items():
        scale = torque if name == "power / omega" else largest
        # 7e-8 measured, of the torque: its power is that of the second-order motion; others 1e-8
        assert np.max(np.abs(values)) < 5e-7 * scale, name
    # Contacts did act on the joints
    assert max(np.max(columns[f"corner_{k}_normal"]) for k in ("ll", "lr", "ul", "ur")) > 10
    assert not [name for name in columns if name.startswith("guide")]


@pytest.mark.parametrize("speed_rpm", [1500.0, 6000.0])
def test_reactions_grow_with_the_square_of_the_speed(run, speed_rpm):
    """Without gravity equal steps per cycle give similar motions; their round-off grows with the forces."""

    def reactions(rpm):
        changes = {
            "environment.gravity": 0.0, "drive.cycles": 0.2, "drive.speed_rpm": rpm,
            "solver.exudyn.step": 8e-6 * 150.0 / rpm, "solver.exudyn.tolerance": 1e-9,
        }  # fmt: skip
        result = run(JOINTS, IDEAL, changes)
        assert result.status == "success"
        return np.array([result.columns[f"reaction_{k}_{axis}"] for k in "OABHCF" for axis in "xy"]) / rpm**2

    slow, fast = reactions(150.0), reactions(speed_rpm)
    # Newton's 8e-14 m/s in a step of 8e-6 s are 1e-9 of the accelerations
    assert np.max(np.abs(fast - slow)) < 3e-9 * np.max(np.abs(slow))


def test_weights_are_borne_at_creep_speed(run, make_scene):
    """Signs by statics: at 1 rpm nothing is accelerated, frame and guide bear the weight."""
    changes = {"drive.speed_rpm": 1.0, "drive.cycles": 0.002, "solver.exudyn.step": 4e-4}
    columns = {name: values[-1] for name, values in run(JOINTS, IDEAL, changes).columns.items()}
    crank, rod2, rocker, rod4, slider = (
        9.81 * make_scene()["mechanism"][k]["mass"] for k in ("crank", "rod2", "rocker", "rod4", "slider")
    )
    # Accelerations are (150)^2 times smaller than some 50 m/s^2: 2e-3 of 9.81
    frame = columns["reaction_O_y"] + columns["reaction_H_y"]
    assert frame == pytest.approx(crank + rod2 + rocker + rod4 + slider, rel=1e-3)
    # The slider hangs from rod 4
    assert columns["reaction_F_y"] == pytest.approx(slider, rel=1e-3)
    assert columns["reaction_C_y"] == pytest.approx(rod4 + slider, rel=1e-3)
    # Rod 4 is inclined to the left at its lower end and pushes the slider to the left: the guide pushes back
    assert columns["guide_force"] == pytest.approx(-columns["reaction_F_x"], rel=1e-9)
