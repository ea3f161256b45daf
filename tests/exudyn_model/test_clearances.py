"""Linkages with clearance at pins and guides: the press's own run, a published contact, conservation laws."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from comparison.scene import load_scene
from exudyn_model import simulate

GRAVITY = 9.81
CONTACT = {
    "law": "hertz-corners", "youngs_modulus": 2.07e11, "poisson": 0.3, "restitution": 0.8, "damping": 100.0,
    "damping_model": "lankarani-nikravesh", "exponent": 1.5, "impact_speed_floor": 1e-3, "stiffness": None,
    "damping_depth": 1e-5,
}  # fmt: skip


def loose(size, block=None, contact=None, friction=0.0, **start):
    """Return the complete table of a clearance, at a guide with the length and width of a ``block``."""
    own = {"journal_radius": 0.01, "offset": [0.0, 0.0], "offset_rate": [0.0, 0.0]}
    if block is not None:
        own = {"corner_radius": 1e-3, "length": block[0], "width": block[1]}
        own |= {"offset": 0.0, "tilt_deg": 0.0, "offset_rate": 0.0, "tilt_rate": 0.0}
    rubbing = {"coefficient": friction, "static_speed": 1e-4, "transition_speed": 1e-3}
    return own | start | {"size": size, "contact": CONTACT | (contact or {}), "friction": rubbing}


def rod(length, mass, inertia, **points):
    ends = {"start": [0.0, 0.0], "end": [length, 0.0]}
    return {"mass": mass, "inertia": inertia, "centroid": [length / 2, 0.0], "points": ends | points}


def block(mass, inertia):
    return {"mass": mass, "inertia": inertia, "centroid": [0.0, 0.0], "points": {}}


def scene(body, pin, clearance, step, gravity=GRAVITY, groups=("contacts", "joints", "energy"), **tables):
    pins = {name: {"joins": joins[:2], "point": (*joins, [0.0, 0.0])[2]} for name, joins in pin.items()}
    tables["output"] = {"groups": ["accelerations", *groups]} | tables["output"]
    common = {"scene": {"name": "loose"}, "environment": {"gravity": gravity}, "guess": {}, "spring": {}}
    common |= {
        "contact": CONTACT,
        "friction": {"coefficient": 0.0, "static_speed": 1e-4, "transition_speed": 1e-3},
    }
    solver = {"exudyn": {"step": step}}
    return common | {"body": body, "pin": pins, "clearance": clearance, "solver": solver} | tables


def run(data):
    result = simulate(data)
    assert result.status == "success", result.remedy
    return result


# ------------------------------------------------------------------ a published first contact

L1, L2, M1, M2, M3, J1, J2 = 0.153, 0.306, 0.038, 0.038, 0.076, 7.4e-5, 5.9e-4
PINS = {"O": ["frame", "crank.start"], "A": ["crank.end", "rod.start"], "B": ["rod.end", "slider.centroid"]}


def flores(step, duration=0.00256, **start):
    """Return the slider-crank of Flores, Leine and Glocker (2010), whose slider has a clearance of 1 mm."""
    bodies = {"crank": rod(L1, M1, J1), "rod": rod(L2, M2, J2), "slider": block(M3, 2.7e-6)}
    guide = {"body": "slider", "on": "frame", "point": [0.0, 0.0], "direction_deg": 0.0, "angle_deg": 0.0}
    return scene(
        bodies, PINS, {"G": loose(1e-3, (0.1, 0.05), **start)}, step, guide={"G": guide},
        drive={"free": True}, initial={"crank": {"angle_deg": 0.0, "omega": 150.0}},
        output={"duration": duration, "samples": 80},
    )  # fmt: skip


def flight(until):
    """Return the times of the slider's touch and both rods' angles (rad) at ``until`` (s): two pendulums."""
    first, second = (M1 / 2 + M2 + M3) * L1, (M2 / 2 + M3) * L2

    def derivative(_, y):
        a, b, wa, wb = y
        mass = [
            [J1 + (M1 / 4 + M2 + M3) * L1**2, second * L1 * math.cos(a - b)],
            [second * L1 * math.cos(a - b), J2 + (M2 / 4 + M3) * L2**2],
        ]
        turn = second * L1 * math.sin(a - b)
        force = [
            -turn * wb**2 - GRAVITY * first * math.cos(a),
            turn * wa**2 - GRAVITY * second * math.cos(b),
        ]
        return [wa, wb, *np.linalg.solve(mass, force)]

    def touch(_, y):
        return abs(L1 * math.sin(y[0]) + L2 * math.sin(y[1])) - 1e-3

    touch.direction = 1.0
    options = {"rtol": 1e-13, "atol": 1e-13, "events": touch, "dense_output": True}
    solution = solve_ivp(derivative, (0.0, 0.003), [0.0, 0.0, 150.0, -75.0], "DOP853", **options)
    return solution.t_events[0][0], solution.sol(until)[:2]


def test_the_slider_of_flores_touches_with_both_corners_when_he_says():
    exact, _ = flight(0.0)
    assert exact == pytest.approx(2.692503e-3, abs=5e-10)
    result = run(flores(1e-6, duration=0.0028))
    events = result.events
    assert events["corner"][:2].tolist() == ["G.ll", "G.ul"]
    np.testing.assert_allclose(events["start"][:2], exact, rtol=0, atol=2e-9)  # 1e-9 s; a fourth at 5e-7 s
    assert events["normal_speed"][0] == pytest.approx(events["normal_speed"][1], rel=1e-6)
    assert (events["start"][2:] > exact + 1e-5).all()
    assert set(result.pulses["row"]) >= {0, 1}
    plan = simulate.plan(flores(1e-6))
    assert plan["contacts"] == ["G.ll", "G.lr", "G.ul", "G.ur"]
    assert plan["constraints"] == 6


def test_free_flight_is_of_second_order():
    _, exact = flight(0.00256)
    steps = np.array([2e-6, 4e-6, 8e-6])
    errors = []
    for step in steps:
        columns = run(flores(step)).columns
        errors.append(np.abs([columns["crank.angle"][-1], columns["rod.angle"][-1]] - exact).max())
    np.testing.assert_allclose(np.diff(np.log(errors)) / np.diff(np.log(steps)), 2.0, atol=0.1)
    assert errors[0] < 1e-6


def test_contacts_that_are_closed_at_the_start_begin_there():
    """On the wall and moving in: two corners at once, and a journal."""
    data = flores(1e-6, duration=5e-4, offset=1e-3, offset_rate=0.4)
    data["clearance"]["A"] = loose(2e-4, offset=[0.0, 2e-4], offset_rate=[0.0, 0.3])
    result = run(data)
    for name, speed in (("G.ll", 0.4), ("G.ul", 0.4), ("A", 0.3)):
        row = result.events["corner"].tolist().index(name)
        assert result.events["start"][row] == 0.0
        assert result.events["normal_speed"][row] == pytest.approx(speed, rel=1e-9)
    first = {name: values[0] for name, values in result.columns.items()}
    assert first["slider.y"] == pytest.approx(1e-3, abs=1e-15)
    assert (first["A.x"], first["A.y"]) == pytest.approx((0.0, 2e-4), abs=1e-15)


# ------------------------------------------------------------------ the press

UPRIGHT = {"angle_deg": 0.0}
EXCEPT = {"crank_torque": "drive.torque", "guide_force": "G.force", "guide_moment": "G.moment"}


def press(name, changes):
    """Return a shipped press for five bodies, and the same as a linkage."""
    groups = {"output.groups": ["accelerations", "corners", "joints", "energy"]}
    data = load_scene(name, {"solver.exudyn.formulation": "full"} | groups | changes).data
    m, start, gaps = data["mechanism"], data["initial"], data["clearance"]
    law = {"contact": data["contact"], "friction": data["friction"]}
    bodies = {key: rod(m[key]["length"], m[key]["mass"], m[key]["inertia"]) for key in m if key in ROUGH}
    for key, body in bodies.items():
        body["centroid"] = [m[key]["centroid"], 0.0]
    bodies["slider"] = block(m["slider"]["mass"], m["slider"]["inertia"])
    joins = {
        "O": ["frame", "crank.start"], "A": ["crank.end", "rod2.start"],
        "H": ["frame", "rocker.start", m["rocker_pivot"]], "B": ["rod2.end", "rocker.centroid"],
        "C": ["rocker.end", "rod4.start"], "F": ["rod4.end", "slider.centroid"],
    }  # fmt: skip
    loosened, x = {}, m["guide_x"]
    if data["joints"]["crank_pin"] == "clearance":
        loosened["A"] = loose(gaps["crank_pin"]) | law | {"journal_radius": gaps["journal_radius"]}
    if data["joints"]["slider"] == "clearance":
        shape = m["slider"]["length"], m["slider"]["width"]
        loosened["G"] = (
            loose(gaps["slider"], shape) | law | {"corner_radius": data["contact"]["corner_radius"]}
        )
        loosened["G"] |= {"offset": -start["slider_offset"], "offset_rate": -start["slider_vx"]}
        loosened["G"] |= {"tilt_rate": start["slider_omega"]}
        loosened = {key: loosened[key] for key in "GA" if key in loosened}
    else:
        x += m["reference_offset"]
    linkage = scene(
        bodies, joins, loosened, data["solver"]["exudyn"]["step"], data["environment"]["gravity"],
        guide={"G": {"body": "slider", "on": "frame", "point": [x, 0.0], "direction_deg": 90.0} | UPRIGHT},
        drive={"body": "crank", "speed_rpm": data["drive"]["speed_rpm"], "cycles": data["drive"]["cycles"]},
        initial={"crank": {"angle_deg": m["crank_angle_deg"]}},
        guess={key: {"angle_deg": angle} for key, angle in ROUGH.items()},
        output={"samples_per_cycle": data["output"]["samples_per_cycle"]},
    )  # fmt: skip
    return data, linkage


@pytest.mark.parametrize(
    ("name", "cycles", "contacts"),
    [("150rpm-0.2mm", 0.15, 8), ("both-clearances", 0.05, 10), ("crank-pin", 0.05, 5)],
)
def test_the_press_as_a_linkage_is_the_press(name, cycles, contacts):
    """All channels; what is left is round-off, and in reactions Newton's tolerance."""
    data, linkage = press(
        name, {"drive.cycles": cycles, "solver.exudyn.step": 2e-6, "output.samples_per_cycle": 2000}
    )
    own, result = run(data), run(linkage)
    events, others = own.events, result.events
    assert len(events["corner"]) >= contacts
    renamed = ["A" if corner == "pin" else f"G.{corner}" for corner in events["corner"]]
    assert others["corner"].tolist() == renamed
    np.testing.assert_allclose(others["start"], events["start"], rtol=0, atol=1e-11)
    for key in ("normal_speed", "impulse", "peak_force", "largest_depth"):
        np.testing.assert_allclose(others[key], events[key], rtol=1e-7)
    free, compared = own.columns["time"] < events["start"][0], 0
    for channel, values in own.columns.items():
        kind, _, rest = channel.partition("_")
        known = {"slider": f"slider.{rest}", "corner": f"G.{rest}", "journal": f"A.{rest}", "energy": channel}
        known["reaction"] = f"{rest[0]}.reaction_{rest[-1]}" if rest else ""
        if channel in ("time", "energy_residual"):
            continue
        scale = np.ptp(values) if np.ptp(values) > 1e-9 else 1.0  # an ideal slider's rates are round-off
        other = result.columns[EXCEPT.get(channel) or known[kind]]
        sign = -1.0 if channel == "guide_force" else 1.0  # to the left of the guide, which points up
        difference = np.abs(sign * other - values) / scale
        by_newton = kind in ("reaction", "crank", "guide")
        assert difference[free].max() <= (1e-9 if by_newton else 1e-12), channel
        assert difference.max() <= 1e-6, channel  # ten contacts magnify it
        compared += 1
    assert compared >= 32


ROUGH = {"crank": 0.0, "rod2": 111.0, "rocker": 163.0, "rod4": -102.0}
"""Angles of the rods at the start, deg."""

# ------------------------------------------------------------------ conservation


def adrift(joint, friction):
    """Return two free bodies that turn: the first has a slot or a bearing for the second."""
    bodies = {
        "a": block(0.5, 2e-3) | {"points": {"p": [0.1, 0.03]}},
        "b": block(0.2, 3e-4) | {"points": {"p": [0.02, 0.0]}},
    }
    law = {"contact": {"restitution": 0.7}, "friction": friction}
    if joint == "guide":
        slot = {"body": "b", "on": "a", "point": [0.05, 0.04], "direction_deg": 20.0, "angle_deg": 65.0}
        tables = {"guide": {"L": slot}}
        clearance = loose(
            2e-4, (0.06, 0.04), offset=5e-5, offset_rate=0.1, tilt_deg=0.02, tilt_rate=1.0, **law
        )
        start = {
            "a": {"x": 0.1, "y": 0.2, "angle_deg": 30.0, "vx": 0.3, "vy": -0.2, "omega": 5.0},
            "b": {"x": 0.13, "vx": 0.5},
        }
        guess = {"b": {"y": 0.26, "angle_deg": 95.0}}
    else:
        tables, guess = {"pin": {"L": ["b.p", "a.p"]}}, {"b": {"x": 0.17, "y": 0.27}}
        clearance = loose(2e-4, offset=[5e-5, -3e-5], offset_rate=[0.3, 0.1], **law)
        start = {
            "a": {"x": 0.1, "y": 0.2, "angle_deg": 30.0, "vx": 0.3, "vy": -0.2, "omega": 5.0},
            "b": {"angle_deg": 40.0, "omega": -30.0},
        }
    return scene(
        bodies, tables.pop("pin", {}), {"L": clearance}, 1e-6, 0.0, drive={"free": True}, initial=start,
        **tables, output={"duration": 0.06, "samples": 300},
    ) | {"guess": guess}  # fmt: skip


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("joint", ["guide", "pin"])
def test_two_bodies_in_contact_keep_their_momenta_and_their_energy(joint, friction):
    """The slot turns: gaps, slips and forces in its frame would lose either, if one of them were wrong."""
    result = run(adrift(joint, friction))
    columns, spin, total = result.columns, 0.0, 0.0
    for name, mass, inertia in (("a", 0.5, 2e-3), ("b", 0.2, 3e-4)):
        x, y, vx, vy, omega = (columns[f"{name}.{part}"] for part in ("x", "y", "vx", "vy", "omega"))
        spin = spin + mass * (x * vy - y * vx) + inertia * omega
        total = total + mass * np.array([vx, vy])
    assert len(result.events["corner"]) >= 7
    np.testing.assert_allclose(total, total[:, :1] + 0.0 * total, rtol=0, atol=1e-12)
    # The trapezoidal rule keeps a moment of momentum to second order in the step
    np.testing.assert_allclose(spin, spin[0], rtol=0, atol=1e-9)
    energy = columns["energy_kinetic"]
    assert np.abs(columns["energy_residual"]).max() < 1e-5 * energy[0]
    lost = columns["energy_damping"] + columns["energy_friction"]
    np.testing.assert_allclose(energy[0] - energy - columns["energy_contact"], lost, atol=1e-5 * energy[0])
    assert lost[-1] > 4e-3 * energy[0]
    assert (columns["energy_friction"][-1] > 1e-3 * energy[0]) == (friction > 0.0)
    if joint == "pin":
        assert (columns["L.x"][0], columns["L.y"][0]) == pytest.approx((5e-5, -3e-5), abs=1e-15)
        return
    for corner, side, end in (("ll", 1, -1), ("lr", -1, -1), ("ul", 1, 1), ("ur", -1, 1)):
        tilt, middle = math.radians(0.02), 5e-5
        reach = side * middle + 0.02 * math.cos(tilt) + side * end * 0.03 * math.sin(tilt)
        assert columns[f"L.{corner}_gap"][0] == pytest.approx(0.02 + 2e-4 - reach, abs=1e-15)
    distance = [columns[f"b.{axis}"] - columns[f"a.{axis}"] for axis in "xy"]
    normal = columns["a.angle"] + math.radians(110.0)
    drop = np.cos(normal) * distance[0] + np.sin(normal) * distance[1]
    own = -0.05 * math.sin(math.radians(20.0)) + 0.04 * math.cos(math.radians(20.0))
    gaps = [columns[f"L.{corner}_gap"] for corner in ("ll", "lr", "ul", "ur")]
    np.testing.assert_allclose(0.25 * (gaps[1] + gaps[3] - gaps[0] - gaps[2]), drop - own, rtol=0, atol=1e-14)


# ------------------------------------------------------------------ several at once


def driven(turn=0.0, own=0.0, friction=0.1, step=2e-6, cycles=0.3):
    """Return a driven slider-crank with three clearances, turned; also the slider's own frame, in it."""
    bodies = {"crank": rod(0.05, 0.1, 2e-5), "rod": rod(0.12, 0.2, 2.4e-4), "slider": block(0.15, 5e-5)}
    guide = {"body": "slider", "on": "frame", "point": [0.0, 0.0]}
    guide |= {"direction_deg": turn, "angle_deg": turn + own}
    gaps = {"A": loose(2e-4, friction=friction), "G": loose(1e-4, (0.05, 0.04), friction=friction)}
    gaps["B"] = loose(1e-4, contact={"law": "adams-impact"}, friction=friction)
    angle = math.radians(turn)
    place = {"x": 0.16 * math.cos(angle), "y": 0.16 * math.sin(angle)}
    drive = {"body": "crank", "speed_rpm": 300.0, "cycles": cycles}
    return scene(
        bodies, PINS, gaps, step, 0.0, guide={"G": guide}, drive=drive, output={"samples_per_cycle": 1000},
        initial={"crank": {"angle_deg": 20.0 + turn}},
    ) | {"guess": {"rod": {"angle_deg": turn - 8.0}, "slider": place}}  # fmt: skip


def test_a_linkage_turned_with_its_guide_moves_as_before_and_its_bodies_balance():
    upright, turned = run(driven(cycles=0.1)), run(driven(70.0, 25.0, cycles=0.1))
    assert upright.events["corner"].tolist() == turned.events["corner"].tolist()
    assert {"A", "B"} < set(upright.events["corner"])
    # Newton's tolerance, which forty contacts magnify to 8e-9 s
    np.testing.assert_allclose(turned.events["start"], upright.events["start"], rtol=0, atol=1e-7)
    columns, normal = turned.columns, math.radians(160.0)
    for corner in ("ll", "lr", "ul", "ur"):
        gap = columns[f"G.{corner}_gap"]
        np.testing.assert_allclose(gap, upright.columns[f"G.{corner}_gap"], rtol=0, atol=1e-8)
    rubbing = sum(columns[f"G.{corner}_friction"] for corner in ("ll", "lr", "ul", "ur"))
    for axis, across, along in (
        ("x", math.cos(normal), math.sin(normal)),
        ("y", math.sin(normal), -math.cos(normal)),
    ):
        force = columns[f"B.reaction_{axis}"] + columns["G.force"] * across + rubbing * along
        np.testing.assert_allclose(force, 0.15 * columns[f"slider.a{axis}"], atol=1e-9 * np.abs(force).max())
    e = np.array([columns["B.x"], columns["B.y"]])
    size = np.hypot(*e)
    # G = N n - F t in the point of the bearing's surface, whose radius is 10.1 mm
    pushed = np.abs(columns["B.normal"]) > 0.0
    assert pushed.sum() > 3
    reach = 0.0101 * e[:, pushed] / size[pushed]
    force = np.array([columns[f"B.reaction_{axis}"][pushed] for axis in "xy"])
    np.testing.assert_allclose(
        columns["B.normal"][pushed], (force * e[:, pushed]).sum(axis=0) / size[pushed], rtol=1e-12
    )
    moment = columns["G.moment"][pushed] + reach[0] * force[1] - reach[1] * force[0]
    np.testing.assert_allclose(moment, 5e-5 * columns["slider.alpha"][pushed], rtol=1e-9, atol=1e-9)


def test_the_energy_of_many_impacts_balances_better_in_smaller_steps():
    residuals = []
    for step in (4e-6, 1e-6):
        result = run(driven(step=step))
        names = set(result.events["corner"])
        assert {"A", "B", "G.ll", "G.ur"} <= names
        columns = result.columns
        lost = columns["energy_damping"][-1] + columns["energy_friction"][-1]
        residuals.append(np.abs(columns["energy_residual"]).max() / (columns["energy_kinetic"].max() + lost))
    assert residuals[1] < 3e-5
    assert residuals[1] < 0.25 * residuals[0]


def test_a_law_of_the_press_is_refused():
    data = driven()
    data["clearance"]["A"]["contact"]["law"] = "foundation"
    for call in (simulate, simulate.check, simulate.plan):
        with pytest.raises(ValueError, match=r"^clearance\.A\.contact\.law = 'foundation' is the press's"):
            call(data)
