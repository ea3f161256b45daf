"""Linkages of bodies, pins, guides and springs against the test set's squeezer and against closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from reference_model import simulate

ALL = ["accelerations", "joints", "energy"]
G = 9.81


def rod(length=1.0, mass=1.0, inertia=None, centroid=None, **points):
    """Return a body with its pins at (0, 0) and (length, 0), homogeneous unless told."""
    return {
        "mass": mass,
        "inertia": mass * length**2 / 12.0 if inertia is None else inertia,
        "length": length,
        "points": {"start": [0.0, 0.0], "end": [length, 0.0]} | points,
        "centroid": [length / 2.0, 0.0] if centroid is None else centroid,
    }


def linkage(body, *, drive=None, tolerance=1e-10, gravity=G, duration=1.0, samples=100, groups=ALL, **tables):
    """Return the complete mapping of a linkage's scene."""
    output = {"groups": groups, "duration": duration, "samples": samples}
    if drive and "speed_rpm" in drive:
        output = {"groups": groups, "samples_per_cycle": samples}
    return {
        "scene": {"name": "linkage", "title": "", "description": ""},
        "body": body,
        "environment": {"gravity": gravity},
        "drive": drive or {"free": True},
        "output": output,
        "solver": {"reference": {"tolerance": tolerance, "formulation": "auto", "method": "dop853"}},
    } | tables


def pins(*joints):
    """Return pins from ends, or from a point of the frame and an end."""
    return {
        f"P{i}": {"joins": [a, b]} if isinstance(a, str) else {"joins": ["frame", b], "point": list(a)}
        for i, (a, b) in enumerate(joints)
    }


def success(scene):
    result = simulate(scene)
    assert (result.status, result.remedy) == ("success", "")
    return result.columns


# Andrews' squeezer: the numbers of the Test Set for IVP Solvers, release 2.4, problem Andrews' squeezing system.

START = (-0.0617138900142764496358948458001, 0.0, 0.455279819163070380255912382449,
         0.222668390165885884674473185609, 0.487364979543842550225598953530,
         -0.222668390165885884674473185609, 1.23054744454982119249735015568)  # fmt: skip
END = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
       0.5347301163226948, 1.048080741042263)  # fmt: skip
RATES = (1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385, 0.5735699284790808,
         -19.29337464421385, 0.3231791658026955)  # fmt: skip


def squeezer(tolerance):
    """Seven bodies of 0.01 to 0.07 kg; only K1, K3, K5, K7 carry angles of their own in the test set."""
    d, da, e, ea, rr, ra, ss, sa, sb = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092, 0.035, 0.01874, 0.01043
    sc, sd, ta, tb, u, ua, ub, zf, zt, fa = (
        0.018, 0.02, 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
    )  # fmt: skip
    beta, theta, gamma, phi, delta, omega, epsilon = START
    a, b, c = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    rows = [
        (0.04325, 2.194e-6, {"O": (0, 0), "E": (rr, 0)}, (ra, 0), beta),
        (0.00365, 4.410e-7, {"E": (0, 0), "F": (-d, 0)}, (-da, 0), beta + theta),
        (0.02373, 5.255e-6, {"B": (0, 0), "F": (0, -ss), "D": (sd, -sc)}, (sb, -sa), gamma),
        (0.00706, 5.667e-7, {"H": (0, 0), "F": (0, -e)}, (0, ea - e), phi + delta),
        (0.07050, 1.169e-5, {"A": (0, 0), "H": (zt, 0)}, (ta, tb), delta),
        (0.00706, 5.667e-7, {"G": (0, 0), "F": (zf, 0)}, (zf - fa, 0), omega + epsilon),
        (0.05498, 1.912e-5, {"A": (0, 0), "G": (0, -u)}, (ua, -ub), epsilon),
    ]
    body = {
        f"K{i}": {"mass": mass, "inertia": inertia, "points": points, "centroid": centroid}
        for i, (mass, inertia, points, centroid, _) in enumerate(rows, start=1)
    }
    joined = pins(
        ((0.0, 0.0), "K1.O"), ("K1.E", "K2.E"), (b, "K3.B"), ("K2.F", "K3.F"), (a, "K5.A"), ("K5.H", "K4.H"),
        ("K2.F", "K4.F"), (a, "K7.A"), ("K7.G", "K6.G"), ("K2.F", "K6.F"),
    )  # fmt: skip
    spring = {"joins": ["frame", "K3.D"], "point": c, "stiffness": 4530.0, "length": 0.07785, "damping": 0.0}
    return linkage(
        body, pin=joined, spring={"S": spring}, drive={"body": "K1", "torque": 0.033}, gravity=0.0,
        initial={"K1": {"angle_deg": math.degrees(beta)}}, duration=0.03, tolerance=tolerance,
        # To a tenth of a degree
        guess={f"K{i}": {"angle_deg": round(math.degrees(row[4]), 1)} for i, row in enumerate(rows, start=1)},
    )  # fmt: skip


def of_the_test_set(columns, what):
    """Return the seven coordinates, most of which are relative angles, or their derivatives at all times."""
    k1, k2, k3, k4, k5, k6, k7 = (columns[f"K{i}.{what}"] for i in range(1, 8))
    return np.array([k1, k2 - k1, k3, k4 - k5, k5, k6 - k7, k7])


@pytest.mark.parametrize(("tolerance", "bound"), [(1e-12, 1e-8), (1e-10, 1e-7), (1e-7, 1e-4)])
def test_squeezer_ends_as_published(tolerance, bound):
    columns = success(squeezer(tolerance))
    np.testing.assert_allclose(of_the_test_set(columns, "angle")[:, 0], START, atol=1e-13, rtol=0)
    alpha = of_the_test_set(columns, "alpha")[:, 0]
    np.testing.assert_allclose(alpha, [14222.4439199541, -10666.83293996558, 0, 0, 0, 0, 0], atol=1e-8, rtol=0)
    np.testing.assert_allclose(of_the_test_set(columns, "angle")[:, -1], END, atol=bound, rtol=0)
    np.testing.assert_allclose(of_the_test_set(columns, "omega")[:, -1], RATES, atol=1e3 * bound, rtol=0)


def double_four_bar(tolerance, duration=10.0):
    """IFToMM's A02: five rods of 1 m, the tip of the first starts at 1 m/s."""
    names = ("left", "top1", "middle", "top2", "right")
    joined = pins(
        ((0.0, 0.0), "left.start"), ("left.end", "top1.start"), ((1.0, 0.0), "middle.start"),
        ("top1.end", "middle.end"), ("middle.end", "top2.start"), ((2.0, 0.0), "right.start"),
        ("top2.end", "right.end"),
    )  # fmt: skip
    upright = {"angle_deg": 90.0}
    return linkage(
        {name: rod() for name in names}, pin=joined, initial={"left": {"angle_deg": 90.0, "omega": -1.0}},
        guess={"middle": upright, "right": upright}, duration=duration, tolerance=tolerance, groups=["energy"],
    )  # fmt: skip


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
        lambda t, y: [y[1], -moment * math.cos(y[0]) / inertia], (0.0, 0.7), [math.pi / 2, -1.0], "DOP853",
        t_eval=columns["time"], rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    np.testing.assert_allclose(columns["right.angle"], exact.y[0], atol=1e-10, rtol=0)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
@pytest.mark.parametrize("turned", [0.0, 130.0])
def test_pendulum_swings_as_the_elliptic_functions(tolerance, turned):
    """Its own frame is turned against the line from pin to centroid."""
    c, s = 0.4 * math.cos(math.radians(turned)), 0.4 * math.sin(math.radians(turned))
    body = {"arm": rod(mass=2.0, inertia=0.1, centroid=[c, s])}
    amplitude, inertia = 2.0, 0.1 + 2.0 * 0.4**2
    scene = linkage(
        body, pin={"O": {"joins": ["frame", "arm.start"], "point": [0.3, -0.2]}}, tolerance=tolerance, samples=40,
        initial={"arm": {"angle_deg": math.degrees(amplitude) - 90.0 - turned}}, duration=5.0,
    )  # fmt: skip
    result = simulate(scene)
    columns, k, w = result.columns, math.sin(amplitude / 2.0), math.sqrt(2.0 * G * 0.4 / inertia)
    sn, cn, dn, _ = ellipj(w * columns["time"] + ellipk(k * k), k * k)
    angle, rate = 2.0 * np.arcsin(k * sn), 2.0 * k * w * cn
    bound = 2e3 * tolerance
    at = angle - math.pi / 2.0 - math.radians(turned)
    np.testing.assert_allclose(columns["arm.angle"], at, atol=bound, rtol=0)
    np.testing.assert_allclose(columns["arm.omega"], rate, atol=10.0 * bound, rtol=0)
    np.testing.assert_allclose(columns["arm.alpha"], -w * w * np.sin(angle), atol=20.0 * bound, rtol=0)
    np.testing.assert_allclose(columns["arm.x"], 0.3 + 0.4 * np.sin(angle), atol=bound, rtol=0)
    pull = 2.0 * (0.4 * rate**2 + G * np.cos(angle))
    across = 2.0 * (-w * w * 0.4 + G) * np.sin(angle)
    force = np.array([-pull * np.sin(angle) + across * np.cos(angle), pull * np.cos(angle) + across * np.sin(angle)])
    np.testing.assert_allclose([columns["O.reaction_x"], columns["O.reaction_y"]], force, atol=400 * bound, rtol=0)
    # The largest rate and force lie between the samples
    assert abs(result.extrema["arm.omega"]["max"] - 2.0 * k * w) < 2e-6 + 10.0 * bound
    assert abs(result.extrema["arm.angle"]["max"] - at.max()) < 1e-6 + bound


@pytest.mark.parametrize(("damping", "direction"), [(0.0, 0.0), (3.0, 30.0), (3.0, -90.0)])
def test_mass_on_a_spring_in_its_guide(damping, direction):
    """x = decaying cosine about where spring and weight balance, along the guide."""
    mass, stiffness, free, along = 0.5, 200.0, 0.3, math.sin(math.radians(direction))
    u = np.array([math.cos(math.radians(direction)), along])
    scene = linkage(
        {"block": {"mass": mass, "inertia": 1e-4, "points": {"eye": [0.0, 0.0]}, "centroid": [0.0, 0.0]}},
        guide={"G": {"body": "block", "on": "frame", "point": [0.1, 0.2], "direction_deg": direction, "angle_deg": 20.0}},
        spring={"S": {"joins": ["frame", "block.eye"], "point": [0.1, 0.2], "stiffness": stiffness, "length": free,
                      "damping": damping}},
        initial={"block": {"x": 0.1 + 0.36 * u[0]} if direction > -45 else {"y": 0.2 + 0.36 * u[1]}}, tolerance=1e-11,
    )  # fmt: skip
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
        {"rotor": rod(centroid=[0.0, 0.0], inertia=0.2)}, pin=pins(((0.1, 0.0), "rotor.start")), gravity=gravity,
        drive={"body": "rotor", "torque": -1.5}, initial={"rotor": {"angle_deg": 10.0, "omega": 2.0}}, duration=3.0,
    )  # fmt: skip
    columns, alpha = success(scene), -1.5 / 0.2
    t = columns["time"]
    np.testing.assert_allclose(columns["rotor.angle"], math.radians(10.0) + 2.0 * t + 0.5 * alpha * t**2, atol=1e-9)
    np.testing.assert_allclose(columns["rotor.alpha"], alpha, rtol=1e-9)
    np.testing.assert_allclose(columns["energy_drive"], -1.5 * (2.0 * t + 0.5 * alpha * t**2), atol=1e-8)
    assert "drive.torque" not in columns


@pytest.mark.parametrize("omega", [3.0, -3.0])
def test_a_table_of_torque_does_the_work_under_it(omega):
    """Over several turns, with corners and a jump in the table: kinetic energy is that and the start's."""
    table = [[0.0, 0.2], [90.0, 1.0], [90.001, -0.3], [200.0, -0.3], [360.0, 0.2]]
    scene = linkage(
        {"rotor": rod(centroid=[0.0, 0.0], inertia=0.2)}, pin=pins(((0.0, 0.0), "rotor.start")), tolerance=1e-11,
        drive={"body": "rotor", "torque_table": table}, initial={"rotor": {"angle_deg": 15.0, "omega": omega}},
        duration=6.0,
    )  # fmt: skip
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
    np.testing.assert_allclose(columns["energy_drive"], done, atol=1e-7, rtol=0)
    np.testing.assert_allclose(0.5 * 0.2 * columns["rotor.omega"] ** 2, 0.9 + done, atol=1e-7, rtol=0)
