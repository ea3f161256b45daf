"""Linkages that a scene states body by body, against closed forms and published results."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipj, ellipk

from comparison.scene import load_scene
from exudyn_model import simulate

GRAVITY = 9.81


def scene(bodies, pins=None, **tables):
    """Return a complete scene: bodies by ``length`` or ``points``, pins by what they join."""
    complete = {}
    for name, table in bodies.items():
        ends = {"start": [0.0, 0.0], "end": [table["length"], 0.0]} if "length" in table else {}
        complete[name] = {"centroid": [0.0, 0.0]} | table | {"points": ends | table.get("points", {})}
    pins = {name: {"joins": list(joins)} | dict(*point) for name, (*joins, point) in _pins(pins or {})}
    solver = {"exudyn": {"step": tables.pop("step")} | tables.pop("solver", {})} if "step" in tables else {}
    output = {"groups": ["accelerations", "joints", "energy"]} | tables.pop("output")
    common = {"scene": {"name": "linkage"}, "environment": {"gravity": tables.pop("gravity", 0.0)}}
    return (
        common
        | {"body": complete, "pin": pins, "solver": solver or {"exudyn": {}}, "output": output}
        | tables
    )


def _pins(pins):
    for name, (*joins,) in pins.items():
        point = [{"point": joins.pop()}] if not isinstance(joins[-1], str) else []
        yield name, (*joins, point)


def rod(length, mass):
    return {"length": length, "mass": mass, "inertia": mass * length**2 / 12, "centroid": [length / 2, 0.0]}


def run(data):
    result = simulate(data)
    assert result.status == "success", result.remedy
    return result


def orders(make, steps, error):
    """Return the order of an error between runs with ascending steps."""
    errors = [error(run(make(step)).columns) for step in steps]
    return errors[0], np.diff(np.log(errors)) / np.diff(np.log(steps))


# ------------------------------------------------------------------ published

ENDED = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
         0.5347301163226948, 1.048080741042263)  # fmt: skip
"""The squeezer of the Bari test set at 0.03 s: beta, theta, gamma, phi, delta, omega, epsilon (rad)."""


def absolute(angles):
    beta, theta, gamma, phi, delta, omega, epsilon = angles
    return np.array([beta, beta + theta, gamma, phi + delta, delta, omega + epsilon, epsilon])


def squeezer(step):
    return load_scene("squeezer", {"solver.exudyn.step": step, "output.samples": 100}).data


def test_the_squeezer_ends_where_the_test_set_does():
    """Second order: 3.5e-6 rad at 3e-6 s, 4.1e-7 at 1e-6, 3.8e-8 at 3e-7."""

    def error(columns):
        assert columns["K1.alpha"][0] == pytest.approx(14222.4439199541, rel=1e-11)
        return np.abs([columns[f"K{k}.angle"][-1] for k in range(1, 8)] - absolute(ENDED)).max()

    finest, order = orders(squeezer, [1e-6, 2e-6, 4e-6], error)
    assert finest < 1e-6
    np.testing.assert_allclose(order, 2.0, atol=0.1)


def double_four_bar(step):
    pins = {f"P{k}": ("frame", f"R{k}.start", [float(k), 0.0]) for k in range(3)}
    pins |= {"A": ("R0.end", "C0.start"), "B": ("R1.end", "C0.end")}
    pins |= {"C": ("R1.end", "C1.start"), "D": ("R2.end", "C1.end")}
    return scene(
        dict.fromkeys(("R0", "R1", "R2", "C0", "C1"), rod(1.0, 1.0)), pins, gravity=GRAVITY,
        initial={"R0": {"angle_deg": 90.0, "omega": -1.0}}, step=step,
        guess={name: {"angle_deg": 90.0} for name in ("R1", "R2")}, drive={"free": True},
        output={"duration": 1.0, "samples": 100},
    )  # fmt: skip


@pytest.mark.parametrize("step", [1e-3, 1e-4, 2e-5])
def test_the_double_four_bar_is_singular_where_its_rods_lie_down(step):
    """IFToMM's A02: until then it moves as one body, whose energy gives the time: 0.7143 s."""
    inertia, moment = 3.0 / 3.0 + 2.0, 3.0 / 2.0 + 2.0
    fallen, _ = quad(
        lambda x: (1 + 2 * GRAVITY * moment / inertia * (1 - math.cos(x))) ** -0.5, 0, math.pi / 2
    )
    result = simulate(double_four_bar(step))
    assert result.status == "singular"
    at = float(result.remedy.split("t = ")[1].split(" s:")[0])
    assert at == pytest.approx(fallen, abs=2e-4)
    assert f"{at:.3f}" == "0.714"
    assert result.columns["time"][-1] == pytest.approx(0.71)
    assert result.extrema["R0.omega"]["time_of_min"] <= at + 1.1e-4
    assert np.abs(result.columns["energy_residual"]).max() < 1e-5 * GRAVITY * 3.5


# ------------------------------------------------------------------ closed forms


def test_a_pendulum_swings_by_elliptic_functions():
    start, length, mass, inertia = 1.0, 0.2, 1.3, 0.02
    frequency = math.sqrt(mass * GRAVITY * length / (inertia + mass * length**2))

    def make(step):
        body = {"points": {"start": [0.0, 0.0]}, "mass": mass, "inertia": inertia, "centroid": [length, 0.0]}
        return scene(
            {"p": body}, {"O": ("frame", "p.start")}, gravity=GRAVITY, drive={"free": True},
            initial={"p": {"angle_deg": math.degrees(start) - 90.0}}, output={"duration": 2.0, "samples": 50},
            step=step,
        )  # fmt: skip

    def error(columns):
        k = math.sin(start / 2)
        swing = 2 * np.arcsin(k * ellipj(ellipk(k * k) - frequency * columns["time"], k * k)[0])
        assert columns["energy_gravity"] == pytest.approx(
            mass * GRAVITY * length * (np.cos(columns["p.angle"] + math.pi / 2) - math.cos(start)), abs=1e-5
        )
        return np.abs(columns["p.angle"] + math.pi / 2 - swing).max()

    finest, order = orders(make, [1e-4, 2e-4, 4e-4], error)
    assert finest < 1e-6
    np.testing.assert_allclose(order, 2.0, atol=0.05)


@pytest.mark.parametrize("slope", [0.0, 30.0, -100.0])
def test_a_spring_swings_a_block_in_a_turned_guide(slope):
    """Damped, from rest beyond its free length, down the slope's share of gravity."""
    mass, stiffness, damping, free, start = 0.7, 350.0, 4.0, 0.3, 0.36
    decay = damping / (2 * mass)
    frequency = math.sqrt(stiffness / mass - decay**2)
    along = np.array([math.cos(math.radians(slope)), math.sin(math.radians(slope))])

    def make(step):
        spring = {
            "joins": ["frame", "b.centroid"],
            "stiffness": stiffness,
            "length": free,
            "damping": damping,
        }
        return scene(
            {"b": {"mass": mass, "inertia": 1e-3}}, gravity=GRAVITY, spring={"S": spring},
            guide={"G": {"body": "b", "point": [0.0, 0.0], "direction_deg": slope, "angle_deg": 12.0}},
            initial={"b": {"x" if along[0] > 0.5 else "y": start * along[0 if along[0] > 0.5 else 1]}},
            guess={"b": {"x": start * along[0], "y": start * along[1]}},
            output={"duration": 0.8, "samples": 40}, step=step,
        )  # fmt: skip

    def error(columns):
        times, rest = columns["time"], free - mass * GRAVITY * along[1] / stiffness
        swing = np.cos(frequency * times) + decay / frequency * np.sin(frequency * times)
        exact = rest + (start - rest) * np.exp(-decay * times) * swing
        at = along @ [columns["b.x"], columns["b.y"]]
        assert columns["b.angle"] == pytest.approx(math.radians(12.0))
        speed = along @ [columns["b.vx"], columns["b.vy"]]
        np.testing.assert_allclose(columns["S.force"], stiffness * (at - free) + damping * speed, atol=1e-9)
        np.testing.assert_allclose(columns["energy_spring"], 0.5 * stiffness * (at - free) ** 2, atol=1e-12)
        np.testing.assert_allclose(columns["G.force"], mass * GRAVITY * along[0], atol=1e-6)
        np.testing.assert_allclose(columns["G.moment"], 0.0, atol=1e-6)
        assert columns["energy_damping"][-1] > 0.1
        return np.abs(at - exact).max()

    finest, order = orders(make, [1e-4, 2e-4, 4e-4], error)
    assert finest < 1e-6
    np.testing.assert_allclose(order, 2.0, atol=0.05)


def test_a_spring_between_two_free_bodies_keeps_both_momenta():
    """It pulls one of them beside its centroid; there is no constraint at all."""
    bodies = {
        "a": {"mass": 1.0, "inertia": 0.1, "points": {"p": [0.1, 0.0]}},
        "b": {"mass": 2.0, "inertia": 0.2, "points": {}},
    }
    start = {"a": {"x": 0.0, "y": 0.0, "angle_deg": 30.0}, "b": {"x": 0.5, "y": 0.1, "angle_deg": 0.0}}
    columns = run(
        scene(
            bodies,
            spring={"S": {"joins": ["a.p", "b.centroid"], "stiffness": 100.0, "length": 0.2}},
            initial=start,
            drive={"free": True},
            output={"duration": 1.0, "samples": 50},
            step=1e-4,
        )
    ).columns
    spin = 0.1 * columns["a.omega"] + 0.2 * columns["b.omega"]
    for name, mass in (("a", 1.0), ("b", 2.0)):
        x, y, vx, vy = (columns[f"{name}.{part}"] for part in ("x", "y", "vx", "vy"))
        spin = spin + mass * (x * vy - y * vx)
    assert abs(columns["a.omega"][-1]) > 1.0
    np.testing.assert_allclose(spin, 0.0, atol=1e-7)
    for axis in "xy":
        np.testing.assert_allclose(columns[f"a.v{axis}"] + 2.0 * columns[f"b.v{axis}"], 0.0, atol=1e-12)
    arm = 0.1 * np.array([np.cos(columns["a.angle"]), np.sin(columns["a.angle"])])
    x, y = columns["b.x"] - columns["a.x"] - arm[0], columns["b.y"] - columns["a.y"] - arm[1]
    gap = np.hypot(x, y)
    np.testing.assert_allclose(columns["S.force"], 100.0 * (gap - 0.2), atol=1e-10)
    np.testing.assert_allclose(columns["a.ax"], columns["S.force"] * x / gap, atol=1e-9)
    moment = columns["S.force"] * (arm[0] * y - arm[1] * x) / gap
    np.testing.assert_allclose(0.1 * columns["a.alpha"], moment, atol=1e-9)
    np.testing.assert_allclose(
        columns["energy_kinetic"] + columns["energy_spring"], 50 * (gap[0] - 0.2) ** 2, atol=1e-5
    )


def rotor(torque, step):
    """Of 0.01 kg m^2, from 10 degrees and 3 rad/s."""
    return scene(
        {"r": {"mass": 1.0, "inertia": 0.01}}, {"O": ("frame", "r.centroid")},
        drive={"body": "r"} | torque, initial={"r": {"angle_deg": 10.0, "omega": 3.0}},
        output={"duration": 1.5, "samples": 150}, step=step,
    )  # fmt: skip


def test_a_constant_torque_speeds_up_a_rotor():
    columns = run(rotor({"torque": 0.25}, 1e-3)).columns
    times = columns["time"]
    exact = math.radians(10.0) + 3.0 * times + 12.5 * times**2
    np.testing.assert_allclose(columns["r.angle"], exact, atol=1e-10)  # the rule is exact here
    np.testing.assert_allclose(columns["energy_drive"], 0.25 * (exact - exact[0]), atol=1e-10)
    np.testing.assert_allclose(columns["r.alpha"], 25.0, rtol=1e-9)


def test_a_torque_follows_its_table_over_the_angle_and_round():
    """Linear: a cosine about the angle without torque, then further pieces, by the energy."""
    table = [[0.0, 0.2], [120.0, -0.1], [300.0, 0.3], [360.0, 0.2]]
    corners, torques = np.radians([row[0] for row in table]), np.array([row[1] for row in table])

    def work(angle):
        turns, rest = np.divmod(angle, 2 * math.pi)
        grid = np.append(corners[corners < rest], rest)
        last = np.append(torques[corners < rest], np.interp(rest, corners, torques))
        return turns * np.trapezoid(torques, corners) + np.trapezoid(last, grid)

    def error(columns):
        slope, start = 0.3 / (2 * math.pi / 3), math.radians(10.0)
        frequency, zero = math.sqrt(slope / 0.01), 0.2 / slope
        times = columns["time"]
        cosine = (start - zero) * np.cos(frequency * times) + 3.0 / frequency * np.sin(frequency * times)
        first = columns["r.angle"] < corners[1]
        energy = 0.5 * 0.01 * columns["r.omega"] ** 2 - 0.045
        exact = np.array([work(angle) - work(start) for angle in columns["r.angle"]])
        assert columns["r.angle"][-1] > 2 * math.pi + 1.0
        assert first.sum() > 5
        np.testing.assert_allclose(energy, exact, atol=1e-6)
        return np.abs(columns["r.angle"] - zero - cosine)[first].max()

    finest, order = orders(lambda step: rotor({"torque_table": table}, step), [1e-4, 2e-4, 4e-4], error)
    assert finest < 1e-7
    np.testing.assert_allclose(order, 2.0, atol=0.1)


def test_a_workpiece_pushes_the_body_that_the_load_names():
    """A block falls on a linear one 0.05 m below and comes back: parabola, cosine, parabola."""
    stiffness, mass, drop = 2000.0, 0.5, 0.05
    load = {"body": "b", "surface": 0.2, "table": [], "force": 20.0, "depth": 0.01, "exponent": 1.0}
    guide = {"body": "b", "point": [0.4, 0.0], "direction_deg": 90.0, "angle_deg": 0.0}
    data = scene(
        {"a": {"mass": 1.0, "inertia": 1.0}, "b": {"mass": mass, "inertia": 1.0}},
        {"O": ("frame", "a.centroid", [0.0, 1.0])}, gravity=GRAVITY, guide={"G": guide}, load=load,
        initial={"b": {"y": 0.2 + drop}, "a": {"angle_deg": 0.0}}, step=1e-5,
        output={"duration": 0.2, "samples": 200},
    )  # fmt: skip
    assert simulate.check(data) == {"load_at_start": 0.0}
    columns = run(data).columns
    touch, speed = math.sqrt(2 * drop / GRAVITY), math.sqrt(2 * drop * GRAVITY)
    frequency, sag = math.sqrt(stiffness / mass), mass * GRAVITY / stiffness
    after = columns["time"] - touch
    inside = (after > 0) & (columns["b.y"] < 0.2)
    exact = 0.2 - sag + sag * np.cos(frequency * after) - speed / frequency * np.sin(frequency * after)
    assert inside.sum() > 20
    np.testing.assert_allclose(columns["b.y"][inside], exact[inside], atol=1e-8)
    np.testing.assert_allclose(
        columns["energy_load"], 0.5 * stiffness * np.maximum(0.2 - columns["b.y"], 0) ** 2, atol=1e-12
    )
    assert np.abs(columns["energy_residual"]).max() < 1e-6


# ------------------------------------------------------------------ driven linkages

MOTION = ("x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha")
CRANK, COUPLER, ROCKER, BASE, RPM = 0.1, 0.25, 0.2, 0.3, 150.0


def turned(point, angle):
    c, s = math.cos(angle), math.sin(angle)
    return [c * point[0] - s * point[1], s * point[0] + c * point[1]]


def four_bar(step=2e-5, turn=0.0, gravity=GRAVITY, order=("crank", "rod", "rocker"), **changes):
    lengths = {"crank": (CRANK, 0.5), "rod": (COUPLER, 1.0), "rocker": (ROCKER, 0.8)}
    pins = {
        "O": ("frame", "crank.start"), "A": ("crank.end", "rod.start"), "B": ("rod.end", "rocker.end"),
        "H": ("frame", "rocker.start", turned([BASE, 0.0], turn)),
    }  # fmt: skip
    degrees = math.degrees(turn)
    return scene(
        {name: rod(*lengths[name]) for name in order}, pins, gravity=gravity,
        drive={"body": "crank", "speed_rpm": RPM, "cycles": 2}, output={"samples_per_cycle": 100}, step=step,
        initial={"crank": {"angle_deg": 60.0 + degrees}},
        guess={"rod": {"angle_deg": 20.0 + degrees}, "rocker": {"angle_deg": 80.0 + degrees}},
    ) | changes  # fmt: skip


def test_a_driven_four_bar_has_its_channels_extrema_and_plan():
    """Its motion is held against a program of one coordinate in tests/linkages."""
    result = run(four_bar())
    columns = result.columns
    assert list(columns)[1:10] == [f"crank.{part}" for part in MOTION]
    assert list(columns)[28:] == [f"{pin}.reaction_{axis}" for pin in "OABH" for axis in "xy"] + [
        "drive.torque", "energy_kinetic", "energy_gravity", "energy_drive", "energy_spring", "energy_damping",
        "energy_residual",
    ]  # fmt: skip
    assert len(result.cycle_extrema["rocker.angle_max"]) == 2
    assert result.extrema["rocker.angle"]["max"] >= columns["rocker.angle"].max()
    assert not len(result.events["corner"])
    assert simulate.plan(four_bar()) == {
        "formulation": "bodies and joints", "bodies": ["crank", "rod", "rocker"], "coordinates": 9,
        "constraints": 9, "freedom": 0,
        "start": {
            body: pytest.approx([columns[f"{body}.{part}"][0] for part in ("x", "y", "angle")])
            for body in ("crank", "rod", "rocker")
        },
    }  # fmt: skip


def quick_return(step=2e-5, base=-0.18, offset=0.02):
    """A block on the crank's end slides along a line of the rocker, ``offset`` beside its pivot."""
    bodies = {
        "crank": rod(0.08, 0.4),
        "block": {"mass": 0.2, "inertia": 3e-4},
        "rocker": {"mass": 1.1, "inertia": 0.02, "centroid": [0.12, 0.0], "points": {"pivot": [0.0, 0.0]}},
    }
    pins = {
        "O": ("frame", "crank.start"), "A": ("crank.end", "block.centroid"),
        "H": ("frame", "rocker.pivot", [0.0, base]),
    }  # fmt: skip
    guide = {"body": "block", "on": "rocker", "point": [0.1, offset], "direction_deg": 0.0, "angle_deg": 25.0}
    return scene(
        bodies, pins, guide={"G": guide}, gravity=GRAVITY, step=step, initial={"crank": {"angle_deg": 10.0}},
        guess={"rocker": {"angle_deg": 70.0}, "block": {"angle_deg": 95.0}},
        drive={"body": "crank", "speed_rpm": -90.0, "cycles": 1.0}, output={"samples_per_cycle": 100},
    )  # fmt: skip


def test_a_quick_return_turns_its_rocker_with_the_block_in_its_slot():
    columns, base, offset = run(quick_return()).columns, -0.18, 0.02
    crank = math.radians(10.0) - 3 * math.pi * columns["time"]
    x, y = 0.08 * np.cos(crank), 0.08 * np.sin(crank) - base
    rocker = np.arctan2(y, x) - np.arcsin(offset / np.hypot(x, y))
    np.testing.assert_allclose(columns["rocker.angle"], rocker, atol=1e-8)
    np.testing.assert_allclose(columns["block.angle"], rocker + math.radians(25.0), atol=1e-8)
    force, moment = columns["G.force"], columns["G.moment"]
    across = np.array([-np.sin(rocker), np.cos(rocker)])
    inertial = 0.2 * np.array([columns["block.ax"], columns["block.ay"] + GRAVITY])
    pin = np.array([columns["A.reaction_x"], columns["A.reaction_y"]])
    np.testing.assert_allclose(pin + force * across, inertial, atol=1e-5)
    np.testing.assert_allclose(moment, 3e-4 * columns["block.alpha"], atol=1e-6)
    # About its pivot the rocker feels the block, whose moment arm is the way along the slot, and its weight
    way = np.hypot(np.hypot(x, y), 0.0) ** 2 - offset**2
    about = -force * np.sqrt(way) - moment - 1.1 * GRAVITY * 0.12 * np.cos(rocker)
    np.testing.assert_allclose(about, (0.02 + 1.1 * 0.12**2) * columns["rocker.alpha"], atol=1e-5)
    assert np.abs(columns["energy_residual"]).max() < 1e-6


def test_a_block_that_nearly_meets_its_rocker_s_pivot_is_followed_or_refused():
    """5 mm beside it, with forces of which the start says nothing; then 1.5 mm."""
    columns = run(quick_return(step=4e-6, base=-0.085, offset=0.0)).columns
    crank = math.radians(10.0) - 3 * math.pi * columns["time"]
    rocker = np.unwrap(np.arctan2(0.08 * np.sin(crank) + 0.085, 0.08 * np.cos(crank)))
    np.testing.assert_allclose(columns["rocker.angle"], rocker, atol=2e-6)
    assert np.abs(columns["G.force"]).max() > 5e4
    far = simulate(quick_return(step=4e-5, base=-0.0815, offset=0.0))
    assert far.status == "invariant-violated"
    assert far.remedy.startswith("constraint-position: ")


def test_turning_the_frame_and_the_order_of_bodies_change_nothing():
    plain = run(four_bar(gravity=0.0)).columns
    angle = 1.1
    moved = run(four_bar(gravity=0.0, turn=angle, order=("rocker", "crank", "rod"))).columns
    for name in ("crank", "rod", "rocker"):
        for x, y in (("x", "y"), ("vx", "vy"), ("ax", "ay")):
            back = turned([moved[f"{name}.{x}"], moved[f"{name}.{y}"]], -angle)
            np.testing.assert_allclose(back[0], plain[f"{name}.{x}"], atol=1e-7)
            np.testing.assert_allclose(back[1], plain[f"{name}.{y}"], atol=1e-7)
        np.testing.assert_allclose(moved[f"{name}.angle"] - angle, plain[f"{name}.angle"], atol=1e-9)
    np.testing.assert_allclose(moved["drive.torque"], plain["drive.torque"], atol=1e-6)


def slider_crank(step, radius=0.1, length=0.08):
    """The rod is shorter than the crank: it stands upright, and the crank can go no further."""
    guide = {"G": {"body": "block", "point": [0.0, 0.0], "direction_deg": 0.0}}
    pins = {
        "O": ("frame", "crank.start"),
        "A": ("crank.end", "rod.start"),
        "B": ("rod.end", "block.centroid"),
    }
    return scene(
        {"crank": rod(radius, 0.5), "rod": rod(length, 1.0), "block": {"mass": 0.3, "inertia": 1e-4}}, pins,
        guide=guide, initial={"crank": {"angle_deg": 20.0}}, guess={"rod": {"angle_deg": -25.0}}, step=step,
        drive={"body": "crank", "speed_rpm": 60.0, "cycles": 1}, output={"samples_per_cycle": 1000},
    )  # fmt: skip


@pytest.mark.parametrize("step", [5e-4, 5e-5, 1e-5])
@pytest.mark.parametrize(
    ("make", "exact"),
    [
        (slider_crank, (math.asin(0.8) - math.radians(20.0)) / (2 * math.pi)),
        (lambda step: slider_crank(step, length=0.1), 70.0 / 360.0),  # equally long: a change point
    ],
)
def test_a_drive_stops_at_a_toggle_and_at_a_change_point(make, exact, step):
    result = simulate(make(step))
    assert result.status == "singular"
    at = float(result.remedy.split("t = ")[1].split(" s:")[0])
    assert at == pytest.approx(exact, abs=6e-4)


@pytest.mark.parametrize(
    ("data", "step"), [(rotor({"torque": 0.1}, "auto"), 1.5e-5), (four_bar("auto"), 0.4 / 50_000)]
)
def test_the_usual_step_divides_a_run_or_a_turn_of_the_drive(data, step):
    settings = run(data).provenance["settings"]
    assert settings["step_used"] == pytest.approx(step, rel=1e-3)  # it also divides the sample interval
    assert settings["method"] == "trapezoidal-index2"


# ------------------------------------------------------------------ starts and refusals


def test_a_start_is_completed_from_values_of_any_body():
    """Two degrees of freedom: a double pendulum by the lower rod's angle and a tip's height."""
    bodies, pins = (
        {"up": rod(0.3, 1.0), "low": rod(0.2, 0.5)},
        {"O": ("frame", "up.start"), "A": ("up.end", "low.start")},
    )
    initial = {"low": {"angle_deg": -60.0, "omega": 2.0, "vy": 0.1}, "up": {"x": 0.1}}
    data = scene(
        bodies, pins, initial=initial, guess={"up": {"angle_deg": -40.0}}, gravity=GRAVITY, step=1e-4,
        drive={"free": True}, output={"duration": 0.5, "samples": 50},
    )  # fmt: skip
    columns = run(data).columns
    upper, lower = -math.acos(0.1 / 0.15), math.radians(-60.0)
    first = {name: columns[name][0] for name in columns}
    assert first["up.angle"] == pytest.approx(upper, abs=1e-12)
    assert first["low.y"] == pytest.approx(0.3 * math.sin(upper) + 0.1 * math.sin(lower), abs=1e-12)
    assert (first["low.vy"], first["low.omega"]) == pytest.approx((0.1, 2.0), abs=1e-12)
    rate = (0.1 - 0.1 * 2.0 * math.cos(lower)) / (0.3 * math.cos(upper))
    assert first["up.omega"] == pytest.approx(rate, abs=1e-12)

    def derivative(_, y):
        a, b, wa, wb = y
        c, s = math.cos(a - b), math.sin(a - b)
        mass = [[0.03 + 0.5 * 0.09, 0.5 * 0.03 * c], [0.5 * 0.03 * c, 0.5 * 0.04 / 3]]
        force = [
            -0.5 * 0.03 * s * wb**2 - GRAVITY * (0.15 + 0.15) * math.cos(a),
            0.5 * 0.03 * s * wa**2 - GRAVITY * 0.05 * math.cos(b),
        ]
        return [wa, wb, *np.linalg.solve(mass, force)]

    exact = solve_ivp(derivative, (0, 0.5), [upper, lower, rate, 2.0], "DOP853", rtol=1e-12, atol=1e-12).y[
        :, -1
    ]
    assert (columns["up.angle"][-1], columns["low.angle"][-1]) == pytest.approx(tuple(exact[:2]), abs=1e-5)


def pinned(**pins):
    return four_bar() | {"pin": four_bar()["pin"] | pins}


def solved(**keys):
    return four_bar(solver={"exudyn": keys})


def reaching(degrees):
    """Return a slider-crank without a drive whose crank is beyond its toggle for 90 degrees."""
    data = slider_crank(1e-4) | {"drive": {"free": True}, "output": {"groups": [], "duration": 1.0}}
    return data | {"initial": {"crank": {"angle_deg": degrees}}}


NEEDS = "initial: the linkage needs 1 position and "
FIXED = {"body": "block", "point": [0.0, 0.0], "direction_deg": 0.0, "angle_deg": 95.0}
SHORT = {"S": {"joins": ["frame", "crank.start"], "stiffness": 1.0, "length": 0.1}}
REFUSED = {
    "rate": (
        four_bar(initial={"crank": {"angle_deg": 60.0, "omega": 1.0}}),
        NEEDS + "0 rates; 1 position and 1 rate are given",
    ),
    "position": (
        four_bar(initial={"rod": {"angle_deg": 20.0}}),
        NEEDS + "0 rates; 2 positions and 0 rates are given",
    ),
    "none": (
        double_four_bar(1e-3) | {"initial": {}},
        NEEDS + "1 rate, or no rate at rest; 0 positions and 0 rates are given",
    ),
    "open": (
        pinned(H={"joins": ["frame", "rocker.start"], "point": [0.9, 0.0]}),
        "guess: the linkage cannot be assembled",
    ),
    "beyond": (reaching(90.0), "guess: the linkage cannot be assembled"),
    "rows": (
        pinned(Z={"joins": ["frame", "crank.start"]}),
        "pin: too many constraints, or a singular position: 2 of 11 rows",
    ),
    "blind": (
        quick_return() | {
            "drive": {"free": True}, "guide": {"G": FIXED}, "output": {"groups": [], "duration": 1.0},
            "initial": {"block": {"angle_deg": 95.0}},
        },
        "initial: the given positions do not determine the linkage's start",
    ),
    "formulation": (solved(formulation="tree"), "solver.exudyn.formulation = 'tree' is the press's"),
    "method": (solved(method="dopri5"), "solver.exudyn.method = 'dopri5' is the press's"),
    "spring": (four_bar(spring=SHORT), "spring.S: its points coincide at the start"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_linkage_is_refused_in_one_line_by_run_check_and_plan(name):
    data, message = REFUSED[name]
    for call in (simulate, simulate.check, simulate.plan):
        with pytest.raises(ValueError, match=r"^\w+[.:]") as refusal:
            call(data)
        assert str(refusal.value).startswith(message)
        assert "\n" not in str(refusal.value)
