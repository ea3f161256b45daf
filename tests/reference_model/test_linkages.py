"""Linkages of bodies, pins, guides and springs against the test set's squeezer and against closed forms."""

import math

import numpy as np
import pytest
from linkage_scenes import DOUBLE_FOUR_BAR, G, linkage, pins, rod
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from comparison.scene import load_scene
from reference_model import simulate


def success(scene):
    result = simulate(scene)
    assert (result.status, result.remedy) == ("success", "")
    return result.columns


# Andrews' squeezer: the numbers of the Test Set for IVP Solvers, Bari.

START = (
    -0.0617138900142764496358948458001,
    0.0,
    0.455279819163070380255912382449,
    0.222668390165885884674473185609,
    0.487364979543842550225598953530,
    -0.222668390165885884674473185609,
    1.23054744454982119249735015568,
)
END = (
    15.81077119629904,
    -15.75637105984298,
    0.04082224013073101,
    -0.5347301163226948,
    0.5244099658805304,
    0.5347301163226948,
    1.048080741042263,
)
RATES = (
    1139.920302151208,
    -1424.379294994111,
    11.03291221937134,
    19.29337464421385,
    0.5735699284790808,
    -19.29337464421385,
    0.3231791658026955,
)


def of_the_test_set(columns, what):
    """Return the seven coordinates, most of which are relative angles, or their derivatives at all times."""
    k1, k2, k3, k4, k5, k6, k7 = (columns[f"K{i}.{what}"] for i in range(1, 8))
    return np.array([k1, k2 - k1, k3, k4 - k5, k5, k6 - k7, k7])


@pytest.mark.parametrize(("tolerance", "bound"), [(1e-12, 1e-8), (1e-10, 1e-7), (1e-7, 1e-4)])
def test_squeezer_ends_as_published(tolerance, bound):
    changes = {"solver.reference.tolerance": tolerance, "environment.gravity": 0.0}
    columns = success(load_scene("squeezer", changes).data)
    np.testing.assert_allclose(of_the_test_set(columns, "angle")[:, 0], START, atol=1e-13, rtol=0)
    alpha = of_the_test_set(columns, "alpha")[:, 0]
    np.testing.assert_allclose(
        alpha, [14222.4439199541, -10666.83293996558, 0, 0, 0, 0, 0], atol=1e-8, rtol=0
    )
    np.testing.assert_allclose(of_the_test_set(columns, "angle")[:, -1], END, atol=bound, rtol=0)
    np.testing.assert_allclose(of_the_test_set(columns, "omega")[:, -1], RATES, atol=1e3 * bound, rtol=0)


def double_four_bar(tolerance, duration=10.0):
    """IFToMM's A02: five rods of 1 m, the tip of the first starts at 1 m/s."""
    names = ("left", "top1", "middle", "top2", "right")
    joined = pins(*DOUBLE_FOUR_BAR)
    upright = {"angle_deg": 90.0}
    return linkage(
        {name: rod() for name in names},
        pin=joined,
        initial={"left": {"angle_deg": 90.0, "omega": -1.0}},
        guess={"middle": upright, "right": upright},
        duration=duration,
        tolerance=tolerance,
        groups=["energy"],
    )


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12])
def test_double_four_bar_ends_at_its_singular_position(tolerance):
    result = simulate(double_four_bar(tolerance))
    assert result.status == "singular"
    assert result.remedy.startswith("singular position at t = 0.714")
    assert 0.69 < result.columns["time"][-1] < 0.714
    assert result.extrema["left.angle"]["time_of_min"] <= 0.7144
    assert np.abs(result.columns["energy_residual"]).max() < 10.0 * tolerance * 98.1


def test_double_four_bar_before_its_singular_position_is_one_rod():
    """Parallel rods of 1 m move as a pendulum upside down: its angle by a program of one coordinate."""
    columns = success(double_four_bar(1e-12, 0.7))
    # Three rods turn about their pivots, two move along with their ends
    inertia, moment = 3.0 / 3.0 + 2.0, (3.0 * 0.5 + 2.0) * G
    exact = solve_ivp(
        lambda _, y: [y[1], -moment * math.cos(y[0]) / inertia],
        (0.0, 0.7),
        [math.pi / 2, -1.0],
        "DOP853",
        t_eval=columns["time"],
        rtol=1e-13,
        atol=1e-13,
    )
    np.testing.assert_allclose(columns["right.angle"], exact.y[0], atol=1e-10, rtol=0)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
@pytest.mark.parametrize("turned", [0.0, 130.0])
def test_pendulum_swings_as_the_elliptic_functions(tolerance, turned):
    """Its own frame is turned against the line from pin to centroid."""
    c, s = 0.4 * math.cos(math.radians(turned)), 0.4 * math.sin(math.radians(turned))
    body = {"arm": rod(mass=2.0, inertia=0.1, centroid=[c, s])}
    amplitude, inertia = 2.0, 0.1 + 2.0 * 0.4**2
    scene = linkage(
        body,
        pin={"O": {"joins": ["frame", "arm.start"], "point": [0.3, -0.2]}},
        tolerance=tolerance,
        samples=40,
        initial={"arm": {"angle_deg": math.degrees(amplitude) - 90.0 - turned}},
        duration=5.0,
    )
    result = simulate(scene)
    columns, k, w = result.columns, math.sin(amplitude / 2.0), math.sqrt(2.0 * G * 0.4 / inertia)
    sn, cn, *_ = ellipj(w * columns["time"] + ellipk(k * k), k * k)
    angle, rate = 2.0 * np.arcsin(k * sn), 2.0 * k * w * cn
    bound = 2e3 * tolerance
    at = angle - math.pi / 2.0 - math.radians(turned)
    np.testing.assert_allclose(columns["arm.angle"], at, atol=bound, rtol=0)
    np.testing.assert_allclose(columns["arm.omega"], rate, atol=10.0 * bound, rtol=0)
    np.testing.assert_allclose(columns["arm.alpha"], -w * w * np.sin(angle), atol=20.0 * bound, rtol=0)
    np.testing.assert_allclose(columns["arm.x"], 0.3 + 0.4 * np.sin(angle), atol=bound, rtol=0)
    pull = 2.0 * (0.4 * rate**2 + G * np.cos(angle))
    across = 2.0 * (-w * w * 0.4 + G) * np.sin(angle)
    force = np.array(
        [-pull * np.sin(angle) + across * np.cos(angle), pull * np.cos(angle) + across * np.sin(angle)]
    )
    np.testing.assert_allclose(
        [columns["O.reaction_x"], columns["O.reaction_y"]], force, atol=400 * bound, rtol=0
    )
    # The largest rate and force lie between the samples
    assert abs(result.extrema["arm.omega"]["max"] - 2.0 * k * w) < 2e-6 + 10.0 * bound
    lowest = -amplitude - math.pi / 2.0 - math.radians(turned)
    assert abs(result.extrema["arm.angle"]["min"] - lowest) < 1e-6 + bound


@pytest.mark.parametrize(("damping", "direction"), [(0.0, 0.0), (3.0, 30.0), (3.0, -90.0)])
def test_mass_on_a_spring_in_its_guide(damping, direction):
    """x = decaying cosine about where spring and weight balance, along the guide."""
    mass, stiffness, free, along = 0.5, 200.0, 0.3, math.sin(math.radians(direction))
    u = np.array([math.cos(math.radians(direction)), along])
    scene = linkage(
        {"block": {"mass": mass, "inertia": 1e-4, "points": {"eye": [0.0, 0.0]}, "centroid": [0.0, 0.0]}},
        guide={
            "G": {
                "body": "block",
                "on": "frame",
                "point": [0.1, 0.2],
                "direction_deg": direction,
                "angle_deg": 20.0,
            }
        },
        spring={
            "S": {
                "joins": ["frame", "block.eye"],
                "point": [0.1, 0.2],
                "stiffness": stiffness,
                "length": free,
                "damping": damping,
            }
        },
        initial={"block": {"x": 0.1 + 0.36 * u[0]} if direction > -45 else {"y": 0.2 + 0.36 * u[1]}},
        tolerance=1e-11,
    )
    columns = success(scene)
    sag, decay = -mass * G * along / stiffness, damping / (2.0 * mass)
    w, t = math.sqrt(stiffness / mass - decay**2), columns["time"]
    swing = (0.36 - free - sag) * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    rate = -(0.36 - free - sag) * np.exp(-decay * t) * (w + decay**2 / w) * np.sin(w * t)
    stretch = sag + swing
    np.testing.assert_allclose(columns["block.x"], 0.1 + (free + stretch) * u[0], atol=1e-9, rtol=0)
    np.testing.assert_allclose(columns["block.y"], 0.2 + (free + stretch) * u[1], atol=1e-9, rtol=0)
    np.testing.assert_allclose(columns["block.angle"], math.radians(20.0), atol=1e-12, rtol=0)
    np.testing.assert_allclose(columns["S.force"], stiffness * stretch + damping * rate, atol=1e-6, rtol=0)
    np.testing.assert_allclose(columns["G.force"], mass * G * u[0], atol=1e-6, rtol=0)
    np.testing.assert_allclose(columns["energy_spring"], 0.5 * stiffness * stretch**2, atol=1e-7, rtol=0)
    lost = np.cumsum(np.append(0.0, damping * 0.5 * (rate[1:] ** 2 + rate[:-1] ** 2) * np.diff(t)))
    np.testing.assert_allclose(columns["energy_damping"], lost, atol=1e-2 * lost[-1] + 1e-15, rtol=0)


@pytest.mark.parametrize("gravity", [0.0, G])
def test_a_constant_torque_turns_a_rotor(gravity):
    scene = linkage(
        {"rotor": rod(centroid=[0.0, 0.0], inertia=0.2)},
        pin=pins(((0.1, 0.0), "rotor.start")),
        gravity=gravity,
        drive={"body": "rotor", "torque": -1.5},
        initial={"rotor": {"angle_deg": 10.0, "omega": 2.0}},
        duration=3.0,
    )
    columns, alpha = success(scene), -1.5 / 0.2
    t = columns["time"]
    np.testing.assert_allclose(
        columns["rotor.angle"], math.radians(10.0) + 2.0 * t + 0.5 * alpha * t**2, atol=1e-9
    )
    np.testing.assert_allclose(columns["rotor.alpha"], alpha, rtol=1e-9)
    np.testing.assert_allclose(columns["energy_drive"], -1.5 * (2.0 * t + 0.5 * alpha * t**2), atol=1e-8)
    assert "drive.torque" not in columns


@pytest.mark.parametrize("omega", [3.0, -3.0])
def test_a_table_of_torque_does_the_work_under_it(omega):
    """Over several turns, with corners and a jump in the table: kinetic energy is that and the start's."""
    table = [[0.0, 0.2], [90.0, 1.0], [90.001, -0.3], [200.0, -0.3], [360.0, 0.2]]
    scene = linkage(
        {"rotor": rod(centroid=[0.0, 0.0], inertia=0.2)},
        pin=pins(((0.0, 0.0), "rotor.start")),
        tolerance=1e-11,
        drive={"body": "rotor", "torque_table": table},
        initial={"rotor": {"angle_deg": 15.0, "omega": omega}},
        duration=6.0,
    )
    columns, (degrees, torques) = success(scene), np.array(table).T
    grid = np.radians(np.concatenate([degrees + 360.0 * turn for turn in range(-8, 8)]))
    steps = np.diff(grid) * 0.5 * (np.tile(torques, 16)[1:] + np.tile(torques, 16)[:-1])
    area = np.append(0.0, np.cumsum(steps))

    def work(angle):
        left = np.clip(np.searchsorted(grid, angle, "right") - 1, 0, grid.size - 2)
        here = np.interp(np.degrees(angle) % 360.0, degrees, torques)
        return area[left] + 0.5 * (np.tile(torques, 16)[left] + here) * (angle - grid[left])

    angle = columns["rotor.angle"]
    assert abs(angle[-1] - angle[0]) > 4.0 * math.pi
    done = work(angle) - work(angle[:1])
    np.testing.assert_allclose(columns["energy_drive"], done, atol=1e-9, rtol=0)
    np.testing.assert_allclose(0.5 * 0.2 * columns["rotor.omega"] ** 2, 0.9 + done, atol=1e-9, rtol=0)


# Four-bars are held against programs of one coordinate in tests/linkages.

LENGTHS, MASSES, GROUND = (0.1, 0.3, 0.25), (0.5, 1.2, 0.8), 0.28


def four_bar(**tables):
    body = {
        name: rod(a, m) for name, a, m in zip(("crank", "coupler", "rocker"), LENGTHS, MASSES, strict=True)
    }
    joined = pins(
        ((0.0, 0.0), "crank.start"),
        ("crank.end", "coupler.start"),
        ((GROUND, 0.0), "rocker.start"),
        ("coupler.end", "rocker.end"),
    )
    guess = {"coupler": {"angle_deg": 50.0}, "rocker": {"angle_deg": 110.0}}
    return linkage(body, pin=joined, guess=guess, **tables)


def by_fourier(values, omega):
    """Return the derivative by time (1/s) of samples of one cycle, the last of which is the first."""
    n = values.size - 1
    spectrum = np.fft.rfft(values[:-1]) * 1j * np.arange(n // 2 + 1) * abs(omega)
    return np.append(back := np.fft.irfft(spectrum, n), back[0])


def test_quick_return_slides_along_its_rocker():
    """A block on the crank's tip in a guide along the rocker, which turns about a pivot below."""
    low, length, at = 0.2, 0.5, math.radians(20.0)
    body = {
        "crank": rod(0.08, 0.3),
        "rocker": rod(length, 2.0, centroid=[0.3, 0.01]),
        "block": rod(0.02, 0.4, centroid=[0.0, 0.0]),
    }
    columns = success(
        linkage(
            body,
            pin=pins(
                ((0.0, 0.0), "crank.start"), ((0.0, -low), "rocker.start"), ("crank.end", "block.centroid")
            ),
            guide={
                "G": {
                    "body": "block",
                    "on": "rocker",
                    "point": [0.1, 0.0],
                    "direction_deg": 0.0,
                    "angle_deg": 15.0,
                }
            },
            drive={"body": "crank", "speed_rpm": 120.0, "cycles": 1.0},
            samples=512,
            tolerance=1e-12,
            initial={"crank": {"angle_deg": 20.0}},
            guess={"rocker": {"angle_deg": 70.0}},
        )
    )
    omega = 4.0 * math.pi
    theta = at + omega * columns["time"]
    x, y = 0.08 * np.cos(theta), 0.08 * np.sin(theta) + low
    angle, reach = np.arctan2(y, x), np.hypot(x, y)
    spin = omega * 0.08 * (np.cos(theta) * x + np.sin(theta) * y) / reach**2
    alpha = by_fourier(spin, omega)
    np.testing.assert_allclose(columns["rocker.angle"], angle, atol=1e-10, rtol=0)
    np.testing.assert_allclose(columns["block.angle"], angle + math.radians(15.0), atol=1e-10, rtol=0)
    np.testing.assert_allclose(columns["block.omega"], spin, atol=1e-8, rtol=0)
    np.testing.assert_allclose(columns["rocker.alpha"], alpha, atol=1e-6, rtol=0)
    moment = 0.4 * 0.02**2 / 12.0 * alpha
    arm = 0.3 * np.cos(angle) - 0.01 * np.sin(angle)
    inertia = 2.0 * length**2 / 12.0 + 2.0 * (0.3**2 + 0.01**2)
    # Moments on the rocker about its pivot: the block pushes back with the force at its reach
    force = -(inertia * alpha + 2.0 * G * arm + moment) / reach
    np.testing.assert_allclose(columns["G.moment"], moment, atol=1e-8, rtol=0)
    np.testing.assert_allclose(columns["G.force"], force, atol=1e-6, rtol=0)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_mass_falls_onto_its_load_and_comes_back(exponent):
    load = {"body": "mass", "surface": 0.0, "force": 300.0, "depth": 0.01, "exponent": exponent, "table": []}
    scene = linkage(
        {"mass": rod(0.1, 2.0, centroid=[0.0, 0.0])},
        guide={"G": {"body": "mass", "point": [0.0, 0.0], "direction_deg": 90.0}},
        initial={"mass": {"y": 0.05}},
        load=load,
        duration=0.5,
        tolerance=1e-11,
        samples=500,
    )
    columns = success(scene)
    y, stored = columns["mass.y"], columns["energy_load"]
    depth = np.maximum(-y, 0.0)
    np.testing.assert_allclose(
        stored, 300.0 * 0.01 / (exponent + 1) * (depth / 0.01) ** (exponent + 1), atol=1e-9
    )
    np.testing.assert_allclose(columns["energy_kinetic"] + stored, 2.0 * G * (0.05 - y), atol=1e-8, rtol=0)
    np.testing.assert_allclose(
        columns["mass.ay"], 300.0 * (depth / 0.01) ** exponent / 2.0 - G, atol=1e-6, rtol=0
    )
    if exponent == 1.0:
        # Two falls and the longer half of a period about where the weight rests
        w, sag, fall = math.sqrt(300.0 / 0.01 / 2.0), 2.0 * G * 0.01 / 300.0, math.sqrt(0.1 / G)
        inside = 2.0 * (math.pi - math.atan(math.sqrt(0.1 * G) / (sag * w))) / w
        assert abs(columns["time"][y[:200].argmin()] - fall - inside / 2.0) < 1e-3
        np.testing.assert_allclose(np.interp(2 * fall + inside, columns["time"], y), 0.05, atol=1e-5)


@pytest.mark.parametrize("torque", [0.0, 0.5 * G])
def test_what_is_in_balance_stays(torque):
    scene = linkage(
        {"rod": rod()},
        pin=pins(((0.0, 0.0), "rod.start")),
        drive={"body": "rod", "torque": torque},
        gravity=torque * 2.0,
        initial={"rod": {"angle_deg": 0.0}},
    )
    np.testing.assert_allclose(success(scene)["rod.angle"], 0.0, atol=1e-9)


def test_a_body_without_joints_is_thrown():
    start = {"x": 0.0, "y": 1.0, "angle_deg": 0.0, "vx": 2.0, "vy": 3.0, "omega": -5.0}
    columns = success(linkage({"stone": rod(0.1)}, initial={"stone": start}))
    t = columns["time"]
    np.testing.assert_allclose(columns["stone.y"], 1.0 + 3.0 * t - 0.5 * G * t**2, atol=1e-12)
    np.testing.assert_allclose([columns["stone.x"], columns["stone.angle"]], [2.0 * t, -5.0 * t], atol=1e-12)


# Singular positions


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_a_drive_that_cannot_turn_ends_where_coupler_and_rocker_align(tolerance):
    body = {"crank": rod(0.3), "coupler": rod(0.2), "rocker": rod(0.25)}
    joined = pins(
        ((0.0, 0.0), "crank.start"),
        ("crank.end", "coupler.start"),
        ((0.28, 0.0), "rocker.start"),
        ("coupler.end", "rocker.end"),
    )
    scene = linkage(
        body,
        pin=joined,
        drive={"body": "crank", "speed_rpm": 30.0, "cycles": 1.0},
        tolerance=tolerance,
        initial={"crank": {"angle_deg": 40.0}},
        guess={"coupler": {"angle_deg": 60.0}, "rocker": {"angle_deg": 120.0}},
    )
    result = simulate(scene)
    lock = (math.acos((0.3**2 + 0.28**2 - 0.45**2) / (2 * 0.3 * 0.28)) - math.radians(40.0)) / math.pi
    assert result.status == "singular"
    assert abs(float(result.remedy.split(" = ")[1].split(" s:")[0]) - lock) < 1e-3
    assert 0.0 <= lock - result.columns["time"][-1] < 0.021


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_a_parallelogram_ends_where_it_is_flat(tolerance):
    body = {"crank": rod(0.1), "coupler": rod(0.3), "rocker": rod(0.1)}
    joined = pins(
        ((0.0, 0.0), "crank.start"),
        ("crank.end", "coupler.start"),
        ((0.3, 0.0), "rocker.start"),
        ("coupler.end", "rocker.end"),
    )
    scene = linkage(
        body,
        pin=joined,
        drive={"body": "crank", "speed_rpm": 60.0, "cycles": 1.0},
        tolerance=tolerance,
        initial={"crank": {"angle_deg": 36.0}},
        guess={"rocker": {"angle_deg": 36.0}},
    )
    result = simulate(scene)
    assert result.status == "singular"
    assert abs(float(result.remedy.split(" = ")[1].split(" s:")[0]) - 0.4) < 1e-3


# Invariances


def joined_pendulums(turned=0.0, order=("upper", "lower"), swap=False):
    """A double pendulum whose lower end a spring holds, without weight, turned with its frame."""
    c, s = math.cos(turned), math.sin(turned)
    body = {"upper": rod(0.4, 1.0, centroid=[0.1, 0.02]), "lower": rod(0.3, 0.5, E=[0.2, 0.1])}
    table = {
        "O": {"joins": ["frame", "upper.start"], "point": [0.2 * c, 0.2 * s]},
        "A": {"joins": ["upper.end", "lower.start"]},
    }
    if swap:
        table = {"A": {"joins": ["lower.start", "upper.end"]}, "O": table["O"]}
    spring = {
        "joins": ["frame", "lower.E"],
        "point": [0.5 * c - 0.3 * s, 0.5 * s + 0.3 * c],
        "stiffness": 40.0,
        "length": 0.1,
        "damping": 0.2,
    }
    start = {
        "upper": {"angle_deg": math.degrees(turned) + 10.0, "omega": 3.0},
        "lower": {"angle_deg": math.degrees(turned) - 70.0, "omega": -6.0},
    }
    return linkage(
        {name: body[name] for name in order},
        pin=table,
        spring={"S": spring},
        initial=start,
        gravity=0.0,
        duration=2.0,
        tolerance=1e-12,
    )


@pytest.mark.parametrize("turned", [1.0, -2.5])
def test_a_turned_frame_turns_the_motion(turned):
    upright, other, c, s = (
        success(joined_pendulums()),
        success(joined_pendulums(turned)),
        math.cos(turned),
        math.sin(turned),
    )
    for x, y, bound in (
        ("lower.x", "lower.y", 1e-8),
        ("A.reaction_x", "A.reaction_y", 1e-5),
        ("upper.ax", "upper.ay", 1e-5),
    ):
        np.testing.assert_allclose(other[x], c * upright[x] - s * upright[y], atol=bound, rtol=0)
        np.testing.assert_allclose(other[y], s * upright[x] + c * upright[y], atol=bound, rtol=0)
    np.testing.assert_allclose(other["lower.angle"], upright["lower.angle"] + turned, atol=1e-8, rtol=0)
    np.testing.assert_allclose(other["S.force"], upright["S.force"], atol=1e-6, rtol=0)
    np.testing.assert_allclose(other["energy_damping"], upright["energy_damping"], atol=1e-8, rtol=0)
    assert upright["energy_damping"][-1] > 0.1


def test_the_order_of_bodies_and_pins_only_orders_the_columns():
    one, other = success(joined_pendulums()), success(joined_pendulums(order=("lower", "upper"), swap=True))
    assert [*other][1] == "lower.x"
    for name in one:
        sign = -1.0 if name.startswith("A.") else 1.0  # the force on the second of two bodies
        np.testing.assert_allclose(other[name], sign * one[name], atol=1e-5, rtol=0)


def test_columns_come_in_order_and_by_groups():
    scene = joined_pendulums()
    motion = [
        f"{body}.{word}" for body in ("upper", "lower") for word in ("x", "y", "angle", "vx", "vy", "omega")
    ]
    energies = [f"energy_{part}" for part in ("kinetic", "gravity", "drive", "spring", "damping", "residual")]
    pair = ["O.reaction_x", "O.reaction_y", "A.reaction_x", "A.reaction_y", "S.force"]
    for groups, names in (([], motion), (["joints"], motion + pair), (["energy"], motion + energies)):
        result = simulate(scene | {"output": scene["output"] | {"groups": groups}})
        assert [*result.columns] == ["time", *names]
        assert [*result.extrema] == names
        assert "energy" in result.provenance["invariants"]
    assert simulate.plan(scene) == {
        "formulation": "multiplier (6 coordinates, 4 multipliers)",
        "bodies": ["upper", "lower"],
        "coordinates": 6,
        "constraints": 4,
        "freedom": 2,
        "start": {
            body: pytest.approx([result.columns[f"{body}.{part}"][0] for part in ("x", "y", "angle")])
            for body in ("upper", "lower")
        },
        "contacts": [],
    }


# Refusals


def parallelogram_with_three_cranks():
    body = {name: rod(0.1) for name in ("a", "b", "c")} | {"top": rod(0.4, M=[0.2, 0.0])}
    joined = [
        ((0.0, 0.0), "a.start"),
        ((0.2, 0.0), "b.start"),
        ((0.4, 0.0), "c.start"),
        ("a.end", "top.start"),
        ("b.end", "top.M"),
        ("c.end", "top.end"),
    ]
    upright = {"angle_deg": 90.0}
    return linkage(body, pin=pins(*joined), initial={"a": upright}, guess={"b": upright, "c": upright})


def short_four_bar():
    scene = four_bar(initial={"crank": {"angle_deg": 0.0}})
    scene["body"]["coupler"] = rod(0.02)
    return scene


TURNING = {"body": "crank", "speed_rpm": 60.0, "cycles": 1.0}


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (
            parallelogram_with_three_cranks(),
            "pin: too many constraints, or a singular position: 1 of 12 rows",
        ),
        (
            four_bar(),
            "initial: this linkage needs 1 position and 1 rate, or no rate at rest, and has 0 positions",
        ),
        (four_bar(initial={"crank": {"angle_deg": 1.0, "x": 0.05}}), "has 2 positions and 0 rates"),
        (
            four_bar(initial={"crank": {"angle_deg": 1.0, "omega": 1.0}}, drive=TURNING),
            "needs 1 position and 0 rates, and has 1 position and 1 rate",
        ),
        (short_four_bar(), "guess: the linkage cannot be assembled"),
        (
            linkage(
                {"rotor": rod(centroid=[0.0, 0.0])},
                pin=pins(((0.0, 0.0), "rotor.start")),
                initial={"rotor": {"x": 0.0}},
            ),
            "initial: the values given do not determine the start",
        ),
        (
            linkage(
                {"rod": rod()},
                pin=pins(((0.0, 0.0), "rod.start")),
                initial={"rod": {"angle_deg": 0.0}},
                spring={
                    "S": {"joins": ["frame", "rod.end"], "point": [1.0, 0.0], "stiffness": 1.0, "length": 0.1}
                },
            ),
            "spring.S: its ends coincide",
        ),
        (four_bar(output={"groups": ["corners"]}), "output.groups = 'corners'"),
        (four_bar(tolerance=1e-15), "solver.reference.tolerance = 1e-15 must be at least"),
        (
            four_bar(solver={"reference": {"tolerance": 1e-9, "method": "BDF"}}),
            "solver.reference.method = 'BDF'",
        ),
        (
            four_bar(solver={"reference": {"tolerance": 1e-9, "method": "dop853", "formulation": "minimal"}}),
            "solver.reference.formulation = 'minimal'",
        ),
    ],
)
def test_refusals(scene, message):
    for function in (simulate, simulate.check, simulate.plan):
        with pytest.raises(ValueError, match=r"^[^\n]*$") as refusal:
            function(scene)
        assert message in str(refusal.value)


def test_a_prescribed_motion_knows_its_work_past_a_sharp_force():
    """The end of a spring passes its anchor at half a millimetre: no error of the motion shows that."""
    anchor = {"joins": ["frame", "crank.end"], "point": [0.0, 0.1005], "stiffness": 500.0, "length": 0.05}
    scene = linkage(
        {"crank": rod(0.1)},
        pin=pins(((0.0, 0.0), "crank.start")),
        spring={"S": anchor},
        drive={"body": "crank", "speed_rpm": 60.0, "cycles": 1.0},
        initial={"crank": {"angle_deg": 0.0}},
        tolerance=1e-11,
    )
    assert np.abs(success(scene)["energy_residual"]).max() < 1e-8
