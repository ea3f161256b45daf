"""The press's motion: exact facts, balances and symmetries."""

import math

import numpy as np
import pytest

from exudyn_model import simulate
from exudyn_model.parameters import read_scene


@pytest.mark.parametrize("speed_rpm", [150.0, -90.0])
def test_ideal_slider_follows_the_closed_form(make_scene, ideal_y, speed_rpm):
    scene = make_scene(
        {
            "joints.slider": "ideal",
            "drive.speed_rpm": speed_rpm,
            "drive.cycles": 1.0,
            "solver.exudyn.step": 2e-5,
        }
    )
    result = simulate(scene)
    time, y = result.columns["time"], result.columns["slider_y"]

    def closed_form(at):
        return ideal_y(scene, math.radians(111.36) + speed_rpm * math.pi / 30 * at)

    # Joints hold to the Newton tolerance of 1e-7, which its last iteration undercuts by orders
    np.testing.assert_allclose(y, closed_form(time), atol=1e-10)
    assert np.ptp(y) == pytest.approx(0.2239, abs=5e-5)
    np.testing.assert_allclose(result.columns["slider_x"], -0.54995, atol=1e-12)
    np.testing.assert_allclose(result.columns["slider_angle"], 0.0, atol=1e-12)
    dt = 1e-4
    before, after = closed_form(time - dt), closed_form(time + dt)
    # Index 3 enforces positions; speeds follow to second order: (omega h)^2 of 2 m/s with factors near 1
    np.testing.assert_allclose(result.columns["slider_vy"], (after - before) / (2 * dt), atol=2e-6)
    # Central difference: dt^2 / 12 times fourth derivatives near 1e5 m/s^4, round-off 1e-16 / dt^2
    curvature = (after - 2 * closed_form(time) + before) / dt**2
    np.testing.assert_allclose(result.columns["slider_ay"], curvature, atol=3e-4)
    assert not result.events["start"].size
    assert not [name for name in result.columns if name.startswith("corner")]


def test_speeds_of_the_ideal_slider_at_150_rpm(make_scene):
    columns = simulate(
        make_scene({"joints.slider": "ideal", "drive.cycles": 1.0, "solver.exudyn.step": 2e-5})
    ).columns
    # Closed form of the identified geometry, printed to the millimetre a second
    assert columns["slider_vy"].min() == pytest.approx(-1.598, abs=5e-4)
    assert columns["slider_vy"].max() == pytest.approx(2.002, abs=5e-4)


def every_step(make_scene, step, changes):
    """Run the first 0.05 s, in which several impacts fall, with a sample at every step."""
    return make_scene(
        {
            "drive.cycles": 0.125,
            "solver.exudyn.step": step,
            "output.samples_per_cycle": round(0.4 / step),
        }
        | changes
    )


def energy_drift(scene, linkage_points):
    """Energy of rod 4 and slider, less the work that joint C does on them, all from the recorded slider."""
    columns = simulate(scene).columns
    time, mechanism = columns["time"], read_scene(scene).mechanism
    m4, j4, l4, s4 = (scene["mechanism"]["rod4"][k] for k in ("mass", "inertia", "length", "centroid"))
    m5, j5 = (scene["mechanism"]["slider"][k] for k in ("mass", "inertia"))
    speed = scene["drive"]["speed_rpm"] * math.pi / 30
    x, vx, vy, omega = (columns[f"slider_{k}"] for k in ("x", "vx", "vy", "omega"))

    def tip(t):
        return linkage_points(scene, mechanism.crank_angle + speed * t)[2]

    dt = 1e-5  # differences of a smooth motion: errors of some 1e-9 of the values
    before, c, after = tip(time - dt), tip(time), tip(time + dt)
    vc, ac = (after - before) / (2 * dt), (after - 2 * c + before) / dt**2
    along = (x - c.real) / l4 - 1j * np.sqrt(1 - ((x - c.real) / l4) ** 2)  # unit vector of rod 4, downwards
    across = 1j * along
    spin = (vx - vc.real) / (l4 * across.real)
    alpha = (columns["slider_ax"] - ac.real + l4 * spin**2 * along.real) / (l4 * across.real)
    v4 = vc + s4 * spin * across
    a4 = ac + s4 * (alpha * across - spin**2 * along)
    a5 = columns["slider_ax"] + 1j * columns["slider_ay"]
    contact = sum(sign * columns[f"corner_{e}{s}_normal"] for e in "lu" for s, sign in (("l", 1), ("r", -1)))
    gravity = -9.81j
    pull = m4 * (a4 - gravity) + m5 * (a5 - gravity) - contact
    power = (pull * vc.conjugate()).real
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    kinetic = 0.5 * (m4 * abs(v4) ** 2 + j4 * spin**2 + m5 * (vx**2 + vy**2) + j5 * omega**2)
    height = 9.81 * (m4 * (c + s4 * along).imag + m5 * columns["slider_y"])
    stiffness = read_scene(scene).guide.stiffness
    depths = [np.maximum(-columns[f"corner_{k}_gap"], 0) for k in ("ll", "lr", "ul", "ur")]
    stored = sum(stiffness * depth**2.5 / 2.5 for depth in depths)
    total = kinetic + height + stored - work
    assert max(stored) > 1e-5  # impacts did happen
    return np.max(np.abs(total - total[0]))


def test_energy_balances_to_the_order_of_the_method(make_scene, linkage_points):
    """Restitution 1, no friction: nothing is lost in impacts of some 1e-4 J."""
    elastic = {"contact.restitution": 1.0, "friction.coefficient": 0.0}
    coarse, fine = (
        energy_drift(every_step(make_scene, step, elastic), linkage_points) for step in (8e-6, 4e-6)
    )
    # Half the step, a quarter of the error (3.9 measured); where touches fall in their steps scatters it
    assert 3.0 < coarse / fine < 5.0, (coarse, fine)
    assert fine < 2e-7  # 7e-8 J measured


def test_energy_of_rod_4_and_slider_alone_balances(make_scene, linkage_points):
    """As above; what is left is the test's own trapezoidal rule for the work of joint C."""
    elastic = {
        "contact.restitution": 1.0,
        "friction.coefficient": 0.0,
        "solver.exudyn.formulation": "tree",
        "solver.exudyn.method": "dopri5",
        "solver.exudyn.tolerance": 1e-10,
    }
    coarse, fine = (
        energy_drift(every_step(make_scene, sample, elastic | {"solver.exudyn.step": 1e-4}), linkage_points)
        for sample in (8e-6, 4e-6)
    )
    # Second order in the distance of samples, at a tolerance that stays: none of it is the model's
    assert coarse / fine == pytest.approx(4.0, abs=0.4), (coarse, fine)
    assert fine < 2e-7


def test_slider_rotates_uniformly_between_contacts(make_scene):
    result = simulate(every_step(make_scene, 4e-6, {}))
    ends = np.sort(result.events["end"])
    flights = [
        (end + 4e-4, start)
        for end in ends
        for start in [min([s for s in result.events["start"] if s > end], default=0.05)]
        if start - end > 2e-3 and not np.any((result.events["start"] < end) & (result.events["end"] > end))
    ]
    assert len(flights) >= 2
    time, omega = result.columns["time"], result.columns["slider_omega"]
    for begin, end in flights:
        flight = omega[(time > begin) & (time < end)]
        # The first 100 steps are left out: the method's accelerations carry the impact on by 0.9^k. Then
        # the remaining moment is the Newton iteration's residual, far below 1e-7 N m; over 0.02 s with
        # 2.6e-5 kg m^2 that would be 1e-4 rad/s
        assert np.ptp(flight) < 1e-5
    # while impacts change it by
    assert np.ptp(omega) > 0.1


def test_mirrored_scene_gives_mirrored_motion(make_scene, mirrored):
    common = {
        "drive.cycles": 0.1,
        "initial.slider_omega": 0.2,
        "initial.slider_angle": 1e-4,
        "solver.exudyn.step": 4e-6,
        "solver.exudyn.tolerance": 1e-8,
    }
    there = simulate(make_scene(common))
    rotated = {"initial.slider_omega": -0.2, "initial.slider_angle": -1e-4}
    back = simulate(make_scene(common | mirrored | rotated))
    swap = {"ll": "lr", "lr": "ll", "ul": "ur", "ur": "ul"}
    assert len(there.events["start"]) > 5
    assert sorted(swap[k] for k in there.events["corner"]) == sorted(back.events["corner"])
    for name, values in there.columns.items():
        if name.startswith("corner"):
            _, corner, part = name.split("_")
            name = f"corner_{swap[corner]}_{part}"
        sign = -1 if name in MIRRORED else 1
        # Angles are rounded differently, the Newton iteration stops at other residuals; impacts magnify that
        scale = np.max(np.abs(values))
        np.testing.assert_allclose(back.columns[name], sign * values, rtol=0, atol=1e-6 * scale, err_msg=name)


MIRRORED = {"slider_x", "slider_vx", "slider_ax", "slider_angle", "slider_omega", "slider_alpha"}


def first_cycle_errors(make_scene, steps, finest, cycles):
    def x(step):
        return simulate(make_scene({"drive.cycles": cycles, "solver.exudyn.step": step})).columns["slider_x"]

    exact = x(finest)
    return [np.max(np.abs(x(step) - exact)) for step in steps]


def test_second_order_through_the_first_impacts(make_scene):
    """The first 0.04 s: seven contacts."""
    steps = [8e-6, 4e-6, 2e-6, 1e-6]
    errors = first_cycle_errors(make_scene, steps, 2.5e-7, 0.1)
    # 2 +- 0.2, and the reference's own error: a sixteenth of the last one
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.25), errors


@pytest.mark.slow
def test_second_order_over_the_first_cycle(make_scene):
    steps = [4e-6, 2e-6, 1e-6, 5e-7]
    errors = first_cycle_errors(make_scene, steps, 1.25e-7, 1.0)
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2), errors
    # Measured 1.1e-6 .. 1.5e-8 m; twice that
    assert errors[0] < 2.2e-6
    assert errors[-1] < 3e-8
